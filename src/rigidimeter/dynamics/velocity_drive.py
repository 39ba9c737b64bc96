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
from dataclasses import dataclass
from types import ModuleType
from typing import Any, NamedTuple, TypeVar

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


class ArmMotion(NamedTuple):
    """Acceleration, velocity and angle, in the order of J, B and K; each of shape (n,)."""

    acceleration_rad_s2: Array
    velocity_rad_s: Array
    angle_rad: Array


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


@dataclass(frozen=True)
class DriveModel:
    """A drive as it is known or identified, with a pure delay before it answers."""

    bandwidth_hz: float
    damping_ratio: float
    delay_s: float = 0.0

    def transfer(self, z: Complex, interval_s: float) -> Complex:
        """Return acceleration, velocity and angle per held command at z, at the ticks.

        Parameters
        ----------
        z : array, shape (m,)
            Not 1, where the angle has no end.
        interval_s : float

        Returns
        -------
        array, shape (3, m)
        """
        # (zI − Φ)⁻¹ Γ. The angle is in no other row.
        step, push = drive_matrices(self.bandwidth_hz, self.damping_ratio, interval_s)
        (a11, a12), (a21, a22) = step[:2, :2]
        determinant = (z - a11) * (z - a22) - a12 * a21
        acceleration = ((z - a22) * push[0] + a12 * push[1]) / determinant
        velocity = (a21 * push[0] + (z - a11) * push[1]) / determinant
        angle = (push[2] + step[2, 1] * velocity + step[2, 0] * acceleration) / (z - 1)
        motion = np.stack([acceleration, velocity, angle])
        return motion * z ** (-self.delay_s / interval_s) if self.delay_s else motion

    def sampled_derivative(self, omega_rad_s: Array, interval_s: float) -> Complex:
        """Return the acceleration at the ticks over the derivative of the velocity's samples.

        1 − (ω_n Δt)²/12 at low frequency: the command's stairs hold the acceleration at the ticks
        below its mean.
        """
        acceleration, velocity, _ = self.transfer(np.exp(1j * omega_rad_s * interval_s), interval_s)
        return np.asarray(acceleration / (1j * omega_rad_s * velocity))

    def held(self, command_rad_s: Array, interval_s: float) -> ArmMotion:
        """Return the motion at the ticks under commands held from tick to tick, from rest."""
        step, push = drive_matrices(self.bandwidth_hz, self.damping_ratio, interval_s)
        acceleration, velocity = held_response(step[:2, :2], push[:2], command_rad_s)
        moved = push[2] * command_rad_s + step[2, 1] * velocity + step[2, 0] * acceleration
        return ArmMotion(acceleration, velocity, np.concatenate(([0.0], np.cumsum(moved[:-1]))))

    def after(self, elapsed_s: Array, motion: ArmMotion, command_rad_s: Array) -> ArmMotion:
        """Return the motion a time after each tick, from that at the tick and its command."""
        # `drive_step`, element by element.
        coefficients = drive_coefficients(self.bandwidth_hz, self.damping_ratio, elapsed_s)
        steps: Any = (elapsed_s, *coefficients)
        states: Any = motion[::-1]
        commands: Any = command_rad_s
        moved: Any = drive_step(Drive(*steps), DriveState(*states), commands)
        return ArmMotion(*moved[::-1])
