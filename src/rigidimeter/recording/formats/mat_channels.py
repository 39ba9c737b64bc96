"""Channels of MATLAB files, each with its name, unit and clock in fields beside its values.

Programs export them as a structure for each channel (Spike2, and by hand), as elements of an array
of structures (dSPACE, Simulink), as the columns of a matrix (AcqKnowledge), as stretches of one
vector (LabChart) or as objects of the class ``timeseries``. All keep their own clocks.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rigidimeter.errors import UserError
from rigidimeter.recording.channels.headers import read_header
from rigidimeter.recording.channels.unit_text import factor
from rigidimeter.recording.exported_session import Stream
from rigidimeter.recording.formats.clocked_table import even_clock, table_of_streams, unique
from rigidimeter.recording.formats.mat_fields import (
    NAMES,
    UNITS,
    Array,
    Fields,
    fields_above,
    fields_by_place,
    matrix_columns,
    number,
    numbers,
    stated_name,
    stated_rate,
    stated_unit,
    stepped_clock,
    texts,
)
from rigidimeter.recording.formats.stored_arrays import Stored
from rigidimeter.recording.formats.table import Table, sorted_arrays, table_of_arrays

_VALUES = ("values", "data", "wave", "signal", "samples")
_DAY_S = 86400.0


@dataclass(frozen=True)
class _Channel:
    """`time_s` is None where the file has no clock for it."""

    name: str
    unit: str
    values: Array
    time_s: Array | None


def table_of_variables(source: str, entries: Mapping[str, Stored]) -> Table:
    """Return the variables of a file as a table: its channels, or else its arrays as they are.

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
    found: dict[str, list[_Channel]] = {}
    for place in groups:
        for needed, read in _LAYOUTS:
            if needed <= groups[place].keys() and (channels := read(source, groups, place)):
                found[place] = channels
                break
    rest = {name: entry for name, entry in entries.items() if name.rpartition(".")[0] not in found}
    channels = [channel for each in found.values() for channel in each]
    if not channels or (_is_recording(sorted_arrays(rest)[0]) and not _is_recording(
        channel.name for channel in channels
    )):  # fmt: skip
        return table_of_arrays(source, entries)
    if all(channel.time_s is None for channel in channels):
        return _without_clock(source, channels, rest)
    streams, units = [], []
    for channel in channels:
        if channel.time_s is not None:
            streams.append(Stream(channel.name, channel.time_s, {channel.name: channel.values}))
            units.append({channel.name: channel.unit})
    columns, scalars, others = sorted_arrays(rest)
    beside = dict.fromkeys(
        [*columns, *(one.name for one in channels if one.time_s is None)],
        "without a clock, beside channels that have one",
    )
    table = table_of_streams(source, streams, units)
    return replace(table, scalars=scalars, others={**others, **beside})


def _without_clock(source: str, channels: Sequence[_Channel], rest: Mapping[str, Stored]) -> Table:
    """Return channels as columns under their names, beside the other arrays of the file."""
    names = unique((channel.name for channel in channels), tuple(rest))
    arrays = {
        name: Stored.of(channel.values) for name, channel in zip(names, channels, strict=True)
    }
    units = {n: channel.unit for n, channel in zip(names, channels, strict=True) if channel.unit}
    return replace(table_of_arrays(source, {**rest, **arrays}), units=units)


def _is_recording(names: Any) -> bool:
    """Whether columns are a torque and a motion by their names."""
    kinds = {read_header(name).kind for name in names}
    return bool(kinds & {"torque", "force"}) and bool(kinds & {"angle", "velocity"})


def _labchart(source: str, groups: Mapping[str, Fields], place: str) -> list[_Channel]:
    """Read one vector of all channels and blocks, and where each begins and ends in it."""
    fields = groups[place]
    if "scaleunits" in fields:
        raise UserError(
            f"{source}: its samples are 16-bit numbers with a scale apart (scaleunits); export it "
            "from LabChart once more, as single or double precision"
        )
    titles = texts(fields["titles"])
    n = len(titles)
    first, last, rate_hz = (
        numbers(fields[key]).reshape(n, -1) for key in ("datastart", "dataend", "samplerate")
    )
    n_blocks = first.shape[1]
    begins_s = np.zeros(n_blocks)
    if n_blocks > 1:
        days = numbers(fields["blocktimes"]).reshape(-1)
        begins_s = _DAY_S * (days - days[0])
    late = np.zeros((n, n_blocks))
    if "firstsampleoffset" in fields and "tickrate" in fields:
        ticks_hz = numbers(fields["tickrate"]).reshape(-1)
        late = numbers(fields["firstsampleoffset"]).reshape(n, n_blocks) / ticks_hz
    stated = texts(fields["unittext"]) if "unittext" in fields else []
    which = np.full((n, n_blocks), -1)
    if "unittextmap" in fields:
        which = numbers(fields["unittextmap"]).reshape(n, n_blocks).astype(int)
    data = numbers(fields["data"]).reshape(-1)
    found = []
    for row, title in enumerate(titles):
        blocks = [k for k in range(n_blocks) if first[row, k] > 0]
        units = {stated[which[row, k] - 1] if 0 < which[row, k] <= len(stated) else ""
                 for k in blocks}  # fmt: skip
        if len(units) > 1:
            raise UserError(
                f"{source}: {title} is in {' and in '.join(sorted(units))} in different blocks; "
                "export each block to a file of its own"
            )
        pieces, stamps = [], []
        for k in blocks:
            piece = data[int(first[row, k]) - 1 : int(last[row, k])]
            pieces.append(piece)
            stamps.append(even_clock(begins_s[k] + late[row, k], rate_hz[row, k], piece.size))
        if pieces:
            found.append(
                _Channel(title, units.pop(), np.concatenate(pieces), np.concatenate(stamps))
            )
    return found


def _acqknowledge(source: str, groups: Mapping[str, Fields], place: str) -> list[_Channel]:
    """Read a matrix with a column for each channel, and the interval of all."""
    fields = groups[place]
    names, units = texts(fields["labels"]), texts(fields["units"])
    in_s = factor(texts(fields["isi_units"])[0], "time_s")
    columns = matrix_columns(fields["data"], len(names))
    if in_s is None or columns is None or len(units) != len(names):
        return []
    step_s = number(fields["isi"]) * in_s
    return [
        _Channel(name, unit, column, stepped_clock(0.0, step_s, column.size))
        for name, unit, column in zip(names, units, columns, strict=True)
    ]


def _spike2(source: str, groups: Mapping[str, Fields], place: str) -> list[_Channel]:
    """Read a waveform; its times, or its start and interval, are in s."""
    fields = groups[place]
    columns = matrix_columns(fields["values"], 1)
    if columns is None:
        return []
    (values,) = columns
    start_s = number(fields["start"]) if "start" in fields else 0.0
    time_s = stepped_clock(start_s, number(fields["interval"]), values.size)
    if "times" in fields and fields["times"].size == values.size:
        time_s = numbers(fields["times"]).reshape(-1)
    return [_Channel(stated_name(fields, place), stated_unit(fields), values, time_s)]


def _simulink(source: str, groups: Mapping[str, Fields], place: str) -> list[_Channel]:
    """Read signals of a structure with time; the time of a simulation is in s."""
    above, _, own = place.rpartition(".")
    time = groups.get(above, {}).get("time")
    if not own.startswith("signals") or time is None or time.size < 2:
        return []
    fields = groups[place]
    time_s = numbers(time).reshape(-1)
    shape = fields["values"].shape
    n_columns = fields["values"].size // time_s.size
    columns = matrix_columns(fields["values"], n_columns) if len(shape) < 3 else None
    if columns is None or columns[0].size != time_s.size:
        return []
    labels = texts(fields["label"]) if "label" in fields else [""]
    block = texts(fields["blockname"])[0] if "blockname" in fields else own
    if len(labels) != n_columns:
        base = (labels or [""])[0] or block.rpartition("/")[2]
        labels = [f"{base} ({k + 1})" for k in range(n_columns)] if n_columns > 1 else [base]
    return [
        _Channel(label or block.rpartition("/")[2], "", column, time_s)
        for label, column in zip(labels, columns, strict=True)
    ]


def _dspace(source: str, groups: Mapping[str, Fields], place: str) -> list[_Channel]:
    """Read a measurement of ControlDesk: `Y` has the channels, `X` their times in s."""
    above, _, own = place.rpartition(".")
    if re.fullmatch(r"Y(\(\d+\))?", own) is None:
        return []
    fields = groups[place]
    index = int(number(fields["xindex"])) if "xindex" in fields else 1
    names = (f"X({index})", "X") if index == 1 else (f"X({index})",)
    places = (f"{above}.{name}".lstrip(".") for name in names)
    times = next((groups[each] for each in places if "data" in groups.get(each, {})), None)
    columns = matrix_columns(fields["data"], 1)
    if times is None or columns is None or times["data"].size != columns[0].size:
        return []
    stamps = numbers(times["data"]).reshape(-1) * (
        factor(stated_unit(times) or "s", "time_s") or 1.0
    )
    name = stated_name(fields, place).replace('"', "")
    return [_Channel(name, stated_unit(fields), columns[0], stamps)]


def _timeseries(source: str, groups: Mapping[str, Fields], place: str) -> list[_Channel]:
    """Read an object: stamps, or where they begin and by how much they increase, and their unit."""
    fields = groups[place]
    about = groups.get(f"{place}.TimeInfo", groups.get(f"{place}.TimeInfo_", {}))
    columns = matrix_columns(fields["data_"], 1)
    in_s = factor(stated_unit(about), "time_s") if stated_unit(about) else None
    if columns is None or in_s is None:
        return []
    (values,) = columns
    if "time_" in fields and fields["time_"].size == values.size:
        stamps = numbers(fields["time_"]).reshape(-1)
    elif {"start_", "increment_"} <= about.keys():
        stamps = stepped_clock(number(about["start_"]), number(about["increment_"]), values.size)
    else:
        return []
    unit = stated_unit(groups.get(f"{place}.DataInfo", groups.get(f"{place}.DataInfo_", {})))
    name = texts(fields["name"])[0] if "name" in fields else ""
    if not name or name == "unnamed":
        name = place.rpartition(".")[2]
    return [_Channel(name, unit, values, stamps * in_s)]


def _by_hand(source: str, groups: Mapping[str, Fields], place: str) -> list[_Channel]:
    """Read values with a name or a unit beside them, and a rate there or in a structure above."""
    fields = groups[place]
    key = next((key for key in _VALUES if key in fields), "")
    columns = matrix_columns(fields[key], 1) if key else None
    rated = next((each for each in fields_above(groups, place) if stated_rate(each)), {})
    own = stated_rate(fields) or (bool(place) and any(key in fields for key in (*NAMES, *UNITS)))
    if columns is None or not own:
        return []
    (values,) = columns
    time_s = even_clock(0.0, stated_rate(rated), values.size) if rated else None
    if time_s is None and not place.endswith(")"):
        return []
    return [_Channel(stated_name(fields, place), stated_unit(fields), values, time_s)]


_LAYOUTS: Sequence[
    tuple[frozenset[str], Callable[[str, Mapping[str, Fields], str], list[_Channel]]]
] = (
    (frozenset(("data", "datastart", "dataend", "samplerate", "titles")), _labchart),
    (frozenset(("data", "labels", "units", "isi", "isi_units")), _acqknowledge),
    (frozenset(("values", "interval", "title")), _spike2),
    (frozenset(("values",)), _simulink),
    (frozenset(("data", "name")), _dspace),
    (frozenset(("data_",)), _timeseries),
    (frozenset(), _by_hand),
)
"""The fields that a structure must have, and how its channels are then read."""
