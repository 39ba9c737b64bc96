"""The chance of a paired t-test to show a difference, and the fewest pairs that reach one."""

from __future__ import annotations

import math
from collections.abc import Callable

import scipy

_FEWEST = 3
_MOST = 1000
"""Pairs, where the search ends."""

_CERTAIN = 40.0
"""Above this noncentrality the power is 1, and the series of the distribution may not converge."""


def paired_power(difference: float, sd: float, pairs: float, *, alpha: float = 0.05) -> float:
    """Return the power of the two-sided paired t-test to find the difference with its sign.

    Parameters
    ----------
    difference, sd : float
        Mean and SD of the differences of pairs, in one unit.
    pairs : float
        Their number, above 1.
    alpha : float
        The level of the test.

    Raises
    ------
    ValueError
        If a number is out of range.

    Examples
    --------
    >>> round(paired_power(1.0, 1.0, 10), 3)
    0.803
    """
    if pairs <= 1 or sd < 0 or not 0 < alpha < 1:
        raise ValueError(
            f"more than 1 pair, an SD of at least 0 and alpha between 0 and 1 are needed, got "
            f"{pairs}, {sd} and {alpha}"
        )
    if abs(difference) * math.sqrt(pairs) > _CERTAIN * sd:
        return 1.0
    shift = abs(difference) * math.sqrt(pairs) / sd
    critical = float(scipy.stats.t.isf(alpha / 2.0, pairs - 1))
    return float(scipy.stats.nct.sf(critical, pairs - 1, shift))


def pairs_needed(
    difference: float, sd: float, power: float = 0.8, *, alpha: float = 0.05
) -> int | None:
    """Return the fewest pairs, from three, that reach the power; None if 1000 do not.

    Raises
    ------
    ValueError
        If a number is out of range.
    """
    return fewest_pairs(lambda pairs: paired_power(difference, sd, pairs, alpha=alpha), power)


def fewest_pairs(chance: Callable[[int], float], wanted: float) -> int | None:
    """Return the fewest pairs, from three, with the wanted chance; None if 1000 do not have it.

    Parameters
    ----------
    chance : callable
        Gives it for a number of pairs, with which it grows.
    wanted : float
    """
    low, high = _FEWEST - 1, _FEWEST
    while chance(high) < wanted:
        low, high = high, 2 * high
        if low >= _MOST:
            return None
    while high - low > 1:
        middle = (low + high) // 2
        if chance(middle) < wanted:
            low = middle
        else:
            high = middle
    return high if high <= _MOST else None
