"""Rows that are not what they seem: repeats of a slower sensor, and samples that were lost.

A sensor of 50 samples/s in a table of 1000 rows/s is often repeated for 20 rows. No joint moves in
such steps: fitted as they are, they make J and K far too small. The repeats are taken for blanks.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigidimeter.errors import UserError
from rigidimeter.recording.channels.quantities import words_of
from rigidimeter.recording.formats.table import Table

Array = NDArray[np.float64]

_LEAST_CHANGES = 20
_LEAST_SHARE = 0.5
"""Of the samples of a slower sensor that differ from the one before; a coarse encoder has fewer."""
_REGULAR = 0.99
_BEGIN_ANEW = (2**8, 2**16)
"""Where the counters of devices begin anew."""
_COUNTERS = {"sample", "samples", "frame", "frames", "index", "counter"}


def held_rows(values: Array) -> int:
    """Return for how many rows a column repeats each of its values, 1 where it does not.

    Examples
    --------
    >>> held_rows(np.repeat(np.sin(np.arange(50.0)), 4))
    4
    """
    changes, count = _changes(values)
    if changes.size < _LEAST_CHANGES or count < 2:
        return 1
    regular = np.mean((changes - changes[-1]) % count == 0) >= _REGULAR
    return count if regular and changes.size >= _LEAST_SHARE * values.size / count else 1


def without_repeats(values: Array, count: int) -> Array:
    """Return a column with NaN where it repeats what it holds for `count` rows."""
    kept = np.full(values.size, np.nan)
    first = _changes(values)[0][-1] % count
    kept[first::count] = values[first::count]
    return kept


def held_text(count: int, *, moves: bool) -> str:
    """Return what to know of such a column; a torque, unlike a motion, may come in steps."""
    held = f"holds each value for {count} rows"
    if moves:
        return f"{held}, so it is read as a slower sensor, sampled in the first row of each"
    return f"{held}; if it is a slower sensor, leave the repeats blank: they bias J, B and K"


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


def _changes(values: Array) -> tuple[NDArray[np.intp], int]:
    """Return the rows in which a column has a new value, and how many mostly lie between them."""
    changes = np.flatnonzero(values[1:] != values[:-1]) + 1
    return changes, int(np.median(np.diff(changes))) if changes.size > 1 else 0
