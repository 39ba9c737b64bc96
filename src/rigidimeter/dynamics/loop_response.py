"""The perturbed admittance loop as a linear system, tick by tick (Fig. 2).

At tick n the loop reads a torque M that was sampled some time ago, filters it (F), sends the
velocity command c (A), and the drive carries it out until the next tick:

    c = A (p − F M'),    A(z) = g / (1 − d z⁻¹),    d = e^(−B_c T/J_c),  g = (1 − d)/B_c
    v'' + 2 ζ ω_n v' + ω_n² v = ω_n² c (held),      M = J v' + B v + K θ − M_sub

with p the perturbation, T the tick and M' the newest reading of M that has arrived. The motion
between two ticks is solved exactly, so any latency is exact, whole ticks or not. A sensor slower
than the loop is read again until it has news: the age of the reading goes through a pattern, and
its mean response is taken; `rigidimeter.dynamics.stability` takes the pattern itself. Jitter is
taken at its bound. The guard is not in it: what it does is no longer linear.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm
from scipy.signal import butter

from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.records import readonly
from rigidimeter.settings import ControllerSettings, RigSettings

__all__ = [
    "Array",
    "Complex",
    "LoopModel",
    "Reading",
    "admittance_coefficients",
    "command_response",
    "drive_advance",
    "loop_model",
    "lowpass_coefficients",
    "open_loop",
    "reading_pattern",
]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_PARTS_OF_A_TICK = 1_000_000

MOST_SAMPLES_A_PATTERN = 64
"""Rates are compared as a fraction of at most this denominator."""


class Reading(NamedTuple):
    """Which sample is read at one tick of the pattern.

    Attributes
    ----------
    sample : int
        Its number; it was sampled at sample / rate − latency.
    age_ticks : Fraction
        How long before this tick it was sampled.
    """

    sample: int
    age_ticks: Fraction


@dataclass(frozen=True)
class LoopModel:
    """Frequency responses of the parts of the loop at given frequencies.

    Attributes
    ----------
    frequency_hz : array, shape (m,)
        From 0 to half the tick rate.
    controller, lowpass : array, shape (m,)
        A, rad/s per N·m, and F.
    angle, velocity, acceleration : array, shape (m,)
        Of the arm at the ticks, per velocity command. The angle at 0 Hz is infinite.
    read_angle, read_velocity, read_acceleration : array, shape (m,)
        The same as the torque sensor's reading sees them, delays included.
    read_torque : array, shape (m,)
        Reading per torque: what the delays alone do, mean e^(−jω age).
    """

    frequency_hz: Array
    controller: Complex
    lowpass: Complex
    angle: Complex
    velocity: Complex
    acceleration: Complex
    read_angle: Complex
    read_velocity: Complex
    read_acceleration: Complex
    read_torque: Complex


def admittance_coefficients(
    controller: ControllerSettings, tick_rate_hz: float
) -> tuple[float, float]:
    """Return decay d and gain g of the admittance held over a tick."""
    J, B = controller.inertia_kg_m2, controller.damping_nm_s_rad
    interval_s = 1.0 / tick_rate_hz
    rate = B / J
    if rate == 0.0:
        return 1.0, interval_s / J
    return math.exp(-rate * interval_s), -math.expm1(-rate * interval_s) / B


def lowpass_coefficients(
    controller: ControllerSettings, tick_rate_hz: float
) -> tuple[Array, Array]:
    """Return numerator and denominator of the torque low-pass, in powers of z⁻¹."""
    b, a = butter(2, controller.torque_cutoff_hz, fs=tick_rate_hz)
    return np.asarray(b), np.asarray(a)


class _Ages(NamedTuple):
    """The ages of one sample, which is read on end: from whole + rest up, for so many ticks."""

    whole: int
    rest: float
    ticks: int


@lru_cache(maxsize=16)
def _ages_by_sample(rig: RigSettings) -> tuple[_Ages, ...]:
    ages = sorted(((age % 1, age) for _, age in reading_pattern(rig)[0]))
    groups = [list(group) for _, group in itertools.groupby(ages, key=lambda pair: pair[0])]
    return tuple(_Ages(math.floor(group[0][1]), float(group[0][0]), len(group)) for group in groups)


def _delays(z: Complex, first: int, count: int) -> Complex:
    """Return Σ z⁻ᵏ over `count` whole ticks from `first`, as the geometric series it is."""
    ratio = np.where(z == 1.0, 0.5, 1.0 / z)  # any number but 1 where the sum is the count
    total = np.where(z == 1.0, count, (1.0 - ratio**count) / (1.0 - ratio))
    return np.asarray(z ** -float(first) * total)


@lru_cache(maxsize=256)
def drive_advance(rig: RigSettings, duration_s: float) -> tuple[Array, Array]:
    """Return Φ and Γ with x⁺ = Φ x + Γ c for x = (θ, v, v') and c held over the duration."""
    omega = 2.0 * math.pi * rig.drive_bandwidth_hz
    augmented = np.zeros((4, 4))
    augmented[0, 1] = augmented[1, 2] = 1.0
    augmented[2] = [0.0, -(omega**2), -2.0 * rig.drive_damping_ratio * omega, omega**2]
    whole = expm(augmented * duration_s)
    return readonly(whole[:3, :3]), readonly(whole[:3, 3])


@lru_cache(maxsize=16)
def reading_pattern(rig: RigSettings) -> tuple[tuple[Reading, ...], Fraction]:
    """Return what is read at each tick until the pattern repeats, and the ticks per sample.

    Sample k arrives at k / rate (later by the jitter's bound) and is read at the first tick that is
    not before; it was sampled one latency earlier.
    """
    tick_rate, sensor_rate = Fraction(repr(rig.tick_rate_hz)), Fraction(repr(rig.torque.rate_hz))
    ticks_per_sample = (tick_rate / sensor_rate).limit_denominator(MOST_SAMPLES_A_PATTERN)
    late, latency = (
        (Fraction(repr(value)) * tick_rate).limit_denominator(_PARTS_OF_A_TICK)
        for value in (rig.torque.jitter_s, rig.torque.latency_s)
    )
    pattern = []
    for tick in range(ticks_per_sample.numerator):
        sample = math.floor((tick - late) / ticks_per_sample)
        pattern.append(Reading(sample, tick - sample * ticks_per_sample - late + latency))
    return tuple(pattern), ticks_per_sample


def loop_model(
    controller: ControllerSettings, rig: RigSettings, frequency_hz: ArrayLike
) -> LoopModel:
    """Return the responses of the loop's parts.

    Parameters
    ----------
    controller : ControllerSettings
    rig : RigSettings
    frequency_hz : array, shape (m,)
        From 0 to half the tick rate.
    """
    frequency = np.asarray(frequency_hz, dtype=np.float64)
    interval_s = 1.0 / rig.tick_rate_hz
    omega = 2.0 * np.pi * frequency
    z = np.exp(1j * omega * interval_s)
    decay, gain = admittance_coefficients(controller, rig.tick_rate_hz)
    b, a = lowpass_coefficients(controller, rig.tick_rate_hz)
    step, push = drive_advance(rig, interval_s)
    with np.errstate(divide="ignore", invalid="ignore"):
        admittance = gain / (1.0 - decay / z)  # infinite at 0 Hz without damping
    state = _ticks_per_command(step, push, z)
    read = np.zeros_like(state)
    delayed = np.zeros_like(z)
    ages = _ages_by_sample(rig)
    ticks = sum(count for _, _, count in ages)
    for whole, rest, count in ages:
        held = _delays(z, whole, count) / ticks
        part, part_push = drive_advance(rig, (1.0 - rest) * interval_s)
        read += (part @ state + part_push[:, None]) * held / z
        delayed += held * np.exp(-1j * omega * rest * interval_s)
    for angle in (state[0], read[0]):
        angle[z == 1.0] = np.inf  # a velocity held for ever
    return LoopModel(
        frequency_hz=frequency,
        controller=admittance,
        lowpass=np.asarray(np.polyval(b, z) / np.polyval(a, z)),  # of one order: z² cancels
        angle=state[0],
        velocity=state[1],
        acceleration=state[2],
        read_angle=read[0],
        read_velocity=read[1],
        read_acceleration=read[2],
        read_torque=delayed,
    )


def open_loop(model: LoopModel, joint: JointDynamics) -> Complex:
    """Return L = A F M'/c: what comes back of a velocity command, with the minus sign left out."""
    J, B, K = joint.inertia_kg_m2, joint.damping_nm_s_rad, joint.stiffness_nm_rad
    torque = J * model.read_acceleration + B * model.read_velocity
    if K > 0:
        torque = torque + K * model.read_angle
    return np.asarray(model.controller * model.lowpass * torque)


def command_response(model: LoopModel, joint: JointDynamics) -> Complex:
    """Return the velocity command per perturbation, A / (1 + L), in rad/s per N·m.

    At 0 Hz a joint with stiffness lets nothing through: a constant torque ends in a constant angle.
    """
    B = joint.damping_nm_s_rad if joint.stiffness_nm_rad == 0 else math.inf
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        response = model.controller / (1.0 + open_loop(model, joint))
        # At 0 Hz A = 1/B_c, and the arm is its damping, or a wall.
        steady = 1.0 / (1.0 / np.abs(model.controller) + B)
    return np.asarray(np.where(model.frequency_hz == 0.0, steady, response))


def _ticks_per_command(step: Array, push: Array, z: Complex) -> Complex:
    """Return (zI − Φ)⁻¹ Γ, shape (3, m): the two lower rows first, the angle from them."""
    # The angle is in no other equation: velocity and acceleration form a system of two.
    a11, a12, a21, a22 = step[1, 1], step[1, 2], step[2, 1], step[2, 2]
    determinant = (z - a11) * (z - a22) - a12 * a21
    velocity = ((z - a22) * push[1] + a12 * push[2]) / determinant
    acceleration = (a21 * push[1] + (z - a11) * push[2]) / determinant
    moved = step[0, 1] * velocity + step[0, 2] * acceleration + push[0]
    angle = moved / np.where(z == 1.0, 1.0, z - 1.0)  # what holds at z = 1 is for the caller
    return np.stack([angle, velocity, acceleration])
