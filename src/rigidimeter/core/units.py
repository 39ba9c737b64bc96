"""Units: degrees at the edges, radians inside, and what a stored name says of its own."""

from __future__ import annotations

import math

_RAD_PER_DEG = math.pi / 180.0
_UNITS = {
    "_kg_m2_per_deg": "kg·m²/deg", "_nm_s_rad": "N·m·s/rad", "_nm_s_deg": "N·m·s/deg",
    "_n2m2_hz": "N²m²/Hz", "_nm_rad": "N·m/rad", "_rad_s2": "rad/s²", "_deg_s2": "deg/s²",
    "_kg_m2": "kg·m²", "_rad_s": "rad/s", "_deg_s": "deg/s", "_nm_s": "N·m·s", "_percent": "%",
    "_rad": "rad", "_deg": "deg", "_min": "min", "_nm": "N·m", "_hz": "Hz", "_db": "dB",
    "_kg": "kg", "_us": "µs", "_ua": "µA", "_ma": "mA", "_j": "J", "_v": "V", "_s": "s", "_m": "m",
}  # fmt: skip
"""How names end that state their unit; the longer ending comes first."""


def named_unit(name: str) -> tuple[str, str]:
    """Return the words of a stored name and its unit, which is empty where the name states none.

    Examples
    --------
    >>> named_unit("damping_nm_s_rad"), named_unit("n_samples")
    (('damping', 'N·m·s/rad'), ('n_samples', ''))
    """
    ending = next((each for each in _UNITS if name.endswith(each)), "")
    return name.removesuffix(ending), _UNITS.get(ending, "")


def rad_from_deg(angle_deg: float) -> float:
    """Return the angle (or angular rate) in radians."""
    return angle_deg * _RAD_PER_DEG


def deg_from_rad(angle_rad: float) -> float:
    """Return the angle (or angular rate) in degrees."""
    return angle_rad / _RAD_PER_DEG


def per_rad_from_per_deg(value_per_deg: float) -> float:
    """Return a quantity per radian, such as N·m·s/rad, from one per degree.

    The paper prints its controller per degree (0.0008 kg·m²/deg and 0.028 N·m·s/deg);
    per radian that is 0.0458 and 1.604.
    """
    return value_per_deg / _RAD_PER_DEG
