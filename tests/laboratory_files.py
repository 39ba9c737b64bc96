"""Files of a known joint as laboratories keep them, each with a trap of its own."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime, timedelta

import numpy as np
from tests.dialects import (
    ANGLE_DEG,
    ANGLE_RAD,
    MILLI,
    TIME_S,
    TORQUE_NM,
    VELOCITY_RAD_S,
    Dialect,
    csv,
)
from tests.known_joint import TRUTH

T, M, D = TIME_S, TORQUE_NM, ANGLE_DEG
HALF = T.size // 2

_FILE_HEAD = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\n"
    "Decimal_Separator\t.\nMulti_Headings\tYes\nX_Columns\tOne\nTime_Pref\tRelative\n"
    "Operator\tlab\nDate\t2024/05/06\nTime\t10:11:12.5\n***End_of_Header***\t\n\t\n"
)
_BLOCK_HEAD = (
    "Channels\t2\t\t\nSamples\t2000\t2000\t\nDate\t2024/05/06\t2024/05/06\t\n"
    "Time\t10:11:12.5\t10:11:12.5\t\nY_Unit_Label\tNewton_Meters\tDegrees\t\n"
    "X_Dimension\tTime\tTime\t\nX0\t0.0E+0\t0.0E+0\t\nDelta_X\t0.005\t0.005\t\n"
    "***End_of_Header***\t\t\t\nX_Value\tTorque\tAngle\tComment"
)


LOST = np.random.default_rng(11).random(T.size) < 0.03


def _with_pauses() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return time, torque and angle of 60 s at 50/s below 2 Hz, with 0.1 s missing now and then."""
    rng = np.random.default_rng(12)
    steps = 0.02 + 0.1 * (rng.random(2400) < 0.02)
    time_s = np.cumsum(steps)
    hz = np.arange(6, 120) / 60.0
    phase, size = rng.uniform(0, 2 * np.pi, hz.size), 0.01 / (1 + hz)
    at = 2 * np.pi * hz * time_s[:, None] + phase
    angle, velocity, acceleration = (
        np.sum(size * (2 * np.pi * hz) ** k * np.cos(at + k * np.pi / 2), axis=1) for k in range(3)
    )
    torque = TRUTH @ np.array([acceleration, velocity, angle])
    return time_s, torque + 0.001 * rng.normal(size=time_s.size), np.degrees(angle)


def _block(part: slice) -> bytes:
    return csv(_BLOCK_HEAD, T[part], M[part], D[part], mark="\t", end="\t")


def _paired() -> bytes:
    """Return a file with a column of the time for each channel, the second at half the rate."""
    heads = (_FILE_HEAD + _BLOCK_HEAD).replace("X_Columns\tOne", "X_Columns\tMulti")
    for twice in ("Newton_Meters", "0.005", "2024/05/06", "10:11:12.5", "0.0E+0", "2000"):
        heads = heads.replace(f"\t{twice}\t", f"\t{twice}\t\t", 1)
    heads = heads.replace("X_Value\tTorque\tAngle", "X_Value\tTorque\tX_Value\tAngle")
    rows = [f"{t:.9g}\t{m:.9g}" for t, m in zip(T, M, strict=True)]
    slow = [f"{t:.9g}\t{d:.9g}" for t, d in zip(T[::2], D[::2], strict=True)]
    slow += ["\t"] * (len(rows) - len(slow))
    return (
        heads + "\n" + "".join(f"{a}\t{b}\t\n" for a, b in zip(rows, slow, strict=True))
    ).encode()


def _clock(mark: str, midnight_at_s: float = 5.0) -> list[str]:
    """Return times of day to the millisecond, past midnight."""
    start = datetime(2024, 5, 7) - timedelta(seconds=midnight_at_s)
    return [
        (start + timedelta(seconds=float(t))).strftime(f"%H:%M:%S{mark}%f")[:-3] for t in T.round(3)
    ]


def _lines(head: str, *columns, mark: str = ";", decimal: str = ",") -> bytes:
    def cell(value: object) -> str:
        return value if isinstance(value, str) else f"{value:.6f}".replace(".", decimal)

    rows = (mark.join(map(cell, row)) for row in zip(*columns, strict=True))
    return "\n".join([head, *rows]).encode()


def _each_its_time() -> bytes:
    """Return a torque and an angle of half the rate as Delsys writes them."""
    slow = [f"{t:.6f},{d:.9g}" for t, d in zip(T[::2], D[::2], strict=True)]
    slow += [","] * (T.size - len(slow))
    rows = (f"{t:.6f},{m:.9g},{late}" for t, m, late in zip(T, M, slow, strict=True))
    return "\n".join(["X[s],Torque [Nm],X[s],Elbow angle [deg]", *rows]).encode()


_RESTART_S = np.concatenate([T[:HALF], T[:HALF]])
_NOISE = np.random.default_rng(4).normal(size=T.size)
_GERMAN = csv("Messung;Ellbogen rechts\nDatum;06.05.2024\n\nZeit [s];Drehmoment [Nm];Winkel [Grad]",
              T, M, D, mark=";", decimal=",")  # fmt: skip

LABORATORY: Mapping[str, Dialect] = {
    "LabVIEW, two blocks": Dialect(
        "r.lvm", _FILE_HEAD.encode() + _block(slice(HALF)) + b"\n" + _block(slice(HALF, None))
    ),
    "LabVIEW, a time for each channel": Dialect("r.lvm", _paired()),
    "German, UTF-16, a footer with numbers": Dialect(
        "r.csv",
        (_GERMAN.decode() + "\nEnde der Messung\nMittelwert;0,123;0,456\n").encode("utf-16"),
    ),
    "times of day, past midnight": Dialect(
        "r.csv", _lines("Uhrzeit;Drehmoment (Nm);Winkel (°)", _clock(","), M, D)
    ),
    "date and time of day apart": Dialect(
        "r.csv",
        _lines("Date,Time,Torque (Nm),Angle (deg)", ["2024-05-06"] * T.size, _clock("."), M, D,
               mark=",", decimal="."),
    ),
    "two angles, the second first": Dialect(
        "r.csv", csv("t [s],angle2 [deg],angle1 [deg],torque [Nm]", T, 30 + np.sin(T), D, M)
    ),
    "a name twice": Dialect(
        "r.csv", csv("Time (s),Torque (Nm),Angle (deg),Torque (Nm)", T, M, D, _NOISE)
    ),
    "counts, the gain in a comment": Dialect(
        "r.csv",
        csv("# torque gain: 0.001 Nm/count\ntime_ms,torque_counts,angle_deg", MILLI * T,
            (1e3 * M).round(), D),
        refused="--scale",
    ),
    "counts, the gain in the comment as it stands": Dialect(
        "r.csv",
        csv("# torque gain: 1e-6 Nm/count\ntime_ms,torque_counts,angle_deg", MILLI * T,
            (1e6 * M).round(), D),
        {"scale": {"torque": "1e-6 Nm/count"}},
    ),
    "encoder counts": Dialect(
        "r.csv", csv("t_s,torque_Nm,angle [counts]", T, M, (1e5 * D).round()),
        {"scale": {"angle": "1e-5 deg/count"}},
    ),
    "counts with their gain": Dialect(
        "r.csv", csv("time_ms,torque_counts,angle_deg", MILLI * T, (1e6 * M).round(), D),
        {"scale": {"torque": "1e-6 Nm"}},
    ),
    "the time starts anew with each trial": Dialect(
        "r.csv",
        csv("Trial,time (s),torque (Nm),angle (deg)", np.repeat([1, 2], HALF), _RESTART_S, M, D),
    ),
    "degrees stated as rad, a short trial at the end": Dialect(
        "r.csv",
        csv("Trial,time_s,torque_nm,angle_rad", np.repeat([1, 2], [T.size - 800, 800]),
            np.concatenate([T[:-800], T[:800]]), M, D / 8),
        refused="unusually fast",
    ),
    "a short trial at the beginning": Dialect(
        "r.csv",
        csv("Trial,time (s),torque (Nm),angle (deg)", np.repeat([2, 1], [800, T.size - 800]),
            np.concatenate([T[:800], T[:-800]]), M, D),
    ),
    "sample numbers, the rate in a line of text": Dialect(
        "r.csv", csv("Sampling rate: 200 Hz\nSample,Torque (Nm),Angle (deg)", np.arange(T.size), M,
                     D),
    ),
    "milliseconds since 1970": Dialect(
        "r.csv", csv("timestamp,torque (Nm),angle (deg)", 1.714e12 + MILLI * T, M, D, digits=16)
    ),
    "LabChart": Dialect(
        "r.txt",
        csv("Interval=\t5 ms\nExcelDateTime=\t4.5418E+04\t06/05/2024 10:19:12\nTimeFormat=\tStart "
            "of block\nChannelTitle=\tTorque\tAngle\nRange=\t10 V\t10 V\nUnitName=\tNm\tdeg",
            T, M, D, mark="\t"),
    ),
    "LabChart, two blocks": Dialect(
        "r.txt",
        2 * csv("Interval=\t5 ms\nChannelTitle=\tTorque\tAngle\nUnitName=\tNm\tdeg", T, M, D,
                mark="\t"),
        refused="2 blocks of LabChart",
    ),
    "a time for each channel, two rates": Dialect("r.csv", _each_its_time()),
    "decimal commas in quotes": Dialect(
        "r.csv", _lines('"temps (s)","couple (Nm)","angle (degré)"', *(
            [f'"{value:.6f}"'.replace(".", ",") for value in column] for column in (T, M, D)
        ), mark=","),
    ),
    "names behind a per cent sign, small units": Dialect(
        "r.txt", csv("% rate 200 Hz\n% t_us torque_mNm angle_mdeg", 1e6 * T, MILLI * M, MILLI * D,
                     mark="  ", digits=10),
    ),
    "the lever arm in the head": Dialect(
        "r.csv", b"Lever arm: 0.2 m\nSubject: 3\n" + csv("t (s),F (N),angle (deg)", T, M / 0.2, D)
    ),
    "the lever arm in a German comment": Dialect(
        "r.csv", b"# Hebelarm [cm]: 20,0\n" + csv("t [s];Kraft [N];Winkel [°]", T, M / 0.2, D,
                                                          mark=";"),
    ),
    "two lever arms": Dialect(
        "r.csv",
        b"Lever arm: 0.2 m\nLever arm: 0.3 m\n" + csv("t (s),F (N),angle (deg)", T, M / 0.2, D),
        refused="lever arm",
    ),
    "an angle from 0 to 360 degrees": Dialect(
        "r.csv", csv("t [s],M [Nm],phi [deg]", T, M, (D + 2.0) % 360)
    ),
    "an angle from -pi to pi": Dialect(
        "r.csv", csv("t [s],M [Nm],phi [rad]", T, M, (ANGLE_RAD + 2 * np.pi) % (2 * np.pi) - np.pi)
    ),
    "an angle that drops to 0": Dialect(
        "r.csv",
        csv("t [s],M [Nm],phi [deg]", T, M, np.where(np.arange(T.size) % 50, D + 340.0, 0.0)),
    ),
    "a torque lost in single rows, written as 0": Dialect(
        "r.csv", csv("t [s],M [Nm],phi [deg]", T, np.where(LOST, 0.0, M), D)
    ),
    "an angle lost in single rows, written as 0": Dialect(
        "r.csv", csv("t [s],M [Nm],phi [deg]", T, M, np.where(LOST, 0.0, D))
    ),
    "a torque that overflows to -9.99": Dialect(
        "r.csv",
        csv("t [s],M [Nm],phi [deg]", T, np.where(np.isin(np.arange(T.size), (900, 2100, 3333)),
            -9.99, M), D),
    ),
    "a torque of -999 after its unit was given": Dialect(
        "r.csv",
        csv("t [s],M,phi [deg]", T, np.where(LOST, -999.0, M), D),
        {"unit": {"torque": "Nm"}},
    ),
    "an angle of 32767": Dialect(
        "r.csv", csv("t [s],M [Nm],phi [deg]", T, M, np.where(LOST, 32767.0, D))
    ),
    "a bridge in mV/V": Dialect(
        "r.csv", csv("t [s],torque cell [mV/V],phi [deg]", T, M / 0.5, D),
        {"scale": {"torque": "0.5 Nm/(mV/V)"}},
    ),
    "a bridge in mV/V, of which the scale says nothing": Dialect(
        "r.csv", csv("t [s],torque cell [mV/V],phi [deg]", T, M / 0.5, D),
        {"scale": {"torque": "0.5 Nm"}}, refused="NUMBER Nm/(mV/V)",
    ),
    "a motor's current": Dialect(
        "r.csv", csv("t [s],iq [A],phi [deg]", T, M / 0.62, D),
        {"column": {"torque": "iq [A]"}, "scale": {"torque": "0.62 Nm/A"}},
    ),
    "a current of the axis q, and a constant": Dialect(
        "r.csv",
        csv("t [s],M [Nm],phi [deg],q-axis [A],torque constant [Nm/A]", T, M, D, M / 0.62, 0 * T),
    ),
    "a raw speed": Dialect(
        "r.csv", csv("t [s],M [Nm],speed (raw)", T, M, VELOCITY_RAD_S / 0.25),
        {"scale": {"velocity": "0.25 rad/s"}},
    ),
    "factors in the head": Dialect(
        "r.csv",
        csv("# torque cell: 1.7 Nm/V\n# goniometer: 20 deg/V\nt [s],torque (V),angle (V)",
            T, M / 1.7, D / 20),
        refused="--scale 'angle=20 deg/V' (as the file states)",
    ),
    "a slow motion with pauses": Dialect("r.csv", csv("t [s],M [Nm],phi [deg]", *_with_pauses())),
    "decimated after the rate of the head": Dialect(
        "r.csv",
        csv("# Sampling rate: 1000 Hz, decimated by 5 for export\ntorque [Nm],angle [rad]", M,
            ANGLE_RAD),
        refused="say --rate-hz",
    ),
    "averaged after the rate of the head": Dialect(
        "r.csv",
        csv("# Sampling rate: 1000 Hz, averaged over 5 samples\ntorque [Nm],angle [rad]", M,
            ANGLE_RAD),
        refused="say --rate-hz",
    ),
    "two rates in the head": Dialect(
        "r.csv",
        csv("# Sample rate: 1000 Hz\n# Stored rate: 200 Hz\ntorque [Nm],angle [rad]", M, ANGLE_RAD),
        refused="say --rate-hz",
    ),
    "decimated from another rate": Dialect(
        "r.csv",
        csv("# Sampling rate: 200 Hz (decimated from 1000 Hz)\ntorque [Nm],angle [rad]", M,
            ANGLE_RAD),
    ),
    "decimated, beside a time": Dialect(
        "r.csv",
        csv("# Sampling rate: 1000 Hz\n# downsampled by 5\nt [s],torque [Nm],angle [deg]", T, M, D),
    ),
    "decimation 1": Dialect(
        "r.csv", csv("# Decimation: 1\n# fs = 200 Hz\ntorque [Nm],angle [deg]", M, D)
    ),
    "a velocity in degrees, stated as rad/s, beside an angle": Dialect(
        "r.csv",
        csv("t [s],M [Nm],phi [rad],omega [rad/s]", T, M, ANGLE_RAD, np.degrees(VELOCITY_RAD_S)),
    ),
    "a velocity in rad/s, stated as degrees, beside an angle": Dialect(
        "r.csv", csv("t [s],M [Nm],phi [rad],omega [deg/s]", T, M, ANGLE_RAD, VELOCITY_RAD_S)
    ),
    "a velocity with the other sign beside an angle": Dialect(
        "r.csv", csv("t [s],M [Nm],phi [rad],omega [rad/s]", T, M, ANGLE_RAD, -VELOCITY_RAD_S),
        refused="--scale velocity=-1",
    ),
    "an angle and a velocity at twice the rate": Dialect(
        "r.csv",
        csv("# fs = 400 Hz\nM [Nm],phi [rad],omega [rad/s]", M, ANGLE_RAD, VELOCITY_RAD_S),
        refused="check both units and the rate",
    ),
    "velocity alone, reaction": Dialect(
        "r.csv",
        csv("t_ms;Mz_Nm;omega_deg_s", MILLI * T, -M, np.degrees(VELOCITY_RAD_S), mark=";"),
    ),
}  # fmt: skip
