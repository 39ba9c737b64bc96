"""The scenarios, and each of their recordings as a text file.

They come from the independent rig of `tests.scenarios`, whose equations no estimator here holds. A
recording is one epoch of 20 s; its file has the samples of all sensors in the order of time, with
empty cells where a slower sensor has none. Its digest is that of the file, so any machine can check
that it has the same data.
"""

from __future__ import annotations

import csv
import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from tests.scenarios.catalogue import SCENARIOS as CATALOGUE
from tests.scenarios.scenario import Scenario, scenario

from rigidimeter.core.records import Epoch

RECORDINGS = 20
"""Of each scenario."""

DECIMALS = {
    "time_s": 4,
    "perturbation_nm": 4,
    "velocity_command_rad_s": 6,
    "torque_nm": 4,
    "angle_rad": 7,
    "velocity_rad_s": 6,
}
"""Columns of a recording: a tenth of what the sensors resolve, or less."""

PARAMETERS = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")
TRUTH = Path(__file__).with_name("truth.csv")

_FROM_CATALOGUE = {
    "relaxed": "relaxed",
    "pushing": "voluntary 0.2 N·m, soft skirts",
    "pushing hard": "voluntary 0.5 N·m",
    "tremor": "tremor 0.3 N·m",
    "reflex": "reflex 60 ms, 0.3",
    "friction": "friction in the joint 0.1 N·m",
    "stiffness drifts": "K drift 0.7 to 1.3",
    "late drive": "drive 15 Hz, 5 ms late",
    "torque filter": "torque filter 100 Hz",
    "low rates": "torque 100/s, motion 50/s, jitter",
    "patient": "elbow of a patient: tremor, bursts, friction, reflex, drift",
}
SCENARIOS: Mapping[str, Scenario] = {
    **{name: replace(CATALOGUE[there], name=there) for name, there in _FROM_CATALOGUE.items()},
    "coloured noise": scenario("coloured noise", subject={"lateral_nm": 0.05}),
}
"""What each of them is, README.md says."""


class Recording(NamedTuple):
    """One recording: its scenario and number, the text of its file, and the true J, B and K."""

    scenario: str
    number: int
    text: str
    truth: tuple[float, ...]

    @property
    def name(self) -> str:
        """Of its file."""
        return f"{self.scenario.replace(' ', '-')}-{self.number:02d}.csv"

    @property
    def digest(self) -> str:
        """SHA-256 of its file."""
        return hashlib.sha256(self.text.encode()).hexdigest()


def recording(name: str, number: int) -> Recording:
    """Simulate a recording, counted from 1, which with the scenario decides what chance does."""
    found = SCENARIOS[name].simulated(number, 1)
    J, B, K = (float(f"{value:.6g}") for value in found.truth[0])
    return Recording(name, number, text_of(found.epochs[0]), (J, B, K))


def recordings(names: Mapping[str, int]) -> Iterator[Recording]:
    """Yield so many recordings of each of these scenarios."""
    for name, count in names.items():
        yield from (recording(name, number) for number in range(1, count + 1))


def text_of(epoch: Epoch) -> str:
    """Return the samples of an epoch as a comma-separated table."""
    present = [name for name in DECIMALS if name in epoch.channels]
    stamps = {name: np.round(epoch.channels[name].time_s, DECIMALS["time_s"]) for name in present}
    time_s = np.unique(np.concatenate([*stamps.values()]))
    cells = [[f"{value:.{DECIMALS['time_s']}f}" for value in time_s]]
    for name in present:
        column = [""] * time_s.size
        values = epoch.channels[name].values
        for row, value in zip(np.searchsorted(time_s, stamps[name]), values, strict=True):
            column[row] = f"{value:z.{DECIMALS[name]}f}"  # z: no −0
        cells.append(column)
    rows = [("time_s", *present), *zip(*cells, strict=True)]
    return "".join(f"{','.join(row)}\n" for row in rows)


def truth_rows() -> list[dict[str, str]]:
    """Return the rows of the table of the truth."""
    with TRUTH.open(encoding="utf-8", newline="") as file:
        return [*csv.DictReader(file)]


def write_truth() -> None:
    """Simulate every recording and write the table of the truth with the digests."""
    with TRUTH.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("scenario", "recording", *PARAMETERS, "sha256"))
        for one in recordings(dict.fromkeys(SCENARIOS, RECORDINGS)):
            writer.writerow((one.scenario, one.number, *one.truth, one.digest))
