"""Signals with clocks of their own as one table.

Each clock has rows of its own, in the order of time; in the rows of other clocks a column is empty.
So every channel keeps its own stamps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from rigidimeter.errors import UserError
from rigidimeter.recording.exported_session import Stream
from rigidimeter.recording.formats.table import Table

TIME = "time_s"


def table_of_streams(
    source: str, streams: Sequence[Stream], units: Mapping[str, str] | None = None
) -> Table:
    """Return streams as a table; a name that two have gets that of its stream before it.

    Parameters
    ----------
    source : str
        The file, as messages name it.
    streams : sequence of Stream
        With stamps that increase.
    units : mapping of str to str
        By column.

    Raises
    ------
    UserError
        If there is no stream with two samples, or stamps do not increase.
    """
    used = [stream for stream in streams if stream.time_s.size > 1 and stream.columns]
    if not used:
        raise UserError(f"{source} holds no signal with at least 2 samples")
    for stream in used:
        if not np.all(np.diff(stream.time_s) > 0):
            raise UserError(
                f"{source}: the time stamps of {stream.name} do not increase throughout; a "
                "recording needs a time of its own for each sample"
            )
    time_s = np.unique(np.concatenate([stream.time_s for stream in used]))
    names = [column for stream in used for column in stream.columns]
    columns = {TIME: time_s}
    known: dict[str, str] = {TIME: "s"}
    for stream in used:
        rows = np.searchsorted(time_s, stream.time_s)
        for column, values in stream.columns.items():
            name = column if names.count(column) == 1 else f"{stream.name}.{column}"
            columns[name] = np.full(time_s.size, np.nan)
            columns[name][rows] = values
            if units and units.get(column):
                known[name] = units[column]
    return Table(source, columns, units=known)
