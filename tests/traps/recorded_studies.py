"""Studies of known truth as a laboratory has them: a file for each session, and the tables.

The recordings come from the independent simulator of `tests.scenarios`: 250 samples a second,
epochs of 12 s. What a trap needs is set for each session: its joint, what its subject does, what of
it was recorded and how it was written.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import csv
from tests.scenarios.limbs import LIMBS, setup_of
from tests.scenarios.recordings import Setup, simulate
from tests.scenarios.subject import Subject

from rigidimeter.core.records import Epoch

RATE_HZ = 250.0
DURATION_S = 12.0
REST_S = 2.0
AT_REST = Subject(voluntary_nm=0.02)
"""Twice the torque of a virtual subject at rest in `rigidimeter.virtual.study_design`."""

MOTION = ("torque_nm", "angle_rad", "velocity_rad_s")
ALL = (*MOTION, "velocity_command_rad_s", "perturbation_nm")


@dataclass(frozen=True)
class Session:
    """One recording of a study.

    Attributes
    ----------
    day, condition : str
    factors : tuple of float
        Of J, B and K of the animal's elbow on that day.
    scatter : float
        SD of the logarithm of B and K between epochs.
    subject : Subject
    epochs : int
    columns : tuple of str
        What was recorded; without the perturbation the method is least squares.
    degrees : bool
        Angle and velocity are in degrees, under the names of radians.
    perturbation_nm : float
        Amplitude.
    """

    day: str
    condition: str
    factors: tuple[float, float, float] = (1.0, 1.0, 1.0)
    scatter: float = 0.02
    subject: Subject = AT_REST
    epochs: int = 2
    columns: tuple[str, ...] = ALL
    degrees: bool = False
    perturbation_nm: float = 1.0

    @property
    def file(self) -> str:
        """The name of its file."""
        return f"day-{self.day}-{self.condition}.csv"


def write_session(path: Path, session: Session, seed: np.random.SeedSequence) -> Path:
    """Simulate the epochs of a session and write them as one table."""
    moved = replace(session, day="", condition="", columns=(), degrees=False)
    tables = []
    for number, epoch in enumerate(_recorded(moved, seed.spawn_key, seed.entropy)):
        start_s = number * (DURATION_S + REST_S)
        values = {name: epoch.channels[name].values for name in session.columns}
        if session.degrees:
            values |= {name: np.degrees(values[name]) for name in MOTION[1:]}
        time_s = epoch.channels["torque_nm"].time_s + start_s
        tables.append({"time_s": time_s, **values, "epoch": np.full(time_s.size, number + 1)})
    columns = {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
    csv.write_csv(pa.table(columns), path)
    return path


@functools.cache
def _recorded(session: Session, key: tuple[int, ...], entropy: int) -> list[Epoch]:
    """Simulate the epochs of a session; studies share those in which nothing differs."""
    seed = np.random.SeedSequence(entropy, spawn_key=key)
    rng = np.random.default_rng(seed.spawn(1)[0])
    children = seed.spawn(session.epochs)
    return [simulate(_setup(session, rng), 1, child).epochs[0] for child in children]


def write_study(folder: Path, sessions: Sequence[Session], seed: int, ratings: str = "") -> Path:
    """Write a study folder of one subject; `ratings` are the lines of its table."""
    folder.mkdir(parents=True)
    seeds = np.random.SeedSequence(seed).spawn(len(sessions))
    rows = ["path,subject,day,condition"]
    for session, child in zip(sessions, seeds, strict=True):
        write_session(folder / session.file, session, child)
        rows.append(f"{session.file},M1,{session.day},{session.condition}")
    (folder / "sessions.csv").write_text("\n".join(rows) + "\n")
    if ratings:
        (folder / "ratings.csv").write_text(f"subject,day,condition,examiner,score\n{ratings}\n")
    (folder / "study.toml").write_text(
        'schema = "rigidimeter.study/1"\ntitle = "Elbow"\nreference = "OFF"\nother = "DBS"\n'
    )
    return folder


def both_each_day(days: int, off: Session, dbs: Session) -> list[Session]:
    """Return sessions of both conditions on each of some days."""
    return [replace(one, day=str(day)) for day in range(1, days + 1) for one in (off, dbs)]


def _setup(session: Session, rng: np.random.Generator) -> Setup:
    setup = setup_of(LIMBS["animal elbow"])
    spread = np.exp([0.0, *(session.scatter * rng.standard_normal(2))])
    joint = setup.joint
    J, B, K = (
        np.array([joint.inertia_kg_m2, joint.damping_nm_s_rad, joint.stiffness_nm_rad])
        * session.factors
        * spread
    ).tolist()
    return replace(
        setup,
        joint=joint._replace(inertia_kg_m2=J, damping_nm_s_rad=B, stiffness_nm_rad=K),
        controller=setup.controller._replace(tick_rate_hz=RATE_HZ),
        torque=replace(setup.torque, rate_hz=RATE_HZ, latency_s=0.0),
        motion=replace(setup.motion, rate_hz=RATE_HZ, latency_s=0.0),
        perturbation=replace(
            setup.perturbation, duration_s=DURATION_S, amplitude_nm=session.perturbation_nm
        ),
        subject=session.subject,
    )
