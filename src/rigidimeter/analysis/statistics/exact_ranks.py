"""The exact rank-sum test, within strata.

Of all ways to deal the values of each stratum to the two samples, the share whose rank sum lies
at least as far from its mean as the one that was found.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import rankdata

Array = NDArray[np.float64]


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
        twice = np.rint(2 * rankdata(np.concatenate([first, second]))).astype(np.int64)
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
