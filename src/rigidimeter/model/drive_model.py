"""A velocity-controlled drive as a linear system of any order, solved exactly between commands.

    V(s) = e^(−τ s) H(s) C(s)        H(s) = Σ_i r_i / (s − λ_i)

with c the velocity command in rad/s, held between ticks, v the velocity, λ_i the poles, r_i their
residues and τ a pure delay. Each pole has a state x' = λ x + c, and a command that was held for a
time t leaves it at

    x → e^(λt) x + (e^(λt) − 1)/λ c

so the motion is known at any time, whatever lies between two samples. The sum of the residues is
the acceleration per command at once: zero where two more poles than zeros smooth the stairs of the
command, as in a drive of second order, and not zero in a drive whose controller passes them on to
the motor, as a PI controller does. There the acceleration jumps at each edge of a command and has
died away, in part, at the next: samples of it at the ticks miss most of what it was.

For commands with the z-transform C(z) of interval T the motion at the time δ after the ticks is

    X_i(z, δ) = [e^(λδ) (e^(λT) − 1) / (z − e^(λT)) + e^(λδ) − 1] C(z) / λ

which is Σ_k H_i(jω + jk 2π/T) ZOH(…), all that sampling folds onto the frequency ω, in closed form
(the modified z-transform, Jury 1964). At δ = 0 the acceleration is that before the edge: a torque
that was sampled at a tick cannot follow from the command that was computed of it.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.model.sensors import SAME_TIME_S
from rigidimeter.model.velocity_drive import Array, Complex

ON_EDGE = 0.01
"""A time this share of an interval away from an edge of the command is the edge."""

APART = 1e-4
"""Poles that are closer than this, as a share of their size, are taken for so far apart."""


class ArmMotion(NamedTuple):
    """Acceleration, velocity and angle, in the order of J, B and K; each of shape (n,)."""

    acceleration_rad_s2: Array
    velocity_rad_s: Array
    angle_rad: Array


@dataclass(frozen=True)
class DriveModel:
    """A drive as it is known or identified.

    Attributes
    ----------
    poles_rad_s : tuple of complex
        λ, of a conjugate pair the one with the positive imaginary part.
    residues : tuple of complex
        r, in rad/s.
    delay_s : float
        τ: how long after its stamp a command begins to act.
    """

    poles_rad_s: tuple[complex, ...]
    residues: tuple[complex, ...]
    delay_s: float = 0.0

    @classmethod
    def second_order(
        cls, bandwidth_hz: float, damping_ratio: float, delay_s: float = 0.0
    ) -> DriveModel:
        """Return v'' + 2 ζ ω v' + ω² v = ω² c, as `velocity_drive` steps it."""
        omega = 2 * math.pi * bandwidth_hz
        pole = omega * complex(-damping_ratio, math.sqrt(1 - damping_ratio**2))
        return cls((pole,), (omega**2 / (2j * pole.imag),), delay_s)

    @property
    def gain(self) -> float:
        """Velocity per command that is held for ever."""
        return sum(2 * part.real for part in self._over(-1))

    @property
    def jump(self) -> float:
        """Acceleration per command at its edge, in 1/s."""
        return sum(2 * part.real for part in self._over(0))

    def response(self, s: Complex) -> Complex:
        """Return H(s), without the delay."""
        total = np.zeros(np.shape(s), dtype=np.complex128)
        for pole, residue, pair in self.modes():
            total += residue / (s - pole)
            if pair:
                total += residue.conjugate() / (s - pole.conjugate())
        return total

    def smoothed(self, cutoff_hz: float, order: int) -> DriveModel:
        """Return the drive with a Butterworth low-pass behind it, which motion goes through.

        Whatever is linear in the motion, such as the torque of the joint, goes through it too.
        """
        own = _butterworth_poles(cutoff_hz, order)
        unit = 2 * math.pi * cutoff_hz
        if min(abs(a - b) for a in own for b in self.poles_rad_s) < APART * unit:
            return self.smoothed(cutoff_hz * (1 + 2 * APART), order)
        there = lowpass(np.array(self.poles_rad_s), cutoff_hz, order)
        behind = [r * f for r, f in zip(self.residues, there.tolist(), strict=True)]
        everyone = with_conjugates(own)
        for pole in own:
            rest = math.prod(((pole - p) / unit for p in everyone if p != pole), start=complex(1))
            behind.append(unit / rest * complex(self.response(np.array(pole))))
        return DriveModel((*self.poles_rad_s, *own), tuple(behind), self.delay_s)

    def transfer(self, z: Complex, interval_s: float, after_s: float = 0.0) -> Complex:
        """Return acceleration, velocity and angle per held command at z, so long after the ticks.

        Parameters
        ----------
        z : array, shape (m,)
            Not 1, where the angle has no end.
        interval_s, after_s : float

        Returns
        -------
        array, shape (3, m)
        """
        place = (after_s - self.delay_s) / interval_s
        tick = math.floor(place + ON_EDGE)
        rest_s = (place - tick if place - tick > ON_EDGE else 0.0) * interval_s
        motion = np.zeros((3, z.size), dtype=np.complex128)
        for pole, residue, pair in self.modes():
            both = ((pole, residue), (pole.conjugate(), residue.conjugate()))
            for p, r in both[: 1 + pair]:
                grown = cmath.exp(p * rest_s)
                state = grown * (cmath.exp(p * interval_s) - 1) / (z - cmath.exp(p * interval_s))
                state = (state + grown - 1) / p
                motion += np.array([r * p, r, r / p])[:, None] * state
        motion[0] += self.jump * (1.0 if rest_s > 0 else 1 / z)
        motion[2] += self.gain * (interval_s / (z - 1) + rest_s)
        return np.asarray(motion * z ** float(tick))

    def motion(
        self,
        command_rad_s: Array,
        lengths_s: float | Array,
        tick: NDArray[np.intp],
        after_s: Array,
    ) -> ArmMotion:
        """Return the motion under held commands, from rest, so long after ticks of given numbers.

        `after_s` is from 0 up to the next tick, or beyond it where nothing more was sent; the delay
        is not taken into account. After 0 s the edge of the command has not come yet.
        """
        return HeldCommand(self, command_rad_s, lengths_s).motion(tick, after_s)

    def held(self, command_rad_s: Array, interval_s: float) -> ArmMotion:
        """Return the motion at the ticks under held commands, from rest, without the delay."""
        tick = np.arange(command_rad_s.size)
        return self.motion(command_rad_s, interval_s, tick, np.zeros(tick.size))

    def modes(self) -> Iterator[tuple[complex, complex, bool]]:
        """Yield pole, residue, and whether they stand for a conjugate pair."""
        for pole, residue in zip(self.poles_rad_s, self.residues, strict=True):
            yield pole, residue, pole.imag != 0.0

    def _over(self, power: int) -> Iterator[complex]:
        """Yield half of each part of Σ r λ^power, with the sign of the gain for −1."""
        sign = -1.0 if power == -1 else 1.0
        for pole, residue, pair in self.modes():
            yield sign * residue * pole**power * (1.0 if pair else 0.5)


class HeldCommand:
    """A command that is held from tick to tick, with the states in which it leaves a drive.

    Parameters
    ----------
    drive : DriveModel
    command_rad_s : array, shape (n,)
    lengths_s : float or array, shape (n - 1,)
        From each tick to the next; one number if they came evenly.
    """

    def __init__(self, drive: DriveModel, command_rad_s: Array, lengths_s: float | Array) -> None:
        self._drive, self._command_rad_s = drive, command_rad_s
        self._summed = np.concatenate(([0.0], np.cumsum(command_rad_s[:-1] * lengths_s)))
        self._states = [
            state_at_ticks(pole, command_rad_s, lengths_s) for pole in drive.poles_rad_s
        ]

    def motion(self, tick: NDArray[np.intp], after_s: Array) -> ArmMotion:
        """Return `DriveModel.motion` so long after ticks of given numbers."""
        command, drive = self._command_rad_s, self._drive
        sent = command[tick]
        before = np.where(tick > 0, command[np.maximum(tick - 1, 0)], 0.0)
        acceleration = drive.jump * np.where(after_s > 0, sent, before)
        velocity, angle = np.zeros(tick.size), drive.gain * (self._summed[tick] + after_s * sent)
        held_s = same_time(after_s)
        for (pole, residue, pair), at_ticks in zip(drive.modes(), self._states, strict=True):
            state = state_later(pole, at_ticks[tick], sent, held_s)
            weight = residue * (1 + pair)
            acceleration += (weight * pole * state).real
            velocity += (weight * state).real
            angle += (weight / pole * state).real
        return ArmMotion(acceleration, velocity, angle)


def lowpass(s: Complex, cutoff_hz: float, order: int) -> Complex:
    """Return the response of a Butterworth low-pass in continuous time at s."""
    unit = 2 * math.pi * cutoff_hz
    total = np.ones(np.shape(s), dtype=np.complex128)
    for pole in with_conjugates(_butterworth_poles(cutoff_hz, order)):
        total *= unit / (s - pole)
    return total


def with_conjugates(poles: Iterable[complex]) -> list[complex]:
    """Return poles with the other one of each conjugate pair."""
    return [p for one in poles for p in ((one, one.conjugate()) if one.imag else (one,))]


def _butterworth_poles(cutoff_hz: float, order: int) -> tuple[complex, ...]:
    """Return the poles on the left half of a circle, of a pair the one above the real axis."""
    unit = 2 * math.pi * cutoff_hz
    upper = (unit * cmath.exp(1j * math.pi * (order + 1 + 2 * k) / (2 * order))
             for k in range(order // 2))  # fmt: skip
    return (*upper, complex(-unit)) if order % 2 else tuple(upper)


def state_at_ticks(
    pole: complex, command_rad_s: Array, lengths_s: float | Array
) -> Array | Complex:
    """Return x of x' = λ x + c, from rest, at each tick; real for a pole that is real.

    Parameters
    ----------
    pole : complex
        λ, in rad/s.
    command_rad_s : array, shape (n,)
    lengths_s : float or array, shape (n - 1,)
        From each tick to the next; one number if they came evenly.
    """
    growth = _growth(pole)
    if isinstance(lengths_s, float):
        decay = np.exp(growth * lengths_s)
        held = (decay - 1) / growth * command_rad_s
        return np.asarray(scipy.signal.lfilter([0.0, 1.0], [1.0, -decay], held))
    # With x → a x + b for each tick, one stretch after another is a₂ a₁ x + (a₂ b₁ + b₂): the
    # stretches that end at the ticks are made twice as long until all begin at the first.
    decays = np.exp(growth * lengths_s)
    state = (decays - 1) / growth * command_rad_s[:-1]
    step = 1
    while step < state.size and np.any(decays):
        state = np.append(state[:step], state[step:] + decays[step:] * state[:-step])
        decays = np.append(decays[:step], decays[step:] * decays[:-step])
        step *= 2
    return np.append(0.0, state)


def state_later(
    pole: complex, state: Array | Complex, command_rad_s: Array, after_s: Array | float
) -> Array | Complex:
    """Return x under the command that has been held for so long since it was `state`."""
    if isinstance(after_s, float) and after_s == 0.0:
        return state
    growth = _growth(pole)
    passed = np.exp(growth * after_s)
    return np.asarray(passed * state + (passed - 1) / growth * command_rad_s)


def same_time(after_s: Array) -> Array | float:
    """Return times after ticks, as one number if all are the same."""
    if not after_s.size or np.ptp(after_s) >= SAME_TIME_S:
        return after_s
    return 0.0 if after_s[0] == 0.0 else float(np.mean(after_s))


def _growth(pole: complex) -> complex | float:
    """Return the pole; numbers that are real take half the time."""
    return pole if pole.imag else pole.real
