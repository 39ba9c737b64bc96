"""The difference of two means where some units have both conditions and others have one.

    δ = α X̄_only + (1 − α) X̄_both − β Ȳ_only − (1 − β) Ȳ_both
    Var δ = α² s²(x_only)/n_x + β² s²(y_only)/n_y + s²((1 − α) x − (1 − β) y over units with both)/n

A unit is what was sampled: a day, or a subject. Given the weights each part of the variance is
unbiased, whatever the two variances and the correlation within a unit. The weights are those of
least squares at equal variances and a correlation of ½, so that they follow from the numbers of
units alone: weights that follow the values choose a variance that is too small.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

CORRELATION = 0.5
"""Of two conditions in one unit, for the weights only."""
FEWEST_BOTH = 3
"""With fewer units that have both, and others beside them, each counts as two units."""


@dataclass(frozen=True)
class PartiallyPaired:
    """A difference of means with its standard error.

    Attributes
    ----------
    estimate, se : float
        In the unit of the values.
    df : float
        Degrees of freedom of t.
    n_both, n_x, n_y : int
        Units that counted as pairs, and those that counted for one condition.
    weight_x, weight_y : float
        α and β: the share of units with x (or y) alone in the mean of x (or y).
    mean_x, mean_y : float
        With these weights; their difference is `estimate`.
    """

    estimate: float
    se: float
    df: float
    n_both: int
    n_x: int
    n_y: int
    weight_x: float
    weight_y: float
    mean_x: float
    mean_y: float


@dataclass(frozen=True)
class _Part:
    """A part of the variance, what it would be at unit variances, its degrees of freedom."""

    variance: float
    expected: float
    df: int


def partially_paired(
    x_both: ArrayLike, y_both: ArrayLike, x_only: ArrayLike, y_only: ArrayLike
) -> PartiallyPaired:
    """Estimate the mean of x less that of y from units with both and units with one.

    Parameters
    ----------
    x_both, y_both : array_like, shape (n,)
        Values of the units with both, in the same order.
    x_only, y_only : array_like, shape (n_x,) and (n_y,)
        Values of the units with one.

    Raises
    ------
    ValueError
        If a condition has fewer than two units, or the values do not vary.

    Notes
    -----
    Units with both only: the paired t-test. None with both: Welch's test. One unit or two with
    both beside others count as separate units, which makes the test conservative if the conditions
    of a unit are alike. A single unit with one condition takes its variance from those with both.

    Degrees of freedom are Welch and Satterthwaite's, with the estimated shares v_j/V of the
    variance drawn toward those m_j/M at equal variances, for shares from few values make them too
    many: 1/ν = Σ (w_j²/k_j), w_j = (1 − 1/k) v_j/V + (1/k) m_j/M with k the smallest k_j, and never
    more than Welch's. With equal numbers that is Welch's test exactly.

    References
    ----------
    Welch, Biometrika 34, 1947. Satterthwaite, Biometrics Bull. 2, 1946. Looney and Jones, A method
    for comparing two normal means using combined samples of correlated and uncorrelated data,
    Stat. Med. 22, 2003.

    Examples
    --------
    >>> found = partially_paired([3.0, 4.0, 6.0], [1.0, 3.0, 4.0], [5.0, 6.0], [])
    >>> round(found.estimate, 3), round(found.weight_x, 3), round(found.df, 2)
    (1.9, 0.2, 2.25)
    """
    both = np.array([x_both, y_both], dtype=np.float64)
    only = [np.asarray(values, dtype=np.float64) for values in (x_only, y_only)]
    if both.shape[1] < (FEWEST_BOTH if only[0].size or only[1].size else 2):
        only = [np.concatenate([*pair]) for pair in zip(both, only, strict=True)]
        both = both[:, :0]
        if min(each.size for each in only) < 2:
            raise ValueError("a condition has one value, so its variance is unknown")
    n, n_x, n_y = both.shape[1], only[0].size, only[1].size
    weights = _weights(n, n_x, n_y)
    means = [
        (weight * each.mean() if each.size else 0.0) + ((1 - weight) * pair.mean() if n else 0.0)
        for weight, each, pair in zip(weights, only, both, strict=True)
    ]
    parts = list(_parts(both, only, weights))
    variance = sum(part.variance for part in parts)
    if (
        variance
        <= 1e-20 * max(float(np.max(np.abs(each), initial=0)) for each in (both, *only)) ** 2
    ):
        raise ValueError("the values do not vary, so there is no error to test against")
    return PartiallyPaired(
        float(means[0] - means[1]),
        math.sqrt(variance),
        _df(parts),
        n,
        n_x,
        n_y,
        *weights,
        *map(float, means),
    )


def _weights(n: int, n_x: int, n_y: int) -> tuple[float, float]:
    """Return α and β of generalised least squares at a correlation of `CORRELATION`."""
    pairs = n / (1 - CORRELATION**2)
    information = [[n_x + pairs, -CORRELATION * pairs], [-CORRELATION * pairs, n_y + pairs]]
    first, second = np.linalg.solve(information, [1.0, -1.0])
    return float(n_x * first), float(-n_y * second)


def _parts(both: Array, only: list[Array], weights: tuple[float, float]) -> Iterator[_Part]:
    n = both.shape[1]
    variance = expected = 0.0
    if n:
        a, b = (1 - weight for weight in weights)
        variance = float(np.var(a * both[0] - b * both[1], ddof=1)) / n
        expected = (a * a + b * b - 2 * CORRELATION * a * b) / n
    for weight, own, pair in zip(weights, only, both, strict=True):
        if own.size > 1:
            scale = weight**2 / own.size
            yield _Part(scale * float(np.var(own, ddof=1)), scale, own.size - 1)
        elif own.size:  # of the same units as the pairs, so of the same degrees of freedom
            variance += weight**2 * float(np.var(pair, ddof=1))
            expected += weight**2
    if n:
        yield _Part(variance, expected, n - 1)


def _df(parts: list[_Part]) -> float:
    df = np.array([part.df for part in parts])
    found, expected = (
        np.array(values) / sum(values)
        for values in ([p.variance for p in parts], [p.expected for p in parts])
    )
    trusted = 1 - 1 / df.min()
    drawn = trusted * found + (1 - trusted) * expected
    return float(min(1 / np.sum(found**2 / df), 1 / np.sum(drawn**2 / df)))
