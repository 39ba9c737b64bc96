"""A corpus of one known joint in every format and many dialects: `python -m tests.corpus OUT`.

Each entry writes a file, or the files that belong together, in a folder. The text dialects are in
`tests.dialects`; here are the binary formats, several clocks, and files that state a wrong unit.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy
from tests import archive_files as archives
from tests import instrument_files as instruments
from tests import matlab_files as matlab
from tests.dialects import ANGLE_DEG, ANGLE_RAD, DIALECTS, MILLI, SEED, TIME_S, TORQUE_NM, csv
from tests.instrument_files import Signal
from tests.known_joint import angle_rad
from tests.laboratory_exports import EXPORTED_TEXT
from tests.laboratory_files import LABORATORY
from tests.matlab_exports import EXPORTS


@dataclass(frozen=True)
class Entry:
    """A recording of the joint.

    `files` are read, `write` makes them in a folder; `said` is what a person adds that no file
    says; `refused` is a part of the refusal, where there must be one.
    """

    files: tuple[str, ...]
    write: Callable[[Path], object]
    said: Mapping[str, object] = field(default_factory=dict)
    refused: str = ""


T, M, D = TIME_S, TORQUE_NM, ANGLE_DEG
_SLOW_S = 0.25 + np.arange(1900) / 100.0
TORQUE, ANGLE = Signal("Torque", "Nm", M), Signal("Angle", "deg", D)
SLOW = Signal("Angle", "deg", np.degrees(angle_rad(_SLOW_S, SEED)), 100.0, 0.25)
EARLY = Signal("Angle", "deg", D[::2], 100.0)
FORCE = Signal("Fz", "N", M / 0.2)
VOLTS = Signal("Torque", "mV", 2000 * M)
FULL = [Signal("Torque", "mV", 8000 * M), Signal("Angle", "mV", 500 * D)]
"""Over the range of 12 bits."""


def _one(file: str, writer: Callable, *arguments: object, **more: object) -> Entry:
    said = more.pop("said", {})
    refused = more.pop("refused", "")
    return Entry((file,), lambda folder: writer(folder / file, *arguments, **more), said, refused)


def _save(path: Path, **values: object) -> None:
    (np.savez if path.suffix == ".npz" else scipy.io.savemat)(path, *([values] if path.suffix ==
     ".mat" else []), **(values if path.suffix == ".npz" else {}))  # fmt: skip


def _date(time_s: np.ndarray) -> np.ndarray:
    return np.datetime64("2024-05-01", "ns") + np.round(1e9 * time_s).astype("timedelta64[ns]")


def _text(name: str, content: bytes) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_bytes(content)


def _both(*writers: Callable[[Path], object]) -> Callable[[Path], object]:
    return lambda folder: [write(folder) for write in writers]


def _raw_and_calibrated(path: Path) -> None:
    """Write the sensor's volts in one group and the torque in another, both called Torque."""
    from nptdms import ChannelObject, TdmsWriter

    wave = {"wf_increment": 0.005, "wf_start_offset": 0.0}
    channels = [("raw", "Torque", M / 2.5, "V"), ("cal", "Torque", M, "Nm"),
                ("cal", "Angle", D, "deg")]  # fmt: skip
    with TdmsWriter(str(path)) as writer:
        writer.write_segment(
            [ChannelObject(group, name, values, wave | {"unit_string": unit})
             for group, name, values, unit in channels]
        )  # fmt: skip


_TORQUE_CSV = _text("m.csv", csv("t [s],M [Nm]", T, M))
_LATE_CSV = _text("a.csv", csv("t [ms];phi [deg]", MILLI * (T - 0.375), D, mark=";", decimal=","))
_COLUMNS = ("time", "torque", "angle")

FILES: Mapping[str, Entry] = {
    "TDMS waveforms": _one("r.tdms", instruments.write_tdms, [TORQUE, ANGLE]),
    "TDMS waveforms, two clocks": _one("r.tdms", instruments.write_tdms, [TORQUE, SLOW]),
    "TDMS columns in ms": _one("r.tdms", instruments.write_tdms_columns, [TORQUE, ANGLE]),
    "TDMS groups, two clocks": _one("r.tdms", instruments.write_tdms_columns, [TORQUE, SLOW]),
    "TDMS, volts and torque": _one("r.tdms", _raw_and_calibrated, refused="2 columns may be the"),
    "TDMS, the torque is named": _one(
        "r.tdms", _raw_and_calibrated, said={"column": {"torque": "cal.Torque"}}
    ),
    "TDMS, degrees stated as rad": _one(
        "r.tdms", instruments.write_tdms, [TORQUE, Signal("Angle", "rad", D)]
    ),
    "TDMS, small degrees stated as rad": _one(
        "r.tdms", instruments.write_tdms, [TORQUE, Signal("Angle", "rad", D / 8)],
        refused="unusually fast",
    ),
    "TDMS, rad stated as degrees": _one(
        "r.tdms", instruments.write_tdms, [TORQUE, Signal("Angle", "deg", ANGLE_RAD)],
        refused="unusually slow",
    ),
    "C3D": _one("r.c3d", instruments.write_c3d, [TORQUE, ANGLE]),
    "C3D in N·mm": _one(
        "r.c3d", instruments.write_c3d, [Signal("Moment", "N.mm", MILLI * M), ANGLE]
    ),
    "C3D, N·mm stated as N·m": _one(
        "r.c3d", instruments.write_c3d, [Signal("Moment", "Nm", MILLI * M), ANGLE],
        refused="unusually large",
    ),
    "C3D, N·m stated as N·mm": _one(
        "r.c3d", instruments.write_c3d, [Signal("Moment", "N.mm", M), ANGLE],
        refused="unusually small",
    ),
    "C3D with a force": _one("r.c3d", instruments.write_c3d, [FORCE, ANGLE], refused="lever arm"),
    "C3D with a force and its lever arm": _one(
        "r.c3d", instruments.write_c3d, [FORCE, ANGLE], said={"scale": {"torque": "0.2 m"}}
    ),
    "AcqKnowledge": _one("r.acq", instruments.write_acq, [TORQUE, ANGLE]),
    "AcqKnowledge, compressed, two rates": _one(
        "r.acq", instruments.write_acq, [TORQUE, EARLY], compressed=True
    ),
    "AcqKnowledge, reaction": _one(
        "r.acq", instruments.write_acq, [Signal("Torque", "N-m", -M), ANGLE]
    ),
    "Spike2": _one("r.smr", instruments.write_smr, [TORQUE, ANGLE]),
    "Spike2, two clocks": _one("r.smr", instruments.write_smr, [TORQUE, SLOW]),
    "pCLAMP": _one("r.abf", instruments.write_abf, [TORQUE, ANGLE]),
    "Blackrock": _one("r.ns2", instruments.write_ns2, [VOLTS, ANGLE], refused="--scale"),
    "Blackrock with its calibration": _one(
        "r.ns2", instruments.write_ns2, [VOLTS, ANGLE], said={"scale": {"torque": "0.5 Nm/V"}}
    ),
    "Plexon with its calibrations": _one(
        "r.plx", instruments.write_plx, FULL,
        said={"scale": {"torque": "0.125 Nm/V", "angle": "2 deg/V"}},
    ),
    "Excel, German": _one(
        "r.xlsx", archives.write_xlsx, ["Zeit [ms]", "Drehmoment [Nm]", "Winkel [°]"],
        [MILLI * T, M, D],
    ),
    "Excel, dates": _one(
        "r.xlsx", archives.write_xlsx, ["Zeitstempel", "Drehmoment [Nm]", "Winkel [°]"],
        [_date(T).astype("datetime64[us]").tolist(), M, D],
    ),
    "OpenDocument": _one(
        "r.ods", archives.write_ods, ["temps (s)", "couple (N.m)", "angle (°)"], [T, M, D]
    ),
    "NumPy": _one("r.npz", _save, time_s=T, torque_nm=M, angle_rad=ANGLE_RAD),
    "NumPy with a rate": _one("r.npz", _save, fs=200.0, torque_nm=M, angle_deg=D),
    "NumPy, no units": _one("r.npz", _save, time=T, torque=M, angle=D / 8, refused="stated no"),
    "MATLAB 5": _one("r.mat", _save, t_ms=MILLI * T, M_Nm=M, phi_deg=D),
    "MATLAB structure": _one(
        "r.mat", _save, data={"fs": 200.0, "Torque_Nm": M, "Angle_deg": D, "subject": "S 1"}
    ),
    "MATLAB 4": _one(
        "r.mat", lambda path: scipy.io.savemat(path, {"t_s": T, "M_Nm": M, "w_deg": D}, format="4"),
        said={"column": {"angle": "w_deg"}, "unit": {"angle": "deg"}},
    ),
    "MATLAB 7.3": _one("r.mat", archives.write_mat73, {"t_s": T, "M_Nm": M, "phi_deg": D}),
    "MATLAB table": _one(
        "r.mat", lambda path: matlab.save(path, T=matlab.table(
            {"t": MILLI * T, "M": M, "phi": D}, ["ms", "N*m", "deg"])),
    ),
    "MATLAB timetable": _one(
        "r.mat", lambda path: matlab.save(
            path, "v7.3", TT=matlab.timetable({"M": M, "phi": D}, ["N*m", "deg"], 200.0)),
    ),
    "MATLAB timetables, two clocks": _one(
        "r.mat", lambda path: matlab.save(
            path, M=matlab.timetable({"M": M}, ["N*m"], _date(T)),
            phi=matlab.timetable({"phi": SLOW.values}, ["deg"], _date(_SLOW_S))),
    ),
    "NWB, two clocks": _one("r.nwb", archives.write_nwb, [TORQUE, SLOW]),
    "NWB without a unit": _one(
        "r.nwb", archives.write_nwb, [TORQUE, Signal("Angle", "a.u.", D / 8)], refused="stated no"
    ),
    "XDF, two clocks": _one("r.xdf", archives.write_xdf, [TORQUE, EARLY], offset_s=0.4),
    "BIDS-Motion": _one("set", archives.write_bids_motion, [TORQUE, ANGLE], latency=False),
    "BIDS-Motion, two clocks": _one(
        "set", archives.write_bids_motion, [TORQUE, SLOW], latency=True
    ),
    "Parquet": _one("r.parquet", archives.write_arrow, _COLUMNS, [T, M, D], ["s", "Nm", "deg"]),
    "Parquet, dates": _one(
        "r.parquet", archives.write_arrow, ["Zeitstempel", "M [Nm]", "phi [deg]"],
        [_date(T), M, D], [""] * 3,
    ),
    "Feather": _one(
        "r.feather", archives.write_arrow, ["t_ms", "M_Nm", "phi_deg"], [MILLI * T, M, D], [""] * 3
    ),
    "Arrow stream, no units": _one(
        "r.arrows", archives.write_arrow, _COLUMNS, [T, M, D / 8], [""] * 3, refused="stated no"
    ),
    "two files": Entry(
        ("m.csv", "a.csv"), _both(_TORQUE_CSV, _text("a.csv", csv("t_s,phi_deg", T, D))),
        {"join": True},
    ),
    "two files, two clocks": Entry(
        ("m.csv", "a.csv"), _both(_TORQUE_CSV, _LATE_CSV), {"join": True, "clock_offset": 0.375}
    ),
    "two formats, the offset found": Entry(
        ("m.tdms", "a.csv"),
        _both(lambda folder: instruments.write_tdms(folder / "m.tdms", [TORQUE]), _LATE_CSV),
        {"join": True, "clock_offset": "found"},
    ),
    "two files without --join": Entry(
        ("m.csv", "a.csv"), _both(_TORQUE_CSV, _LATE_CSV), refused="velocity_rad_s nor angle_rad"
    ),
}  # fmt: skip

CORPUS: Mapping[str, Entry] = {
    **{
        name: Entry((one.file,), _text(one.file, one.content), one.said, one.refused)
        for name, one in {**DIALECTS, **LABORATORY, **EXPORTED_TEXT}.items()
    },
    **{name if name not in DIALECTS else f"{name}, binary": one for name, one in FILES.items()},
    **{name: _one("r.mat", made, refused="".join(more)) for name, (made, *more) in EXPORTS.items()},
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    out = parser.parse_args().out
    for name, entry in CORPUS.items():
        folder = out / name.replace("/", "-")
        folder.mkdir(parents=True)
        entry.write(folder)
    print(f"{len(CORPUS)} recordings in {out}")


if __name__ == "__main__":
    main()
