"""MATLAB files: version 4 to 7 by scipy, 7.3 (which is HDF5) by h5py, objects by mat-io.

Fields of structures get dotted names: `data.torque`; of arrays of structures `data(2).torque`. The
columns of the only table of a file keep their names; otherwise, and for the properties of other
objects, names are dotted. Row times become stamps in seconds: each timetable has its own clock.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.arrays import Expansion, Stored, check_count, silent
from rigidimeter.analysis.reading_anew.columns import Array, Columns, unique
from rigidimeter.analysis.reading_anew.hdf5 import hdf5_arrays, hdf5_objects
from rigidimeter.analysis.reading_anew.mapping import Mapping as Said
from rigidimeter.analysis.reading_anew.streams import Stream, columns_of_streams
from rigidimeter.analysis.reading_anew.structures import columns_of_variables
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import MAX_COLUMNS

TIME = "time_s"
# scipy's name of the variable without a name, which holds the values of objects.
_OBJECTS = "__function_workspace__"
_HDF5 = b"\x89HDF\r\n\x1a\n"
# The type of what cannot be a column.
_NO_COLUMN = "V1"
_ROW_BYTES = 32


def read_mat(path: Path, said: Said) -> Columns:
    """Read a MATLAB file, or the one of its variables that is named as the table.

    Version 4 to 7; tables, timetables, objects and 7.3 need the extra; units from
    `VariableUnits`; fields of structures have dotted names (`data.torque`); exports of
    LabChart, AcqKnowledge, Spike2 and ControlDesk, Simulink and `timeseries` with names, units
    and clocks.

    Raises
    ------
    UserError
        If it has no column, or needs h5py or mat-io and that is not installed.
    Exception
        Whatever scipy, h5py and mat-io raise on a damaged file.
    """
    with path.open("rb") as file:
        start = file.read(520)
        expansion = Expansion(path, path.stat().st_size)
        if _HDF5 in (start[:8], start[512:520]):
            entries, objects = hdf5_arrays(path), hdf5_objects(path, expansion)
        else:
            loaded, objects = _loaded(path, file)
            check_count(path, len(loaded))
            entries = _flat(loaded)
    if said.table:
        names = [*entries, *objects]
        mine = {name for name in names if name.partition(".")[0] == said.table}
        if not mine:
            known = ", ".join(dict.fromkeys(name.partition(".")[0] for name in names))
            raise UserError(f"{path}: there is no variable {said.table!r}; it has {known}")
        entries = {name: entry for name, entry in entries.items() if name in mine}
        objects = [name for name in objects if name in mine]
    if not objects:
        return columns_of_variables(str(path), entries)
    plain = {n: entry for n, entry in entries.items() if n.partition(".")[0] not in objects}
    try:
        return _with_objects(path, objects, plain, expansion)
    except MemoryError:
        raise
    except Exception as error:  # mat-io raises what comes up in a class that it does not know
        if all(entry.dtype.kind == "V" or entry.size < 2 for entry in plain.values()):
            raise
        rest = columns_of_variables(str(path), plain)  # the columns beside them
        reason = str(error).removeprefix(f"{path}: ") or type(error).__name__
        unread = dict.fromkeys(objects, f"an object that is not read ({reason})")
        return replace(rest, others={**rest.others, **unread})


def _loaded(path: Path, file: BinaryIO) -> tuple[dict[str, Any], list[str]]:
    """Return the variables of a file of version 4 to 7, and which are objects or hold some."""
    file.seek(0)
    with warnings.catch_warnings():
        # A file that scipy warns of is refused, with the warning as the reason; but objects are
        # variables without a name to it.
        warnings.simplefilter("error", scipy.io.matlab.MatReadWarning)
        warnings.filterwarnings("ignore", 'Duplicate variable name "None"')
        # A file too, say scipy's documents.
        loaded = scipy.io.loadmat(cast("Any", file), simplify_cells=True)
    found = {name: value for name, value in loaded.items() if name[:2] != "__"}
    if _OBJECTS not in loaded:
        return found, []
    raw = _by_mat_io(path, "T", raw_data=True)
    objects = [name for name, value in raw.items() if _holds_objects(value)]
    return {n: v for n, v in found.items() if n in raw and n not in objects}, objects


def _holds_objects(value: Any) -> bool:
    if hasattr(value, "classname"):
        return True
    return any(_holds_objects(part) for _, part in _parts(value))


def _flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, Stored]:
    """Give the fields of nested structures dotted names."""
    flat: dict[str, Stored] = {}
    for key, value in values.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{name}.")
        elif _is_signals(value):
            for index, one in enumerate(value, start=1):
                flat |= _flat(one, f"{name}({index}).")
        else:
            flat[name] = Stored.of(_array(value))
    return flat


def _is_signals(value: object) -> bool:
    """Whether a list is one of structures of which some hold samples; not one of many events."""
    if not isinstance(value, list) or not all(isinstance(one, Mapping) for one in value):
        return False
    fields = [field for one in value for field in one.values()]
    return 0 < len(fields) <= MAX_COLUMNS and any(
        isinstance(field, np.ndarray) and field.dtype.kind in "fiu" and field.size > 1
        for field in fields
    )


def _array(value: object) -> NDArray[Any]:
    """Return numbers as they are and text as objects; anything else as an array of type void."""
    if isinstance(value, list):
        plain = np.empty(len(value), dtype=object)
        plain[:] = value
        return _array(plain)
    array = np.asarray(value)
    if array.dtype == object and not all(isinstance(entry, str) for entry in array.flat):
        return np.empty(array.shape, dtype=_NO_COLUMN)
    return array


def _mat_io(path: Path, name: str) -> Any:
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


def _by_mat_io(path: Path, name: str, **options: Any) -> dict[str, Any]:
    library = _mat_io(path, name)
    with warnings.catch_warnings():
        # It warns of what it could not read, and of times that it rounds to nanoseconds.
        warnings.simplefilter("ignore")
        warnings.simplefilter("error", library.utils.matclass.MatReadWarning)
        warnings.simplefilter("error", UserWarning)
        warnings.simplefilter("ignore", library.utils.matclass.MatConvertWarning)
        return dict(library.load_from_mat(str(path), **options))


def _with_objects(
    path: Path, names: list[str], entries: Mapping[str, Stored], expansion: Expansion
) -> Columns:
    """Return the columns of a file whose variables `names` are objects, or hold some."""
    raw = _by_mat_io(path, names[0], variable_names=list(names), raw_data=True)
    for name, rows in _timetable_rows(raw):
        expansion.take(name, _ROW_BYTES * rows)  # row times at a rate are counted, not stored
    found = _Found()
    values = _by_mat_io(path, names[0], variable_names=list(names), add_table_attrs=True)
    for name, value in values.items():
        found.add(name, value)
    arrays = {**entries, **found.arrays}
    clocked = [name for name, frame in found.frames.items() if frame.index.dtype.kind in "mM"]
    if len({found.frames[name].index.dtype.kind for name in clocked}) > 1:
        raise UserError(
            f"{path}: of {', '.join(clocked)[:60]} some have dates as row times, some durations; "
            f"say which one is read, as in --table {clocked[0]}"
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
    variables = columns_of_variables(str(path), arrays)
    stated = {
        name: one._replace(unit=units.get(name, one.unit))
        for name, one in variables.columns.items()
    }
    return replace(variables, columns=stated)


def _of_timetables(
    path: Path, found: _Found, clocked: list[str], arrays: dict[str, Stored], origin: Any
) -> Columns:
    others = {name: "without a clock, beside timetables" for name in [*arrays, *found.frames]}
    streams = []
    for name in clocked:
        del others[name]
        columns = _columns(found.frames[name], origin)
        units = _units(found.frames[name], columns)
        stamps = columns.pop(TIME)
        plain = {key: array for key, array in columns.items() if array.dtype.kind == "f"}
        others |= {f"{name}.{key}": "text" for key in columns if key not in plain}
        streams.append(Stream(name, stamps, plain, units))
    return replace(columns_of_streams(str(path), streams), others=others)


def _columns(frame: Any, origin: Any) -> dict[str, NDArray[Any]]:
    """Return the columns of a table by name, row times as seconds."""
    timed = frame.index.dtype.kind in "mM"
    columns = {TIME: _seconds(frame.index.to_numpy(), origin)} if timed else {}
    names = unique(map(str, frame.columns), tuple(columns))
    return columns | {
        name: _of_frame(frame[column].array)
        for name, column in zip(names, frame.columns, strict=True)
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
            self.arrays[name] = Stored.of(_of_frame(value))


def _of_frame(value: Any) -> NDArray[Any]:
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
    return array if array.dtype.kind in "fO" and kind != "O" else np.empty(array.shape, _NO_COLUMN)


def _seconds(times: NDArray[Any], origin: Any) -> Array:
    """Return durations in s, and dates in s since `origin`."""
    if times.dtype.kind == "M":
        times = times.astype("datetime64[ns]") - np.datetime64(origin, "ns")
    seconds = times.astype("timedelta64[ns]") / np.timedelta64(1, "s")
    return np.asarray(seconds, dtype=np.float64)
