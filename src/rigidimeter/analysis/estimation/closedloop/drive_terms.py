"""Drives of one structure as terms: for given poles and delay, velocity is linear in a numerator.

A drive with dry friction answers the sign of its velocity as well as the command, with the same
poles and a numerator of its own.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.closedloop.drive_motion import lengths_s, since_ticks
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.records import Channel
from rigidimeter.model import (
    DriveModel,
    same_time,
    state_at_every,
    state_at_ticks,
    state_later,
    with_conjugates,
)

Complex = NDArray[np.complex128]

MOST_STATES = 12
"""Of poles, that are kept during a search."""

TINY = float(np.finfo(np.float64).tiny)

FASTEST, SLOWEST = 6.0, 5e-4
"""In rad a tick: poles are sought between; a faster one leaves nothing to see at the ticks."""

FORGOTTEN = 0.01
"""A pole of which no more is left at the next tick is not seen."""

QUICKEST = 3.0
"""In rad a tick: an oscillation beyond π a tick looks like a slower one at the ticks."""

DOUBLE = 1e-4
"""Two poles that are this close, as a share of their size, are taken for so far apart."""


class Structure(NamedTuple):
    """A family of drives.

    Attributes
    ----------
    name : str
    poles, zeros : int
    beside : float
        Where the search for a further pole starts, in times the bandwidth.
    friction : bool
        The velocity also answers its own sign, as with dry friction in the drive.
    """

    name: str
    poles: int
    zeros: int
    beside: float = 0.0
    friction: bool = False


class Samples(NamedTuple):
    """What a drive is identified from.

    Attributes
    ----------
    command : Channel
    sign : Channel
        Mean sign of the velocity, in steps shorter than a tick.
    interval_s : float
        Of the ticks.
    time_s, measured : array, shape (n,)
        The velocity at its stamps.
    scale : float
        Its SD.
    """

    command: Channel
    sign: Channel
    interval_s: float
    time_s: Array
    measured: Array
    scale: float

    def inputs(self, friction: bool) -> tuple[Channel, ...]:
        """Return what acts on the drive: the command, and the sign of the velocity."""
        return (self.command, self.sign) if friction else (self.command,)

    @property
    def halves(self) -> tuple[slice, slice]:
        """The first half of the velocity's samples, and the second."""
        middle = self.measured.size // 2
        return slice(middle), slice(middle, None)


class Fitted(NamedTuple):
    """A structure that was fitted to some of the samples.

    Attributes
    ----------
    structure : Structure
    model : DriveModel
    rubbing : tuple of complex
        Residues of the answer to the sign of the velocity; empty without friction.
    power : float
        What is left of the velocity, as a share of its variance.
    interval_s : float
        Of the ticks.
    """

    structure: Structure
    model: DriveModel
    rubbing: tuple[complex, ...]
    power: float
    interval_s: float

    @property
    def too_fast(self) -> bool:
        """Whether a pole ended where nothing of it is seen."""
        fastest = max(-pole.real for pole in self.model.poles_rad_s)
        return math.exp(-fastest * self.interval_s) < FORGOTTEN

    @property
    def unseen_pair(self) -> bool:
        """Whether a conjugate pair ended where the samples do not show that it is one.

        At the ticks a pair is 1 − 2 Re(e^(λT)) z⁻¹ + |e^(λT)|² z⁻². With the last term gone it is
        one pole. As two real poles the same pair would be `too_fast`.
        """
        pairs = [-2 * pole.real for pole in self.model.poles_rad_s if pole.imag]
        return math.exp(-max(pairs, default=0.0) * self.interval_s) < FORGOTTEN


class Terms(NamedTuple):
    """What the terms of a numerator would make of the inputs, for given poles and delay.

    Attributes
    ----------
    poles : tuple of complex
    delay_s : float
    shapes : tuple of complex array, shape (poles, j)
        Residues of each term, for the command and, with friction, for the sign of the velocity.
    table : array, shape (terms, n)
        The velocity that each term makes.
    """

    poles: tuple[complex, ...]
    delay_s: float
    shapes: tuple[Complex, ...]
    table: Array

    def numerator(self, measured: Array) -> Array:
        """Return the terms that explain a velocity best."""
        gram = self.table @ self.table.T
        size = np.sqrt(np.diagonal(gram)) + TINY
        along = self.table @ measured / size
        if size.size == 1:
            return np.asarray(along / size)
        return np.asarray(np.linalg.lstsq(gram / np.outer(size, size), along)[0] / size)

    def fitted(
        self, structure: Structure, samples: Samples, numerator: Array, power: float
    ) -> Fitted:
        """Return the drive with that numerator."""
        parts = np.split(samples.scale * numerator, [structure.zeros + 1])
        residues, *rubbing = (
            tuple((shape @ part).tolist()) for shape, part in zip(self.shapes, parts, strict=False)
        )
        drive = DriveModel(self.poles, residues, self.delay_s)
        answer = rubbing[0] if rubbing else ()
        return Fitted(structure, drive, answer, power, samples.interval_s)


def acting_on(samples: Samples, structure: Structure, time_s: Array) -> list[Acting]:
    """Return what acts on a drive of that structure, at the times."""
    return [Acting(one, time_s) for one in samples.inputs(structure.friction)]


def terms_of(
    inputs: Sequence[Acting], structure: Structure, coordinates: Array, interval_s: float
) -> Terms:
    """Return the terms for poles (`coordinates_of`) and, last, a delay in ticks."""
    poles = _poles(coordinates[:-1], interval_s)
    delay_s = float(coordinates[-1]) * interval_s
    # Friction acts behind the controller, whose zeros are not its own.
    zeros = (structure.zeros, structure.poles - 1)[: len(inputs)]
    shapes = tuple(_shapes(poles, n) for n in zeros)
    columns = [
        acting.columns(poles, shape, late_s)
        for acting, shape, late_s in zip(inputs, shapes, (delay_s, 0.0), strict=False)
    ]
    return Terms(poles, delay_s, shapes, np.concatenate(columns))


def coordinates_of(structure: Structure, start: DriveModel, interval_s: float) -> Array:
    """Return the logarithms of the coefficients of (s + a) or (s² + a s + b), and the delay.

    In units of the tick. Two real poles and a conjugate pair are the same to the coefficients.
    """
    everyone = [pole * interval_s for pole in with_conjugates(start.poles_rad_s)]
    if len(everyone) < structure.poles:
        size = math.sqrt(abs(everyone[0] * everyone[1]))
        everyone += [complex(-size * structure.beside)] * (structure.poles - len(everyone))
    found = []
    for a, b in zip(everyone[::2], everyone[1::2], strict=False):
        found += [math.log(-(a + b).real), math.log((a * b).real)]
    if structure.poles % 2:
        found.append(math.log(-everyone[-1].real))
    return np.array([*found, start.delay_s / interval_s])


def _poles(coordinates: Array, interval_s: float) -> tuple[complex, ...]:
    """Return the poles, of a conjugate pair the one with the positive imaginary part."""
    poles: list[complex] = []
    coefficients = np.exp(coordinates)
    for a, b in zip(coefficients[::2], coefficients[1::2], strict=False):
        root = cmath.sqrt(a * a / 4 - b)
        if abs(root) < DOUBLE * a:
            root = complex(DOUBLE * a)
        if root.imag:
            poles.append(complex(-a / 2, min(abs(root.imag), QUICKEST)))
        else:
            poles += [complex(-a / 2 - root.real), complex(-b / (a / 2 + root.real))]
    if coefficients.size % 2:
        poles.append(complex(-coefficients[-1]))
    return tuple(pole / interval_s for pole in poles)


def _shapes(poles: tuple[complex, ...], zeros: int) -> Complex:
    """Return the residues of s^j / Π(s − λ), s in units of the first pole, shape (poles, j)."""
    unit = abs(poles[0])
    everyone = with_conjugates(poles)
    rows = []
    for pole in poles:
        rest = math.prod(((pole - p) / unit for p in everyone if p != pole), start=complex(1))
        rows.append([unit * (pole / unit) ** j / rest for j in range(zeros + 1)])
    return np.array(rows)


class Acting:
    """An input at the times of the velocity, with what does not change in a search."""

    def __init__(self, channel: Channel, time_s: Array) -> None:
        self._channel, self._time_s = channel, time_s
        self._lengths_s = lengths_s(channel)
        self._late_s = math.nan
        self._at_ticks: dict[complex, Array | Complex] = {}
        self._states: dict[complex, Array] = {}

    def columns(self, poles: tuple[complex, ...], shapes: Complex, late_s: float) -> Array:
        """Return the velocity that each term of a numerator makes of the input, shape (j, n)."""
        states = np.concatenate([self._state(pole, late_s) for pole in poles])
        weights = [
            part
            for pole, row in zip(poles, shapes, strict=True)
            for part in ((2 * row.real, -2 * row.imag) if pole.imag else (row.real,))
        ]
        return np.asarray(np.transpose(weights) @ states)

    def _state(self, pole: complex, late_s: float) -> Array:
        """Return the state of a pole, of a pair its real and imaginary part, shape (1 or 2, n).

        A search moves some of the poles, or the delay, and not all.
        """
        if late_s != self._late_s:
            self._tick, after_s = since_ticks(self._channel, self._time_s, late_s, even=0.0)
            self._after_s, self._sent = same_time(after_s), self._channel.values[self._tick]
            self._late_s = late_s
            self._states.clear()
            steps = np.diff(self._tick)
            strided = steps.size and steps[0] > 1 and np.all(steps == steps[0])
            self._stride = int(steps[0]) if strided else 0
        if pole not in self._states:
            if len(self._states) >= MOST_STATES:
                self._states.clear()
            before = self._before(pole)
            state = state_later(pole, before, self._sent, self._after_s)
            self._states[pole] = np.array([state.real, state.imag] if pole.imag else [state])
        return self._states[pole]

    def _before(self, pole: complex) -> Array | Complex:
        """Return the state at the tick before each time."""
        values, first = self._channel.values, int(self._tick[0])
        if self._stride and isinstance(self._lengths_s, float):
            used = values[: int(self._tick[-1]) + 1]
            return state_at_every(pole, used, self._lengths_s, first, self._stride)
        if pole not in self._at_ticks:
            if len(self._at_ticks) >= MOST_STATES:
                self._at_ticks.clear()
            self._at_ticks[pole] = state_at_ticks(pole, values, self._lengths_s)
        return self._at_ticks[pole][self._tick]
