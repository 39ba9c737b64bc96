"""What a driver must do, from the checks of it."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import Any

from rigidimeter.testing import DRIVE_CHECKS, SENSOR_CHECKS


def sensor_rules() -> str:
    """Return the table of the checks of a torque sensor."""
    return _table(SENSOR_CHECKS)


def drive_rules() -> str:
    """Return the table of the checks of a drive."""
    return _table(DRIVE_CHECKS)


def _table(checks: Sequence[Callable[..., Any]]) -> str:
    rows = [
        f"| `{check.__name__}` | {' '.join(inspect.cleandoc(check.__doc__ or '').split())} |\n"
        for check in checks
    ]
    return "| check | what must hold |\n| --- | --- |\n" + "".join(rows)
