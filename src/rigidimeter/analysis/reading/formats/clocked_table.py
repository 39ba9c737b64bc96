"""Signals with clocks of their own as one table.

Each clock has rows of its own, in the order of time; in the rows of other clocks a column is empty.
So every channel keeps its own stamps. Labels hold in the rows between.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.channels.choice import LABELS
from rigidimeter.analysis.reading.formats.columns import numbers
from rigidimeter.analysis.reading.formats.stored_arrays import Columns
from rigidimeter.analysis.reading.formats.table import Table, label_text
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import printable

TIME = "time_s"
EXCLUDED = "excluded"
"""The column of a table of intervals that says which of them do not count."""
ROUNDING_S = 1e-9
"""A file may hold a first stamp and a rate in place of even stamps."""


@dataclass(frozen=True)
class Stream:
    """Signals that were sampled together.

    Attributes
    ----------
    name : str
        Such as ``torque``, ``motion`` or ``control``.
    time_s : array, shape (n,)
        When each sample was taken, in s.
    columns : mapping of str to array, shape (n,)
        By name.
    """

    name: str
    time_s: NDArray[np.float64]
    columns: Mapping[str, NDArray[Any]]

    @property
    def rate_hz(self) -> float:
        """The mean sampling rate; NaN below two samples."""
        if self.time_s.size < 2:
            return float("nan")
        return (self.time_s.size - 1) / float(self.time_s[-1] - self.time_s[0])


def table_of_streams(
    source: str, streams: Sequence[Stream], units: Sequence[Mapping[str, str]] = ()
) -> Table:
    """Return streams as a table; a name that two have gets that of its stream before it.

    Labels of epochs are those of the first stream that has them.

    Parameters
    ----------
    source : str
        The file, as messages name it.
    streams : sequence of Stream
        With stamps that increase.
    units : sequence of mapping of str to str
        For each stream, by column.

    Raises
    ------
    UserError
        If there is no stream with two samples, or stamps do not increase.
    """
    used = [
        (stream, units[k] if k < len(units) else {})
        for k, stream in enumerate(streams)
        if stream.time_s.size > 1 and stream.columns
    ]
    if not used:
        raise UserError(f"{source} holds no signal with at least 2 samples")
    for stream, _ in used:
        if not np.all(np.diff(stream.time_s) > 0):
            raise UserError(
                f"{source}: the time stamps of {stream.name} do not increase throughout; a "
                "recording needs a time of its own for each sample"
            )
    time_s = np.unique(np.concatenate([stream.time_s for stream, _ in used]))
    labelled = {
        label: k for label in LABELS for k in range(len(used))[::-1] if label in used[k][0].columns
    }
    given = [column for stream, _ in used for column in stream.columns if column not in LABELS]
    names = iter(
        unique(
            column if given.count(column) == 1 else f"{stream.name}.{column}"
            for stream, _ in used
            for column in stream.columns
            if column not in LABELS
        )
    )
    columns = {TIME: lambda: time_s}
    known: dict[str, str] = {TIME: "s"}
    for k, (stream, stated) in enumerate(used):
        rows = np.searchsorted(time_s, stream.time_s)
        for column, values in stream.columns.items():
            if labelled.get(column, k) != k:
                continue
            name = column if column in LABELS else next(names)
            columns[name] = functools.partial(
                spread, values, rows, time_s.size, fill=column in LABELS
            )
            if stated.get(column):
                known[name] = stated[column]
    return Table(source, Columns(columns), units=known)


def table_of_pairs(table: Table) -> Table:
    """Return a table whose every second column is a channel, with its time in s before it.

    Raises
    ------
    UserError
        If a time is not a number, or does not increase.
    """
    names = list(table.columns)
    streams, units = [], []
    for time, name in zip(names[::2], names[1::2], strict=True):
        stamps, values = numbers(table, TIME, time), numbers(table, name, name, [])
        here = np.isfinite(stamps)  # a shorter channel ends in empty cells
        streams.append(Stream(name, stamps[here], {name: values[here]}))
        units.append({name: table.units.get(name, "")})
    return table_of_streams(table.source, streams, units)


def with_intervals(
    table: Table,
    starts_s: Sequence[float] | NDArray[np.float64],
    stops_s: Sequence[float] | NDArray[np.float64],
    labels: Mapping[str, Sequence[str]],
) -> Table:
    """Return a table whose rows from a start to its stop have labels; the others have none.

    Parameters
    ----------
    table : Table
        With a clock (`TIME`).
    starts_s, stops_s : sequence of float
        Of each interval, on that clock.
    labels : mapping of str to sequence of str
        By column (`LABELS`), one for each interval; and `EXCLUDED`: intervals for which it is true
        have no labels.
    """
    time_s = table.columns[TIME]
    counts = [text.lower() not in ("true", "1") for text in labels.get(EXCLUDED, ())]
    columns = {name: np.full(time_s.size, "", dtype=object) for name in labels if name in LABELS}
    for k, (start_s, stop_s) in enumerate(zip(starts_s, stops_s, strict=True)):
        rows = slice(*np.searchsorted(time_s, (start_s - ROUNDING_S, stop_s + ROUNDING_S)))
        for name, column in columns.items():
            text = label_text(labels[name][k])
            # A rest may share its first sample with the epoch before it.
            if text and (not counts or counts[k]):
                column[rows] = text
    return replace(table, columns={**table.columns, **columns})


def unique(names: Iterable[str], but: Sequence[str] = (TIME,)) -> list[str]:
    """Return names of which no two are the same: a second ``Fx`` is ``Fx (2)``.

    Parameters
    ----------
    names : iterable of str
    but : sequence of str
        Names that are taken already.

    Examples
    --------
    >>> unique(["Fx", "Fy", "Fx"])
    ['Fx', 'Fy', 'Fx (2)']
    """
    found: dict[str, None] = dict.fromkeys(but)
    for name in map(printable, names):
        free = (f"{name} ({k})" for k in itertools.count(2))
        found[name if name not in found else next(one for one in free if one not in found)] = None
    return list(found)[len(but) :]


def even_clock(start_s: float, rate_hz: float, count: int) -> NDArray[np.float64]:
    """Return the stamps of even samples.

    Raises
    ------
    ValueError
        If the rate cannot be one.
    """
    if not (0 < rate_hz < math.inf and math.isfinite(start_s)):
        raise ValueError(f"a clock from {start_s:g} s at {rate_hz:g} samples/s")
    return start_s + np.arange(count) / rate_hz


def spread(column: NDArray[Any], rows: NDArray[np.intp], size: int, *, fill: bool) -> NDArray[Any]:
    """Put a column into the rows of its own clock.

    Parameters
    ----------
    column : array, shape (n,)
    rows : array of int, shape (n,)
        Where the table has them.
    size : int
        The rows of the table.
    fill : bool
        Whether a value holds in the rows between, too, as a label does.
    """
    if fill:
        before = np.searchsorted(rows, np.arange(size), side="right") - 1
        return column[np.clip(before, 0, None)]
    text = column.dtype == object
    found = np.full(size, "" if text else np.nan, dtype=object if text else np.float64)
    found[rows] = column
    return found
