"""One recording of a known joint, written as many programs and laboratories write it.

Each dialect is the text of a file in the layout of the program that is named, with the options that
a person would add for what no file says, and what must come of it.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from tests.known_joint import angle_rad, torque_nm

RATE_HZ, SEED = 200.0, 1
TIME_S = np.arange(4000) / RATE_HZ
TORQUE_NM = torque_nm(TIME_S, SEED)
ANGLE_RAD = angle_rad(TIME_S, SEED)
VELOCITY_RAD_S = angle_rad(TIME_S, SEED, 1)
ANGLE_DEG = np.degrees(ANGLE_RAD)
MILLI = 1e3


@dataclass(frozen=True)
class Dialect:
    """A file, what a person says of it, and a part of the refusal where it must be refused."""

    file: str
    content: bytes
    said: Mapping[str, object] = field(default_factory=dict)
    refused: str = ""


@functools.cache
def _written(column: bytes, decimal: str, digits: int) -> list[str]:
    """Return the numbers of a column as text; many dialects share a column."""
    values = np.frombuffer(column).tolist()
    return [f"{value:.{digits}g}".replace(".", decimal) for value in values]


def rows(*columns, mark=",", decimal=".", end="", digits=9) -> str:
    made = [np.asarray(column, dtype=np.float64).tobytes() for column in columns]
    lists = [_written(column, decimal, digits) for column in made]
    return "\n".join(mark.join(row) + end for row in zip(*lists, strict=True)) + "\n"


def csv(head: str, *columns, **more) -> bytes:
    return (head + "\n" + rows(*columns, **more)).encode("utf-8")


T, M, A, D, W = TIME_S, TORQUE_NM, ANGLE_RAD, ANGLE_DEG, VELOCITY_RAD_S
_NOISE = np.random.default_rng(3).normal(size=(2, T.size))
_LABVIEW = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\n"
    "Decimal_Separator\t.\nMulti_Headings\tNo\nX_Columns\tOne\nTime_Pref\tRelative\n"
    "Operator\tlab\nDate\t2024/03/01\nTime\t10:11:12.5\n***End_of_Header***\t\n\t\n"
    "Channels\t2\t\t\nSamples\t4000\t4000\t\nDate\t2024/03/01\t2024/03/01\t\n"
    "Time\t10:11:12.5\t10:11:12.5\t\nY_Unit_Label\tN-m\tdeg\t\nX_Dimension\tTime\tTime\t\n"
    "X0\t0.0E+0\t0.0E+0\t\nDelta_X\t0.005\t0.005\t\n***End_of_Header***\t\t\t\n"
    "X_Value\tTorque\tAngle\tComment\n"
)
_OPENSIM = "elbow\nversion=1\nnRows=4000\nnColumns=3\ninDegrees={}\n\nendheader\n"
_BIOPAC = "elbow.acq\n5 msec/sample\n2 channels\nTorque\nNm\nElbow angle\ndeg\nsec\tCH1\tCH2\t\n"
_MONITOR = (
    "Motion Monitor export\nSubject:\tS 01\nDate:\t1/3/2024\nMeasurement rate:\t200\nTrial:\t4\n"
    "\nTime\tElbow Moment\tElbow Angle\n[s]\t[N*m]\t[deg]\n"
)
_DATES = np.datetime_as_string(
    np.datetime64("2024-03-01T10:00:00", "us") + (1e6 * T).astype("timedelta64[us]"), unit="us"
)
_DATED = "Timestamp,torque_nm,angle_deg\n" + "".join(
    f"{t},{m:.9g},{d:.9g}\n" for t, m, d in zip(_DATES, M, D, strict=True)
)

_SPIKE2 = (
    '"INFORMATION"\n"elbow.smr"\n\n"SUMMARY"\n'
    '"1"\t"Waveform"\t"Torque"\t" Nm"\t200\t200\t0.001\t0\n'
    '"2"\t"Evt+"\t"Sync"\t""\n'
    '"3"\t"Waveform"\t"Angle"\t" deg"\t200\t200\t0.001\t0\n\n'
    '"CHANNEL"\t"1"\n"Waveform"\n"No comment"\n"Torque"\n" Nm"\n"START"\t0.00000\t0.00500\n'
    + rows(M)
    + '\n"CHANNEL"\t"2"\n"Evt+"\n"No comment"\n"Sync"\n0.5\n1.5\n\n'
    '"CHANNEL"\t"3"\n"Waveform"\n"No comment"\n"Angle"\n" deg"\n"START"\t0.00000\t0.00500\n'
    + rows(D)
)

DIALECTS: Mapping[str, Dialect] = {
    "own names": Dialect("r.csv", csv("time_s,torque_nm,angle_rad", T, M, A)),
    "own names, no time": Dialect("r.csv", csv("torque_nm,angle_rad", M, A), {"rate_hz": RATE_HZ}),
    "German, Excel": Dialect(
        "r.csv",
        ("Zeit [ms];Drehmoment [Nm];Winkel [°]\r\n"
         + rows(MILLI * T, M, D, mark=";", decimal=",").replace("\n", "\r\n")).encode("cp1252"),
    ),
    "German, name and unit": Dialect(
        "r.txt", csv("Zeit in s\tDrehmoment, Nm\tEllbogenwinkel / Grad", T, M, D, mark="\t")
    ),
    "French": Dialect("r.csv", csv("temps (s),couple (N.m),angle (degrés)", T, M, D)),
    "Italian": Dialect(
        "r.csv", csv("tempo [s];coppia [N·m];angolo [gradi]", T, M, D, mark=";", decimal=",")
    ),
    "Spanish": Dialect(
        "r.csv",
        ("tiempo (ms);par (N·mm);ángulo (grados)\n"
         + rows(MILLI * T, MILLI * M, D, mark=";")).encode("latin-1"),
    ),
    "suffixes": Dialect("r.csv", csv("Time_ms,Torque_Nm,Angle_deg", MILLI * T, M, D)),
    "row of units": Dialect("r.csv", csv("Time,Torque,Angle\ns,Nm,deg", T, M, D)),
    "row of units in brackets": Dialect(
        "r.csv", csv("t;M;phi\n[ms];[mNm];[mrad]", MILLI * T, MILLI * M, MILLI * A, mark=";")
    ),
    "name and row disagree": Dialect(
        "r.csv", csv("Time,Torque,Angle (deg)\ns,Nm,rad", T, M, D), refused="say which"
    ),
    "force": Dialect("r.csv", csv("t (s),F (N),angle (deg)", T, M / 0.2, D), refused="lever arm"),
    "force with its lever arm": Dialect(
        "r.csv", csv("t (s),F (N),angle (deg)", T, M / 0.2, D), {"scale": {"torque": "0.2 m"}}
    ),
    "volts": Dialect(
        "r.csv", csv("t (s),Torque (V),angle (deg)", T, M / 2.5, D), refused="--scale"
    ),
    "volts with their calibration": Dialect(
        "r.csv", csv("t (s),Torque (mV),angle (deg)", T, MILLI * (M / 2.5 + 0.1), D),
        {"scale": {"torque": "2.5 Nm/V"}, "offset": {"torque": "0.1 V"}},
    ),
    "foot-pounds and turns a minute": Dialect(
        "r.csv", csv("Time (sec),Torque (ft-lb),Speed (rpm)", T, M / 1.3558179483314004,
                     W * 30 / np.pi, digits=12),
    ),
    "no units": Dialect(
        "r.csv", csv("time,torque,angle", T, M, D / 8), refused="'torque', 'angle' is stated no"
    ),
    "gons or degrees": Dialect(
        "r.csv", csv("time_s,torque_nm,angle (grad)", T, M, D), refused="'angle (grad)' is stated"
    ),
    "degrees stated as rad": Dialect("r.csv", csv("time_s,torque_nm,angle_rad", T, M, D)),
    "degrees about 40 stated as rad": Dialect(
        "r.csv", csv("time_s,torque_nm,Angle [rad]", T, M, D + 40)
    ),
    "ms stated as s": Dialect(
        "r.csv", csv("time_s,torque_nm,angle_rad", MILLI * T, M, A), refused="--unit time=ms"
    ),
    "ticks of half a millisecond": Dialect(
        "r.csv", csv("time,torque_nm,angle_rad", 2 * MILLI * T, M, A), refused="if it counts ticks"
    ),
    "exchanged": Dialect("r.csv", csv("time_s,torque_nm,angle_rad", T, A, M), refused="exchanged"),
    "reaction": Dialect("r.csv", csv("time_s,torque_nm,angle_rad", T, -M, A)),
    "angle reversed": Dialect("r.csv", csv("time_s,torque_nm,angle_rad", T, M, -A)),
    "two torques": Dialect(
        "r.csv", csv("t [s],Torque raw [Nm],Torque [Nm],angle [deg]", T, M, 0.9 * M, D),
        refused="2 columns may be the torque",
    ),
    "three axes": Dialect(
        "r.csv", csv("t [s],Mx [Nm],My [Nm],Mz [Nm],angle [deg]", T, *_NOISE, M, D)
    ),
    "UTF-16": Dialect("r.txt", csv("time_s\ttorque_nm\tangle_deg", T, M, D, mark="\t").decode()
                      .encode("utf-16")),
    "blanks": Dialect("r.dat", csv("t_s  M_Nm  phi_deg", T, M, D, mark="   ")),
    "blanks, decimal comma": Dialect(
        "r.asc", csv("t_s M_Nm phi_deg", T, M, D, mark=" ", decimal=",")
    ),
    "bars": Dialect("r.txt", csv("t [s]|M [Nm]|phi [deg]", T, M, D, mark="|")),
    "NumPy savetxt": Dialect("r.txt", csv("# t_s M_Nm phi_deg", T, M, D, mark=" ")),
    "LabVIEW": Dialect("r.lvm", csv(_LABVIEW.rstrip("\n"), T, M, D, mark="\t")),
    "LabVIEW, empty comments": Dialect(
        "r.lvm", csv(_LABVIEW.rstrip("\n"), T, M, D, mark="\t", end="\t")
    ),
    "OpenSim storage": Dialect(
        "r.sto", csv(_OPENSIM.format("yes") + "time\telbow_flexion\telbow_flexion_moment", T, D, M,
                     mark="\t"),
    ),
    "OpenSim motion in rad": Dialect(
        "r.mot", csv(_OPENSIM.format("no") + "time\telbow_angle\telbow_moment", T, A, M, mark="\t")
    ),
    "AcqKnowledge": Dialect(
        "r.txt", (_BIOPAC + "\t4000\t4000\t\n" + rows(T.round(2), M, D, mark="\t", end="\t"))
        .encode("cp1252"),
    ),
    "Spike2": Dialect("r.txt", _SPIKE2.encode()),
    "block of lines and units": Dialect("r.txt", (_MONITOR + rows(T, M, D, mark="\t")).encode()),
    "headerless": Dialect("r.csv", rows(T, M, D).encode(), refused="must name the columns"),
    "headerless, blanks": Dialect(
        "r.txt", rows(T, M, D, mark=" ").encode(), refused="name them with --names"
    ),
    "headerless with names": Dialect(
        "r.csv", rows(T, M, D).encode(), {"names": ("t [s]", "M [Nm]", "phi [deg]")}
    ),
    "rows to skip": Dialect(
        "r.csv", csv("junk,1,2\n0,0,0\ntime_s,torque_nm,angle_deg", T, M, D), {"skip_rows": 2}
    ),
    "trailing separator": Dialect("r.csv", csv("t_s,M_Nm,phi_deg,", T, M, D, end=",")),
    "trailing separator in the rows": Dialect("r.csv", csv("t_s,M_Nm,phi_deg", T, M, D, end=",")),
    "footer": Dialect(
        "r.csv", csv("t_s;M_Nm;phi_deg", T, M, D, mark=";") + b"\nEnd of data\nSaved by lab 3\n"
    ),
    "Excel serial days": Dialect(
        "r.csv", csv("Time,torque_nm,angle_rad", 45352.5 + T / 86400, M, A, digits=17)
    ),
    "dates": Dialect("r.csv", _DATED.encode()),
    "dates of a zone": Dialect("r.csv", re.sub(r"(?m)^(2024[^,]*)", r"\1+01:00", _DATED).encode()),
    "nanoseconds since 1970": Dialect(
        "r.csv", csv("%time,torque_nm,angle_rad", 1.7e18 + 1e9 * T, M, A, digits=17)
    ),
    "names over two lines": Dialect(
        "r.csv", csv('"Time\n(s)","Torque\n(Nm)","Angle\n(deg)"', T, M, D)
    ),
}  # fmt: skip
