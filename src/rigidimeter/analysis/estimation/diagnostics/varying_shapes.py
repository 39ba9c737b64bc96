"""What a joint may vary with within an epoch: time, the slow angle, the phase of a movement.

Each is a few smooth functions of time. Polynomials of degree 3 follow a drift and, roughly, a
step; of degree 2 a stiffness that rises to one side or to both; two harmonics what happens within a
cycle.

The torque that an imposed movement takes is no stiffness about it, and neither is the torque that
holds the joint where it slowly goes, unless the perturbation brought it there. Both are fitted
beside, as smooth functions of the phase or of the slow angle, and the motion that is multiplied is
the fast one alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy
from numpy.polynomial import legendre

from rigidimeter.analysis.estimation.diagnostics.varying_lines import VaryingLines
from rigidimeter.analysis.estimation.signals import Array

TIME_DEGREE, FINER_TIME_DEGREE = 3, 20
SLOW_HZ = 0.5
"""The angle below this is where the joint is; above, how it moves there."""

LEAST_RANGE_RAD = math.radians(5.0)
"""Between the 5th and the 95th percentile. Over less, what torque and angle have in common
beyond proportion is a reflex or the fibres' own (short-range) stiffness, not the joint's angle."""

LONGEST_PERIOD_SHARE, FASTEST_HZ = 1 / 3, 2.0
"""An imposed movement has at least three cycles in an epoch, and at most 2 a second."""

PERIODIC_SHARE = 0.6
"""Of the variance of the angle that the perturbation does not explain, within two lines either way
of the strongest, at least. A perturbation in the loop reaches 0.5 at its slowest line."""

PERIODIC_OF_ALL = 0.25
"""Of the variance of the angle, at least."""

ANGLE_DEGREE, FINER_ANGLE_DEGREE = 2, 4
PHASE_HARMONICS, FINER_PHASE_HARMONICS = 2, 4
MOVEMENT_HARMONICS = 6
INNER_TIME, INNER_ANGLE = (0.1, 0.9), (0.05, 0.95)
"""Between these shares of the epoch, and quantiles of the slow angle, a range is stated: at the
ends polynomials follow the noise."""

POINTS = 61


class Shapes(NamedTuple):
    """The functions of one kind.

    Attributes
    ----------
    name : str
        Of the finding.
    functions : array, shape (n, q)
        On the coarse time grid.
    finer : array, shape (n, s)
        More of the kind, for what the few leave of a change that is known to be there: no other
        kind shall be found in that.
    at : array, shape (g, q)
        The same at the places where the range is looked for.
    place : callable
        From the index of a place to words.
    beside : array, shape (n, r)
        Functions whose torque is fitted beside.
    elastic : array, shape (q,)
        What the functions are multiplied by in the torque of a stiffness.
    """

    name: str
    functions: Array
    finer: Array
    at: Array
    place: Callable[[int], str]
    beside: Array
    elastic: Array


def with_time(lines: VaryingLines, movement: Shapes | None) -> Shapes:
    """Return polynomials over the epoch; the torque that an imposed movement takes is beside."""
    begin_s = float(lines.grid.time_s[0])
    place = np.linspace(*INNER_TIME, POINTS)

    def polynomials(share: Array, degree: int) -> Array:
        return np.asarray(legendre.legvander(2 * share - 1, degree)[:, 1:])

    share = lines.time_s / lines.duration_s

    return Shapes(
        "varying_with_time",
        polynomials(share, TIME_DEGREE),
        polynomials(share, FINER_TIME_DEGREE),
        polynomials(place, TIME_DEGREE),
        lambda i: f"{begin_s + place[i] * lines.duration_s:.1f} s",
        np.empty((lines.time_s.size, 0)) if movement is None else movement.beside,
        np.ones(TIME_DEGREE),
    )


def with_angle(lines: VaryingLines) -> Shapes | None:
    """Return polynomials of the angle; None where it hardly changes.

    Where the perturbation is the instrument, the torque of a stiffness K₀ + c₁ θ + c₂ θ² is its
    integral over the angle, θ (K₀ + c₁ θ/2 + c₂ θ²/3). Without it the angle is the slow one.
    """
    angle = lines.angle_rad
    if not lines.by_perturbation:
        angle = lines.slow_part(angle, SLOW_HZ)
    low, high = np.quantile(angle, INNER_ANGLE).tolist()
    if high - low < LEAST_RANGE_RAD:
        return None
    half = (high - low) / 2
    place = np.linspace(low, high, POINTS)
    powers = _powers(angle / half, FINER_ANGLE_DEGREE)
    return Shapes(
        "varying_with_angle",
        powers[:, :ANGLE_DEGREE],
        powers,
        _powers(place / half, ANGLE_DEGREE),
        lambda i: f"{math.degrees(place[i]):+.1f}° from the mean",
        np.empty((angle.size, 0))
        if lines.by_perturbation
        else np.column_stack([np.ones_like(angle), powers[:, : ANGLE_DEGREE + 1]]),
        1 / (2.0 + np.arange(ANGLE_DEGREE)) if lines.by_perturbation else np.ones(ANGLE_DEGREE),
    )


def with_phase(lines: VaryingLines) -> Shapes | None:
    """Return harmonics of an imposed movement's phase; None where there is no such movement."""
    period_s = imposed_period_s(lines)
    if period_s is None:
        return None
    phase = _phase(lines, 1 / period_s)
    place = np.linspace(0.0, 2 * np.pi, POINTS)
    return Shapes(
        "varying_with_phase",
        _harmonics(phase, PHASE_HARMONICS),
        _harmonics(phase, FINER_PHASE_HARMONICS),
        _harmonics(place, PHASE_HARMONICS),
        lambda i: f"{math.degrees(place[i]):.0f}° of the {period_s:.3g} s cycle",
        np.column_stack([np.ones_like(phase), _harmonics(phase, MOVEMENT_HARMONICS)]),
        np.ones(2 * PHASE_HARMONICS),
    )


def imposed_period_s(lines: VaryingLines) -> float | None:
    """Return the period of a movement that is not the perturbation's; None where there is none."""
    angle = lines.motion[:, 2]
    rest = angle
    if lines.by_perturbation:
        caused = lines.instruments[:, 2]
        size = float(np.sum(np.abs(caused) ** 2))
        gain = float(np.sum((caused.conj() * angle).real)) / max(size, 1e-300)
        rest = angle - gain * caused
    power, total = np.abs(rest) ** 2, float(np.sum(np.abs(angle) ** 2))
    line = np.arange(1, power.size + 1)
    slow = (line >= 1 / LONGEST_PERIOD_SHARE) & (line <= FASTEST_HZ * lines.duration_s)
    if not np.any(slow) or not total > 0:
        return None
    peak = int(np.argmax(np.where(slow, power, 0.0)))
    near = slice(max(peak - 2, 0), peak + 3)
    own = float(np.sum(power[near]))
    if own < PERIODIC_SHARE * float(np.sum(power)) or own < PERIODIC_OF_ALL * total:
        return None
    return lines.duration_s / float(power[near] @ line[near] / own)


def _phase(lines: VaryingLines, frequency_hz: float) -> Array:
    """Return the phase of the movement, 0 where the angle is highest, shape (n,)."""
    n = lines.angle_rad.size
    # Mirrored at the end, so that a movement that is no whole number of cycles has no step there.
    spectrum = scipy.fft.fft(np.concatenate([lines.angle_rad, lines.angle_rad[::-1]]))
    frequency = np.arange(2 * n) / (2 * lines.duration_s)
    spectrum *= np.exp(-0.5 * ((frequency - frequency_hz) / (frequency_hz / 3)) ** 2)
    return np.asarray(np.angle(scipy.fft.ifft(spectrum)[:n]))


def _powers(values: Array, degree: int) -> Array:
    """Return the first to the last power, shape (n, degree)."""
    return np.asarray(values[:, None] ** np.arange(1, degree + 1))


def _harmonics(phase: Array, count: int) -> Array:
    of = phase[:, None] * np.arange(1, count + 1)
    return np.concatenate([np.cos(of), np.sin(of)], axis=1)
