"""Faults of the torque sensor with the drive's own torque as a witness, on both joints and drives.

A PRBS epoch of a subject who pushes with 0.5 N·m (SD) runs on the virtual rig with a simulated
clock; from `AT_S` on the torque sensor is spoiled, with stamps and counters of now. The model of
the drive's side is what commissioning finds on the same rig. Each cell says what ended the epoch,
how long after, and the largest true torque until the arm was told to rest; then the same where the
two torques are not compared. The largest fault of a kind that passes is looked for by halving.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from benchmarks.drive_torque import SIDES, settings_of
from benchmarks.false_alarms import SIZES

from rigidimeter.cli.virtual_check import measured_drive_side
from rigidimeter.core.settings import Settings
from rigidimeter.planning import prbs_nm
from rigidimeter.rig.acquisition import ControlLoop, SimulatedClock, hold, perturb
from rigidimeter.rig.devices import SimulatedRig
from rigidimeter.rig.devices.base import Reading
from rigidimeter.rig.guard import TIMES_SCATTER, Cause, DriveModel

HELD_S, AT_S, LONGEST_S = 1.0, 2.0, 4.0
HALVINGS = 4
Spoil = Callable[[float, np.random.Generator], float]
"""Takes the true torque and a generator, gives what the sensor says."""


class Kind(NamedTuple):
    """A kind of fault: its size as text, from the smallest to the largest, and what it does."""

    name: str
    unit: str
    least: float
    most: float
    spoil: Callable[[float], Spoil]


def _clipped(level: float) -> Spoil:
    return lambda nm, _: max(-level, min(level, nm))


FAULTS: dict[str, Spoil] = {
    "stuck, with noise of 0.3 N·m": lambda _, rng: 0.3 * rng.standard_normal(),
    "gain 0.5": lambda nm, _: 0.5 * nm,
    "gain 3": lambda nm, _: 3.0 * nm,
    "gain 10": lambda nm, _: 10.0 * nm,
    "offset 1 N·m": lambda nm, _: nm + 1.0,
    "single zeros, 1 in 20": lambda nm, rng: 0.0 if rng.random() < 0.05 else nm,
    "clipped at 0.3 N·m": _clipped(0.3),
}
KINDS = (
    Kind("offset", "N·m", 0.0, 4.0, lambda size: lambda nm, _: nm + size),
    Kind("gain above 1", "times", 1.0, 10.0, lambda gain: lambda nm, _: gain * nm),
    Kind("gain below 1", "times", 1.0, 0.0, lambda gain: lambda nm, _: gain * nm),
    Kind(
        "zeros",
        "of all samples",
        0.0,
        1.0,
        lambda share: lambda nm, rng: 0.0 if rng.random() < share else nm,
    ),
    Kind("clipping", "N·m", 6.0, 0.0, _clipped),
)


class Ended(NamedTuple):
    """What ended an epoch, how long after the fault, and the largest true torque since then."""

    cause: Cause
    after_s: float
    largest_nm: float

    def __str__(self) -> str:
        """Say it in a cell."""
        name = self.cause.name.lower().replace("_", " ") if self.cause else "passes"
        after = f", {self.after_s:.2f} s" if self.cause else ""
        return f"{name}{after}, {self.largest_nm:.1f} N·m"


class Case(NamedTuple):
    """A joint and a drive's side, with the model that commissioning found."""

    size: str
    side: str
    settings: Settings
    model: DriveModel


class _SpoiledSensor(SimulatedRig):
    """The simulated rig, whose torque sensor is spoiled from a tick on."""

    spoil: Spoil | None = None
    wrong_at = math.inf

    def watch(self, spoil: Spoil | None) -> None:
        self.spoil, self.chance = spoil, np.random.default_rng(17)
        self.wrong_at = (HELD_S + AT_S) * self._settings.tick_rate_hz
        self.true_nm: list[float] = []

    def read(self, elapsed_ticks: int = 1) -> Reading:
        reading = super().read(elapsed_ticks)
        if self._tick <= self.wrong_at:
            return reading
        self.true_nm.append(reading.torque_nm)
        if self.spoil is None:
            return reading
        return reading._replace(torque_nm=self.spoil(reading.torque_nm, self.chance))


def cases() -> Iterator[Case]:
    """Yield both joints on both drives."""
    for size in SIZES:
        for side in SIDES:
            settings = settings_of(size, "pushing 0.5 N·m", side=side)
            model = measured_drive_side(settings)
            assert model is not None
            yield Case(size, side, settings, model)


def ended(case: Case, spoil: Spoil | None, model: DriveModel | None, seed: int = 4) -> Ended:
    """Run one epoch."""
    settings = case.settings
    rate_hz = settings.rig.tick_rate_hz
    rig = _SpoiledSensor(settings.rig, settings.subject["OFF"], np.random.default_rng(seed))
    rig.watch(spoil)
    loop = ControlLoop(settings, rig, SimulatedClock(), lambda _: None, drive_model=model)
    rig.enable()
    hold(loop, HELD_S)
    ticks = round((AT_S + LONGEST_S) * rate_hz)
    perturb(loop, 0, prbs_nm(settings.prbs, rate_hz)[:ticks].tolist())
    after_s = len(rig.true_nm) / rate_hz
    return Ended(loop.cause, after_s, float(np.abs(rig.true_nm).max()))


def largest_unseen(case: Case, kind: Kind) -> tuple[float, float, Ended]:
    """Return the largest fault of a kind that the epoch survives, the next one, and how it went."""
    good, bad = kind.least, kind.most
    best = ended(case, kind.spoil(good), case.model)
    for _ in range(HALVINGS):
        middle = 0.5 * (good + bad)
        found = ended(case, kind.spoil(middle), case.model)
        if found.cause is Cause.NONE:
            good, best = middle, found
        else:
            bad = middle
    return good, bad, best


def column(case: Case) -> list[str]:
    """Return the cells of a case, from the head of the column on."""
    found = (
        f"{TIMES_SCATTER * case.model.scatter_nm:.2f} N·m, friction {case.model.friction_nm:.1f}"
    )
    cells = [f"{case.size}, {case.side}", found]
    for spoil in FAULTS.values():
        now, before = ended(case, spoil, case.model), ended(case, spoil, None)
        cells.append(f"{now}<br>before: {before}")
    for kind in KINDS:
        size, found_at, how = largest_unseen(case, kind)
        largest = f"below {found_at:.2f}" if size == kind.least else f"{size:.2f}"
        cells.append(f"{largest} {kind.unit}, up to {how.largest_nm:.1f} N·m")
    return cells


def table(which: int | None = None) -> str:
    """Return the table of the faults and of the largest that pass; of one case if so asked."""
    chosen = [case for k, case in enumerate(cases()) if which in (None, k)]
    names = ["fault", "*found from here on*", *FAULTS]
    names += [f"*largest that passes:* {kind.name}" for kind in KINDS]
    rows = list(zip(names, *(column(case) for case in chosen), strict=True))
    rows.insert(1, ("---",) * len(rows[0]))
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


if __name__ == "__main__":
    print(table(int(sys.argv[1]) if len(sys.argv) > 1 else None))
