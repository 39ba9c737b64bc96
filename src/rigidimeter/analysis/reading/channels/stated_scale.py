"""The calibration of a column, where a file states it, as in ``goniometer: 20 deg/V``."""

from __future__ import annotations

import re
from collections.abc import Mapping

from rigidimeter.analysis.reading.channels.unit_text import divided_by, expression, factor

_FACTOR = re.compile(
    r"([-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?)\s*([^\s\d,;=:]+/(?:\([^()\s]+\)|[^\s,;()]+))"
)


def stated_scale(stated: Mapping[str, float | str], standard: str, unit: str) -> str:
    """Return the one factor that makes a channel of a column's unit, as ``20 deg/V``, or nothing.

    Parameters
    ----------
    stated : mapping of str to float or str
        Single values and lines of a head, by name.
    standard : str
        The channel, such as ``torque_nm``.
    unit : str
        Of the column's values.

    Examples
    --------
    >>> lines = {"calibration": "Torque cell: 1.7 Nm/V; goniometer: 20 deg/V"}
    >>> stated_scale(lines, "angle_rad", "V"), stated_scale(lines, "angle_rad", "mV")
    ('20 deg/V', '20 deg/V')
    """
    found = {
        f"{number} {per}"
        for text in stated.values()
        for number, per in _FACTOR.findall(str(text))
        if expression(divided_by(f"{number} {per}"))
        and factor(unit, standard, f"{number} {per}") is not None
    }
    return found.pop() if len(found) == 1 else ""
