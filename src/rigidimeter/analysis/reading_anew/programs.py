"""Structures as programs of measurement export them to MATLAB: a row each.

LabChart has one vector of all channels, AcqKnowledge a matrix, Spike2 a structure for each channel,
dSPACE and Simulink arrays of structures, and MATLAB the class ``timeseries``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rigidimeter.analysis.reading_anew.arrays import Stored
from rigidimeter.analysis.reading_anew.clock import RATE_NAMES
from rigidimeter.analysis.reading_anew.columns import Array, even_clock
from rigidimeter.analysis.reading_anew.units import factor
from rigidimeter.core.errors import UserError

_DAY_S = 86400.0
Fields = Mapping[str, Stored]
"""The fields of a structure by name in lower case."""
NAMES = ("title", "label", "name", "channel")
UNITS = ("unit", "units")
_RATES = (*RATE_NAMES, "samplerate", "sample_rate", "srate")


def fields_by_place(entries: Mapping[str, Stored]) -> dict[str, dict[str, Stored]]:
    """Return the fields of each structure by its place, such as ``rec.Y(1)``.

    Parameters
    ----------
    entries : mapping of str to Stored
        By dotted name; those without a dot have the place ``""``.
    """
    groups: dict[str, dict[str, Stored]] = {}
    for name, entry in entries.items():
        place, _, field = name.rpartition(".")
        groups.setdefault(place, {}).setdefault(field.lower(), entry)
    return groups


def stepped_clock(start_s: float, step_s: float, count: int) -> Array:
    """Return the stamps of even samples.

    Raises
    ------
    ValueError
        If the step cannot be one.
    """
    return even_clock(start_s, 1.0 / step_s if step_s else 0.0, count)


def fields_above(groups: Mapping[str, Fields], place: str) -> list[Fields]:
    """Return the fields of a structure and of those in which it lies, the innermost first."""
    found = [groups[place]]
    while place:
        place = place.rpartition(".")[0]
        found.append(groups.get(place, {}))
    return found


def stated_rate(fields: Fields) -> float:
    """Return the sampling rate that a structure states, 0 where it states none."""
    found = (fields[key] for key in _RATES if key in fields)
    return next((number(each) for each in found if each.size == 1), 0.0)


def stated_name(fields: Fields, place: str) -> str:
    """Return the name that a structure states, or its own."""
    stated = (texts(fields[key]) for key in NAMES if key in fields)
    return next((each[0] for each in stated if each and each[0]), "") or place.rpartition(".")[2]


def stated_unit(fields: Fields) -> str:
    """Return the unit that a structure states, nothing where it states none."""
    stated = (texts(fields[key]) for key in UNITS if key in fields)
    return next((each[0] for each in stated if each and each[0] not in ("", "-")), "")


def texts(entry: Stored) -> list[str]:
    """Return one text, a cell of texts or the rows of a matrix of letters."""
    if entry.dtype.kind not in "OU":
        return []
    return [str(one).replace("\0", "").strip() for one in entry.read().reshape(-1)]


def text(entry: Stored) -> str:
    """Return the first text of a field.

    Raises
    ------
    ValueError
        If it has none.
    """
    found = texts(entry)
    if not found:
        raise ValueError("a field that must hold text does not")
    return found[0]


def number(entry: Stored) -> float:
    """Return the first number of a field.

    Raises
    ------
    ValueError
        If it has none.
    """
    found = numbers_of(entry).reshape(-1)
    if not found.size:
        raise ValueError("a field that must hold a number is empty")
    return float(found[0])


def numbers_of(entry: Stored) -> Array:
    """Return a field of numbers as it is shaped.

    Raises
    ------
    ValueError
        If it holds anything else.
    """
    if entry.dtype.kind not in "fiub":
        raise ValueError("a field that must hold numbers does not")
    return np.asarray(entry.read(), dtype=np.float64)


def matrix_columns(entry: Stored, count: int) -> list[Array] | None:
    """Return a matrix as columns, where it has so many; None where it is no such matrix."""
    long = [length for length in entry.shape if length != 1]
    if entry.dtype.kind not in "fiub" or entry.size < 2 or len(long) > 2 or count < 1:
        return None
    if count == 1:
        return [numbers_of(entry).reshape(-1)] if len(long) == 1 else None
    values = numbers_of(entry).reshape(long)
    if count not in values.shape or values.ndim != 2:
        return None
    return list(np.ascontiguousarray(values.T if values.shape[1] == count else values))


class Signal(NamedTuple):
    """A channel; `time_s` is None where the file has no clock for it."""

    name: str
    unit: str
    values: Array
    time_s: Array | None


def _labchart(source: str, groups: Mapping[str, Fields], place: str) -> list[Signal]:
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
        found = numbers_of(fields[key])
        if found.size != n * n_blocks:
            raise ValueError(f"{key} has {found.size} values for {n} channels")
        return found.reshape(n, n_blocks)

    first, last, rate_hz = map(by_channel, ("datastart", "dataend", "samplerate"))
    begins_s = np.zeros(n_blocks)
    if n_blocks > 1:
        days = numbers_of(fields["blocktimes"]).reshape(-1)
        begins_s = _DAY_S * (days - days[0])
    late = np.zeros((n, n_blocks))
    if "firstsampleoffset" in fields and "tickrate" in fields:
        ticks_hz = numbers_of(fields["tickrate"]).reshape(-1)
        late = by_channel("firstsampleoffset") / ticks_hz
    stated = texts(fields["unittext"]) if "unittext" in fields else []
    which = np.full((n, n_blocks), -1)
    if "unittextmap" in fields:
        which = by_channel("unittextmap").astype(int)
    data = numbers_of(fields["data"]).reshape(-1)
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
            found.append(Signal(title, units.pop(), np.concatenate(pieces), np.concatenate(stamps)))
    return found


def _acqknowledge(source: str, groups: Mapping[str, Fields], place: str) -> list[Signal]:
    """Read a matrix with a column for each channel, and the interval of all."""
    fields = groups[place]
    names, units = texts(fields["labels"]), texts(fields["units"])
    in_s = factor(text(fields["isi_units"]), "time")
    columns = matrix_columns(fields["data"], len(names))
    if in_s is None or columns is None or len(units) != len(names):
        return []
    step_s = number(fields["isi"]) * in_s
    return [
        Signal(name, unit, column, stepped_clock(0.0, step_s, column.size))
        for name, unit, column in zip(names, units, columns, strict=True)
    ]


def _spike2(source: str, groups: Mapping[str, Fields], place: str) -> list[Signal]:
    """Read a waveform; its times, or its start and interval, are in s."""
    fields = groups[place]
    columns = matrix_columns(fields["values"], 1)
    if columns is None:
        return []
    (values,) = columns
    start_s = number(fields["start"]) if "start" in fields else 0.0
    time_s = stepped_clock(start_s, number(fields["interval"]), values.size)
    if "times" in fields and fields["times"].size == values.size:
        time_s = numbers_of(fields["times"]).reshape(-1)
    return [Signal(stated_name(fields, place), stated_unit(fields), values, time_s)]


def _simulink(source: str, groups: Mapping[str, Fields], place: str) -> list[Signal]:
    """Read signals of a structure with time; the time of a simulation is in s."""
    above, _, own = place.rpartition(".")
    time = groups.get(above, {}).get("time")
    if not own.startswith("signals") or time is None or time.size < 2:
        return []
    fields = groups[place]
    time_s = numbers_of(time).reshape(-1)
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
        Signal(label or block.rpartition("/")[2], "", column, time_s)
        for label, column in zip(labels, columns, strict=True)
    ]


def _dspace(source: str, groups: Mapping[str, Fields], place: str) -> list[Signal]:
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
    stamps = numbers_of(times["data"]).reshape(-1) * (
        factor(stated_unit(times) or "s", "time") or 1.0
    )
    name = stated_name(fields, place).replace('"', "")
    return [Signal(name, stated_unit(fields), columns[0], stamps)]


def _timeseries(source: str, groups: Mapping[str, Fields], place: str) -> list[Signal]:
    """Read an object: stamps, or where they begin and by how much they increase, and their unit."""
    fields = groups[place]
    about = groups.get(f"{place}.TimeInfo", groups.get(f"{place}.TimeInfo_", {}))
    columns = matrix_columns(fields["data_"], 1)
    in_s = factor(stated_unit(about), "time") if stated_unit(about) else None
    if columns is None or in_s is None:
        return []
    (values,) = columns
    if "time_" in fields and fields["time_"].size == values.size:
        stamps = numbers_of(fields["time_"]).reshape(-1)
    elif {"start_", "increment_"} <= about.keys():
        stamps = stepped_clock(number(about["start_"]), number(about["increment_"]), values.size)
    else:
        return []
    unit = stated_unit(groups.get(f"{place}.DataInfo", groups.get(f"{place}.DataInfo_", {})))
    name = text(fields["name"]) if "name" in fields else ""
    if not name or name == "unnamed":
        name = place.rpartition(".")[2]
    return [Signal(name, unit, values, stamps * in_s)]


PROGRAMS: Sequence[
    tuple[str, frozenset[str], Callable[[str, Mapping[str, Fields], str], list[Signal]]]
] = (
    ("LabChart", frozenset(("data", "datastart", "dataend", "samplerate", "titles")), _labchart),
    ("AcqKnowledge", frozenset(("data", "labels", "units", "isi", "isi_units")), _acqknowledge),
    ("Spike2", frozenset(("values", "interval", "title")), _spike2),
    ("Simulink", frozenset(("values",)), _simulink),
    ("dSPACE", frozenset(("data", "name")), _dspace),
    ("MATLAB's timeseries", frozenset(("data_",)), _timeseries),
)
"""Each program, the fields that a structure of it has, and how its channels are then read."""
