"""Channels of structures, each with its name, unit and clock in fields beside its values.

The layouts are those of programs, and structures that people make by hand with the same fields.
Where there is none, the arrays are columns as they are.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from rigidimeter.analysis.reading_anew.arrays import Stored, columns_of_arrays, sorted_arrays
from rigidimeter.analysis.reading_anew.columns import Array, Columns, even_clock, unique
from rigidimeter.analysis.reading_anew.headers import read_header
from rigidimeter.analysis.reading_anew.programs import (
    NAMES,
    PROGRAMS,
    UNITS,
    Fields,
    Signal,
    fields_above,
    fields_by_place,
    matrix_columns,
    number,
    numbers_of,
    stated_name,
    stated_rate,
    stated_unit,
    texts,
)
from rigidimeter.analysis.reading_anew.quantities import LABELS
from rigidimeter.analysis.reading_anew.streams import Stream, columns_of_streams
from rigidimeter.analysis.reading_anew.units import factor
from rigidimeter.core.errors import UserError

_VALUES = ("values", "data", "wave", "signal", "signals", "samples")
_LABELS = ("labels", "names", "colheaders", "channels", "titles", "channelnames", "columns", *NAMES)
_STARTS = ("start", "t0", "starttime", "start_time")
_SAME = 0.01


def columns_of_variables(source: str, entries: Mapping[str, Stored]) -> Columns:
    """Return the variables of a file: its channels or clocks, or its arrays as they are.

    Parameters
    ----------
    source : str
    entries : mapping of str to Stored
        By dotted name; of an array of structures as ``Y(1).Data``.

    Raises
    ------
    UserError
        If there is no column.
    """
    groups = fields_by_place(entries)
    found: dict[str, list[Signal]] = {}
    for place in groups:
        if channels := _channels(source, groups, place):
            found[place] = channels
    channels = [channel for each in found.values() for channel in each]
    if not channels or _is_recording(sorted_arrays(entries)[0]):
        clocks = _clocks(entries)
        return columns_of_streams(source, clocks) if clocks else columns_of_arrays(source, entries)
    bare = all(channel.time_s is None for channel in channels)
    rest = {
        name: entry
        for name, entry in entries.items()
        if (parts := name.rpartition("."))[0] not in found
        or parts[2] in LABELS
        or (bare and read_header(parts[2]).kind == "time")
    }
    if bare:
        return _without_clock(source, channels, rest)
    streams = [
        Stream(one.name, one.time_s, {one.name: one.values}, {one.name: one.unit})
        for one in channels
        if one.time_s is not None
    ]
    columns, facts, others = sorted_arrays(rest)
    beside = dict.fromkeys(
        [*columns, *(one.name for one in channels if one.time_s is None)],
        "without a clock, beside channels that have one",
    )
    found_columns = columns_of_streams(source, streams)
    return replace(found_columns, facts=facts, others={**others, **beside})


def _clocks(entries: Mapping[str, Stored]) -> list[Stream]:
    """Return structures with a column of the time each, and columns of as many samples beside it.

    There are none unless there are several, with different columns: structures with the same are
    trials.
    """
    groups: dict[str, dict[str, Stored]] = {}
    for name, entry in entries.items():
        place, _, field = name.rpartition(".")
        groups.setdefault(place, {})[field] = entry
    found = []
    for place, fields in groups.items():
        times = [name for name in fields if read_header(name).kind == "time"]
        size_s = factor(read_header(times[0]).unit, "time") if len(times) == 1 else None
        if not place or not size_s or fields[times[0]].size < 2:
            continue
        time = fields.pop(times[0])
        columns, _, _ = sorted_arrays(fields)
        beside = {n: one.read() for n, one in columns.items() if one.size == time.size}
        found.append(Stream(place, numbers_of(time).reshape(-1) * size_s, beside))
    names = [name for stream in found for name in stream.columns if name not in LABELS]
    return found if len(found) > 1 and len(set(names)) == len(names) else []


def _channels(source: str, groups: Mapping[str, Fields], place: str) -> list[Signal]:
    """Return the channels of a structure by the first layout that it has."""
    for program, needed, read in PROGRAMS:
        if needed <= groups[place].keys():
            with _naming(f"{source}: {place or 'what it holds'} is an export of {program} that"):
                if channels := read(source, groups, place):
                    return channels
    with _naming(f"{source}: {place or 'what it holds'} has samples and a rate, but"):
        return _by_hand(groups, place)


@contextmanager
def _naming(what: str) -> Iterator[None]:
    """Say of what a fault is."""
    try:
        yield
    except (ValueError, IndexError) as error:
        raise UserError(f"{what} cannot be read ({error})") from None


def _without_clock(source: str, channels: Sequence[Signal], rest: Mapping[str, Stored]) -> Columns:
    """Return channels as columns under their names, beside the other arrays of the file."""
    names = unique((channel.name for channel in channels), tuple(rest))
    arrays = {
        name: Stored.of(channel.values) for name, channel in zip(names, channels, strict=True)
    }
    units = {n: channel.unit for n, channel in zip(names, channels, strict=True)}
    return columns_of_arrays(source, {**rest, **arrays}, units)


def _is_recording(names: Iterable[str]) -> bool:
    """Whether arrays are a torque and a motion by their own names."""
    kinds = {read_header(name.rpartition(".")[2]).kind for name in names}
    return bool(kinds & {"torque", "force"}) and bool(kinds & {"angle", "velocity"})


def _by_hand(groups: Mapping[str, Fields], place: str) -> list[Signal]:
    """Read values with a name or a unit beside them, and a rate there or in a structure above."""
    fields = groups[place]
    key = next((key for key in _VALUES if key in fields), "")
    rates = (stated_rate(each) for each in fields_above(groups, place))
    rate_hz = next(filter(None, rates), 0.0)
    if key and (names := _labels(fields, fields[key])):
        return _of_matrix(fields, place, fields[key], names, rate_hz)
    columns = matrix_columns(fields[key], 1) if key else None
    own = stated_rate(fields) or any(key in fields for key in (*NAMES, *UNITS))
    if columns is None or not (place and own):  # a vector beside others is a column
        return []
    (values,) = columns
    time_s = _clock(fields, place, values.size, rate_hz)
    beside = place.endswith(")") or _is_timed(groups, place, values.size)
    if time_s is None and (rate_hz or not beside):
        return []
    return [Signal(stated_name(fields, place), stated_unit(fields), values, time_s)]


def _is_timed(groups: Mapping[str, Fields], place: str, count: int) -> bool:
    """Whether a structure above has a column of the time of so many samples."""
    return any(
        entry.size == count and read_header(name).kind == "time"
        for fields in fields_above(groups, place)[1:]
        for name, entry in fields.items()
    )


def _labels(fields: Fields, matrix: Stored) -> list[str]:
    """Return the texts beside a matrix of which there are as many as it has columns."""
    found = (texts(fields[key]) for key in _LABELS if key in fields)
    many = matrix.dtype.kind in "fiu" and len(matrix.shape) == 2 and min(matrix.shape) > 1
    return next((each for each in found if many and len(each) in matrix.shape), [])


def _of_matrix(
    fields: Fields, place: str, matrix: Stored, names: list[str], rate_hz: float
) -> list[Signal]:
    """Read the columns of a matrix, of which one may be the time."""
    columns = matrix_columns(matrix, len(names)) or []
    stated = (texts(fields[key]) for key in UNITS if key in fields)
    units = next((each for each in stated if len(each) == len(names)), [""] * len(names))
    timed = any(read_header(name).kind == "time" for name in names)
    time_s = None if timed or not columns else _clock(fields, place, columns[0].size, rate_hz)
    return [
        Signal(name, unit, column, time_s)
        for name, unit, column in zip(names, units, columns, strict=False)
    ]


def _clock(fields: Fields, place: str, count: int, rate_hz: float) -> Array | None:
    """Return the stamps of a channel; None where nothing states them, or not in what unit.

    A column of the time whose name states no unit is in the one in which it has the stated rate.
    """
    for name, entry in fields.items():
        header = read_header(name)
        if header.kind != "time" or entry.size != count or entry.dtype.kind not in "fiu":
            continue
        stamps = numbers_of(entry).reshape(-1)
        sizes = [factor(unit, "time") for unit in ([header.unit] if header.unit else ("s", "ms"))]
        steps = float(np.median(np.diff(stamps))) * rate_hz
        fitting = [
            size for size in sizes if size and (header.unit or abs(size * steps - 1) < _SAME)
        ]
        return stamps * fitting[0] if fitting else None
    begins = [name for name in _STARTS if name in fields and number(fields[name])]
    if begins and rate_hz:
        raise ValueError(
            f"{place}.{begins[0]} is {number(fields[begins[0]]):g}, and no unit is stated; put the "
            "times of the samples into a field time_s"
        )
    return even_clock(0.0, rate_hz, count) if rate_hz else None
