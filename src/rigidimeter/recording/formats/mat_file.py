"""MATLAB files: version 4 to 7 by scipy, version 7.3 (which is HDF5) by h5py.

Fields of structures get dotted names: `data.torque`.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.errors import UserError
from rigidimeter.recording.formats.mat_check import check_mat5
from rigidimeter.recording.formats.table import Table, table_of_arrays

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
    with path.open("rb") as file:
        start = file.read(520)
    hdf5 = _HDF5 in (start[:8], start[512:520])
    return table_of_arrays(str(path), _entries_hdf5(path) if hdf5 else _entries(path))


def _entries(path: Path) -> dict[str, NDArray[Any]]:
    check_mat5(path.read_bytes())
    with warnings.catch_warnings():
        # A file that scipy warns of is refused, with the warning as the reason.
        warnings.simplefilter("error", scipy.io.matlab.MatReadWarning)
        loaded = scipy.io.loadmat(path, simplify_cells=True)
    return _flat({name: value for name, value in loaded.items() if not name.startswith("__")})


def _flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, NDArray[Any]]:
    """Give the fields of nested structures dotted names."""
    flat: dict[str, NDArray[Any]] = {}
    for key, value in values.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{name}.")
        else:
            flat[name] = _array(value)
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


def _entries_hdf5(path: Path) -> dict[str, NDArray[Any]]:
    try:
        import h5py
    except ImportError:
        raise UserError(
            f"{path} is a MATLAB file of version 7.3, which needs one more package: "
            "pip install 'rigidimeter[matlab73]' (or save it in MATLAB with -v7)"
        ) from None

    def text(dataset: Any) -> str:
        return "".join(map(chr, np.asarray(dataset[()]).T.reshape(-1)))

    def entry(dataset: Any) -> NDArray[Any]:
        kind = dataset.attrs.get("MATLAB_class", b"").decode("ascii", "replace")
        if "MATLAB_empty" in dataset.attrs:
            return np.empty(0)
        if kind == "char":
            return np.asarray(text(dataset), dtype=object)
        if kind == "cell":
            cells = [file[reference] for reference in np.asarray(dataset[()]).reshape(-1)]
            kinds = {cell.attrs.get("MATLAB_class", b"") for cell in cells}
            if kinds != {b"char"}:
                return np.empty(len(cells), dtype="V1")
            return np.array(
                ["" if "MATLAB_empty" in cell.attrs else text(cell) for cell in cells], dtype=object
            )
        if h5py.check_ref_dtype(dataset.dtype) is not None:
            return np.empty(dataset.shape, dtype="V1")
        return np.asarray(dataset[()])

    entries: dict[str, NDArray[Any]] = {}

    def visit(group: Any, prefix: str) -> None:
        for key, value in group.items():
            if key.startswith("#"):
                continue  # where MATLAB keeps the contents of cells and its own classes
            if isinstance(value, h5py.Group):
                visit(value, f"{prefix}{key}.")
            elif isinstance(value, h5py.Dataset):
                entries[f"{prefix}{key}"] = entry(value)

    with h5py.File(path, "r") as file:
        visit(file, "")
    return entries
