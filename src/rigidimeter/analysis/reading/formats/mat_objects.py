"""Tables, timetables and other class objects of MATLAB files, read by mat-io.

The columns of the only table of a file keep their names; otherwise, and for the properties of other
objects, names are dotted. Row times become a column in seconds: each timetable has its own clock.
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.formats.clocked_table import (
    TIME,
    Stream,
    table_of_streams,
    unique,
)
from rigidimeter.analysis.reading.formats.mat_channels import table_of_variables
from rigidimeter.analysis.reading.formats.mat_check import check_mat5
from rigidimeter.analysis.reading.formats.stored_arrays import Expansion, Stored, silent
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.errors import UserError

_OBJECTS = "V1"
"""The type of what cannot be a column."""
_ROW_BYTES = 32


def mat_io(path: Path, name: str) -> Any:
    """Return the library.

    Raises
    ------
    UserError
        If it is not installed; the message names an object of the file.
    """
    try:
        with silent("matio"):  # it sets an option that pandas calls deprecated
            import matio
    except ImportError:
        raise UserError(
            f"{path}: {name[:60]} is a table or another object of a MATLAB class, which needs one "
            "more package: pip install 'rigidimeter[matlab]'. Or in MATLAB: s = table2struct("
            f"{name[:60]}, 'ToScalar', true); save('r.mat', '-struct', 's'). Of a timetable TT "
            "with the row times Time: T = timetable2table(TT); T.time_s = seconds(T.Time - "
            "T.Time(1)); T.Time = []; then the same with T"
        ) from None
    return matio


def check_subsystem(data: bytes, expansion: Expansion) -> None:
    """Check the variable without a name of a file of version 5 to 7, which holds the objects.

    Its bytes are a file by themselves, with a header of 8 bytes in place of 128.

    Raises
    ------
    ValueError
        If an element is not one, or does not end where the next begins.
    """
    whole = b" " * 124 + data[:4] + data[8:]
    check_mat5(
        io.BytesIO(whole), len(whole), lambda size: expansion.take("the data of objects", size)
    )


def table_with_objects(
    path: Path, names: list[str], entries: Mapping[str, Stored], expansion: Expansion
) -> Table:
    """Return the table of a file whose variables `names` are objects, or hold some.

    Parameters
    ----------
    path : Path
    names : list of str
    entries : mapping of str to Stored
        All other variables.
    expansion : Expansion

    Raises
    ------
    UserError
        If mat-io is not installed, or there is no column.
    Exception
        Whatever mat-io raises on a damaged file.
    """
    found = _Found()
    for name, value in _loaded(path, names, expansion).items():
        found.add(name, value)
    arrays = {**entries, **found.arrays}
    clocked = [name for name, frame in found.frames.items() if frame.index.dtype.kind in "mM"]
    if len({found.frames[name].index.dtype.kind for name in clocked}) > 1:
        raise UserError(
            f"{path}: of {', '.join(clocked)[:60]} some have row times that are dates and some "
            "durations, and nothing says how these belong together; say which one is read, as in "
            f"--table {clocked[0]}"
        )
    dates = [found.frames[name].index for name in clocked]
    origin = min((index.min() for index in dates if index.dtype.kind == "M"), default=None)
    if len(clocked) > 1:
        return _of_timetables(path, found, clocked, arrays, origin)
    units: dict[str, str] = {}
    for name, frame in found.frames.items():
        prefix = f"{name}." if len(found.frames) > 1 else ""
        columns = _columns(frame, origin) if name in clocked else _columns(frame, None)
        arrays |= {f"{prefix}{column}": Stored.of(values) for column, values in columns.items()}
        units |= {f"{prefix}{column}": unit for column, unit in _units(frame, columns).items()}
    table = table_of_variables(str(path), arrays)
    return replace(table, units={**table.units, **units})


def _of_timetables(
    path: Path, found: _Found, clocked: list[str], arrays: dict[str, Stored], origin: Any
) -> Table:
    streams, units = [], []
    others = {name: "without a clock, beside timetables" for name in [*arrays, *found.frames]}
    for name in clocked:
        del others[name]
        columns = _columns(found.frames[name], origin)
        units.append(_units(found.frames[name], columns))
        stamps = columns.pop(TIME)
        plain = {key: array for key, array in columns.items() if array.dtype.kind == "f"}
        others |= {f"{name}.{key}": "text" for key in columns if key not in plain}
        streams.append(Stream(name, stamps, plain))
    return replace(table_of_streams(str(path), streams, units), others=others)


def _columns(frame: Any, origin: Any) -> dict[str, NDArray[Any]]:
    """Return the columns of a table by name, row times as seconds."""
    timed = frame.index.dtype.kind in "mM"
    columns = {TIME: _seconds(frame.index.to_numpy(), origin)} if timed else {}
    names = unique(map(str, frame.columns), tuple(columns))
    return columns | {
        name: _array(frame[column].array) for name, column in zip(names, frame.columns, strict=True)
    }


def _units(frame: Any, columns: Mapping[str, NDArray[Any]]) -> dict[str, str]:
    stated = frame.attrs.get("varUnits") or frame.attrs.get("VariableUnits") or []
    timed = TIME in columns and frame.index.dtype.kind in "mM"
    units = {TIME: "s"} if timed else {}
    names = [name for name in columns if not (timed and name == TIME)]
    for name, dtype in zip(names, frame.dtypes, strict=True):
        if dtype.kind in "mM":
            units[name] = "s"
    # A column that is a matrix was split, and then the units are of fewer names.
    if len(stated) == len(names):
        units |= {name: str(unit) for name, unit in zip(names, stated, strict=True) if unit}
    return units


def _loaded(path: Path, names: list[str], expansion: Expansion) -> dict[str, Any]:
    library = mat_io(path, names[0])
    with warnings.catch_warnings():
        # It warns of what it could not read, and of times that it rounds to nanoseconds.
        warnings.simplefilter("ignore")
        warnings.simplefilter("error", library.utils.matclass.MatReadWarning)
        warnings.simplefilter("error", UserWarning)
        warnings.simplefilter("ignore", library.utils.matclass.MatConvertWarning)
        raw = library.load_from_mat(str(path), variable_names=list(names), raw_data=True)
        for name, rows in _timetable_rows(raw):
            expansion.take(name, _ROW_BYTES * rows)  # row times at a rate are counted, not stored
        return dict(
            library.load_from_mat(str(path), variable_names=list(names), add_table_attrs=True)
        )


def _timetable_rows(value: Any, name: str = "") -> Iterator[tuple[str, int]]:
    if getattr(value, "classname", "") == "timetable":
        yield name, int(value.properties["any"][0, 0]["numRows"].item())
    for key, part in _parts(value):
        yield from _timetable_rows(part, f"{name}.{key}" if name else key)


def _parts(value: Any) -> list[tuple[str, Any]]:
    """Return the named parts of a structure, an object or a map; nothing of anything else."""
    value = getattr(value, "properties", value)
    if isinstance(value, Mapping):
        return [(str(key), part) for key, part in value.items()]
    if isinstance(value, np.ndarray) and value.dtype.names and value.size == 1:
        return [(name, value.reshape(-1)[0][name]) for name in value.dtype.names]
    return []


@dataclass
class _Found:
    """Tables and arrays by dotted name."""

    frames: dict[str, Any] = field(default_factory=dict)
    arrays: dict[str, Stored] = field(default_factory=dict)

    def add(self, name: str, value: Any) -> None:
        if name.startswith("__"):
            return
        parts = _parts(value)
        if hasattr(value, "columns"):
            self.frames[name] = value
        elif parts:
            for key, part in parts:
                self.add(f"{name}.{key}", part)
        else:
            self.arrays[name] = Stored.of(_array(value))


def _array(value: Any) -> NDArray[Any]:
    """Return numbers as float, text as objects, durations and dates as seconds."""
    if str(getattr(value, "dtype", "")) == "category":
        value = value.astype(object)
    array = np.asarray(value)
    kind = array.dtype.kind
    if kind in "mM":
        array = _seconds(array, np.nanmin(array) if array.size else None)
    elif kind in "fiub":
        array = array.astype(np.float64)
    elif kind in "OUT" and not array.dtype.names:
        # One text is an array of one text.
        texts = [one.item() if getattr(one, "size", 0) == 1 else one for one in array.flat]
        if all(isinstance(one, str) or one is None or one != one for one in texts):
            array = np.empty(len(texts), dtype=object)
            array[:] = [one if isinstance(one, str) else "" for one in texts]
            return array
    return array if array.dtype.kind in "fO" and kind != "O" else np.empty(array.shape, _OBJECTS)


def _seconds(times: NDArray[Any], origin: Any) -> NDArray[np.float64]:
    """Return durations in s, and dates in s since `origin`."""
    if times.dtype.kind == "M":
        times = times.astype("datetime64[ns]") - np.datetime64(origin, "ns")
    seconds = times.astype("timedelta64[ns]") / np.timedelta64(1, "s")
    return np.asarray(seconds, dtype=np.float64)
