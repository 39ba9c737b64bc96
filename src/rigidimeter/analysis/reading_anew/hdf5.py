"""HDF5 files: datasets of h5py and MATLAB 7.3, with units and rates in attributes.

Only what lies in the file itself is read: no link to another file, no data kept in one. Datasets in
groups have dotted names.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.arrays import Expansion, Stored, check_count
from rigidimeter.analysis.reading_anew.clock import RATE_NAMES
from rigidimeter.analysis.reading_anew.columns import Columns
from rigidimeter.analysis.reading_anew.structures import columns_of_variables
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import CELLS, MAX_COLUMNS, NESTING

_UNITS = ("unit", "units")
_SCALES = {"scale_factor", "add_offset", "scale", "offset", "gain", "conversion", "calibration",
           "resolution", "slope", "intercept"}  # fmt: skip
_NEUTRAL = {"offset": 0.0, "add_offset": 0.0, "intercept": 0.0}


def read_hdf5(path: Path) -> Columns:
    """Read the datasets of a file.

    Datasets, in groups with dotted names; fields of tables; columns of matrices as `q[0]`;
    attributes `unit` or `units`, and `fs` or as in NumPy archives; a dataset with a
    `scale_factor` is not read.

    Raises
    ------
    UserError
        If there is no column, h5py is not installed, or it is a file of NWB.
    Exception
        Whatever h5py raises on a damaged file.
    """
    entries = hdf5_arrays(path)
    import h5py

    units: dict[str, str] = {}
    scaled: dict[str, str] = {}
    with h5py.File(path, "r") as file:
        if "nwb_version" in file.attrs:
            raise UserError(f"{path} is an NWB file by its attributes; let its name end in .nwb")
        for name in ("", *_inside(entries)):
            place = file.get(name.replace(".", "/")) if name else file
            for key, value in _attributes(place).items():
                if key in RATE_NAMES and not isinstance(value, str):
                    entries[f"{name}.{key}".lstrip(".")] = Stored.of(np.array([value]))
                elif key in _UNITS and isinstance(value, str):
                    units[name] = value
                elif key in _SCALES and value != _NEUTRAL.get(key, 1.0) and name in entries:
                    scaled[name] = (
                        f"stored with an attribute {key} of {str(value)[:40]}, which is not "
                        "applied; save it in its unit"
                    )
    kept = {name: entry for name, entry in entries.items() if name not in scaled}
    if not kept:
        name, why = next(iter(scaled.items()))
        raise UserError(f"{path}: {name} is {why}")
    found = columns_of_variables(str(path), kept)
    columns = {
        name: one if one.unit else one._replace(unit=units.get(name.partition("[")[0], ""))
        for name, one in found.columns.items()
    }
    return replace(found, columns=columns, others={**scaled, **found.others})


def _inside(entries: dict[str, Stored]) -> list[str]:
    """Return the datasets and the groups in which they lie."""
    parts = [name.split(".") for name in entries if "(" not in name]
    return sorted({".".join(each[:n]) for each in parts for n in range(1, len(each) + 1)})


def _attributes(place: Any) -> dict[str, str | float]:
    """Return the attributes of one value by name in lower case."""
    found: dict[str, str | float] = {}
    if place is None:  # of a name with a dot of its own
        return found
    for key, value in place.attrs.items():
        array = np.asarray(value)
        if array.size != 1:
            continue
        (one,) = array.reshape(-1).tolist()
        if isinstance(one, bytes):
            found[key.lower()] = one.decode("utf-8", "replace")
        elif isinstance(one, str | int | float):
            found[key.lower()] = one if isinstance(one, str) else float(one)
    return found


# MATLAB's mark of an object of a class.
_OPAQUE = 3


def hdf5_arrays(path: Path) -> dict[str, Stored]:
    """Return the arrays of a file by name; fields of structures have dotted names.

    Raises
    ------
    UserError
        If h5py is not installed, or the file holds more than a recording does.
    Exception
        Whatever h5py raises on a damaged file.
    """
    h5py = _h5py(path)
    expansion = Expansion(path, path.stat().st_size)
    entries: dict[str, Stored] = {}

    def visit(group: Any, prefix: str, depth: int) -> None:
        if depth > NESTING:  # a group may lie in itself
            raise ValueError("its structures are nested too deeply")
        check_count(path, len(group))
        for key in group:
            if key.startswith("#"):
                continue  # where MATLAB keeps the contents of cells and its own classes
            if not isinstance(group.get(key, getlink=True), h5py.HardLink):
                continue
            value = group[key]
            if isinstance(value, h5py.Group):
                visit(value, f"{prefix}{key}.", depth + 1)
            elif isinstance(value, h5py.Dataset):
                for name, part in _elements(h5py, value, prefix, key):
                    entries[name] = _stored(path, h5py, part, name, expansion)
                check_count(path, len(entries))

    with h5py.File(path, "r") as file:
        visit(file, "", 0)
    return entries


def hdf5_objects(path: Path, expansion: Expansion) -> list[str]:
    """Return the variables that are objects of a class, such as a table, or hold some.

    Their values lie in the groups of a leading ``#``, which are then checked as a whole.

    Raises
    ------
    ValueError
        If a part of such a file lies in another file.
    """
    h5py = _h5py(path)
    found: dict[str, None] = {}
    links: list[str] = []

    def look(name: str, value: Any) -> None:
        if isinstance(value, h5py.Group):
            links.extend(
                key for key in value if not isinstance(value.get(key, getlink=True), h5py.HardLink)
            )
        elif value.is_virtual or value.external:
            links.append(name)
        else:
            sizes.append((name, value.size or 0))
        if value.attrs.get("MATLAB_object_decode") == _OPAQUE and not name.startswith("#"):
            found[name.partition("/")[0]] = None

    sizes: list[tuple[str, int]] = []
    with h5py.File(path, "r") as file:
        look("", file)
        file.visititems(look)
    if found and links:
        raise ValueError(f"{links[0]} lies in another file or place")
    for name, size in sizes if found else ():
        expansion.take(name, 8 * size)
    return list(found)


def _h5py(path: Path) -> Any:
    try:
        import h5py
    except ImportError:
        raise UserError(
            f"{path} is an HDF5 file, as MATLAB 7.3 writes, which needs one more package: "
            "pip install 'rigidimeter[matlab]' (or save it in MATLAB with -v7)"
        ) from None
    return h5py


def _stored(path: Path, h5py: Any, dataset: Any, name: str, expansion: Expansion) -> Stored:
    """Return what a dataset is; text and single values are read at once."""
    kind = _kind(dataset)
    if "MATLAB_empty" in dataset.attrs:
        return Stored.of(np.empty(0))
    if dataset.is_virtual or dataset.external or "MATLAB_object_decode" in dataset.attrs:
        return Stored(np.dtype("V1"), dataset.shape, lambda: np.empty(0))
    if kind == "char":
        expansion.take(name, 4 * dataset.size)
        return Stored.of(np.asarray(_letters(dataset), dtype=object))
    if kind == "cell":
        if dataset.size > CELLS:
            raise UserError(
                f"{path}: {name[:60]} has {dataset.size} cells; at most {CELLS} are read, so save "
                "labels as numbers"
            )
        expansion.take(name, 8 * dataset.size)
        cells = [dataset.file[reference] for reference in np.asarray(dataset[()]).reshape(-1)]
        if {_kind(cell) for cell in cells} != {"char"}:
            return Stored(np.dtype("V1"), (len(cells),), lambda: np.empty(0))
        expansion.take(name, sum(4 * cell.size for cell in cells))
        texts = ["" if "MATLAB_empty" in cell.attrs else _text(cell) for cell in cells]
        return Stored.of(np.array(texts, dtype=object))
    if h5py.check_ref_dtype(dataset.dtype) is not None or dataset.dtype.hasobject:
        return Stored(np.dtype("V1"), dataset.shape or (), lambda: np.empty(0))
    read = functools.partial(_read, path, name, dataset.name, expansion)
    return Stored(dataset.dtype, (dataset.shape or (0,))[::-1], read)


def _elements(h5py: Any, dataset: Any, prefix: str, key: str) -> Iterator[tuple[str, Any]]:
    """Yield a field of a structure, or of each element of an array of structures."""
    references = h5py.check_ref_dtype(dataset.dtype) is not None and not _kind(dataset)
    if not (references and prefix and 0 < dataset.size <= MAX_COLUMNS):
        yield f"{prefix}{key}", dataset
        return
    parts = [dataset.file[reference] for reference in np.asarray(dataset[()]).reshape(-1)]
    if not all(isinstance(part, h5py.Dataset) for part in parts):
        yield f"{prefix}{key}", dataset
        return
    for index, part in enumerate(parts, start=1):
        yield f"{prefix[:-1]}({index}).{key}", part


def _read(path: Path, name: str, place: str, expansion: Expansion) -> NDArray[Any]:
    """Return an array in MATLAB's order of dimensions, which HDF5 has reversed."""
    with _h5py(path).File(path, "r") as file:
        dataset = file[place]
        expansion.take(name, dataset.size * max(dataset.dtype.itemsize, 8))
        return np.asarray(dataset[()]).T


def _kind(dataset: Any) -> str:
    return str(dataset.attrs.get("MATLAB_class", b"").decode("ascii", "replace"))


def _letters(dataset: Any) -> str | list[str]:
    """Return a text, or the rows of a matrix of letters."""
    if len(dataset.shape) == 2 and min(dataset.shape) > 1:
        return ["".join(map(chr, row)) for row in np.asarray(dataset[()]).T]
    return _text(dataset)


def _text(dataset: Any) -> str:
    return "".join(map(chr, np.asarray(dataset[()]).T.reshape(-1)))
