"""Rows that are not what they seem: repeats of a slower sensor, and samples that were lost.

A sensor of 50 samples/s in a table of 1000 rows/s is often repeated for 20 rows. No joint moves in
such steps: fitted as they are, they make J and K far too small. The repeats are taken for blanks,
as is what was interpolated by straight lines.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.channels.quantities import words_of
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.errors import UserError

Array = NDArray[np.float64]

SLOWEST_S = 0.1
"""Between samples of a slower sensor; what lasts longer is a step or a ramp of the motion."""
_LEAST_CHANGES = 20
_LEAST_SHARE = 0.5
"""Of the samples of a slower sensor that differ from the one before; a coarse encoder has fewer."""
_REGULAR = 0.99
_BEND = 30.0
"""Of a bend between two straight lines over the median, which is rounding."""
_STRAIGHT = 1.2
"""Of the RMS about the straight lines over the median bend: 0.7 for rounding, and above 1.6 for the
curves between the steps of a simulated perturbation, if they last `_FEWEST_ROWS`."""
_FEWEST_ROWS = 4
_BEGIN_ANEW = (2**8, 2**16)
"""Where the counters of devices begin anew."""
_COUNTERS = {"sample", "samples", "frame", "frames", "index", "counter"}


def held_rows(values: Array) -> NDArray[np.intp]:
    """Return the rows with samples of a column that repeats each of them; none where it does not.

    Examples
    --------
    >>> held_rows(np.repeat(np.sin(np.arange(50.0)), 4))[:3]
    array([0, 4, 8])
    """
    return _evenly(np.flatnonzero(values[1:] != values[:-1]) + 1, values.size)


def knots(values: Array) -> NDArray[np.intp]:
    """Return the rows with samples of a column that has straight lines between them, or none."""
    none = np.empty(0, dtype=np.intp)
    if values.size < 3 or not np.all(np.isfinite(values)):
        return none
    bends = np.abs(np.diff(values, 2))
    usual = float(np.median(bends))
    rows = _evenly(np.flatnonzero(bends > _BEND * usual) + 1, values.size)
    if rows.size < 2 or rows[1] - rows[0] < _FEWEST_ROWS:
        return none
    between = np.arange(rows[0], rows[-1])
    about = values[between] - np.interp(between, rows, values[rows])
    rounding = 8 * np.finfo(np.float64).eps * np.max(np.abs(values))
    return rows if np.sqrt(np.mean(about**2)) <= _STRAIGHT * usual + rounding else none


def only_at(values: Array, rows: NDArray[np.intp]) -> Array:
    """Return a column with NaN in all rows but these."""
    kept = np.full(values.size, np.nan)
    kept[rows] = values[rows]
    return kept


def slower_text(rows: NDArray[np.intp], *, held: bool, moves: bool) -> str:
    """Return what to know of such a column; a torque, unlike a motion, may come in steps."""
    count = rows[1] - rows[0]
    if not held:
        return f"has straight lines of {count} rows, so it is read as a slower sensor at their ends"
    text = f"holds each value for {count} rows"
    if moves:
        return f"{text}, so it is read as a slower sensor, sampled in the first row of each"
    return f"{text}; if it is a slower sensor, leave the repeats blank: they bias J, B and K"


def sample_numbers(table: Table, size: int, *, of_rows: bool) -> Array:
    """Return the number of each row, by a column of them if samples are lost between the rows.

    Parameters
    ----------
    table : Table
    size : int
    of_rows : bool
        Whether the sampling rate is that of the rows, as the user gives it.

    Raises
    ------
    UserError
        If the numbers skip evenly, and the rate may be that of what they count.
    """
    for name in table.columns:
        if not _COUNTERS.intersection(words_of(name)):
            continue
        numbers = table.columns[name]
        if numbers.dtype == object or numbers.size != size:
            continue
        steps = np.diff(numbers)
        if numbers.max() + 1 in _BEGIN_ANEW:
            steps %= numbers.max() + 1
        usual = np.median(steps)
        if not (usual >= 1 and np.all(steps > 0) and np.all(steps % usual == 0)):
            continue
        if usual > 1 and not of_rows:
            raise UserError(
                f"{table.source}: column {name!r} goes up by {usual:g} from row to row, so the "
                "sampling rate that the file states may not be that of the rows; say --rate-hz"
            )
        return np.asarray(np.concatenate([[0.0], np.cumsum(steps / usual)]))
    return np.arange(size, dtype=np.float64)


def _evenly(rows: NDArray[np.intp], size: int) -> NDArray[np.intp]:
    """Return even rows to which nearly all of these belong and most of which they are, or none."""
    count = int(np.median(np.diff(rows))) if rows.size >= _LEAST_CHANGES else 0
    if count < 2 or rows.size < _LEAST_SHARE * size / count:
        return np.empty(0, dtype=np.intp)
    first = rows[-1] % count
    if np.mean(rows % count == first) < _REGULAR:
        return np.empty(0, dtype=np.intp)
    return np.arange(first, size, count)
