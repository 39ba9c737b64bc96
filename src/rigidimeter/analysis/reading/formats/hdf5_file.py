"""HDF5 files as h5py writes them: a dataset a channel, units and rates in attributes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rigidimeter.analysis.reading.formats.columns import RATE_NAMES
from rigidimeter.analysis.reading.formats.hdf5_arrays import hdf5_arrays
from rigidimeter.analysis.reading.formats.mat_channels import table_of_variables
from rigidimeter.analysis.reading.formats.stored_arrays import Stored
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.errors import UserError

_UNITS = ("unit", "units")
_SCALES = {"scale_factor", "add_offset", "scale", "offset", "gain", "conversion", "calibration",
           "resolution", "slope", "intercept"}  # fmt: skip
_NEUTRAL = {"offset": 0.0, "add_offset": 0.0, "intercept": 0.0}


def read_hdf5(path: Path) -> Table:
    """Read the datasets of one dimension; those in groups get dotted names.

    An attribute ``unit`` or ``units`` of a dataset is its unit, an attribute such as ``fs`` of the
    file, a group or a dataset the sampling rate.

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
    table = table_of_variables(str(path), kept)
    units = {name: unit for name, unit in units.items() if name in table.columns}
    return replace(table, units={**units, **table.units}, others={**scaled, **table.others})


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
