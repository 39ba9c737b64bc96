"""A known joint in MATLAB files as programs of measurement export them, and as people save them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import scipy
from tests import matlab_files as matlab
from tests.dialects import ANGLE_DEG, MILLI, RATE_HZ, SEED, TIME_S, TORQUE_NM
from tests.known_joint import angle_rad

T, M, D = TIME_S, TORQUE_NM, ANGLE_DEG
SLOW_HZ, LATE_S = 100.0, 0.25
SLOW_S = LATE_S + np.arange(1900) / SLOW_HZ
SLOW_DEG = np.degrees(angle_rad(SLOW_S, SEED))
Values = Mapping[str, object]


def save(path: Path, **values: object) -> None:
    scipy.io.savemat(path, values)


def structures(*records: Values) -> np.ndarray:
    """Return an array of structures, as MATLAB's `struct` makes one."""
    array = np.empty((1, len(records)), dtype=[(field, object) for field in records[0]])
    for index, record in enumerate(records):
        array[0, index] = tuple(record.values())
    return array


def labchart(units: Sequence[str] = ("Nm", "deg"), blocks: int = 1) -> Values:
    """Return what LabChart exports: all channels and blocks in one vector, and where each is."""
    data, start, stop = [], np.empty((2, blocks)), np.empty((2, blocks))
    rates = np.repeat([[RATE_HZ], [SLOW_HZ]], blocks, axis=1)
    length = TIME_S.size // blocks
    for block in range(blocks):
        here = slice(block * length, (block + 1) * length)
        for channel, values in enumerate((M[here], D[here][::2])):
            start[channel, block] = sum(map(len, data)) + 1
            data.append(values)
            stop[channel, block] = sum(map(len, data))
    return {
        "data": np.concatenate(data)[None], "datastart": start, "dataend": stop,
        "titles": np.array(["Torque", "Elbow angle"]), "samplerate": rates,
        "tickrate": np.full((1, blocks), RATE_HZ), "firstsampleoffset": np.zeros((2, blocks)),
        "blocktimes": 739378.5 + np.arange(blocks) * (length / RATE_HZ + 30.0) / 86400,
        "rangemin": -np.ones((2, blocks)), "rangemax": np.ones((2, blocks)),
        "unittext": np.array(units), "unittextmap": np.repeat([[1], [2]], blocks, axis=1),
        "com": np.array([[-1.0, 1.0, 100.0, 1.0, 1.0]]), "comtext": np.array(["start"]),
    }  # fmt: skip


def acqknowledge(interval_ms: float = 5.0) -> Values:
    return {
        "data": np.stack([M, D, np.zeros(T.size)], axis=1), "isi": interval_ms, "isi_units": "ms",
        "labels": np.array(["Elbow torque", "Elbow angle", "Stim"]), "start_sample": 0.0,
        "units": np.array(["N-m", "deg", "Volts"]),
    }  # fmt: skip


def spike2(torque_unit: str = "Nm", scale: float = 1.0) -> Values:
    """Return a structure for each channel, the angle at another rate and with its times."""

    def wave(title: str, unit: str, start_s: float, rate_hz: float, values: np.ndarray) -> dict:
        return {"title": title, "comment": "No comment", "interval": 1.0 / rate_hz, "scale": 1.0,
                "offset": 0.0, "units": unit, "start": start_s, "length": float(values.size),
                "values": values[:, None]}  # fmt: skip

    angle = wave("Angle", " deg", LATE_S, SLOW_HZ, SLOW_DEG) | {"times": SLOW_S[:, None]}
    keyboard = {"title": "Keyboard", "resolution": 1e-5, "length": 2.0, "times": np.array([[1.0]]),
                "codes": np.zeros((2, 4), np.uint8)}  # fmt: skip
    return {"elbow_Ch1": wave("Torque", torque_unit, 0.0, RATE_HZ, scale * M), "elbow_Ch2": angle,
            "elbow_Ch31": keyboard, "file": {"name": "elbow.smr", "start": [0.0, 1.0]}}  # fmt: skip


def dspace(units: Sequence[str] = ("Nm", "deg")) -> Values:
    """Return a measurement of ControlDesk: channels in `Y`, each with a raster of times in `X`."""
    x = [
        {"Name": "", "Type": "FloatNC", "Data": stamps[None], "Unit": "s"} for stamps in (T, SLOW_S)
    ]
    y = [
        {"Name": name, "Type": "FloatNC", "Data": values[None], "Unit": unit, "XIndex": raster}
        for name, unit, values, raster in (
            ('"Model Root"/"Sensor"/"Torque"', units[0], M, 1),
            ('"Model Root"/"Encoder"/"Angle"', units[1], SLOW_DEG, 2),
        )
    ]
    return {"elbow_001": {"X": structures(*x), "Y": structures(*y), "Description": "",
                          "Capture": {"SamplingPeriod": 0.005}}}  # fmt: skip


def simulink(labels: Sequence[str] = ("Torque [Nm]", "Angle [deg]")) -> Values:
    """Return what a To Workspace block logs as a structure with time."""
    signals = [
        {"values": values[:, None], "dimensions": 1.0, "label": label, "blockName": f"m/{label}"}
        for values, label in zip((M, D), labels, strict=True)
    ]
    return {"simout": {"time": T[:, None], "signals": structures(*signals), "blockName": "m/log"}}


def by_hand(field: str = "fs") -> Values:
    """Return an array of structures, each channel with its own rate."""
    return {"ch": structures(
        {"name": "Torque", "unit": "Nm", field: RATE_HZ, "data": M},
        {"name": "Angle", "unit": "deg", field: SLOW_HZ, "data": D[::2]},
    )}  # fmt: skip


def two_rates() -> Values:
    """Return a structure for each channel, named after it, with its own rate."""
    angle = {"data": D[::2], "unit": "deg", "fs": SLOW_HZ}
    return {
        "S01": {"torque": {"data": M, "unit": "Nm", "fs": RATE_HZ}, "angle": angle, "age": 60.0}
    }


def of_one_clock(time: str, stamps: object) -> Values:
    """Return an array of structures beside the time, or the rate, of all."""
    channels = structures({"label": "Torque", "units": "Nm", "values": M},
                          {"label": "Angle", "units": "deg", "values": D})  # fmt: skip
    return {"rec": {time: stamps, "channels": channels, "date": "1 May"}}


def matrix(**more: object) -> Values:
    """Return a matrix with the names and units of its columns beside it."""
    return {"labels": _cells("Torque", "Angle"), "units": _cells("Nm", "deg"),
            "data": np.stack([M, D], axis=1), **more}  # fmt: skip


def _cells(*texts: str) -> np.ndarray:
    return np.array([texts], dtype=object)


def write_timeseries(path: Path, *, implicit: bool) -> None:
    """Write two objects of the class `timeseries` as mat-io writes objects.

    MATLAB keeps even stamps as their start and increment, with `Time_` empty.
    """
    from matio.utils.matclass import MatlabOpaque

    def series(name: str, unit: str, values: np.ndarray) -> object:
        about = {"Units": "seconds", "Start_": np.array([[0.0]]), "Length": np.array([[4000.0]]),
                 "Increment_": np.array([[0.005]])}  # fmt: skip
        stamps = np.empty((0, 0)) if implicit else T[:, None]
        parts = {"Name": name, "Data_": values[:, None], "Time_": stamps,
                 "TimeInfo": MatlabOpaque(about, "tsdata.timemetadata"),
                 "DataInfo": MatlabOpaque({"Units": unit}, "tsdata.datametadata")}  # fmt: skip
        return MatlabOpaque(parts, "timeseries")

    matlab.save(path, M=series("Torque", "Nm", M), phi=series("Angle", "deg", D))


def write_mat73(path: Path, values: Values) -> None:
    """Write structures, arrays of them and text as MATLAB 7.3 does, in HDF5."""
    import h5py
    from tests.archive_files import mark_mat73

    with h5py.File(path, "w", userblock_size=512) as file:
        _put(file, file.create_group("#refs#"), values)
    mark_mat73(path)


def _put(group, kept, values: Values) -> None:
    import h5py

    for name, value in values.items():
        if isinstance(value, dict):
            inner = group.create_group(name)
            inner.attrs["MATLAB_class"] = np.bytes_(b"struct")
            _put(inner, kept, value)
        elif isinstance(value, np.ndarray) and value.dtype.names:
            inner = group.create_group(name)
            inner.attrs["MATLAB_class"] = np.bytes_(b"struct")
            for field in value.dtype.names:
                places = [f"{len(kept) + k}" for k in range(value.size)]
                _put(kept, kept, dict(zip(places, value[field].reshape(-1), strict=True)))
                references = [kept[place].ref for place in places]
                inner.create_dataset(field, data=[references], dtype=h5py.ref_dtype)
        else:
            array = np.asarray(value)
            text = array.dtype.kind == "U"
            if text:
                width = max(map(len, array.reshape(-1)))
                rows = [text.ljust(width) for text in array.reshape(-1)]
                array = np.array([[ord(letter) for letter in row] for row in rows], np.uint16)
            group[name] = np.atleast_2d(array).T
            group[name].attrs["MATLAB_class"] = np.bytes_(b"char" if text else b"double")


def _entry(values: Values) -> tuple:
    return lambda path: save(path, **values)


EXPORTS: Mapping[str, tuple] = {
    "MATLAB of LabChart": (_entry(labchart()),),
    "MATLAB of LabChart, two blocks": (_entry(labchart(blocks=2)),),
    "MATLAB of LabChart, no unit": (_entry(labchart(units=("*", "deg"))), "'Torque' is stated no"),
    "MATLAB of LabChart, 16 bits": (
        _entry({**labchart(), "scaleunits": np.ones((2, 1)), "scaleoffset": np.zeros((2, 1))}),
        "as single or double precision",
    ),
    "MATLAB of AcqKnowledge": (_entry(acqknowledge()),),
    "MATLAB of Spike2, two clocks": (_entry(spike2()),),
    "MATLAB of Spike2 in volts": (_entry(spike2(" volt")), "--scale"),
    "MATLAB of dSPACE, two clocks": (_entry(dspace()),),
    "MATLAB of dSPACE, no unit": (_entry(dspace(units=("", "deg"))), "is stated no"),
    "MATLAB of Simulink": (_entry(simulink()),),
    "MATLAB of Simulink, no units": (_entry(simulink(("Torque", "Angle"))), "is stated no"),
    "MATLAB array of structures, two rates": (_entry(by_hand()),),
    "MATLAB array of structures, a rate": (_entry(of_one_clock("fs", RATE_HZ)),),
    "MATLAB array of structures, a time": (_entry(of_one_clock("t_ms", MILLI * T)),),
    "MATLAB structures, two rates": (_entry(two_rates()),),
    "MATLAB matrix with labels": (_entry(matrix(fs=RATE_HZ)),),
    "MATLAB matrix with headings": (
        _entry({"rec": {"data": np.stack([T, M, D], axis=1),
                        "colheaders": _cells("t [s]", "M [Nm]", "phi [deg]")}}),
    ),
    "MATLAB matrix beside its time": (_entry(matrix(t_ms=MILLI * T)),),
    "MATLAB, a force and its lever arm": (_entry({"t_s": T, "F_N": M / 0.2, "phi_deg": D,
                                                  "lever_arm_m": 0.2}),),
    "MATLAB structures beside their time": (
        _entry({"rec": {"t_s": T, "torque": {"data": M, "units": "Nm"},
                        "angle": {"data": D, "units": "deg"}}}),
    ),
    "MATLAB timeseries": (lambda path: write_timeseries(path, implicit=False),),
    "MATLAB timeseries, even stamps": (lambda path: write_timeseries(path, implicit=True),),
    "MATLAB 7.3 of LabChart": (lambda path: write_mat73(path, labchart(blocks=2)),),
    "MATLAB 7.3 of AcqKnowledge": (lambda path: write_mat73(path, acqknowledge()),),
    "MATLAB 7.3 of dSPACE": (lambda path: write_mat73(path, dspace()),),
    "MATLAB 7.3, array of structures": (lambda path: write_mat73(path, by_hand()),),
}  # fmt: skip
"""What writes each, and a part of the refusal where there must be one."""
