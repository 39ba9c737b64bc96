"""How far two groups lie apart, how sure that is, and whether one measure separates them better.

    rank-biserial  δ = (#{x > y} − #{x < y}) / (m n) = 2 U/(m n) − 1
    r = z/√N,  z the rank-sum statistic

Intervals are BCa bootstraps (`bootstrap`) that resample units within each condition: a
value, or a session with all its values. Two measures of the same units are resampled together.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rigidimeter.analysis.statistics.published_effects import rank_biserial_interval
from rigidimeter.analysis.statistics.ranks import RankSum, ranksum, u_sigma
from rigidimeter.analysis.statistics.resampling import bootstrap
from rigidimeter.analysis.statistics.summary import Array, checked_sample


@dataclass(frozen=True)
class TwoGroups:
    """One measure in two conditions, and the unit that each value belongs to.

    Attributes
    ----------
    x, y : ndarray, shape (m,) and (n,)
    x_units, y_units : tuple of str
        What is resampled: labels, one for each value. Values with one label stay together.
    """

    x: Array
    y: Array
    x_units: tuple[str, ...]
    y_units: tuple[str, ...]


@dataclass(frozen=True)
class Effects:
    """Effect sizes of one comparison; positive where x tends to be larger.

    Attributes
    ----------
    test : RankSum
    r, r_low, r_high : float
        z/√N with continuity correction.
    rank_biserial, rank_biserial_low, rank_biserial_high : float
    confidence : float
    method : str
        ``BCa`` or, where the groups do not overlap and resampling would claim certainty,
        ``Newcombe``.
    """

    test: RankSum
    r: float
    r_low: float
    r_high: float
    rank_biserial: float
    rank_biserial_low: float
    rank_biserial_high: float
    confidence: float
    method: str


@dataclass(frozen=True)
class EffectDifference:
    """How much better one measure separates two conditions than another does.

    Attributes
    ----------
    estimate, low, high : float
        Difference of the sizes of the rank-biserial correlations, each counted positive in the
        direction that was found. The ends are NaN where nothing varies.
    p : float
        Of no difference, two-sided, from the same bootstrap.
    paired : bool
        Whether both measures come from the same units and were resampled together.
    """

    estimate: float
    low: float
    high: float
    p: float
    paired: bool


def two_groups(
    x: ArrayLike,
    y: ArrayLike,
    x_units: Sequence[str] | None = None,
    y_units: Sequence[str] | None = None,
) -> TwoGroups:
    """Return one measure in two conditions; without labels each value is a unit of its own.

    Raises
    ------
    ValueError
        If a group is empty or not finite, or the labels are not as many as the values.
    """
    values, labels = [], []
    for name, sample, units in (("x", x, x_units), ("y", y, y_units)):
        array = checked_sample(name, sample)
        own = tuple(map(str, range(array.size))) if units is None else tuple(units)
        if len(own) != array.size:
            raise ValueError(f"{name} has {array.size} values and {len(own)} units")
        values.append(array)
        labels.append(own)
    return TwoGroups(values[0], values[1], labels[0], labels[1])


def rank_biserial(x: ArrayLike, y: ArrayLike) -> float:
    """Return the share of pairs with x > y less the share with x < y.

    References
    ----------
    Cureton, Rank-biserial correlation, Psychometrika 21, 1956; Cliff's delta is the same.

    Examples
    --------
    >>> rank_biserial([3.0, 4.0], [1.0, 3.0])
    0.75
    """
    groups = two_groups(x, y)
    return float(np.mean(np.sign(np.subtract.outer(groups.x, groups.y))))


def effect_sizes(
    groups: TwoGroups,
    rng: np.random.Generator,
    *,
    resamples: int = 9999,
    confidence: float = 0.95,
) -> Effects:
    """Return r and the rank-biserial correlation with bootstrap intervals, and the rank-sum test.

    Notes
    -----
    With fixed group sizes and ties r is a function of the rank-biserial correlation, and BCa
    follows such functions; so the ends of r are those of the correlation, carried over. Resampling
    r itself would count the copies that a resample makes as ties.
    """
    test = ranksum(groups.x, groups.y, confidence=confidence)
    counted = _counted(groups, *_units(groups))
    sizes = (len(counted[1]), len(counted[2]))
    found = bootstrap(
        lambda a, b: _weighted(counted, a, b),
        sizes,
        rng,
        resamples=resamples,
        confidence=confidence,
    )
    delta, low, high, method = found.estimate, found.low, found.high, "BCa"
    if not math.isfinite(low):
        method = "Newcombe"
        low, high = rank_biserial_interval(delta, test.n_x, test.n_y, confidence=confidence)
    return Effects(
        test=test,
        r=test.r,
        r_low=_r(low, groups),
        r_high=_r(high, groups),
        rank_biserial=delta,
        rank_biserial_low=low,
        rank_biserial_high=high,
        confidence=confidence,
        method=method,
    )


def compare_effects(
    first: TwoGroups,
    second: TwoGroups,
    rng: np.random.Generator,
    *,
    paired: bool,
    resamples: int = 9999,
) -> EffectDifference:
    """Ask whether the first measure separates the two conditions better than the second.

    Compared by the rank-biserial correlation: r is bounded by the group sizes, which differ between
    measures (`published.largest_r`).

    Parameters
    ----------
    first, second : TwoGroups
        The same two conditions, in the same order.
    rng : numpy.random.Generator
    paired : bool
        Resample the units of both together; a unit may hold several values, not as many in both,
        or lack one measure. Else each measure is resampled by itself.

    Raises
    ------
    ValueError
        If `paired` and they have no unit in common in a condition.
    """
    units = [_units(first), _units(second)]
    if paired:
        if any(set(a).isdisjoint(b) for a, b in zip(*units, strict=True)):
            raise ValueError("a paired comparison needs units that both measures have")
        x, y = (list(dict.fromkeys([*a, *b])) for a, b in zip(*units, strict=True))
        units = [(x, y), (x, y)]
    one, two = _counted(first, *units[0]), _counted(second, *units[1])
    ahead = [math.copysign(1.0, float(np.sum(counted[0]))) for counted in (one, two)]

    def difference(*counts: Array) -> Array:
        a, b = counts[:2], counts[:2] if paired else counts[2:]
        return ahead[0] * _weighted(one, *a) - ahead[1] * _weighted(two, *b)

    sizes = [len(one[1]), len(one[2])] + ([] if paired else [len(two[1]), len(two[2])])
    found = bootstrap(difference, sizes, rng, resamples=resamples)
    return EffectDifference(found.estimate, found.low, found.high, found.p, paired)


def holm(p_values: Sequence[float]) -> tuple[float, ...]:
    """Return Holm's adjusted p-values in the order given; a NaN stays and is not counted.

    That of statsmodels collects all garbage first, 0.3 s at each call in a large process.

    References
    ----------
    Holm, A simple sequentially rejective multiple test procedure, Scand. J. Stat. 6, 1979.

    Examples
    --------
    >>> holm([0.01, 0.04, 0.03])
    (0.03, 0.06, 0.06)
    """
    adjusted = np.array(p_values, dtype=np.float64)
    smallest_first = np.argsort(adjusted)[: np.count_nonzero(~np.isnan(adjusted))]
    remaining = np.arange(smallest_first.size, 0, -1)
    stepped = np.maximum.accumulate(adjusted[smallest_first] * remaining)
    adjusted[smallest_first] = np.minimum(stepped, 1.0)
    return tuple(adjusted.tolist())


def _units(groups: TwoGroups) -> tuple[list[str], list[str]]:
    return list(dict.fromkeys(groups.x_units)), list(dict.fromkeys(groups.y_units))


def _counted(groups: TwoGroups, x: list[str], y: list[str]) -> tuple[Array, Array, Array]:
    """Return by pairs of units the excess of x > y over x < y, and the values in each unit."""
    columns = [
        np.array([[label == unit for unit in units] for label in labels], dtype=np.float64)
        for labels, units in ((groups.x_units, x), (groups.y_units, y))
    ]
    signs = np.sign(np.subtract.outer(groups.x, groups.y))
    return columns[0].T @ signs @ columns[1], columns[0].sum(axis=0), columns[1].sum(axis=0)


def _weighted(counted: tuple[Array, Array, Array], x: Array, y: Array) -> Array:
    excess, n_x, n_y = counted
    pairs = (x @ n_x) * (y @ n_y)
    # A resample without any value gives no number; the bootstrap leaves it out.
    return np.asarray(np.sum((x @ excess) * y, axis=1) / np.where(pairs > 0, pairs, np.nan))


def _r(delta: float, groups: TwoGroups) -> float:
    """Return r of another rank-biserial correlation at the sizes and ties of these groups."""
    m, n = groups.x.size, groups.y.size
    sigma = u_sigma(groups.x, groups.y)
    if sigma == 0:
        return 0.0
    size = max(abs(delta) * m * n / 2 - 0.5, 0.0)
    return math.copysign(size / sigma / math.sqrt(m + n), delta)
