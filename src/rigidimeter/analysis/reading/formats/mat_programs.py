"""Channels of MATLAB structures as programs of measurement export them.

LabChart has one vector of all channels, AcqKnowledge a matrix, Spike2 a structure for each channel,
dSPACE and Simulink arrays of structures, and MATLAB the class ``timeseries``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rigidimeter.analysis.reading.channels.unit_text import factor
from rigidimeter.analysis.reading.formats.clocked_table import even_clock
from rigidimeter.analysis.reading.formats.mat_fields import (
    Array,
    Fields,
    matrix_columns,
    number,
    numbers,
    stated_name,
    stated_unit,
    stepped_clock,
    text,
    texts,
)
from rigidimeter.core.errors import UserError

_DAY_S = 86400.0


@dataclass(frozen=True)
class Channel:
    """A channel; `time_s` is None where the file has no clock for it."""

    name: str
    unit: str
    values: Array
    time_s: Array | None


def _labchart(source: str, groups: Mapping[str, Fields], place: str) -> list[Channel]:
    """Read one vector of all channels and blocks, and where each begins and ends in it."""
    fields = groups[place]
    if "scaleunits" in fields:
        raise UserError(
            f"{source}: its samples are 16-bit numbers with a scale apart (scaleunits); export it "
            "from LabChart once more, as single or double precision"
        )
    titles = texts(fields["titles"])
    n = len(titles)
    n_blocks = max(1, fields["datastart"].size // max(n, 1))

    def by_channel(key: str) -> Array:
        found = numbers(fields[key])
        if found.size != n * n_blocks:
            raise ValueError(f"{key} has {found.size} values for {n} channels")
        return found.reshape(n, n_blocks)

    first, last, rate_hz = map(by_channel, ("datastart", "dataend", "samplerate"))
    begins_s = np.zeros(n_blocks)
    if n_blocks > 1:
        days = numbers(fields["blocktimes"]).reshape(-1)
        begins_s = _DAY_S * (days - days[0])
    late = np.zeros((n, n_blocks))
    if "firstsampleoffset" in fields and "tickrate" in fields:
        ticks_hz = numbers(fields["tickrate"]).reshape(-1)
        late = by_channel("firstsampleoffset") / ticks_hz
    stated = texts(fields["unittext"]) if "unittext" in fields else []
    which = np.full((n, n_blocks), -1)
    if "unittextmap" in fields:
        which = by_channel("unittextmap").astype(int)
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
                Channel(title, units.pop(), np.concatenate(pieces), np.concatenate(stamps))
            )
    return found


def _acqknowledge(source: str, groups: Mapping[str, Fields], place: str) -> list[Channel]:
    """Read a matrix with a column for each channel, and the interval of all."""
    fields = groups[place]
    names, units = texts(fields["labels"]), texts(fields["units"])
    in_s = factor(text(fields["isi_units"]), "time_s")
    columns = matrix_columns(fields["data"], len(names))
    if in_s is None or columns is None or len(units) != len(names):
        return []
    step_s = number(fields["isi"]) * in_s
    return [
        Channel(name, unit, column, stepped_clock(0.0, step_s, column.size))
        for name, unit, column in zip(names, units, columns, strict=True)
    ]


def _spike2(source: str, groups: Mapping[str, Fields], place: str) -> list[Channel]:
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
    return [Channel(stated_name(fields, place), stated_unit(fields), values, time_s)]


def _simulink(source: str, groups: Mapping[str, Fields], place: str) -> list[Channel]:
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
    block = text(fields["blockname"]) if "blockname" in fields else own
    if len(labels) != n_columns:
        base = (labels or [""])[0] or block.rpartition("/")[2]
        labels = [f"{base} ({k + 1})" for k in range(n_columns)] if n_columns > 1 else [base]
    return [
        Channel(label or block.rpartition("/")[2], "", column, time_s)
        for label, column in zip(labels, columns, strict=True)
    ]


def _dspace(source: str, groups: Mapping[str, Fields], place: str) -> list[Channel]:
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
    return [Channel(name, stated_unit(fields), columns[0], stamps)]


def _timeseries(source: str, groups: Mapping[str, Fields], place: str) -> list[Channel]:
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
    name = text(fields["name"]) if "name" in fields else ""
    if not name or name == "unnamed":
        name = place.rpartition(".")[2]
    return [Channel(name, unit, values, stamps * in_s)]


PROGRAMS: Sequence[
    tuple[str, frozenset[str], Callable[[str, Mapping[str, Fields], str], list[Channel]]]
] = (
    ("LabChart", frozenset(("data", "datastart", "dataend", "samplerate", "titles")), _labchart),
    ("AcqKnowledge", frozenset(("data", "labels", "units", "isi", "isi_units")), _acqknowledge),
    ("Spike2", frozenset(("values", "interval", "title")), _spike2),
    ("Simulink", frozenset(("values",)), _simulink),
    ("dSPACE", frozenset(("data", "name")), _dspace),
    ("MATLAB's timeseries", frozenset(("data_",)), _timeseries),
)
"""Each program, the fields that a structure of it has, and how its channels are then read."""
