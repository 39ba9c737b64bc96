"""MATLAB files: version 4 to 7 by scipy, version 7.3 (which is HDF5) by h5py.

Fields of structures get dotted names: `data.torque`.
"""

from __future__ import annotations

import functools
import os
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.documents import open_regular
from rigidimeter.documents.bounds import RECORDING_BYTES
from rigidimeter.errors import UserError
from rigidimeter.recording.formats.hdf5_arrays import hdf5_arrays
from rigidimeter.recording.formats.mat4_check import check_mat4
from rigidimeter.recording.formats.mat_check import Variable, check_mat5
from rigidimeter.recording.formats.stored_arrays import Expansion, Stored, check_count
from rigidimeter.recording.formats.table import Table, table_of_arrays

_VALUE_BYTES = 8
_HDF5 = b"\x89HDF\r\n\x1a\n"


def read_mat(path: Path) -> Table:
    """Read a MATLAB file.

    Raises
    ------
    UserError
        If it has no column, or needs h5py and that is not installed.
    Exception
        Whatever scipy and h5py raise on a damaged file.
    """
    with open_regular(path, RECORDING_BYTES) as file:
        start = file.read(520)
        if _HDF5 in (start[:8], start[512:520]):
            entries = hdf5_arrays(path)
        else:
            file.seek(0)
            entries = _entries(path, file)
    objects = [name for name, entry in entries.items() if entry.dtype.kind == "V"]
    if objects and len(objects) == len(entries):
        name = objects[0]
        raise UserError(
            f"{path}: {', '.join(objects)[:60]} is a table or another object, and those are not "
            f"read; in MATLAB say s = table2struct({name[:60]}, 'ToScalar', true); "
            "save('r.mat', '-struct', 's'). Of a timetable TT with the row times Time: T = "
            "timetable2table(TT); T.time_s = seconds(T.Time - T.Time(1)); T.Time = []; then the "
            "same with T"
        )
    return table_of_arrays(str(path), entries)


def _entries(path: Path, file: BinaryIO) -> dict[str, Stored]:
    file_bytes = os.fstat(file.fileno()).st_size
    checked, used = Expansion(path, file_bytes), Expansion(path, file_bytes)
    variables = check_mat5(file, file_bytes, lambda n_bytes: checked.take("a variable", n_bytes))
    if variables is None:  # version 4, which is never compressed
        check_count(path, check_mat4(file, file_bytes))
        return _flat(_loaded(file, None))
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
    return entries


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
    return {name: value for name, value in loaded.items() if not name.startswith("__")}


def _flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, Stored]:
    """Give the fields of nested structures dotted names."""
    flat: dict[str, Stored] = {}
    for key, value in values.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{name}.")
        else:
            flat[name] = Stored.of(_array(value))
    return flat


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
