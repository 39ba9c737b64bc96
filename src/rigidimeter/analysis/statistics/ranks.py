"""Tests by ranks: two samples, two samples within strata, and the correlation of pairs.

Wilcoxon's rank-sum test with its effect size and the Hodges–Lehmann shift is

    U = #{x > y} + ½ #{x = y}
    σ² = m n / 12 · (N + 1 − Σ(t³ − t) / (N (N − 1))),   N = m + n
    z = (U − m n / 2 ∓ ½) / σ,   p = 2 (1 − Φ(|z|)),   r = z / √N

with t the sizes of the groups of ties and ½ the continuity correction towards zero. The exact test
takes, of all ways to deal the values of each stratum to the two samples, the share whose rank sum
lies at least as far from its mean as the one that was found. Spearman's rank correlation is

    ρ = Pearson's correlation of the ranks;  tanh(atanh ρ ± 1.96 √((1 + ρ²/2)/(n − 3)))

Within groups its ranks are those of each group, less their mean, so that what sets the groups apart
does not count; each group after the first takes one degree of freedom.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from rigidimeter.analysis.statistics.summary import Array, checked_sample
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import RANKED_PAIRS


@dataclass(frozen=True)
class RankSum:
    """A two-sided rank-sum test of x against y; positive where x tends to be larger.

    Attributes
    ----------
    n_x, n_y : int
        Sizes of the samples.
    z, p : float
        With tie correction and continuity correction.
    r : float
        Effect size z/√(n_x + n_y).
    shift : float
        Hodges–Lehmann estimate: the median of all differences x − y.
    shift_low, shift_high : float
        The interval of the shift at `confidence`.
    confidence : float
        For example 0.95.
    z_uncorrected, p_uncorrected : float
        With tie correction, without continuity correction.
    u : float
        Mann–Whitney U of x, R's W.
    shift_bounded : bool
        Whether the samples are large enough for an interval at this confidence. If not, its ends
        are the smallest and the largest difference, and it covers less than it says.
    """

    n_x: int
    n_y: int
    z: float
    p: float
    r: float
    shift: float
    shift_low: float
    shift_high: float
    confidence: float
    z_uncorrected: float
    p_uncorrected: float
    u: float
    shift_bounded: bool


def ranksum(x: ArrayLike, y: ArrayLike, *, confidence: float = 0.95) -> RankSum:
    r"""Test whether x and y come from the same distribution, by their ranks.

    The asymptotic test with tie and continuity correction, two-sided: what MATLAB's ``ranksum``
    does for samples that are not small, and R's ``wilcox.test(x, y, exact = FALSE)``.

    Parameters
    ----------
    x, y : array_like, shape (m,) and (n,)
        The samples, finite, at least one value each, in one unit.
    confidence : float
        Of the interval of the shift.

    Returns
    -------
    RankSum
        The shift and its ends in the unit of the samples. If all values are identical, z = 0 and
        p = 1.

    Raises
    ------
    ValueError
        If a sample is empty, not one-dimensional or not finite, or `confidence` is not between
        0 and 1.
    UserError
        If there are too many pairs of values.

    Notes
    -----
    .. math:: z = \frac{U - mn/2 \mp 1/2}{\sigma}, \qquad
              \sigma^2 = \frac{mn}{12}\left(N + 1 - \frac{\sum (t^3 - t)}{N (N - 1)}\right)

    The interval holds the shifts d at which the test of x − d against y does not reject. Between
    two neighbouring differences x − y, U(d) is constant and no x − d equals a y, so the test is
    inverted exactly, over the sorted differences, with the ties within x and within y only. R
    searches the same steps with ``uniroot``, to 1e-4.

    References
    ----------
    Hollander, Wolfe and Chicken, Nonparametric Statistical Methods, 3rd ed., 2014, ch. 4.
    Hodges and Lehmann, Estimates of location based on rank tests, Ann. Math. Stat. 34, 1963.
    Fritz, Morris and Richler, Effect size estimates, J. Exp. Psychol. Gen. 141, 2012 (r).

    Examples
    --------
    >>> test = ranksum([4.0, 5.0, 6.0, 7.0], [1.0, 2.0, 3.0, 4.5])
    >>> test.u, round(test.z, 4), round(test.p, 4)
    (15.0, 1.8764, 0.0606)
    >>> test.shift
    3.0
    """
    sample_x, sample_y = checked_sample("x", x), checked_sample("y", y)
    if not 0 < confidence < 1:
        raise ValueError(f"confidence must be between 0 and 1, got {confidence}")
    pairs = sample_x.size * sample_y.size
    if pairs > RANKED_PAIRS:
        raise UserError(
            f"{sample_x.size} and {sample_y.size} values make {pairs:.2g} pairs, and a rank-sum "
            f"test with the interval of its shift takes at most {RANKED_PAIRS:.2g}; compare means "
            "of days or subjects instead"
        )
    sigma = u_sigma(sample_x, sample_y)
    u, p, p_uncorrected = pairs / 2, 1.0, 1.0
    if sigma > 0:
        corrected, plain = (
            scipy.stats.mannwhitneyu(sample_x, sample_y, method="asymptotic", use_continuity=flag)
            for flag in (True, False)
        )
        u, p, p_uncorrected = (
            float(value) for value in (corrected.statistic, corrected.pvalue, plain.pvalue)
        )
    excess = u - pairs / 2
    z = _z(excess, sigma, 0.5)
    first = _lower_end(sample_x, sample_y, confidence)
    ends = max(first, 1) - 1, pairs - max(first, 1)
    differences = np.subtract.outer(sample_x, sample_y).reshape(-1)
    differences.partition(sorted({*ends, (pairs - 1) // 2, pairs // 2}))
    low, high = (float(differences[end]) for end in ends)
    return RankSum(
        n_x=sample_x.size,
        n_y=sample_y.size,
        z=z,
        p=p,
        r=z / math.sqrt(sample_x.size + sample_y.size),
        shift=float(differences[(pairs - 1) // 2] + differences[pairs // 2]) / 2,
        shift_low=low,
        shift_high=high,
        confidence=confidence,
        z_uncorrected=_z(excess, sigma, 0.0),
        p_uncorrected=p_uncorrected,
        u=u,
        shift_bounded=first > 0,
    )


def _tie_term(values: Array) -> float:
    sizes = np.unique(values, return_counts=True)[1].astype(np.float64)
    return float(np.sum(sizes**3 - sizes))


def _sigma_from_ties(m: int, n: int, tie_term: float) -> float:
    total = m + n
    variance = m * n / 12 * (total + 1 - tie_term / (total * (total - 1)))
    return math.sqrt(max(variance, 0.0))


def u_sigma(x: Array, y: Array) -> float:
    """Return the standard deviation of U with the ties of these samples, 0 where all are equal."""
    pooled = np.concatenate([x, y])
    if pooled.min() == pooled.max():
        return 0.0
    return _sigma_from_ties(x.size, y.size, _tie_term(pooled))


def _z(excess: float, sigma: float, correction: float) -> float:
    size = abs(excess) - correction
    if sigma == 0 or size <= 0:
        return 0.0
    return math.copysign(size, excess) / sigma


def _lower_end(x: Array, y: Array, confidence: float) -> int:
    """Return which of the sorted differences is the lower end, from 1 on; see `ranksum`.

    Above k of the differences, U(d) − m n / 2 = m n / 2 − k. The test does not reject while its
    size, less ½, is at most z σ; so the k that are kept lie symmetrically about m n / 2. Below 1
    the interval has no end.
    """
    sigma = _sigma_from_ties(x.size, y.size, _tie_term(x) + _tie_term(y))
    reach = float(scipy.stats.norm.isf((1 - confidence) / 2)) * sigma + 0.5
    return math.ceil(x.size * y.size / 2 - reach)


def exact_ranksum(strata: Sequence[tuple[ArrayLike, ArrayLike]]) -> float:
    """Return the exact two-sided p of the rank-sum test, ranks and dealing within each stratum.

    Tied values share their mid-rank, and the distribution is that of these ranks. Two-sided: the
    probability of a rank sum at least as far from its mean. NaN if no stratum has both samples.

    Parameters
    ----------
    strata : sequence of (array_like, array_like)
        The two samples of each stratum; a single stratum is the usual test.

    References
    ----------
    van Elteren, Bull. Inst. Int. Stat. 37, 1960 (ranks within strata).

    Examples
    --------
    >>> round(exact_ranksum([([4.0, 5.0, 6.0], [1.0, 2.0, 3.0])]), 3)
    0.1
    """
    counts = np.ones(1)  # by twice the rank sum, which is whole with mid-ranks too
    found, mean, known = 0, 0.0, False
    for x, y in strata:
        first, second = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
        if first.size == 0 or second.size == 0:
            continue
        known = True
        twice = np.rint(2 * scipy.stats.rankdata(np.concatenate([first, second]))).astype(np.int64)
        counts = np.convolve(counts, _sums(twice, first.size))
        found += int(twice[: first.size].sum())
        mean += first.size * float(twice.mean())
    if not known:
        return math.nan
    far = np.abs(np.arange(counts.size) - mean) >= abs(found - mean) - 1e-9
    return min(float(counts[far].sum() / counts.sum()), 1.0)


def _sums(ranks: NDArray[np.int64], size: int) -> Array:
    """Return how probable each sum of `size` of the ranks is, over all choices of that size."""
    table = np.zeros((size + 1, int(ranks.sum()) + 1))
    table[0, 0] = 1.0
    for k, rank in enumerate(ranks.tolist(), start=1):
        # Of k ranks: taken into j of them with probability j/k, so that nothing overflows.
        for j in range(min(k, size), 0, -1):
            taken = np.zeros_like(table[j])
            taken[rank:] = table[j - 1, : table.shape[1] - rank]
            table[j] = ((k - j) * table[j] if j < k else 0.0) / k + taken * j / k
    return np.asarray(table[size])


class RankCorrelation(NamedTuple):
    """ρ with its 95 % interval; NaN where it is not known, the interval also where |ρ| is 1."""

    rho: float
    low: float
    high: float


def rank_correlation(
    x: ArrayLike, y: ArrayLike, groups: Sequence[str] | None = None, confidence: float = 0.95
) -> RankCorrelation:
    """Return Spearman's ρ of pairs of values.

    Parameters
    ----------
    x, y : array_like, shape (n,)
    groups : sequence of str, optional
        The group of each pair, where the correlation is that within groups.
    confidence : float

    References
    ----------
    Bonett and Wright, Sample size requirements for estimating Pearson, Kendall and Spearman
    correlations, Psychometrika 65, 2000.

    Examples
    --------
    >>> found = rank_correlation([1, 2, 3, 4, 5, 6], [1, 3, 2, 4, 6, 5])
    >>> round(found.rho, 3), round(found.low, 3), round(found.high, 3)
    (0.886, 0.119, 0.991)
    """
    first, second = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    labels = np.asarray(groups if groups is not None else [""] * first.size, dtype=object)
    ranks = np.zeros((2, first.size))
    names = dict.fromkeys(labels.tolist())
    for name in names:
        own = labels == name
        for row, values in zip(ranks, (first, second), strict=True):
            row[own] = scipy.stats.rankdata(values[own])
            row[own] -= row[own].mean()
    size = math.sqrt(float(ranks[0] @ ranks[0]) * float(ranks[1] @ ranks[1]))
    if not size:
        return RankCorrelation(math.nan, math.nan, math.nan)
    rho = max(-1.0, min(1.0, float(ranks[0] @ ranks[1]) / size))
    free = first.size - 3 - (len(names) - 1)
    if free < 1 or abs(rho) > 1 - 1e-12:
        return RankCorrelation(rho, math.nan, math.nan)
    half = float(scipy.stats.norm.ppf((1 + confidence) / 2)) * math.sqrt((1 + rho**2 / 2) / free)
    z = math.atanh(rho)
    return RankCorrelation(rho, math.tanh(z - half), math.tanh(z + half))
