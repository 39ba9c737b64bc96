"""A known joint as text that programs export, in languages and with marks of thousands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from tests.dialects import (
    ANGLE_DEG,
    MILLI,
    SEED,
    TIME_S,
    TORQUE_NM,
    VELOCITY_RAD_S,
    Dialect,
    csv,
    rows,
)
from tests.known_joint import angle_rad

T, M, D = TIME_S, TORQUE_NM, ANGLE_DEG
W = np.degrees(VELOCITY_RAD_S)
CAMERA_HZ, FIRST_FRAME = 100.0, 26
"""Frames are counted from 1; the first one is 0.25 s after the beginning."""
FRAMES = np.arange(FIRST_FRAME, FIRST_FRAME + 1900)
CAMERA_DEG = np.degrees(angle_rad((FRAMES - 1) / CAMERA_HZ, SEED))
_STILL = np.random.default_rng(5).normal(size=(2, 1900))


def vicon(moment: str = "N.mm", angle: str = "deg") -> str:
    """Return a device of two samples a frame and the angles of a model, as Nexus exports them."""
    # Before its first frame the device has samples that the cameras do not have.
    count = np.arange(T.size)
    device = rows(count // 2 + 1, count % 2, MILLI * M, M)
    model = rows(FRAMES, 0 * FRAMES, CAMERA_DEG, *_STILL)
    return (
        "Devices\n200\n,,Elbow cell - Moment,Elbow cell - Voltage\n"
        f"Frame,Sub Frame,Mz,1\n,,{moment},V\n{device}\n"
        "Model Outputs\n100\n,,S01:RElbowAngles,,\n"
        f"Frame,Sub Frame,X,Y,Z\n,,{angle},{angle},{angle}\n{model}"
    )


def vicon_plate() -> str:
    """Return a plate of three forces and three moments, of which one, and one angle, belong."""
    count, still = np.arange(T.size), np.zeros(T.size)
    forces = (M / 0.2, still + 1, 700 + np.sin(T))
    plate = rows(count // 2 + 1, count % 2, *forces, still + 3, np.cos(T), MILLI * M)
    return (
        "Devices\n200\n,,Plate #1 - Force,,,Plate #1 - Moment,,\n"
        f"Frame,Sub Frame,Fx,Fy,Fz,Mx,My,Mz\n,,N,N,N,N.mm,N.mm,N.mm\n{plate}\n"
        + vicon()[vicon().index("Model") :]
    )


def european(text: str) -> str:
    """Return text with semicolons and decimal commas."""
    return text.replace(",", ";").replace(".", ",")


def qualisys(names: Sequence[str], *, heading: bool) -> str:
    """Return analogue channels as Qualisys Track Manager exports them."""
    head = (
        "NO_OF_SAMPLES\t4000\nNO_OF_ANALOG\t2\nFREQUENCY\t200\nDESCRIPTION\t--\n"
        "TIME_STAMP\t2024-05-06, 10:11:12.500\t1234.5\nDATA_INCLUDED\tANALOG\n"
        + "\t".join(["CHANNEL_NAMES", *names]) + "\n"
    )  # fmt: skip
    if not heading:
        return head + rows(M, D, mark="\t")
    return head + "\t".join(["Sample", "Time", *names]) + "\n" + rows(
        np.arange(1, T.size + 1), T, M, D, mark="\t"
    )  # fmt: skip


def biodex(mark: str, units: Sequence[str], *columns: np.ndarray) -> str:
    head = "Biodex System 4\nPatient: S 01\nJoint: Elbow\nSide: Right\n\n"
    names = mark.join(["mSec", "TORQUE", "POSITION", "POS(ANAT)", "VELOCITY"])
    return head + names + "\n" + mark.join(units) + "\n" + rows(*columns, mark=mark)


def grouped(head: str, thousands: str, decimal: str, mark: str, quote: str = "") -> str:
    """Return a time in ms and a torque in N·mm with a mark between thousands."""

    def cell(value: float, digits: int) -> str:
        text = f"{value:,.{digits}f}".replace(",", "&").replace(".", decimal)
        return quote + text.replace("&", thousands) + quote

    lines = (
        mark.join([cell(t, 0), cell(m, 1), cell(d, 4)])
        for t, m, d in zip(MILLI * T, 1e6 * M, MILLI * D, strict=True)
    )
    return head + "\n" + "\n".join(lines) + "\n"


_GROUPED_HEAD = ("time [ms]", "torque [uNm]", "angle [mdeg]")
_TAB, _SEMICOLON, _COMMA = (mark.join(_GROUPED_HEAD) for mark in "\t;,")
_BIODEX = (MILLI * T, M, D + 60.0, 90.0 - (D + 60.0), W)

EXPORTED_TEXT: Mapping[str, Dialect] = {
    "Vicon Nexus, two rates": Dialect("r.csv", vicon().encode()),
    "Vicon Nexus, mm.N": Dialect("r.csv", vicon("mm.N").encode()),
    "Vicon Nexus in volts": Dialect("r.csv", vicon("V").encode(), refused="--scale"),
    "Vicon Nexus, saved by a spreadsheet": Dialect(
        "r.csv",
        vicon().replace("Devices\n200\n", "Devices,,,\n200,,,\n")
        .replace("\n\nModel", "\n,,,\nModel").encode(),
    ),
    "Vicon Nexus, three axes of each": Dialect("r.csv", vicon_plate().encode()),
    "Vicon Nexus, decimal commas and N.mm": Dialect(
        "r.csv", european(vicon()).replace("N,mm", "N.mm").encode()
    ),
    "a rate in a comment": Dialect("r.csv", csv("# fs = 0.2 kHz\nTorque (Nm),Angle (deg)", M, D)),
    "a rate with its unit before it": Dialect(
        "r.csv",
        csv("Abtastrate [Hz];200\nDauer [s];20\nDrehmoment [Nm];Winkel [Grad]", M, D, mark=";",
            decimal=","),
    ),
    "an interval in the head": Dialect(
        "r.csv", csv("Sampling interval: 5 ms\nTorque (Nm),Angle (deg)", M, D)
    ),
    "units above the names": Dialect("r.csv", csv("s;Nm;deg\nt;M;phi", T, M, D, mark=";")),
    "Qualisys": Dialect(
        "r.tsv", qualisys(("Torque (Nm)", "Angle (deg)"), heading=True).encode()
    ),
    "Qualisys, the names in the block alone": Dialect(
        "r.tsv", qualisys(("Torque (Nm)", "Angle (deg)"), heading=False).encode()
    ),
    "Qualisys, no units": Dialect(
        "r.tsv", qualisys(("Torque", "Angle"), heading=True).encode(),
        refused="'Torque' is stated no",
    ),
    "Biodex": Dialect(
        "r.txt", biodex("\t", ["", "N-M", "DEG", "DEG", "DEG/SEC"], *_BIODEX).encode()
    ),
    "Biodex, blanks and foot-pounds": Dialect(
        "r.txt",
        biodex("  ", ["mSec", "FT-LBS", "DEG", "DEG", "DEG/SEC"], 
               _BIODEX[0], M / 1.3558179483314004, *_BIODEX[2:]).encode(),
    ),
    "Dutch": Dialect(
        "r.csv", csv("tijd [s];koppel [Nm];hoek [graden]", T, M, D, mark=";", decimal=",")
    ),
    "Dutch, units behind": Dialect(
        "r.txt", csv("Tijd in milliseconden\tElleboogkoppel (Nm)\thoeksnelheid (graden/s)",
                     MILLI * T, M, W, mark="\t"),
    ),
    "1,234.5 between tabs": Dialect("r.txt", grouped(_TAB, ",", ".", "\t").encode()),
    "1,234.5 in quotes": Dialect("r.csv", grouped(_COMMA, ",", ".", ",", '"').encode()),
    "1.234,5": Dialect("r.csv", grouped(_SEMICOLON, ".", ",", ";").encode()),
    "1 234,5": Dialect("r.csv", grouped(_SEMICOLON, " ", ",", ";").encode()),
    "1 234,5 with blanks that do not break": Dialect(
        "r.csv", grouped(_SEMICOLON, "\u202f", ",", ";").encode()
    ),
    "1'234.5": Dialect("r.csv", grouped(_SEMICOLON, "'", ".", ";").encode()),
    "1,234.5 without quotes": Dialect(
        "r.csv", grouped(_COMMA, ",", ".", ",").encode(),
        refused="without a comma between thousands",
    ),
}  # fmt: skip
