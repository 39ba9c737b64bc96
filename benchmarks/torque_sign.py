"""How soon the guard finds a torque sensor whose sign is wrong, and how far the arm goes wrong.

The loop runs the simulated rig, as fast as it goes, under a PRBS perturbation; from some moment on
the sensor's torque has the opposite sign. A twin with the same random numbers keeps the right sign:
where the two arms are apart, the motion is wrong. Each row is of `MOMENTS_S` and of some epochs.

    python -m benchmarks.torque_sign
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.false_alarms import RATES, SIZES
from rigidimeter.acquisition import SimulatedClock, perturb, tick
from rigidimeter.devices import SimulatedRig
from rigidimeter.devices.base import Reading
from rigidimeter.experiment import prbs_nm
from rigidimeter.guard import Cause
from rigidimeter.settings import Settings, parse_settings

MOMENTS_S = (0.0, 1.0, 1.37, 2.05, 3.13)
"""When the sign turns; at 0 it was wrong from the start."""

LONGEST_S = 4.0
"""So long after it the epoch ends."""

SUBJECTS: dict[str, tuple[tuple[float, float, float], dict[str, float]]] = {
    "relaxed, no torque of its own": ((1.0, 1.0, 1.0), {}),
    "relaxed, 0.05 N·m (SD)": ((1.0, 1.0, 1.0), {"voluntary_sd_nm": 0.05}),
    "0.2 N·m (SD)": ((1.0, 1.0, 1.0), {"voluntary_sd_nm": 0.2}),
    "1 N·m (SD)": ((1.0, 1.0, 1.0), {"voluntary_sd_nm": 1.0}),
    "hanging": ((1.0, 0.15, 0.03), {}),
}


class TurnedRig(SimulatedRig):
    """The simulated rig whose torque has the wrong sign from one of its ticks on."""

    turned_at = math.inf

    def read(self, elapsed_ticks: int = 1) -> Reading:
        """Return the reading, its torque perhaps turned."""
        reading = super().read(elapsed_ticks)
        if self._tick > self.turned_at:
            return reading._replace(torque_nm=-reading.torque_nm)
        return reading


class Run(NamedTuple):
    """What ended an epoch, after how many ticks, and the angle at each of them."""

    cause: Cause
    ticks: int
    angle_deg: NDArray[np.float64]


def run(settings: Settings, seed: int, turned_at: float, seconds: float) -> Run:
    """Run one epoch from rest."""
    rate_hz = settings.rig.tick_rate_hz
    rig = TurnedRig(settings.rig, settings.subject["OFF"], np.random.default_rng(seed))
    rig.turned_at = turned_at * rate_hz
    angles: list[float] = []
    loop = tick.ControlLoop(settings, rig, SimulatedClock(), lambda s: angles.append(s.angle_rad))
    rig.enable()
    perturb(loop, 0, prbs_nm(settings.prbs, rate_hz)[: round(seconds * rate_hz)].tolist())
    return Run(loop.cause, loop.tick, np.degrees(angles))


def row(settings: Settings, epochs: int) -> str:
    """Return what became of one subject, as columns of the table."""
    rate_hz = settings.rig.tick_rate_hz
    found_s: list[float] = []
    wrong_deg: list[float] = []
    others: Counter[str] = Counter()
    for moment_s in MOMENTS_S:
        for seed in range(epochs):
            seconds = moment_s + LONGEST_S
            turned = run(settings, seed, moment_s, seconds)
            twin = run(settings, seed, math.inf, turned.ticks / rate_hz)
            n = min(turned.ticks, twin.ticks)
            if turned.cause is Cause.TORQUE_SIGN:
                found_s.append(turned.ticks / rate_hz - moment_s)
                wrong_deg.append(float(abs(turned.angle_deg[:n] - twin.angle_deg[:n]).max()))
            else:
                others[turned.cause.name.lower().replace("_", " ")] += 1
    rest = ", ".join(f"{n} {name}" for name, n in sorted(others.items())) or "–"
    if not found_s:
        return f"0 | – | – | {rest}"
    within_s, deg = np.array(found_s), np.array(wrong_deg)
    return (
        f"{len(found_s)} | {np.median(within_s):.2f} ({within_s.min():.2f}–{within_s.max():.2f}) "
        f"| {np.median(deg):.0f} ({deg.max():.0f}) | {rest}"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--epochs", type=int, default=4, help="for each moment")
    parser.add_argument("--sizes", nargs="*", choices=list(SIZES), default=list(SIZES))
    given = parser.parse_args()
    print("| size | ticks/s | subject | found | after s | wrong by deg (most) | else |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for size in given.sizes:
        values = SIZES[size]
        for tick_hz, torque_hz, guard, controller in RATES:
            for name, (factors, subject) in SUBJECTS.items():
                names = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")
                joint = (v * f for v, f in zip(values["joint"], factors, strict=True))
                tables: dict[str, Any] = {
                    "subject": {"OFF": {**dict(zip(names, joint, strict=True)), **subject}},
                    "controller": {**values["controller"], **controller},
                    "prbs": values["prbs"],
                    "guard": guard,
                    "rig": {
                        "tick_rate_hz": tick_hz,
                        "torque": {"rate_hz": torque_hz},
                        "motion": {"rate_hz": tick_hz},
                    },
                }
                of = f"{tick_hz:g}" if torque_hz == tick_hz else f"{tick_hz:g}, {torque_hz:g}"
                columns = row(parse_settings(tables), given.epochs)
                print(f"| {size} | {of} | {name} | {columns} |", flush=True)


if __name__ == "__main__":
    main()
