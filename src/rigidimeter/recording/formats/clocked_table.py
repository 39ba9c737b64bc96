"""Signals with clocks of their own as one table.

Each clock has rows of its own, in the order of time; in the rows of other clocks a column is empty.
So every channel keeps its own stamps.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rigidimeter.errors import UserError
from rigidimeter.recording.exported_session import Stream
from rigidimeter.recording.formats.columns import numbers
from rigidimeter.recording.formats.stored_arrays import Columns
from rigidimeter.recording.formats.table import Table, printable

TIME = "time_s"


def table_of_streams(
    source: str, streams: Sequence[Stream], units: Sequence[Mapping[str, str]] = ()
) -> Table:
    """Return streams as a table; a name that two have gets that of its stream before it.

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
    given = [column for stream, _ in used for column in stream.columns]
    names = iter(
        unique(
            column if given.count(column) == 1 else f"{stream.name}.{column}"
            for stream, _ in used
            for column in stream.columns
        )
    )
    columns = {TIME: lambda: time_s}
    known: dict[str, str] = {TIME: "s"}
    for stream, stated in used:
        rows = np.searchsorted(time_s, stream.time_s)
        for column, values in stream.columns.items():
            name = next(names)
            columns[name] = functools.partial(_spread, values, rows, time_s.size)
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


def _spread(values: NDArray[np.float64], rows: NDArray[np.intp], count: int) -> NDArray[np.float64]:
    column = np.full(count, np.nan)
    column[rows] = values
    return column
