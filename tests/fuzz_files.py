"""The files of instruments, archives and offices that `tests.fuzz` damages."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from tests import archive_files as archives
from tests import instrument_files as instruments
from tests import matlab_exports as exports
from tests import matlab_files as matlab
from tests.instrument_files import Signal
from tests.laboratory_exports import qualisys, vicon

_TIME_S = np.arange(1200) / 100.0
_RNG = np.random.default_rng(1)
_ANGLE_DEG = np.degrees(np.cumsum(_RNG.standard_normal(1200)) / 500)
_TORQUE_NM = 0.05 * np.radians(_ANGLE_DEG) + 0.001 * _RNG.standard_normal(1200)
_SIGNALS = [Signal("Torque", "Nm", _TORQUE_NM, 100.0), Signal("Angle", "deg", _ANGLE_DEG, 100.0)]
_HEAD, _COLUMNS = ["t [s]", "M [Nm]", "phi [deg]"], [_TIME_S, _TORQUE_NM, _ANGLE_DEG]
_MILLIVOLTS = ("--scale", "torque=1 Nm/mV", "--scale", "angle=1 deg/mV")
Made = tuple[str, Callable[[Path], object], str, tuple[str, ...]]


def _labview(path: Path) -> None:
    rows = zip(*(column.tolist() for column in _COLUMNS), strict=True)
    head = (
        "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n"
        "X_Columns\tOne\n***End_of_Header***\t\n\t\nChannels\t2\t\t\nY_Unit_Label\tN-m\tdeg\t\n"
        "***End_of_Header***\t\t\t\nX_Value\tTorque\tAngle\tComment\n"
    )
    path.write_text(head + "".join("\t".join(f"{x:.9g}" for x in row) + "\n" for row in rows))


def _biopac(path: Path) -> None:
    instruments.write_acq(path, _SIGNALS, compressed=True)


def _matlab_table(path: Path) -> None:
    columns = dict(zip(("t", "M", "phi"), _COLUMNS, strict=True))
    matlab.save(path, T=matlab.table(columns, ["s", "N*m", "deg"]))


def _matlab_timetable(path: Path) -> None:
    columns = dict(zip(("M", "phi"), _COLUMNS[1:], strict=True))
    matlab.save(path, "v7.3", T=matlab.timetable(columns, ["N*m", "deg"], 100.0))


def _matlab_export(path: Path, made: Mapping[str, object]) -> None:
    exports.save(path, **made)


def _in_set(folder: Path) -> None:
    archives.write_bids_motion(folder, _SIGNALS, latency=True)


def _file(name: str, file: str, write: Callable, *arguments: object, more: tuple = ()) -> Made:
    command = ("estimate", file, *more) if len(name) % 2 else ("inspect", file, *more)
    return name, lambda folder: write(folder / file, *arguments), file, command


_BIOPAC = (
    _file(".acq file", "r.acq", instruments.write_acq, _SIGNALS),
    _file("compressed .acq", "r.acq", _biopac),
)
_MOTION = "set/sub-01/motion/sub-01_task-elbow_tracksys-torque"
FILES: tuple[Made, ...] = (
    *(
        _file(f"{suffix} file", f"r{suffix}", write, _SIGNALS,
              more=_MILLIVOLTS if suffix == ".plx" else ())
        for suffix, write in instruments.WRITERS.items() if suffix != ".acq"
    ),
    *(_BIOPAC if find_spec("bioread") else ()),
    _file("LabVIEW text", "r.lvm", _labview),
    _file("MATLAB table", "r.mat", _matlab_table),
    _file("MATLAB timetable", "r.mat", _matlab_timetable),
    _file("Vicon text", "r.csv", Path.write_text, vicon()),
    _file("Qualisys text", "r.tsv", Path.write_text, qualisys(_HEAD[1:], heading=True)),
    _file("MATLAB of LabChart", "r.mat", _matlab_export, exports.labchart(blocks=2)),
    _file("MATLAB of dSPACE", "r.mat", _matlab_export, exports.dspace()),
    _file("MATLAB 7.3 of Spike2", "r.mat", exports.write_mat73, exports.spike2()),
    _file("MATLAB 7.3, structures", "r.mat", exports.write_mat73, exports.by_hand()),
    _file("XDF", "r.xdf", archives.write_xdf, _SIGNALS),
    _file("NWB", "r.nwb", archives.write_nwb, _SIGNALS),
    _file("Excel", "r.xlsx", archives.write_xlsx, _HEAD, _COLUMNS),
    _file("OpenDocument", "r.ods", archives.write_ods, _HEAD, _COLUMNS),
    _file("Parquet", "r.parquet", archives.write_arrow, _HEAD, _COLUMNS, ["", "", ""]),
    _file("Feather", "r.feather", archives.write_arrow, _HEAD, _COLUMNS, ["", "", ""]),
    ("BIDS motion", lambda folder: _in_set(folder / "set"), f"{_MOTION}_motion.tsv",
     ("inspect", "set")),
    ("BIDS channels", lambda folder: _in_set(folder / "set"), f"{_MOTION}_channels.tsv",
     ("estimate", "set")),
)  # fmt: skip
"""Name, what makes it in a folder, the file that is damaged and the command that reads it."""
