"""The perturbed admittance loop as a linear system (Fig. 2): its response and the motion in it.

At each tick the loop reads a torque M that was sampled some time ago, filters it (F), sends the
velocity command c (A), and the drive carries it out until the next tick:

    c = A (p − F M'),    A(z) = g / (1 − d z⁻¹),    d = e^(−B_c T/J_c),  g = (1 − d)/B_c
    v'' + 2 ζ ω_n v' + ω_n² v = ω_n² c (held),      M = J v' + B v + K θ − M_sub

with p the perturbation in N·m, T the tick and M' the newest reading of M that has arrived. With
L = A F M'/c the open loop, a perturbation is answered by c = A/(1 + L) p, and torque ν that is
added to the measured one by c = −F A/(1 + L) ν, later by the delays of the sensor.

The coefficients are those of the steps in `controller` and `velocity_drive`, and the
motion between two ticks is solved exactly, so any latency is exact, whole ticks or not. A sensor
slower than the loop is read again until it has news: the age of the reading goes through a
pattern, and its mean response is taken; `loop_poles` takes the pattern itself. For a sensor of
interval n T that is e^(−jω latency) Σ e^(−jωkT)/n, k = 0 … n − 1: a delay of latency + (n − 1) T/2
and a gain of sin(nωT/2) / (n sin(ωT/2)). Where the edges of the perturbation stay in step with the
sensor, the loop is always in the same phase and not in the mean of all: with chips of 50 ms the
velocity then differs by 0.1 % of its standard deviation at 100 samples/s, and by 1.6 % at 50.
Jitter is taken at its bound. The guard is left out: it is not linear.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from rigidimeter.core.settings import ControllerSettings, RigSettings, Settings, SubjectSettings
from rigidimeter.model.controller import admittance, butterworth_lowpass
from rigidimeter.model.drive_model import DriveModel, lowpass
from rigidimeter.model.joint import JointDynamics, median_joint
from rigidimeter.model.subject_torque import subject_density
from rigidimeter.model.velocity_drive import Array, Complex

Parameters = tuple[float, float, float]
"""J, B and K of the joint."""

_PARTS_OF_A_TICK = 1_000_000

_MAX_PATTERN_SAMPLES = 64
"""Rates are compared as a fraction of at most this denominator."""

_LINES_A_HZ = 50
"""How finely the band of voluntary torque is summed."""

_DIGITS = 36.0
"""−ln of the relative rounding of a float, 2e-16."""


class PatternReading(NamedTuple):
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


class ClosedLoopMotion(NamedTuple):
    """Command, and motion of the arm, at the ticks; each of shape (n,)."""

    command_rad_s: Array
    acceleration_rad_s2: Array
    velocity_rad_s: Array
    angle_rad: Array


class OpenLoop(NamedTuple):
    """What of the loop does not change with the joint, at m points z.

    Attributes
    ----------
    admittance, forward : array, shape (m,)
        A, and A F, in rad/s per N·m.
    motion, sensed, read : array, shape (3, m)
        Acceleration, velocity and angle of the arm per velocity command: at the ticks, the same
        through the filter of the torque sensor, and as the reading of that sensor has them, delays
        included.
    read_torque : array, shape (m,)
        Reading per torque: what the delays alone do.
    """

    admittance: Complex
    forward: Complex
    motion: Complex
    sensed: Complex
    read: Complex
    read_torque: Complex

    def gain(self, parameters: Parameters) -> Complex:
        """Return L: what comes back of a velocity command, with the minus sign left out."""
        J, B, K = parameters
        torque = J * self.read[0] + B * self.read[1] + K * self.read[2]
        return np.asarray(self.forward * torque)

    def command(self, parameters: Parameters) -> Complex:
        """Return the velocity command per perturbation, A / (1 + L), in rad/s per N·m."""
        return np.asarray(self.admittance / (1.0 + self.gain(parameters)))

    def motion_per_torque(self, parameters: Parameters) -> Complex:
        """Return acceleration, velocity and angle per N·m that is added to the measured torque."""
        command = -self.forward * self.read_torque / (1.0 + self.gain(parameters))
        return np.asarray(command * self.motion)


@dataclass(frozen=True)
class Loop:
    """Controller, torque path and drive.

    Parameters
    ----------
    controller : ControllerSettings
        J_c and B_c of the admittance, and the cutoff of the low-pass in front of it.
    rig : RigSettings
        Tick rate, drive and torque sensor.
    identified : DriveModel, optional
        The drive as a recording shows it, instead of that of the rig.
    lowpass_hz : float
        Butterworth filter of the torque sensor; 0 for none.
    lowpass_order : int
    """

    controller: ControllerSettings
    rig: RigSettings
    identified: DriveModel | None = None
    lowpass_hz: float = 0.0
    lowpass_order: int = 2

    @property
    def drive(self) -> DriveModel:
        """The drive."""
        if self.identified is not None:
            return self.identified
        rig = self.rig
        return DriveModel.second_order(rig.drive_bandwidth_hz, rig.drive_damping_ratio)

    def at_frequency(self, frequency_hz: ArrayLike) -> OpenLoop:
        """Return the loop at frequencies above 0 and up to half the tick rate, shape (m,)."""
        rate_hz = self.rig.tick_rate_hz
        omega = 2.0 * np.pi * np.asarray(frequency_hz, dtype=np.float64)
        return self.at(np.exp(1j * omega / rate_hz), rate_hz)

    def at(self, z: Complex, rate_hz: float) -> OpenLoop:
        """Return the loop at points z, not 1, with commands held for 1 / rate_hz.

        `rate_hz` is that of the rig, or that at which a recording holds the perturbation.
        """
        interval_s = 1.0 / rate_hz
        controller, rig = self.controller, self.rig
        decay, gain = admittance(controller.inertia_kg_m2, controller.damping_nm_s_rad, interval_s)
        steady = gain / (1.0 - decay / z)
        motion = sensed = self.drive.transfer(z, interval_s)
        seen, through = self.drive, np.ones_like(z)
        if self.lowpass_hz > 0:
            seen = self.drive.smoothed(self.lowpass_hz, self.lowpass_order)
            sensed = seen.transfer(z, interval_s)
            through = lowpass(np.asarray(np.log(z) * rate_hz), self.lowpass_hz, self.lowpass_order)
        read, read_torque = np.zeros_like(motion), np.zeros_like(z)
        ages = _ages_by_sample(rig, rate_hz)
        ticks = sum(age.ticks for age in ages)
        for whole, rest, count in ages:
            held = _delays(z, whole, count) / ticks
            read += seen.transfer(z, interval_s, -rest * interval_s) * held
            read_torque += through * held * z**-rest
        forward = steady * _lowpass(controller.torque_cutoff_hz, z, rate_hz)
        return OpenLoop(steady, forward, motion, sensed, read, read_torque)


def closed_loop_motion(
    perturbation_nm: ArrayLike, settings: Settings, joint: JointDynamics
) -> ClosedLoopMotion:
    """Return command and motion that a perturbation causes, without noise and from rest.

    For a sensor slower than the loop it is the mean over the phases of the sensor.

    Parameters
    ----------
    perturbation_nm : array, shape (n,)
        One value a tick.
    settings : Settings
        Of which `controller` and `rig` are used.
    joint : JointDynamics
        The loop with it must be stable.
    """
    torque = np.asarray(perturbation_nm, dtype=np.float64)
    loop = Loop(settings.controller, settings.rig)
    circle = on_circle(loop, torque.size, settings.rig.tick_rate_hz, 2)
    command = circle.to(torque) * circle.loop.command(joint.parameters)
    parts = (command, *(command * part for part in circle.loop.motion))
    return ClosedLoopMotion(*(circle.back(part) for part in parts))


def voluntary_motion_sd(settings: Settings, subject: SubjectSettings) -> tuple[float, float]:
    """Return the SD of angle (rad) and velocity (rad/s) that the subject's own torque causes."""
    rate_hz = settings.rig.tick_rate_hz
    # Fine enough for the slowest pole of the loop; the last tick of the band holds no power.
    frequency = np.arange(1, round(rate_hz / 2.0 * _LINES_A_HZ)) / _LINES_A_HZ
    density = subject_density(subject, frequency, rate_hz)
    loop = Loop(settings.controller, settings.rig).at_frequency(frequency)
    _, velocity, angle = loop.motion_per_torque(median_joint(subject).parameters)
    return (
        math.sqrt(2.0 * float(np.sum(np.abs(angle) ** 2 * density)) / _LINES_A_HZ),
        math.sqrt(2.0 * float(np.sum(np.abs(velocity) ** 2 * density)) / _LINES_A_HZ),
    )


class Circle(NamedTuple):
    """The loop at the frequencies of an FFT, on a circle just outside the unit circle.

    A record is damped before its FFT, and the damping is undone afterwards. So the integrator of
    the angle and the wrap-around of the FFT need no special treatment.
    """

    length: int
    z: Complex
    damping: Array
    loop: OpenLoop

    def to(self, record: Array) -> Complex:
        """Return the spectrum of a record, one value a tick."""
        return np.asarray(scipy.fft.rfft(record * self.damping, self.length))

    def back(self, spectrum: Complex) -> Array:
        """Return the record that has a spectrum."""
        return np.asarray(
            scipy.fft.irfft(spectrum, self.length)[: self.damping.size] / self.damping
        )


@lru_cache(maxsize=8)
def on_circle(loop: Loop, n: int, rate_hz: float, times: int) -> Circle:
    """Return the loop for records of `n` ticks, in an FFT of `times` that length.

    The wrap-around is damped by e^(−D), and undoing the damping amplifies rounding at the end of
    the record by e^(D/times). Both are equal at D = 36 times/(times + 1): 2e-8 of the largest
    value for an FFT of the record's own length, 4e-11 for twice that. An estimate needs the same
    loop many times.
    """
    length = int(scipy.fft.next_fast_len(times * n, real=True))
    radius = _DIGITS * times / (times + 1) / length
    angle = 2.0 * np.pi * np.arange(length // 2 + 1) / length
    damping = np.exp(-radius * np.arange(n))
    z = np.exp(radius + 1j * angle)
    return Circle(length, z, damping, loop.at(z, rate_hz))


def _lowpass(cutoff_hz: float, z: Complex, rate_hz: float) -> Complex:
    """Return the second-order low-pass of the loop at z; none where the ticks are too slow."""
    if cutoff_hz >= rate_hz / 2:
        return np.ones_like(z)
    b0, b1, b2, a1, a2 = butterworth_lowpass(cutoff_hz, rate_hz)
    return np.asarray(((b0 * z + b1) * z + b2) / ((z + a1) * z + a2))


class _Ages(NamedTuple):
    """Ages of a sample that is read at `ticks` ticks in a row: whole + rest, then one tick more."""

    whole: int
    rest: float
    ticks: int


@lru_cache(maxsize=16)
def _ages_by_sample(rig: RigSettings, rate_hz: float) -> tuple[_Ages, ...]:
    """Return the ages of the readings in ticks of the given rate."""
    # A rate that was found from stamps carries their rounding.
    scale = Fraction(rate_hz / rig.tick_rate_hz).limit_denominator(_PARTS_OF_A_TICK)
    ages = sorted((scale * age % 1, scale * age) for _, age in reading_pattern(rig)[0])
    if scale != 1:  # the ages are not a tick apart
        return tuple(_Ages(math.floor(age), float(rest), 1) for rest, age in ages)
    groups = [list(group) for _, group in itertools.groupby(ages, key=lambda pair: pair[0])]
    return tuple(_Ages(math.floor(group[0][1]), float(group[0][0]), len(group)) for group in groups)


def _delays(z: Complex, first: int, count: int) -> Complex:
    """Return Σ z⁻ᵏ over `count` whole ticks from `first`, by doubling: exact near z = 1 too."""
    total, summed = np.ones_like(z), 1
    for bit in f"{count:b}"[1:]:
        total = total * (1.0 + z ** -float(summed))
        summed *= 2
        if bit == "1":
            total = 1.0 + total / z
            summed += 1
    return np.asarray(z ** -float(first) * total)


@lru_cache(maxsize=16)
def reading_pattern(rig: RigSettings) -> tuple[tuple[PatternReading, ...], Fraction]:
    """Return what is read at each tick until the pattern repeats, and the ticks per sample.

    Sample k arrives at k / rate (later by the jitter's bound) and is read at the first tick that is
    not before; it was sampled one latency earlier.
    """
    tick_rate, sensor_rate = Fraction(repr(rig.tick_rate_hz)), Fraction(repr(rig.torque.rate_hz))
    ticks_per_sample = (tick_rate / sensor_rate).limit_denominator(_MAX_PATTERN_SAMPLES)
    late, latency = (
        (Fraction(repr(value)) * tick_rate).limit_denominator(_PARTS_OF_A_TICK)
        for value in (rig.torque.jitter_s, rig.torque.latency_s)
    )
    pattern = []
    for tick in range(ticks_per_sample.numerator):
        sample = math.floor((tick - late) / ticks_per_sample)
        pattern.append(PatternReading(sample, tick - sample * ticks_per_sample - late + latency))
    return tuple(pattern), ticks_per_sample
