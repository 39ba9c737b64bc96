"""What the guard does about readings and motion that are not true, and how far the arm goes wrong.

The loop runs the simulated rig under a PRBS perturbation; after `AT_S` the drive or a sensor is no
longer what it was, with stamps and counters of now. A twin with the same random numbers stays
sound: where the two arms are apart, the motion is wrong. The subject is relaxed, with a torque of
0.05 N·m (SD) of its own.

    python -m benchmarks.untrue
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.false_alarms import RATES
from benchmarks.torque_sign import SUBJECTS, made
from rigidimeter.core.settings import Settings
from rigidimeter.planning import prbs_nm
from rigidimeter.rig.acquisition import ControlLoop, SimulatedClock, perturb
from rigidimeter.rig.devices import SimulatedRig
from rigidimeter.rig.devices.base import Reading
from rigidimeter.rig.guard import Cause

AT_S, LONGEST_S = 1.0, 5.0
SEEDS = 2


class Untrue(NamedTuple):
    """What is wrong: the drive does `gain` times the command and `drift_deg_s` more; the readings
    are changed, given how long it lasts and, for torques, those since then."""

    gain: float = 1.0
    drift_deg_s: float = 0.0
    read: Callable[[Reading, float, list[float]], Reading] = lambda reading, _, __: reading


def _late(growth: float) -> Untrue:
    def read(reading: Reading, since_s: float, torques: list[float]) -> Reading:
        back = round(min(growth * since_s, 0.3) * len(torques) / max(since_s, 1e-9))
        return reading._replace(torque_nm=torques[max(len(torques) - 1 - back, 0)])

    return Untrue(read=read)


CASES: dict[str, Untrue] = {
    "drive adds 1 deg/s": Untrue(drift_deg_s=1.0),
    "drive adds 2 deg/s": Untrue(drift_deg_s=2.0),
    "drive adds 5 deg/s": Untrue(drift_deg_s=5.0),
    "drive and encoder: 10 % more than commanded, reported as commanded": Untrue(
        1.1,
        read=lambda r, _, __: r._replace(
            angle_rad=r.angle_rad / 1.1, velocity_rad_s=r.velocity_rad_s / 1.1
        ),
    ),
    "velocity times 0.5": Untrue(
        read=lambda r, _, __: r._replace(velocity_rad_s=0.5 * r.velocity_rad_s)
    ),
    "velocity times 2": Untrue(
        read=lambda r, _, __: r._replace(velocity_rad_s=2.0 * r.velocity_rad_s)
    ),
    "torque times 0.3": Untrue(read=lambda r, _, __: r._replace(torque_nm=0.3 * r.torque_nm)),
    "torque 0.5 N·m more": Untrue(read=lambda r, _, __: r._replace(torque_nm=r.torque_nm + 0.5)),
    "torque later by 0.1 s each second, to 0.3 s": _late(0.1),
    "angle, velocity and torque mirrored": Untrue(
        read=lambda r, _, __: r._replace(
            torque_nm=-r.torque_nm, angle_rad=-r.angle_rad, velocity_rad_s=-r.velocity_rad_s
        )
    ),
    "angle wraps by 360 deg": Untrue(
        read=lambda r, _, __: r._replace(angle_rad=r.angle_rad - 2.0 * math.pi)
    ),
    "stamps jump by +30 ms": Untrue(
        read=lambda r, _, __: r._replace(
            torque_time_s=r.torque_time_s + 0.03, motion_time_s=r.motion_time_s + 0.03
        )
    ),
    "stamps jump by -50 ms": Untrue(
        read=lambda r, _, __: r._replace(
            torque_time_s=r.torque_time_s - 0.05, motion_time_s=r.motion_time_s - 0.05
        )
    ),
}


class UntrueRig(SimulatedRig):
    """The simulated rig with something wrong from a tick on."""

    untrue, wrong_at = Untrue(), math.inf

    def __init__(self, settings: Settings, seed: int) -> None:
        subject = settings.subject["OFF"]
        super().__init__(settings.rig, subject, np.random.default_rng(seed))
        self._torques: list[float] = []
        self.angle_rad: list[float] = []

    def read(self, elapsed_ticks: int = 1) -> Reading:
        """Return the reading, and keep where the arm truly is."""
        told = self._command
        wrong = self._tick >= self.wrong_at
        if wrong:
            self._command = self.untrue.gain * told + math.radians(self.untrue.drift_deg_s)
        reading = super().read(elapsed_ticks)
        self._command = told
        self.angle_rad.append(self._state[0])
        if wrong:
            self._torques.append(reading.torque_nm)
            since_s = (self._tick - self.wrong_at) * self._interval_s
            reading = self.untrue.read(reading, since_s, self._torques)
        return reading


def epoch(
    settings: Settings, seed: int, untrue: Untrue | None
) -> tuple[Cause, NDArray[np.float64]]:
    """Run one epoch; return what ended it, and the arm's true angle at each tick."""
    rig = UntrueRig(settings, seed)
    if untrue:
        rig.untrue, rig.wrong_at = untrue, AT_S * settings.rig.tick_rate_hz
    loop = ControlLoop(settings, rig, SimulatedClock(), lambda _: None)
    rig.enable()
    ticks = round((AT_S + LONGEST_S) * settings.rig.tick_rate_hz)
    perturb(loop, 0, prbs_nm(settings.prbs, settings.rig.tick_rate_hz)[:ticks].tolist())
    return loop.cause, np.degrees(rig.angle_rad)


def cell(settings: Settings, untrue: Untrue) -> str:
    """Return what ended some epochs, after how long at most, and how far the arm was wrong."""
    causes, after_s, wrong_deg = set(), 0.0, 0.0
    for seed in range(SEEDS):
        cause, angle_deg = epoch(settings, seed, untrue)
        _, sound_deg = epoch(settings, seed, None)
        n = min(angle_deg.size, sound_deg.size)
        causes.add(cause.name.lower().replace("_", " ") if cause else "passes")
        after_s = max(after_s, n / settings.rig.tick_rate_hz - AT_S)
        wrong_deg = max(wrong_deg, float(np.abs(angle_deg[:n] - sound_deg[:n]).max()))
    return f"{' or '.join(sorted(causes))}, {after_s:.2f} s, {wrong_deg:.1f} deg"


def main() -> None:
    """Print the table."""
    rows = [
        (size, made(size, SUBJECTS["relaxed, 0.05 N·m (SD)"], hz, torque_hz, guard, controller))
        for size in ("small", "human elbow")
        for hz, torque_hz, guard, controller in (RATES[0], RATES[-1])
    ]
    head = " | ".join(f"{size}, {settings.rig.tick_rate_hz:g}/s" for size, settings in rows)
    print(f"| what is wrong | {head} |\n{'| --- ' * (1 + len(rows))}|")
    for name, untrue in CASES.items():
        cells = " | ".join(cell(settings, untrue) for _, settings in rows)
        print(f"| {name} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
