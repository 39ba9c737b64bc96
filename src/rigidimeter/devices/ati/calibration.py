"""The calibration of an ATI force/torque transducer: six gauge voltages to six loads.

    load = matrix · (voltages - bias)

with the rows in the order Fx Fy Fz Tx Ty Tz, the columns in the order of the gauges G0 to G5,
forces in N, torques in N·m.

Two kinds of file are read. ATI's own ``*.cal`` is XML: the attributes of `Calibration` name the
units, and six `UserAxis` elements hold the rows in load per volt, ready to use. The `Axis` elements
of the same file hold the rows multiplied by a `scale` each and before the tool transform, for
ATI's programs only; a file without `UserAxis` is refused. A ``*.toml`` file is written by hand:

    serial = "FT0001"
    force_unit = "N"
    torque_unit = "N-m"
    matrix = [[six numbers], six rows]
"""

from __future__ import annotations

import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.devices.base import DeviceError

__all__ = ["AXES", "Calibration", "read_calibration"]

AXES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")

POUND_N = 4.4482216152605
INCH_M = 0.0254
FORCE_N = {"N": 1.0, "kN": 1e3, "lb": POUND_N, "lbf": POUND_N, "klbf": 1e3 * POUND_N}
TORQUE_NM = {
    "N-m": 1.0,
    "Nm": 1.0,
    "N-mm": 1e-3,
    "Nmm": 1e-3,
    "kN-m": 1e3,
    "lb-in": POUND_N * INCH_M,
    "lbf-in": POUND_N * INCH_M,
    "lb-ft": POUND_N * 12.0 * INCH_M,
    "lbf-ft": POUND_N * 12.0 * INCH_M,
}


class Calibration(NamedTuple):
    """A matrix of 6 × 6 in N/V and N·m/V, and what the file said beside it."""

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
        text = path.read_bytes()
    except OSError as error:
        raise DeviceError(f"torque sensor: calibration {path} cannot be read: {error}") from error
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
    rows = {axis.get("Name", ""): axis.get("values", "").split() for axis in found.iter("UserAxis")}
    if set(rows) != set(AXES):
        raise DeviceError(
            f"torque sensor: {path} has UserAxis rows {', '.join(rows) or 'none'}; "
            f"{', '.join(AXES)} would be right (ask ATI for a newer file)"
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
        table = tomllib.loads(text.decode())
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise DeviceError(f"torque sensor: {path} is not TOML: {error}") from error
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
        ("force unit", force_unit, FORCE_N),
        ("torque unit", torque_unit, TORQUE_NM),
    ):
        if unit not in known:
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
    scale = np.repeat([FORCE_N[force_unit], TORQUE_NM[torque_unit]], 3)
    return Calibration(scale[:, None] * matrix, serial, model, force_unit, torque_unit)
