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
from typing import Any

import numpy as np

from benchmarks.false_alarms import RATES, SIZES
from rigidimeter.commissioning.turned_sign import turned_epoch
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


def row(settings: Settings, epochs: int) -> str:
    """Return what became of one subject, as columns of the table."""
    found_s: list[float] = []
    wrong_deg: list[float] = []
    others: Counter[str] = Counter()
    for moment_s in MOMENTS_S:
        for seed in range(epochs):
            turned = turned_epoch(settings, "OFF", seed, moment_s, moment_s + LONGEST_S)
            twin = turned_epoch(settings, "OFF", seed, math.inf, turned.ended_s)
            n = min(len(turned.angle_deg), len(twin.angle_deg))
            if turned.cause is Cause.TORQUE_SIGN:
                found_s.append(turned.ended_s - moment_s)
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
