"""A velocity-controlled drive of finite bandwidth, solved exactly between commands.

    v'' + 2 ζ ω_n v' + ω_n² v = ω_n² c

with c the velocity command in rad/s (held between ticks), v the velocity and ω_n/2π the bandwidth
(its −3 dB frequency at the damping ratio of 0.7071). Second order, so that the acceleration, and
with it the torque, is continuous. The drive is stiff: the arm does not change its motion.

With σ = ζ ω_n, ω_d = ω_n √(1 − ζ²), C = e^(−σt) cos ω_d t and S = e^(−σt) sin(ω_d t) / ω_d, the
state after a time t of constant command is

    v − c → (C + σS)(v − c) + S a        a → −ω_n² S (v − c) + (C − σS) a

and the angle follows from integrating the equation of v − c once. `drive_coefficients` is the only
place where this is computed; the steps of the virtual rig, the linear loop and the estimation use
it. A step of the command from rest gives v = c (1 − C − σS).
"""

from __future__ import annotations

import math
from types import ModuleType
from typing import NamedTuple, TypeVar

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Time = TypeVar("Time", float, Array)


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


def drive_coefficients(
    bandwidth_hz: float, damping_ratio: float, interval_s: Time
) -> tuple[Time, Time, Time, Time, Time, Time]:
    """Return m11, m12, m21, m22, n1 and n2 of a step, or of steps of many lengths.

    Raises
    ------
    ValueError
        If the damping ratio is not below 1 (the closed form is the oscillating one).
    """
    if not 0 < damping_ratio < 1:
        raise ValueError(f"damping ratio must be between 0 and 1, got {damping_ratio}")
    # `math` for one interval: its bits are those of the recorded sessions.
    functions: ModuleType = np if isinstance(interval_s, np.ndarray) else math
    omega = 2 * math.pi * bandwidth_hz
    sigma = damping_ratio * omega
    omega_d = omega * math.sqrt(1 - damping_ratio**2)
    decay = functions.exp(-sigma * interval_s)
    cosine = decay * functions.cos(omega_d * interval_s)
    sine = decay * functions.sin(omega_d * interval_s) / omega_d
    m11, m12 = cosine + sigma * sine, sine
    m21, m22 = -omega * omega * sine, cosine - sigma * sine
    n1 = (2 * sigma * (1 - m11) - m21) / omega**2
    n2 = (1 - m22 - 2 * sigma * m12) / omega**2
    return m11, m12, m21, m22, n1, n2


def drive(bandwidth_hz: float, damping_ratio: float, interval_s: float) -> Drive:
    """Discretise the drive exactly.

    Raises
    ------
    ValueError
        If the damping ratio is not below 1.
    """
    return Drive(interval_s, *drive_coefficients(bandwidth_hz, damping_ratio, interval_s))


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


def held_response(step: Array, push: Array, values: Array) -> tuple[Array, Array]:
    """Return both states of x⁺ = Φ x + Γ u, from rest, at each of the held values u.

    As one filter for each state, (zI − Φ)⁻¹ Γ.

    Parameters
    ----------
    step : array, shape (2, 2)
    push : array, shape (2,)
    values : array, shape (n,)
    """
    (a11, a12), (a21, a22) = step
    denominator = [1.0, -(a11 + a22), a11 * a22 - a12 * a21]
    first = scipy.signal.lfilter([0.0, push[0], a12 * push[1] - a22 * push[0]], denominator, values)
    second = scipy.signal.lfilter(
        [0.0, push[1], a21 * push[0] - a11 * push[1]], denominator, values
    )
    return np.asarray(first), np.asarray(second)


def drive_matrices(
    bandwidth_hz: float, damping_ratio: float, interval_s: float
) -> tuple[Array, Array]:
    """Return Φ and Γ with x⁺ = Φ x + Γ c, for x = (acceleration, velocity, angle)."""
    interval_s, m11, m12, m21, m22, n1, n2 = drive(bandwidth_hz, damping_ratio, interval_s)
    step = np.array([[m22, m21, 0.0], [m12, m11, 0.0], [n2, n1, 1.0]])
    return step, np.array([-m21, 1.0 - m11, interval_s - n1])
