"""Degrees at the edges, radians inside."""

from __future__ import annotations

import math

_RAD_PER_DEG = math.pi / 180.0


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
