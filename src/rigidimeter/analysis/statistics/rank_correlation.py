"""Spearman's rank correlation with an interval, over all values or within groups.

    ρ = Pearson's correlation of the ranks;  tanh(atanh ρ ± 1.96 √((1 + ρ²/2)/(n − 3)))

Within groups the ranks are those of each group, less their mean, so that what sets the groups apart
does not count; each group after the first takes one degree of freedom.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import norm, rankdata


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
            row[own] = rankdata(values[own])
            row[own] -= row[own].mean()
    size = math.sqrt(float(ranks[0] @ ranks[0]) * float(ranks[1] @ ranks[1]))
    if not size:
        return RankCorrelation(math.nan, math.nan, math.nan)
    rho = max(-1.0, min(1.0, float(ranks[0] @ ranks[1]) / size))
    free = first.size - 3 - (len(names) - 1)
    if free < 1 or abs(rho) > 1 - 1e-12:
        return RankCorrelation(rho, math.nan, math.nan)
    half = float(norm.ppf((1 + confidence) / 2)) * math.sqrt((1 + rho**2 / 2) / free)
    z = math.atanh(rho)
    return RankCorrelation(rho, math.tanh(z - half), math.tanh(z + half))
