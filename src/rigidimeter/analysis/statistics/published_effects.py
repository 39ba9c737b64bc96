"""What a printed p-value and its group sizes say of an effect, without the data.

    |z| = Φ⁻¹(1 − p/2),   r = z/√N,   r ≤ √(3 m n / (N (N + 1)))
    rank-biserial δ = z σ / (m n / 2),   σ² = m n (N + 1) / 12   (no ties)
    δ = 2 A − 1;   V(A) = A(1 − A) (1 + (N/2 − 1) ((1 − A)/(2 − A) + A/(1 + A))) / (m n)

r depends on how unequal the groups are, δ does not: compare measures by δ. Newcombe's interval
solves |Â − A| = z √V(A) for A, and needs nothing but Â, m and n.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import scipy


@dataclass(frozen=True)
class PublishedEffect:
    """The size of an effect of which p and the group sizes are known; without sign.

    Attributes
    ----------
    n_x, n_y : int
    z, r : float
        r = z/√(n_x + n_y).
    rank_biserial, rank_biserial_low, rank_biserial_high : float
        As if there were no ties; the interval is Newcombe's.
    """

    n_x: int
    n_y: int
    z: float
    r: float
    rank_biserial: float
    rank_biserial_low: float
    rank_biserial_high: float


@dataclass(frozen=True)
class PublishedDifference:
    """A difference of two rank-biserial correlations, as if from independent samples."""

    estimate: float
    low: float
    high: float
    p: float


def effect_from_p(p: float, n_x: int, n_y: int) -> PublishedEffect:
    """Return the effect sizes behind a two-sided rank-sum p.

    Raises
    ------
    ValueError
        If p is not in (0, 1], or a group is empty.

    Examples
    --------
    >>> round(effect_from_p(1.8e-4, 78, 23).r, 3)
    0.373
    """
    if not 0 < p <= 1:
        raise ValueError(f"p must be above 0 and at most 1, got {p}")
    _checked(n_x, n_y)
    z = float(scipy.stats.norm.isf(p / 2))
    sigma = math.sqrt(n_x * n_y * (n_x + n_y + 1) / 12)
    rank_biserial = min(z * sigma / (n_x * n_y / 2), 1.0)
    low, high = rank_biserial_interval(rank_biserial, n_x, n_y)
    return PublishedEffect(n_x, n_y, z, z / math.sqrt(n_x + n_y), rank_biserial, low, high)


def largest_r(n_x: int, n_y: int) -> float:
    """Return r of two groups that do not overlap at all (no ties, no continuity correction)."""
    _checked(n_x, n_y)
    total = n_x + n_y
    return math.sqrt(3 * n_x * n_y / (total * (total + 1)))


def rank_biserial_interval(
    rank_biserial: float, n_x: int, n_y: int, *, confidence: float = 0.95
) -> tuple[float, float]:
    """Return Newcombe's interval (his method 5), which holds at ±1 too.

    Raises
    ------
    ValueError
        If the correlation is not in [−1, 1], a group is empty, or `confidence` not in (0, 1).

    References
    ----------
    Newcombe, Confidence intervals for an effect size measure based on the Mann-Whitney statistic.
    Part 2, Stat. Med. 25, 2006. Hanley and McNeil, Radiology 143, 1982.
    """
    if not -1 <= rank_biserial <= 1:
        raise ValueError(f"a rank-biserial correlation lies in -1 to 1, got {rank_biserial}")
    if not 0 < confidence < 1:
        raise ValueError(f"confidence must be between 0 and 1, got {confidence}")
    _checked(n_x, n_y)
    if rank_biserial < 0:
        low, high = rank_biserial_interval(-rank_biserial, n_x, n_y, confidence=confidence)
        return -high, -low
    found = (1 + rank_biserial) / 2
    z = float(scipy.stats.norm.isf((1 - confidence) / 2))

    def beyond(area: float) -> float:
        return abs(found - area) - z * math.sqrt(_variance(area, n_x, n_y))

    inside = found - 1e-12
    low = float(scipy.optimize.brentq(beyond, 0.0, inside))
    high = 1.0 if found > 1 - 1e-9 else float(scipy.optimize.brentq(beyond, found, 1.0))
    return 2 * low - 1, 2 * high - 1


def compare_published(first: PublishedEffect, second: PublishedEffect) -> PublishedDifference:
    """Return the first rank-biserial correlation less the second, with an interval and a test.

    Effects without sign are taken to point the same way, and samples to be independent: measures of
    the same session usually agree, which makes the true interval narrower. The interval combines
    the two Newcombe intervals; the test uses the variances at the estimates.

    References
    ----------
    Zou and Donner, Construction of confidence limits about effect measures, Stat. Med. 27, 2008.
    """
    a, b = first.rank_biserial, second.rank_biserial
    variance = sum(4 * _variance((1 + e.rank_biserial) / 2, e.n_x, e.n_y) for e in (first, second))
    p = (
        2 * float(scipy.stats.norm.sf(abs(a - b) / math.sqrt(variance)))
        if variance > 0
        else math.nan
    )
    return PublishedDifference(
        estimate=a - b,
        low=a - b - math.hypot(a - first.rank_biserial_low, second.rank_biserial_high - b),
        high=a - b + math.hypot(first.rank_biserial_high - a, b - second.rank_biserial_low),
        p=p,
    )


def _variance(area: float, n_x: int, n_y: int) -> float:
    half = (n_x + n_y) / 2
    spread = 1 + (half - 1) * ((1 - area) / (2 - area) + area / (1 + area))
    return area * (1 - area) * spread / (n_x * n_y)


def _checked(n_x: int, n_y: int) -> None:
    if min(n_x, n_y) < 1:
        raise ValueError(f"each group needs at least one value, got {n_x} and {n_y}")
