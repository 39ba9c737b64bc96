"""Samples that were lost and written as a number: 0, −999, 32767.

Such a code is a value that recurs exactly, alone, and far from the values beside it. A sample x
stands out from p before and q after it by

    D = min(|x − p|, |x − q|, |x − c|)    where x is above both or below both, else 0,

with c the cubic through the two samples on either side. A step of the torque has no D, since x lies
between, and a turn of the motion hardly any, since the cubic follows it. The column without one of
its values v has the D of its noise; where those of v, each from the column without it, are many
times what nine in ten of the others are, and nothing else stands out to near v, v is a code.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.columns import Array
from rigidimeter.analysis.reading_anew.repeated import held_rows

# In samples; a value that lasts longer is not alone.
_LONGEST_RUN = 3
# Of what nine in ten of the others that stand out do so by.
_TIMES_OTHERS = 6.0
# Of the median distance of a sample from the cubic through those beside it.
_TIMES_CUBIC = 4.0
# Of the sensor's resolution.
_TIMES_STEP = 3.0
# How often a code recurs; fewer where it is farther outside than all others are apart.
_FEWEST, _FEWEST_OUTSIDE = 3, 2
# Of the runs of a code; the others lie near the values beside them by chance.
_LEAST_FAR = 0.3
# Of the distance of a code: others that stand out to so near it are peaks of a coarse signal.
_ALONE = 0.1
# Of the samples; what is written more often is no exception.
_LARGEST_SHARE = 0.25
_MOST_CODES = 4
_MOST_TRIED = 8
_FEWEST_SAMPLES = 50
_BLOCK = 2**15
_PIECES, _PIECE = 16, 2**12
# Of what is asked of a sample, where the others are known from some stretches alone.
_NEARLY = 0.8
# Of the samples of a noisy signal that stand out at all, and of a code so frequent that it changes
# what the others do.
_NOISY, _DENSE = 0.1, 0.05


class Code(NamedTuple):
    """A value, and the rows in which it stands for a lost sample."""

    value: float
    rows: NDArray[np.intp]


def missing_codes(values: Array) -> list[Code]:
    """Return what stands for lost samples in a column of a sensor.

    Parameters
    ----------
    values : array, shape (n,)
        NaN where there is no number.

    Examples
    --------
    >>> torque = np.sin(np.arange(400.0) / 9)
    >>> torque[[50, 120, 200, 301]] = -999.0
    >>> [(code.value, code.rows.tolist()) for code in missing_codes(torque)]
    [(-999.0, [50, 120, 200, 301])]
    """
    with np.errstate(all="ignore"):  # of numbers that are refused elsewhere
        held = held_rows(values)  # of a slower sensor each sample is several rows
        if not _may_have_one(values[held] if held.size else values):
            return []
        return _codes(values, held if held.size else np.arange(values.size))


def _may_have_one(values: Array) -> bool:
    """Whether some value stands out twice, which `_one_code` asks for before it sorts all values.

    Most recordings have none. Of a coarse and noisy signal many values do; then a code is also far
    from the others beside it, of which a quarter may be codes.
    """
    here = values[np.isfinite(values)]
    if here.size < _FEWEST_SAMPLES:
        return False
    starts = np.unique(np.linspace(0, max(here.size - _PIECE, 0), _PIECES).astype(int))
    some = np.concatenate([here[start : start + _PIECE] for start in starts])
    levels, times = np.unique(some, return_counts=True)
    finest = float(np.min(np.diff(levels), initial=np.inf)) if levels.size > 1 else 0.0
    usual = _TIMES_STEP * finest + _TIMES_CUBIC * _from_cubic(some)
    found = _standing_out(here, _NEARLY * usual)
    if found.size <= _MOST_TRIED:
        return found.size > 0
    others = _stands_out(some)
    others = others[others > 0]
    if others.size < _NOISY * some.size or times.max() > _DENSE * some.size:
        return True
    far = max(usual, _TIMES_OTHERS * float(np.quantile(others, 0.7)))
    return _standing_out(here, _NEARLY * far).size > 0


def _standing_out(values: Array, least: float) -> Array:
    """Return the values that stand out by more than `least` twice, of blocks that fit a cache."""
    found = []
    for begin in range(0, values.size, _BLOCK):
        block = values[begin : begin + _BLOCK + 4]
        rise = np.diff(block)
        far = np.abs(rise) > least
        turns = far[1:] & far[:-1] & (rise[1:] * rise[:-1] < 0)
        at = 2 + np.flatnonzero(turns[1:-1])
        apart = _apart(block[at], *(block[at + k] for k in (-2, -1, 1, 2)))
        found.append(block[at[apart > least]])
    levels, counts = np.unique(np.concatenate(found), return_counts=True)
    return np.asarray(levels[counts >= _FEWEST_OUTSIDE], dtype=np.float64)


def _codes(values: Array, samples: NDArray[np.intp]) -> list[Code]:
    left, found = values.copy(), list[Code]()
    while len(found) < _MOST_CODES:
        rows = samples[np.isfinite(left[samples])]
        value = _one_code(left[rows]) if rows.size >= _FEWEST_SAMPLES else None
        if value is None:
            break
        own = left == value
        found.append(Code(value, np.flatnonzero(own)))
        left[own] = np.nan
    return found


def _one_code(values: Array) -> float | None:
    """Return the code that is written most often, of a column without NaN."""
    levels, level, times = np.unique(values, return_inverse=True, return_counts=True)
    if levels.size < 2:
        return None
    step = float(np.median(np.diff(levels)))
    usual = _TIMES_STEP * step + _TIMES_CUBIC * _from_cubic(values)
    often = np.bincount(level[_stands_out(values) > usual], minlength=levels.size)
    often[times > _LARGEST_SHARE * values.size] = 0
    tried = [k for k in np.argsort(-often)[:_MOST_TRIED] if often[k] >= _FEWEST_OUTSIDE]
    counts = {float(levels[k]): _times_far(values, level == k, step) for k in tried}
    best = max(counts, key=lambda value: counts[value], default=0.0)
    return best if counts and counts[best] else None


def _times_far(values: Array, own: NDArray[np.bool_], step: float) -> int:
    """Return how often a value is far from the others beside it; 0 where it is no code."""
    rest = values[~own]
    out = _stands_out(rest)
    others = out[out > 0]
    far = max(
        _TIMES_STEP * step,
        _TIMES_CUBIC * _from_cubic(rest),
        _TIMES_OTHERS * float(np.quantile(others, 0.9)) if others.size else 0.0,
    )
    edges = np.flatnonzero(np.diff(np.concatenate(([False], own, [False]))))
    start, stop = edges.reshape(-1, 2)[(edges[::2] > 0) & (edges[1::2] < own.size)].T
    before = np.cumsum(~own)[start - 1] - 1  # the place in `rest` of the sample before each run
    inside = (before > 0) & (before + 2 < rest.size)
    start, stop, before = start[inside], stop[inside], before[inside]
    value = values[own][0]
    distance = _apart(value, *(rest[before + k] for k in (-1, 0, 1, 2)))
    is_far = (distance > far) & (stop - start <= _LONGEST_RUN)
    count = int(np.count_nonzero(is_far))
    outside = max(rest.min() - value, value - rest.max()) > np.ptp(rest)
    if count < (_FEWEST_OUTSIDE if outside else _FEWEST) or count < _LEAST_FAR * start.size:
        return 0
    near = np.abs(rest - value) < _ALONE * float(np.median(distance[is_far]))
    return count if 3 * np.count_nonzero(near & (out > far)) < count else 0


def _from_cubic(values: Array) -> float:
    a, b, own, c, d = (values[k : values.size - 4 + k] for k in range(5))
    return float(np.median(np.abs(own - (4.0 * (b + c) - a - d) / 6.0)))


def _stands_out(values: Array) -> Array:
    """Return D of each sample, 0 of the two at each end."""
    a, b, own, c, d = (values[k : values.size - 4 + k] for k in range(5))
    return np.concatenate(([0.0, 0.0], _apart(own, a, b, c, d), [0.0, 0.0]))


def _apart(value: float | Array, a: Array, b: Array, c: Array, d: Array) -> Array:
    """Return D of a value between b and c, of which a comes before and d after."""
    up, down = value - b, value - c
    by_cubic = np.abs(value - (4.0 * (b + c) - a - d) / 6.0)
    size = np.minimum(np.minimum(np.abs(up), np.abs(down)), by_cubic)
    return np.where(up * down > 0, size, 0.0)
