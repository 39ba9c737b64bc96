"""A velocity-controlled drive of finite bandwidth, solved exactly between commands.

    v'' + 2 ζ ω_n v' + ω_n² v = ω_n² c

with c the velocity command (held between ticks), v the velocity and ω_n/2π the bandwidth (its
-3 dB frequency at the damping ratio of 0.7071). Second
order, so that the acceleration, and with it the torque, is continuous. The drive is stiff: the arm
does not change its motion.
"""

from __future__ import annotations

import math
from typing import NamedTuple

__all__ = ["Drive", "DriveState", "drive", "drive_step"]


class Drive(NamedTuple):
    """Coefficients of one exact step of length `interval_s`."""

    interval_s: float
    m11: float
    m12: float
    m21: float
    m22: float
    n1: float
    n2: float


class DriveState(NamedTuple):
    """What moves: angle in rad, velocity in rad/s, acceleration in rad/s²."""

    angle_rad: float = 0.0
    velocity_rad_s: float = 0.0
    acceleration_rad_s2: float = 0.0


def drive(bandwidth_hz: float, damping_ratio: float, interval_s: float) -> Drive:
    """Discretise the drive exactly.

    Raises
    ------
    ValueError
        If the damping ratio is not below 1 (the closed form is the oscillating one).
    """
    if not 0 < damping_ratio < 1:
        raise ValueError(f"damping ratio must be between 0 and 1, got {damping_ratio}")
    omega = 2 * math.pi * bandwidth_hz
    sigma = damping_ratio * omega
    omega_d = omega * math.sqrt(1 - damping_ratio**2)
    decay = math.exp(-sigma * interval_s)
    cosine = decay * math.cos(omega_d * interval_s)
    sine = decay * math.sin(omega_d * interval_s) / omega_d
    m11, m12 = cosine + sigma * sine, sine
    m21, m22 = -omega * omega * sine, cosine - sigma * sine
    # The angle follows from integrating the equation of v − c once.
    n1 = (2 * sigma * (1 - m11) - m21) / omega**2
    n2 = (1 - m22 - 2 * sigma * m12) / omega**2
    return Drive(interval_s, m11, m12, m21, m22, n1, n2)


def drive_step(step: Drive, state: DriveState, command_rad_s: float) -> DriveState:
    """Return the state after one interval of the given command."""
    interval_s, m11, m12, m21, m22, n1, n2 = step
    angle, velocity, acceleration = state
    lag = velocity - command_rad_s
    return DriveState(
        angle + command_rad_s * interval_s + n1 * lag + n2 * acceleration,
        command_rad_s + m11 * lag + m12 * acceleration,
        m21 * lag + m22 * acceleration,
    )
