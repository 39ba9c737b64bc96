"""The drive of one structure that explains the velocity best.

For given poles and delay the velocity is linear in the numerator, so only poles and delay are
searched (variable projection, Golub and Pereyra 1973). A drive with dry friction answers the sign
of its velocity as well as the command, with the same poles and a numerator of its own.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from rigidimeter.dynamics import DriveModel, with_conjugates
from rigidimeter.dynamics.drive_model import state_after
from rigidimeter.estimation.closedloop.drive_motion import lateness_s, since_ticks
from rigidimeter.estimation.signals import Array
from rigidimeter.records import Channel

Complex = NDArray[np.complex128]

FASTEST, SLOWEST = 6.0, 5e-4
"""In rad a tick: poles are sought between; a faster one leaves nothing to see at the ticks."""

QUICKEST = 3.0
"""In rad a tick: an oscillation beyond π a tick looks like a slower one at the ticks."""

LONGEST_S, LONGEST_TICKS = 0.1, 4.0
"""The longest delay of a drive, the larger of both."""

EARLIEST = -0.5
"""In ticks. The search may pass through delays below zero; none is the answer."""

LATER = 0.5
"""In ticks: where a search begins again that came to no delay at first."""

DOUBLE = 1e-4
"""Two poles that are this close, as a share of their size, are taken for so far apart."""

MOST_TRIES = 80
"""Steps of a search; one that takes longer is on its way to poles without an end."""

EVERYTHING = slice(None)

TINY = float(np.finfo(np.float64).tiny)


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
        return max(map(abs, self.model.poles_rad_s)) * self.interval_s > 0.99 * FASTEST


class _Solved(NamedTuple):
    """Poles and delay of a drive, the numerator that suits them best, and what it leaves."""

    poles: tuple[complex, ...]
    shapes: list[Complex]
    delay_s: float
    numerator: Array
    left: Array


def search(
    samples: Samples, structure: Structure, start: DriveModel, part: slice = EVERYTHING
) -> Fitted:
    """Return the drive of a structure that explains a part of the samples best."""
    interval_s, time_s = samples.interval_s, samples.time_s[part]
    measured = samples.measured[part] / samples.scale
    degrees = np.array(([1.0, 2.0] * structure.poles)[: structure.poles])
    lower, upper = degrees * math.log(SLOWEST), degrees * math.log(FASTEST)
    longest = max(LONGEST_S / interval_s, LONGEST_TICKS)
    inputs = [_Acting(one, time_s) for one in samples.inputs(structure.friction)]

    def solved(x: Array, delay_ticks: float) -> _Solved:
        poles = _poles(np.minimum(np.maximum(x, lower), upper), interval_s)
        delay_s = min(max(float(delay_ticks), EARLIEST), longest) * interval_s
        # Friction acts behind the controller, whose zeros are not its own.
        shapes = [_shapes(poles, n) for n in (structure.zeros, structure.poles - 1)]
        columns = [
            acting.columns(poles, shape, late_s)
            for acting, shape, late_s in zip(inputs, shapes, (delay_s, 0.0), strict=False)
        ]
        table = np.concatenate(columns) if len(columns) > 1 else columns[0]
        size = np.sqrt(np.einsum("ij,ij->i", table, table)) + TINY
        gram = (table @ table.T) / np.outer(size, size)
        numerator = np.linalg.lstsq(gram, table @ measured / size)[0] / size
        return _Solved(poles, shapes, delay_s, numerator, numerator @ table - measured)

    def misfit(x: Array) -> Array:
        return solved(x[:-1], x[-1]).left

    def undelayed(x: Array) -> Array:
        return solved(x, 0.0).left

    def fitted(x: Array, delay_ticks: float) -> Fitted:
        poles, shapes, delay_s, numerator, left = solved(x, delay_ticks)
        parts = np.split(samples.scale * numerator, [structure.zeros + 1])
        residues, rubbing = (
            tuple((shape[:, : part.size] @ part).tolist())
            for shape, part in zip(shapes, parts, strict=True)
        )
        answer = rubbing if structure.friction else ()
        drive = DriveModel(poles, residues, delay_s)
        return Fitted(structure, drive, answer, float(np.mean(left**2)), interval_s)

    def found(x: Array, left: Callable[[Array], Array]) -> Array:
        scale = np.append(0.1 * degrees, 0.1)[: x.size]
        done = least_squares(
            left, x, method="lm", x_scale=scale, ftol=1e-6, xtol=1e-6, max_nfev=MOST_TRIES
        )
        return np.asarray(done.x)

    begin = _coordinates(structure, start, interval_s)
    x = found(begin, misfit)
    if 0.0 < x[-1] < LATER:
        return fitted(x[:-1], x[-1])
    # No delay, a short one and a long one are valleys of their own.
    valleys = [fitted(found(begin[:-1], undelayed), 0.0)]
    if x[-1] <= 0.0:
        valleys.append(fitted(found(x[:-1], undelayed), 0.0))
        x = found(np.append(begin[:-1], LATER), misfit)
    if x[-1] > 0.0:
        valleys.append(fitted(x[:-1], x[-1]))
    return min(valleys, key=lambda one: one.power)


def _coordinates(structure: Structure, start: DriveModel, interval_s: float) -> Array:
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
    return np.array([*found, max(start.delay_s / interval_s, 0.1)])


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


class _Acting:
    """An input at the times of the velocity, with what does not change in a search."""

    def __init__(self, channel: Channel, time_s: Array) -> None:
        self._channel, self._time_s = channel, time_s
        self._interval_s = 1.0 / channel.mean_rate_hz
        self._uneven_s = lateness_s(channel)
        self._late_s = math.nan

    def columns(self, poles: tuple[complex, ...], shapes: Complex, late_s: float) -> Array:
        """Return the velocity that each term of a numerator makes of the input, shape (j, n)."""
        if late_s != self._late_s:  # a search moves the poles more often than the delay
            self._since = since_ticks(self._channel, self._time_s, late_s, even=0.0)
            self._late_s = late_s
        columns = np.zeros((shapes.shape[1], self._time_s.size))
        for pole, weights in zip(poles, shapes, strict=True):
            values = self._channel.values
            state = state_after(pole, values, self._interval_s, *self._since, self._uneven_s)
            if pole.imag:
                weights = 2 * weights
                columns += np.outer(weights.real, state.real) - np.outer(weights.imag, state.imag)
            else:
                columns += np.outer(weights.real, state)
        return columns


def explained(samples: Samples, fitted: Fitted, time_s: Array) -> Array:
    """Return the velocity of a fitted drive, its answer to friction included."""
    model = fitted.model
    answers = ((model.residues, model.delay_s), (fitted.rubbing, 0.0))
    inputs = samples.inputs(fitted.structure.friction)
    columns = [
        _Acting(acting, time_s).columns(model.poles_rad_s, np.array(row)[:, None], late_s)[0]
        for acting, (row, late_s) in zip(inputs, answers, strict=False)
    ]
    return np.asarray(np.sum(columns, axis=0))


def power_left(samples: Samples, fitted: Fitted, part: slice) -> float:
    """Return the power that is left of a part of the velocity, as a share of its variance."""
    left = explained(samples, fitted, samples.time_s[part]) - samples.measured[part]
    return float(np.mean((left / samples.scale) ** 2))


def with_sign_of(samples: Samples, fitted: Fitted) -> Samples:
    """Return the samples with the sign that the velocity has between them, by a fitted drive."""
    time_s = samples.sign.time_s
    left = samples.measured - explained(samples, fitted, samples.time_s)
    velocity = explained(samples, fitted, time_s) + np.interp(time_s, samples.time_s, left)
    return samples._replace(sign=mean_sign(time_s, velocity))


def mean_sign(time_s: Array, velocity_rad_s: Array) -> Channel:
    """Return the mean sign, from each time to the next, of what goes straight between them."""
    after = np.append(velocity_rad_s[1:], velocity_rad_s[-1])
    larger = np.abs(velocity_rad_s) + np.abs(after)
    sign = (velocity_rad_s + after) / np.where(larger > 0, larger, 1.0)
    return Channel("velocity_rad_s", time_s, sign)
