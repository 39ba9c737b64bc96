"""The drive of one structure that explains the velocity best.

For given poles and delay the velocity is linear in the numerator, so only poles and delay are
searched (variable projection, Golub and Pereyra 1973).
"""

from __future__ import annotations

import itertools
import math
from collections import deque
from collections.abc import Callable

import numpy as np
import scipy

from rigidimeter.analysis.estimation.closedloop.drive_motion import since_ticks
from rigidimeter.analysis.estimation.closedloop.drive_terms import (
    FASTEST,
    SLOWEST,
    TINY,
    Acting,
    Fitted,
    Samples,
    Structure,
    Terms,
    acting_on,
    coordinates_of,
    terms_of,
)
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.records import Channel
from rigidimeter.model import DriveModel

LONGEST_S, LONGEST_TICKS = 0.1, 4.0
"""The longest delay of a drive, the larger of both."""

EARLIEST = -0.5
"""In ticks. The search may pass through delays below zero; none is the answer."""

SHORT, LATER = 0.1, 0.5
"""In ticks: the shortest delay that a search begins with, and where one begins again that came to
no delay at first."""

MOST_TRIES = 80
"""Steps of a search; one that takes longer is on its way to poles without an end."""

STEP = float(np.sqrt(np.finfo(np.float64).eps))
"""Of a coordinate, for its slope: rounding and curvature disturb it alike."""

EVERYTHING = slice(None)

LAGS_TICKS = (0, *sorted(step << octave for octave in range(13) for step in (2, 3)))
"""Edges of stretches of an input, ever longer the longer ago."""


def search(
    samples: Samples,
    structure: Structure,
    start: DriveModel,
    part: slice = EVERYTHING,
    delayed: bool = True,
) -> Fitted:
    """Return the drive of a structure that explains a part of the samples best.

    Of those without a delay if that is what `delayed` says.
    """
    interval_s, time_s = samples.interval_s, samples.time_s[part]
    measured = samples.measured[part] / samples.scale
    degrees = np.array(([1.0, 2.0] * structure.poles)[: structure.poles])
    longest = max(LONGEST_S / interval_s, LONGEST_TICKS)
    lower = np.append(degrees * math.log(SLOWEST), EARLIEST)
    upper = np.append(degrees * math.log(FASTEST), longest)
    inputs = acting_on(samples, structure, time_s)

    def solved(x: Array) -> tuple[Terms, Array, Array]:
        terms = terms_of(inputs, structure, np.minimum(np.maximum(x, lower), upper), interval_s)
        numerator = terms.numerator(measured)
        return terms, numerator, numerator @ terms.table - measured

    # The solver asks for slopes where it has just been.
    recent: deque[tuple[bytes, Array]] = deque(maxlen=degrees.size + 3)

    def misfit(x: Array) -> Array:
        place = x.tobytes()
        for known, left in recent:
            if known == place:
                return left
        left = solved(x)[-1]
        recent.append((place, left))
        return left

    def undelayed(x: Array) -> Array:
        return misfit(np.append(x, 0.0))

    def fitted(x: Array, delay_ticks: float) -> Fitted:
        terms, numerator, left = solved(np.append(x, delay_ticks))
        return terms.fitted(structure, samples, numerator, float(np.mean(left**2)))

    def found(x: Array, left: Callable[[Array], Array]) -> Array:
        place_of_x = x.tobytes()
        at_x: list[Array] = []

        def slopes(place: Array) -> Array:
            if place.tobytes() != place_of_x:
                return _slopes(left, place)
            if not at_x:  # asked for twice: the solver looks at their shape first
                at_x.append(_slopes(left, place))
            return at_x[0]

        scale = np.append(0.1 * degrees, 0.1)[: x.size]
        done, *_ = scipy.optimize.leastsq(
            left,
            x,
            Dfun=slopes,
            full_output=True,
            diag=1.0 / scale,
            ftol=1e-6,
            xtol=1e-6,
            gtol=1e-8,
            maxfev=MOST_TRIES,
        )
        return np.asarray(done)

    begin = coordinates_of(structure, start, interval_s)
    begin[-1] = max(begin[-1], SHORT)
    if not delayed:
        return fitted(found(begin[:-1], undelayed), 0.0)
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


def _slopes(function: Callable[[Array], Array], x: Array) -> Array:
    """Return how a function of the coordinates changes along each of them, shape (n, coordinates).

    By forward differences; those of scipy take as long beside the function as the function.
    """
    here = function(x)
    columns = []
    for at, step in enumerate(STEP * np.where(x >= 0, 1.0, -1.0) * np.maximum(1.0, np.abs(x))):
        there = x.copy()
        there[at] += step
        columns.append((function(there) - here) / (there[at] - x[at]))
    return np.column_stack(columns)


def explained(samples: Samples, fitted: Fitted, time_s: Array) -> Array:
    """Return the velocity of a fitted drive, its answer to friction included."""
    model = fitted.model
    answers = ((model.residues, model.delay_s), (fitted.rubbing, 0.0))
    inputs = samples.inputs(fitted.structure.friction)
    columns = [
        Acting(acting, time_s).columns(model.poles_rad_s, np.array(row)[:, None], late_s)[0]
        for acting, (row, late_s) in zip(inputs, answers, strict=False)
    ]
    return np.asarray(np.sum(columns, axis=0))


def explainable(samples: Samples, fitted: Fitted) -> float:
    """Return how much of what is left any linear drive might explain, as a share of its power.

    Whatever its poles, it adds up the past of its inputs: so do their means over `LAGS_TICKS`. What
    chance gives so many of them is taken off.
    """
    left = samples.measured - explained(samples, fitted, samples.time_s)
    columns = []
    for channel in samples.inputs(fitted.structure.friction):
        sums = np.concatenate(([0.0], np.cumsum(channel.values)))
        tick, _ = since_ticks(channel, samples.time_s, 0.0)
        edges = [sums[np.maximum(tick + 1 - lag, 0)] for lag in LAGS_TICKS if lag <= tick[-1]]
        columns += [late - early for late, early in itertools.pairwise(edges)]
    table = np.column_stack(columns)
    basis, _ = np.linalg.qr(table / (np.linalg.norm(table, axis=0) + TINY))
    along = basis.T @ left
    free = max(left.size - along.size, 1)
    return 1.0 - float(left @ left - along @ along) / float(left @ left) * left.size / free


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
