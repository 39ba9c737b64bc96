"""Signals that were sampled together, several of which make the columns of a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.columns import (
    Array,
    Column,
    Columns,
    Interval,
    label_text,
    unique,
)
from rigidimeter.analysis.reading_anew.quantities import LABELS
from rigidimeter.core.errors import UserError


class Stream(NamedTuple):
    """Signals on one clock.

    Attributes
    ----------
    name : str
        Such as ``torque``, ``motion`` or ``control``.
    time_s : array, shape (n,)
        When each sample was taken, in s.
    columns : mapping of str to array, shape (n,)
        By name.
    units : mapping of str to str
        By column, where the file states them.
    """

    name: str
    time_s: Array
    columns: Mapping[str, NDArray[Any]]
    units: Mapping[str, str] = {}


def columns_of_streams(source: str, streams: Sequence[Stream]) -> Columns:
    """Return streams as columns; a name that two have gets that of its stream before it.

    Labels of epochs are those of the first stream that has them.

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
    clocks = unique(stream.name for stream in used)
    given = [name for stream in used for name in stream.columns]
    names = iter(
        unique(
            name if given.count(name) == 1 else f"{stream.name}.{name}"
            for stream in used
            for name in stream.columns
            if name not in LABELS
        )
    )
    columns: dict[str, Column] = {}
    for clock, stream in zip(clocks, used, strict=True):
        for own, values in stream.columns.items():
            name = own if own in LABELS else next(names)
            if name not in columns:
                columns[name] = Column.of(values, stream.units.get(own, ""), clock)
    stamps = {clock: stream.time_s for clock, stream in zip(clocks, used, strict=True)}
    return Columns(source, columns, stamps)


def with_intervals(
    columns: Columns,
    starts_s: Sequence[float] | Array,
    stops_s: Sequence[float] | Array,
    labels: Mapping[str, Sequence[str]],
) -> Columns:
    """Return columns with labels by time.

    Parameters
    ----------
    columns : Columns
    starts_s, stops_s : sequence of float
        Of each interval.
    labels : mapping of str to sequence of str
        By what they label, one for each interval; and ``excluded``: intervals for which it is true
        have no labels.
    """
    left_out = [text.lower() in ("true", "1") for text in labels.get("excluded", ())]
    intervals = tuple(
        Interval(
            float(start_s),
            float(stop_s),
            {
                name: "" if left_out and left_out[k] else label_text(texts[k])
                for name, texts in labels.items()
                if name in LABELS
            },
        )
        for k, (start_s, stop_s) in enumerate(zip(starts_s, stops_s, strict=True))
    )
    return replace(columns, intervals=intervals)
