"""The calibration of an ATI force/torque transducer: six gauge voltages to six loads.

    load = matrix · (voltages - bias)

with the rows in the order Fx Fy Fz Tx Ty Tz, the columns in the order of the gauges G0 to G5,
forces in N, torques in N·m.

Two kinds of file can be read. ATI's own ``*.cal`` is XML: the attributes of `Calibration` name the
units, and six `UserAxis` elements hold the rows in load per volt. The `Axis` elements of the same
file hold the rows before the tool transform, each multiplied by a `scale`, for ATI's own programs;
a file without `UserAxis` is refused. A ``*.toml`` file is written by hand:

    serial = "FT0001"
    force_unit = "N"
    torque_unit = "N-m"
    matrix = [[six numbers], six rows]
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import SETTINGS_BYTES, parse_toml, read_bytes
from rigidimeter.rig.devices.base import DeviceError

AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")

POUND_FORCE_N = 4.4482216152605
KILOGRAM_FORCE_N = 9.80665
INCH_M = 0.0254

FORCE_UNITS_N = {
    "N": 1.0,
    "kN": 1000.0,
    "lbf": POUND_FORCE_N,
    "klbf": 1000.0 * POUND_FORCE_N,
    "kgf": KILOGRAM_FORCE_N,
}
"""Newtons in one unit."""

TORQUE_UNITS_NM = {
    "Nm": 1.0,
    "Nmm": 1e-3,
    "kNm": 1000.0,
    "lbf-in": POUND_FORCE_N * INCH_M,
    "lbf-ft": POUND_FORCE_N * 12.0 * INCH_M,
    "kgf-cm": KILOGRAM_FORCE_N * 0.01,
}
"""Newton metres in one unit."""

_SPELLINGS = {"N-m": "Nm", "N-mm": "Nmm", "kN-m": "kNm", "kg": "kgf", "kg-cm": "kgf-cm"}
_SPELLINGS |= {"lb": "lbf", "lb-in": "lbf-in", "lb-ft": "lbf-ft"}


def unit_name(written: str) -> str:
    """Return a unit of force or torque in the spelling used here; ATI has several."""
    return _SPELLINGS.get(written, written)


class Calibration(NamedTuple):
    """A 6 × 6 matrix in N/V and N·m/V, with the other entries of the file."""

    matrix: NDArray[np.float64]
    serial: str
    model: str
    force_unit: str
    torque_unit: str


def read_calibration(path: Path) -> Calibration:
    """Read a calibration file.

    Raises
    ------
    DeviceError
        If the file cannot be read, names a unit that is not known, or holds no 6 × 6 matrix.
    """
    try:
        text = read_bytes(path, SETTINGS_BYTES)
    except UserError as error:
        raise DeviceError(f"torque sensor: calibration {error}") from error
    return _from_toml(path, text) if path.suffix == ".toml" else _from_xml(path, text)


def _from_xml(path: Path, text: bytes) -> Calibration:
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise DeviceError(f"torque sensor: {path} is not an ATI calibration: {error}") from error
    found = root.find("Calibration")
    if root.tag != "FTSensor" or found is None:
        raise DeviceError(
            f"torque sensor: {path} begins with <{root.tag}>; an ATI calibration has "
            "<FTSensor> with a <Calibration> inside"
        )
    gain = found.get("GainMultiplier", "1")
    if gain != "1":
        raise DeviceError(f"torque sensor: {path} has GainMultiplier {gain}; only 1 is known here")
    if len(root.findall("Calibration")) > 1:
        raise DeviceError(
            f"torque sensor: {path} has several <Calibration>; keep the one that is used"
        )
    axes = list(found.iter("UserAxis"))
    rows = {axis.get("Name", ""): axis.get("values", "").split() for axis in axes}
    if set(rows) != set(AXES) or len(axes) > len(AXES):
        names = ", ".join(axis.get("Name", "") for axis in axes)
        raise DeviceError(
            f"torque sensor: {path} has UserAxis rows {names or 'none'}; "
            f"{', '.join(AXES)} expected, each once (ask ATI for a newer file)"
        )
    return _calibration(
        path,
        [rows[axis] for axis in AXES],
        serial=root.get("Serial", ""),
        model=" ".join(filter(None, (root.get("BodyStyle"), found.get("PartNumber")))),
        force_unit=found.get("ForceUnits", ""),
        torque_unit=found.get("TorqueUnits", ""),
    )


def _from_toml(path: Path, text: bytes) -> Calibration:
    try:
        table = parse_toml(text, str(path))
    except UserError as error:
        raise DeviceError(f"torque sensor: {error}") from error
    return _calibration(
        path,
        table.get("matrix"),
        serial=str(table.get("serial", "")),
        model=str(table.get("model", "")),
        force_unit=str(table.get("force_unit", "")),
        torque_unit=str(table.get("torque_unit", "")),
    )


def _calibration(
    path: Path, rows: Any, *, serial: str, model: str, force_unit: str, torque_unit: str
) -> Calibration:
    for field, unit, known in (
        ("force unit", force_unit, FORCE_UNITS_N),
        ("torque unit", torque_unit, TORQUE_UNITS_NM),
    ):
        if unit_name(unit) not in known:
            raise DeviceError(
                f"torque sensor: {path} has {field} {unit!r}; one of {', '.join(known)} is known"
            )
    try:
        matrix = np.array(rows, dtype=np.float64)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape != (6, 6) or not np.isfinite(matrix).all():
        raise DeviceError(f"torque sensor: {path} holds no matrix of 6 rows of 6 finite numbers")
    if np.linalg.matrix_rank(matrix) < 6:
        raise DeviceError(
            f"torque sensor: {path} holds a singular matrix; six gauges carry six loads"
        )
    scale = np.repeat(
        [FORCE_UNITS_N[unit_name(force_unit)], TORQUE_UNITS_NM[unit_name(torque_unit)]], 3
    )
    return Calibration(scale[:, None] * matrix, serial, model, force_unit, torque_unit)
