"""The inputs: fixed sessions and a small study on the virtual rig, and tables of ratings.

Everything random has a fixed seed. Settings lie beside the numbers, with what is said here in
addition; the examples of the repository may change.
"""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.io

__all__ = ["RATED", "Workspace", "shared_data"]

ROOT = Path(__file__).parents[2]
KERNELS = "Haswell"
"""OpenBLAS has kernels for each family of processors, which add up in other orders, and then
numbers differ by up to 2e-6. Every x86-64 processor with AVX2 can use these."""
SETTINGS = ROOT / "tests" / "reference" / "numbers" / "settings"
SCORES = ROOT / "tests" / "reference" / "mixed" / "scores.csv"
RATED = {
    "unbalanced": ("examiner",),
    "three": ("examiner",),
    "nested": ("subject", "subject/day"),
    "no_days": ("subject", "subject/day"),
    "crossed": ("examiner", "subject"),
}
"""Sets of ratings in that table, and what has a random offset."""

SHORT = """
[protocol]
rests_s = [1.0]
return_s = 1.0
"""
SESSIONS = {
    "day-1": ("study.toml", 7, ""),
    "day-2": ("study.toml", 8, ""),
    "elbow": ("human-elbow.toml", 3, SHORT),
    "paper-rates": ("paper-rates.toml", 4, SHORT),
    "pushing": ("", 5, "[subject.OFF]\nvoluntary_sd_nm = 0.2\n" + SHORT),
}
"""Sessions by name: the settings they are made from, the seed, and further settings."""
BLOCKS = {
    "elbow": (("prbs", "OFF", 2), ("prbs", "DBS", 2)),
    "paper-rates": (("prbs", "OFF", 2), ("sinusoid", "OFF", 1)),
    "pushing": (("prbs", "OFF", 3),),
}

STUDY = """\
schema = "rigidimeter.study/1"
title = "Small study"
reference = "OFF"
other = "DBS"
[conditions.OFF]
title = "stimulation off"
[conditions.DBS]
title = "stimulation on"
"""
SUBJECT = """\
[subject.{condition}]
inertia_kg_m2 = {inertia}
damping_nm_s_rad = {damping}
stiffness_nm_rad = {stiffness}
damping_cv_percent = 12.0
stiffness_cv_percent = 15.0
voluntary_sd_nm = 0.02
"""
DAYS = (
    ("M1", "1", "OFF", 0.00450, 0.1400, 1.80),
    ("M1", "2", "OFF", 0.00452, 0.1300, 1.65),
    ("M1", "2", "DBS", 0.00452, 0.1150, 1.40),
    ("M1", "3", "OFF", 0.00447, 0.1450, 1.90),
    ("M1", "3", "DBS", 0.00447, 0.1200, 1.50),
    ("M1", "4", "DBS", 0.00455, 0.1100, 1.35),
    ("M2", "1", "OFF", 0.00520, 0.1600, 2.10),
    ("M2", "2", "OFF", 0.00515, 0.1500, 1.95),
    ("M2", "2", "DBS", 0.00515, 0.1350, 1.70),
    ("M2", "3", "DBS", 0.00525, 0.1300, 1.60),
)
"""The small study: subject, day, condition, and the joint of that day."""
SCORED = {
    "A": (2.0, 2.0, 1.0, 2.5, 1.5, 1.0, 2.5, 2.0, 2.0, 1.5),
    "B": (2.5, 2.0, 1.5, 2.5, 2.0, 1.5, 3.0, 2.5, 2.0, 2.0),
    "C": (1.5, 1.5, 1.0, 2.0, 1.0, 0.5, 2.0, 2.0, 1.5, 1.0),
}
"""Its ratings by examiner, in the order of the days."""
TAKEN_OUT = ("sessions/M1-1-OFF", "2", "the examiner knocked against the table")


def shared_data() -> Path | None:
    """Return the folder of real recordings beside the repository, or None where it is absent."""
    shared = Path(os.environ.get("RIGIDIMETER_SHARED", ROOT.parent / "shared"))
    return next((folder for folder in (shared / "data", shared) if (folder / "ankle").is_dir()),
                None)  # fmt: skip


class Workspace:
    """A folder in which commands run; every input is made once, when it is first asked for.

    Parameters
    ----------
    folder : Path
        Keeps what the commands write and, by the name of the run, what they print.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        # One thread and one kind of kernel, so that sums are always taken in the same order.
        self._environment = os.environ | {
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
            "MKL_NUM_THREADS": "1",
            "OPENBLAS_CORETYPE": KERNELS,
        }

    def run(self, name: str, *arguments: object, statuses: Sequence[int] = (0,)) -> None:
        """Run a command of `rigidimeter` in the folder.

        Raises
        ------
        RuntimeError
            If it ends with another status than it should.
        """
        command = [sys.executable, "-m", "rigidimeter", *map(str, arguments)]
        ran = subprocess.run(
            command,
            cwd=self.folder,
            env=self._environment,
            capture_output=True,
            text=True,
            check=False,
        )
        printed = self.folder / f"{name}.txt"
        printed.parent.mkdir(parents=True, exist_ok=True)
        printed.write_text(f"{ran.stdout}\n{ran.stderr}", encoding="utf-8")
        if ran.returncode not in statuses:
            shown = " ".join(map(str, arguments))
            raise RuntimeError(f"rigidimeter {shown}: status {ran.returncode}\n{ran.stderr}")

    def document(self, name: str, *arguments: object, statuses: Sequence[int] = (0,)) -> Any:
        """Run a command that takes ``--json`` and return what it wrote."""
        path = self.folder / f"{name}.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        self.run(name, *arguments, "--json", path, statuses=statuses)
        return json.loads(path.read_text(encoding="utf-8"))

    def session(self, name: str) -> Path:
        """Return a session by its name in `SESSIONS`, relative to the folder."""
        file, seed, further = SESSIONS[name]
        settings = (SETTINGS / file).read_text(encoding="utf-8") if file else ""
        return self._simulated(Path("sessions") / name, settings + further, seed, BLOCKS.get(name))

    def study(self) -> Path:
        """Return the small study of two subjects, relative to the folder."""
        study = Path("study")
        if (self.folder / study).exists():
            return study
        sessions, ratings = ["path,subject,day,condition"], ["subject,day,condition,examiner,score"]
        for index, (subject, day, condition, *joint) in enumerate(DAYS):
            path = f"sessions/{subject}-{day}-{condition}"
            named = dict(zip(("inertia", "damping", "stiffness"), joint, strict=True))
            settings = SUBJECT.format(condition=condition, **named) + SHORT
            blocks = (("prbs", condition, 2), ("sinusoid", condition, 1))
            self._simulated(study / path, settings, 100 + index, blocks)
            sessions.append(f"{path},{subject},{day},{condition}")
            for examiner, scores in SCORED.items():
                ratings.append(f"{subject},{day},{condition},{examiner},{scores[index]}")
        self._write(study / "study.toml", STUDY)
        self._write(study / "sessions.csv", "\n".join(sessions))
        self._write(study / "ratings.csv", "\n".join(ratings))
        self._write(study / "exclusions.csv", "path,epoch,reason\n" + ",".join(TAKEN_OUT))
        return study

    def full_study(self) -> Path:
        """Return the virtual study of the paper's size, relative to the folder."""
        study = Path("full-study")
        if not (self.folder / study).exists():
            self.run("full-study", "study", "simulate", "--out", study)
        return study

    def ratings(self, name: str) -> Path:
        """Return one of the sets of ratings as a table of its own, relative to the folder."""
        with SCORES.open(encoding="utf-8", newline="") as file:
            rows = [row for row in csv.DictReader(file) if row.pop("dataset") == name]
        lines = [",".join(rows[0]), *(",".join(row.values()) for row in rows)]
        return self._write(Path("ratings") / f"{name}.csv", "\n".join(lines))

    def emps(self, shared: Path) -> Path:
        """Return the positioning axis as force and position, relative to the folder."""
        data = scipy.io.loadmat(shared / "emps" / "DATA_EMPS.mat")
        force = float(data["gtau"].ravel()[0]) * data["vir"].ravel()
        path = Path("emps.npz")
        np.savez(self.folder / path, torque_nm=force, angle_rad=data["qm"].ravel())
        return path

    def silverbox(self, shared: Path, part: slice) -> Path:
        """Return a part of the circuit's input and output, relative to the folder."""
        table = np.genfromtxt(
            shared / "silverbox" / "SNLS80mV.csv", delimiter=",", skip_header=1, usecols=(0, 1)
        )[part]
        path = Path(f"silverbox-{part.start}-{part.stop}.npz")
        np.savez(self.folder / path, torque_nm=table[:, 0], angle_rad=table[:, 1])
        return path

    def settings(self, name: str, text: str) -> Path:
        """Return settings as a file, relative to the folder."""
        return self._write(Path("settings") / f"{name}.toml", text)

    def _simulated(
        self,
        session: Path,
        settings: str,
        seed: int,
        blocks: Sequence[tuple[str, str, int]] | None,
    ) -> Path:
        if not (self.folder / session).exists():
            tables = [
                "[[protocol.blocks]]\n"
                f'task = "{task}"\ncondition = "{condition}"\nepochs = {epochs}\n'
                for task, condition, epochs in blocks or ()
            ]
            file = self.settings(session.name, "\n".join([settings, *tables]))
            arguments = ("--out", session, "--settings", file, "--seed", seed)
            self.run(f"{session}-simulated", "simulate", *arguments)
        return session

    def _write(self, path: Path, text: str) -> Path:
        (self.folder / path).parent.mkdir(parents=True, exist_ok=True)
        (self.folder / path).write_text(text + "\n", encoding="utf-8")
        return path
