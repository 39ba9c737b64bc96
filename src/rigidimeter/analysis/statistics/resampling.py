"""Bias-corrected and accelerated bootstrap (BCa) of a statistic of weighted samples.

    α ↦ Φ(z₀ + (z₀ + z_α) / (1 − a (z₀ + z_α)))

z₀ is the normal quantile of the share of resamples below the estimate; a is a sixth of the
skewness of the leave-one-out estimates. A resample is a count for each unit, so that a statistic
of ten thousand resamples is one product of matrices.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from rigidimeter.analysis.statistics.summary import Array
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import BOOTSTRAP_COUNTS

Statistic = Callable[..., Array]


@dataclass(frozen=True)
class Bootstrapped:
    """An estimate with its interval and its test against zero.

    Attributes
    ----------
    estimate, low, high : float
        In the statistic's unit. The ends are NaN where all resamples give one value.
    p : float
        Two-sided: one less the confidence at which the interval ends at zero. At least 1/resamples;
        NaN where there is no interval.
    distribution : ndarray, shape (resamples,)
    """

    estimate: float
    low: float
    high: float
    p: float
    distribution: Array


def bootstrap(
    statistic: Statistic,
    sizes: Sequence[int],
    rng: np.random.Generator,
    *,
    resamples: int = 9999,
    confidence: float = 0.95,
) -> Bootstrapped:
    """Resample the units of independent samples with replacement.

    Parameters
    ----------
    statistic : callable
        Takes one array of counts for each sample, shape (m, size), and returns shape (m,). It must
        depend on the proportions of the counts alone.
    sizes : sequence of int
        Number of units in each sample.
    rng : numpy.random.Generator
    resamples : int
        At least 100.
    confidence : float

    Returns
    -------
    Bootstrapped

    Raises
    ------
    ValueError
        If `resamples` is below 100, `confidence` is not between 0 and 1, or a sample is empty.

    Notes
    -----
    Resamples that give no number (a product of an empty unit) are left out.

    References
    ----------
    Efron and Tibshirani, An Introduction to the Bootstrap, 1993, ch. 14.3; the acceleration of
    several samples as in Davison and Hinkley, Bootstrap Methods and their Application, 1997, 5.3.
    """
    if resamples < 100:
        raise ValueError(f"a bootstrap needs at least 100 resamples, got {resamples}")
    if resamples * sum(sizes) > BOOTSTRAP_COUNTS:
        raise UserError(
            f"--resamples {resamples} of {sum(sizes)} values or units are too many; with so many "
            f"values it must be at most {BOOTSTRAP_COUNTS // sum(sizes)} (at least 100)"
        )
    if not 0 < confidence < 1:
        raise ValueError(f"confidence must be between 0 and 1, got {confidence}")
    if min(sizes) < 1:
        raise ValueError("every sample needs at least one unit")
    estimate = float(statistic(*(np.ones((1, size)) for size in sizes))[0])
    drawn = [rng.multinomial(size, np.full(size, 1 / size), resamples) for size in sizes]
    found = statistic(*(counts.astype(np.float64) for counts in drawn))
    found = found[np.isfinite(found)]
    if found.size == 0 or np.ptp(found) <= 1e-14 * max(1.0, abs(estimate)):
        return Bootstrapped(estimate, math.nan, math.nan, math.nan, found)
    z0 = float(scipy.stats.norm.ppf(_clipped(_share_below(found, estimate), found.size)))
    a = _acceleration(statistic, sizes)

    def end(tail: float) -> float:
        z = z0 + float(scipy.stats.norm.ppf(tail))
        return float(np.quantile(found, scipy.stats.norm.cdf(z0 + z / (1 - a * z))))

    tail = (1 - confidence) / 2
    moved = float(scipy.stats.norm.ppf(_clipped(_share_below(found, 0.0), found.size))) - z0
    z = moved / (1 + a * moved) - z0
    p = max(2 * float(scipy.stats.norm.sf(abs(z))), 1 / found.size)
    return Bootstrapped(estimate, end(tail), end(1 - tail), p, found)


def _share_below(found: Array, value: float) -> float:
    """Return the share below a value, those equal to it counted half."""
    near = 1e-12 * max(1.0, abs(value))
    return float(np.mean(found < value - near) + np.mean(found <= value + near)) / 2


def _clipped(share: float, count: int) -> float:
    return min(max(share, 0.5 / count), 1 - 0.5 / count)


def _acceleration(statistic: Statistic, sizes: Sequence[int]) -> float:
    cubes = squares = 0.0
    for index, size in enumerate(sizes):
        if size < 2:
            continue
        counts = [np.ones((size, other)) for other in sizes]
        counts[index] = 1.0 - np.eye(size)
        left_out = statistic(*counts)
        left_out = left_out[np.isfinite(left_out)]
        influence = (size - 1) * (np.mean(left_out) - left_out)
        cubes += float(np.sum(influence**3)) / size**3
        squares += float(np.sum(influence**2)) / size**2
    return cubes / (6 * squares**1.5) if squares > 0 else 0.0
