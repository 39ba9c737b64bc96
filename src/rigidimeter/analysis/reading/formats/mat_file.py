"""MATLAB files: version 4 to 7 by scipy, 7.3 (which is HDF5) by h5py, objects by mat-io.

Fields of structures get dotted names: `data.torque`; of arrays of structures `data(2).torque`.
"""

from __future__ import annotations

import functools
import os
import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO, Literal, cast

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.reading.formats.hdf5_arrays import hdf5_arrays, hdf5_objects
from rigidimeter.analysis.reading.formats.mat4_check import check_mat4
from rigidimeter.analysis.reading.formats.mat_channels import table_of_variables
from rigidimeter.analysis.reading.formats.mat_check import Variable, check_mat5
from rigidimeter.analysis.reading.formats.mat_objects import check_subsystem, table_with_objects
from rigidimeter.analysis.reading.formats.stored_arrays import Expansion, Stored, check_count
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.analysis.reading.formats.text_head import Layout
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import MAX_COLUMNS, RECORDING_BYTES, open_regular

_VALUE_BYTES = 8
_VALUES = "__function_workspace__"
"""scipy's name of the variable without a name, which holds the values of objects."""
_HDF5 = b"\x89HDF\r\n\x1a\n"


def read_mat(path: Path, layout: Layout | None = None) -> Table:
    """Read a MATLAB file, or the one of its variables that `layout` names as the table.

    Raises
    ------
    UserError
        If it has no column, or needs h5py or mat-io and that is not installed.
    Exception
        Whatever scipy, h5py and mat-io raise on a damaged file.
    """
    with open_regular(path, RECORDING_BYTES) as file:
        start = file.read(520)
        if _HDF5 in (start[:8], start[512:520]):
            entries = hdf5_arrays(path)
            objects = hdf5_objects(path, Expansion(path, path.stat().st_size))
        else:
            file.seek(0)
            entries, objects = _entries(path, file)
    if layout is not None and layout.table:
        chosen = layout.table
        mine = {name for name in [*entries, *objects] if name.partition(".")[0] == chosen}
        if not mine:
            names = dict.fromkeys(name.partition(".")[0] for name in [*entries, *objects])
            raise UserError(f"{path}: there is no variable {chosen!r}; it has {', '.join(names)}")
        entries = {name: entry for name, entry in entries.items() if name in mine}
        objects = [name for name in objects if name in mine]
    if not objects:
        return table_of_variables(str(path), entries)
    plain = {
        name: entry for name, entry in entries.items() if name.partition(".")[0] not in objects
    }
    try:
        return table_with_objects(path, objects, plain, Expansion(path, path.stat().st_size))
    except MemoryError:
        raise
    except Exception as error:  # mat-io raises what comes up in a class that it does not know
        if all(entry.dtype.kind == "V" or entry.size < 2 for entry in plain.values()):
            raise
        rest = table_of_variables(str(path), entries)  # the columns beside them
        reason = str(error).removeprefix(f"{path}: ") or type(error).__name__
        unread = dict.fromkeys(objects, f"an object that is not read ({reason})")
        return replace(rest, others={**rest.others, **unread})


def _entries(path: Path, file: BinaryIO) -> tuple[dict[str, Stored], list[str]]:
    """Return the variables, and the names of those that are objects or hold some."""
    file_bytes = os.fstat(file.fileno()).st_size
    checked, used = Expansion(path, file_bytes), Expansion(path, file_bytes)
    variables = check_mat5(file, file_bytes, lambda n_bytes: checked.take("a variable", n_bytes))
    if variables is None:  # version 4, which is never compressed
        check_count(path, check_mat4(file, file_bytes))
        return _flat(_loaded(file, None)), []
    check_count(path, len(variables))
    names = [variable.name for variable in variables if variable.name]
    if len(set(names)) < len(names):
        raise ValueError("two variables have one name")
    whole = [each for each in variables if each.content == "text or parts"]
    for variable in whole:
        used.take(variable.name, _VALUE_BYTES * variable.n_values)
    parts = _flat(_loaded(file, [variable.name for variable in whole])) if whole else {}
    entries: dict[str, Stored] = {}
    for variable in variables:
        name = variable.name
        if not name or name.startswith("__"):
            continue
        if variable.content == "text or parts":
            own = (name, f"{name}.")
            entries |= {key: part for key, part in parts.items() if key.startswith(own)}
        elif variable.content == "numbers":
            read = functools.partial(_read, path, variable, used)
            entries[name] = Stored(np.dtype(np.float64), variable.shape, read)
        else:
            dtype = np.dtype(np.complex128 if variable.content == "complex" else "V1")
            entries[name] = Stored(dtype, variable.shape, lambda: np.empty(0))
    objects = [each.name for each in variables if each.content == "objects" and each.name]
    if objects:
        _check_subsystem(file, variables, checked)
    return entries, objects


def _check_subsystem(file: BinaryIO, variables: list[Variable], expansion: Expansion) -> None:
    """Check the last variable, in which the values of objects are."""
    file.seek(116)
    header = file.read(12)
    order: Literal["little", "big"] = "little" if header[10:] == b"IM" else "big"
    starts = [variable.start for variable in variables if not variable.name]
    if starts != [int.from_bytes(header[:8], order)]:
        raise ValueError("it does not hold the values of its objects where its header says")
    data = _loaded(file, [_VALUES])[_VALUES]
    check_subsystem(np.ascontiguousarray(data, np.uint8).tobytes(), expansion)


def _read(path: Path, variable: Variable, used: Expansion) -> NDArray[Any]:
    used.take(variable.name, _VALUE_BYTES * variable.n_values)
    with open_regular(path, RECORDING_BYTES) as file:
        return np.asarray(_loaded(file, [variable.name])[variable.name])


def _loaded(file: BinaryIO, names: list[str] | None) -> dict[str, Any]:
    """Return the variables of these names, or all."""
    file.seek(0)
    with warnings.catch_warnings():
        # A file that scipy warns of is refused, with the warning as the reason.
        warnings.simplefilter("error", scipy.io.matlab.MatReadWarning)
        # A file too, say scipy's documents.
        loaded = scipy.io.loadmat(cast("Any", file), simplify_cells=True, variable_names=names)
    return {name: value for name, value in loaded.items() if name == _VALUES or name[:2] != "__"}


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
        return np.empty(array.shape, dtype="V1")
    return array
