from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rigidimeter.cli.virtual import run_virtual_session
from rigidimeter.settings import parse_settings

Simulate = Callable[..., Path]


@pytest.fixture
def simulate(tmp_path: Path) -> Simulate:
    """Run a virtual session in a new folder and return the folder."""

    def run(
        *, task: str = "prbs", epochs: int = 1, seed: int = 1, name: str = "session", **tables: Any
    ) -> Path:
        values = {
            "seed": seed,
            "protocol": {
                "blocks": [{"task": task, "epochs": epochs}],
                "rests_s": [1.0],
                "return_s": 1.0,
            },
            **tables,
        }
        run_virtual_session(parse_settings(values), tmp_path / name)
        return tmp_path / name

    return run
