"""An analysis needs no processes, threads, sockets or locks, as in a browser's Python."""

import subprocess
import sys
from pathlib import Path

import numpy as np
from tests.known_joint import INERTIA_KG_M2, angle_rad, torque_nm

PROGRAM = """
import builtins, sys

import_ = builtins.__import__
ABSENT = {"multiprocessing", "concurrent", "threading", "socket", "mmap", "fcntl"}


def without(name, globals=None, *rest, **named):
    importer = (globals or {}).get("__name__", "")
    if name.split(".")[0] in ABSENT and importer.startswith("rigidimeter"):
        raise ModuleNotFoundError(f"{importer} imports {name}")
    return import_(name, globals, *rest, **named)


builtins.__import__ = without
import numpy as np
import rigidimeter as rm

path, out = sys.argv[1:]
recording = rm.read(path, epoch_length_s=10.0, column={"condition": "condition"})
channels = {name: channel.values for name, channel in recording.epochs[0].channels.items()}
fit = rm.identify(**channels, rate_hz=200.0)
estimates = rm.estimate(recording)
compared = rm.compare(estimates)
rm.report(recording, out)
print(fit.inertia_kg_m2, len(estimates.table()), len(compared.table()))
"""


def test_a_csv_is_read_estimated_compared_and_reported(tmp_path: Path) -> None:
    time_s = np.arange(8000) / 200.0
    rows = np.column_stack([time_s, torque_nm(time_s), angle_rad(time_s)])
    named = ["OFF"] * 4000 + ["DBS"] * 4000
    lines = (f"{t:.3f},{m:.9f},{q:.9f},{c}" for (t, m, q), c in zip(rows, named, strict=True))
    path = tmp_path / "elbow.csv"
    path.write_text("\n".join(["time_s,torque_nm,angle_rad,condition", *lines]) + "\n")
    command = [sys.executable, "-c", PROGRAM, str(path), str(tmp_path / "report")]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr[-2000:]
    inertia_kg_m2, epochs, measures = map(float, ran.stdout.split())
    assert abs(inertia_kg_m2 - INERTIA_KG_M2) < 0.02 * INERTIA_KG_M2
    assert (epochs, measures) == (4, 3)
    assert (tmp_path / "report" / "report.html").is_file()
