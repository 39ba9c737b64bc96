"""What the guard's laws of agreement cost a tick: CPU time with and without them, in turn.

The loop runs the simulated rig for 20 s of PRBS perturbation and 20 s of rest at 1 kHz, as fast as
it goes, and records nothing. Without the laws, a step that finds nothing stands in their place. The
least of some runs is taken: whatever else the machine does only adds.

    python -m benchmarks.tick
    python -m benchmarks.tick --lateness 120

With `--lateness` one loop of so many seconds runs in real time, as `benchmarks.loop` runs it, with
the laws in every other window of 2 s and without them in those between: the ratios of lateness of
neighbouring windows, as their geometric mean and its 95 % interval (Student's t of the logarithms).
"""

from __future__ import annotations

import argparse
import itertools
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy import stats

from benchmarks.loop import PRIORITY, patient, virtual_session
from rigidimeter.core.session import read_samples
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.planning import prbs_nm
from rigidimeter.rig.acquisition import SimulatedClock, decision, go_back, perturb, rest, tick
from rigidimeter.rig.acquisition.processes import LoopSide, Realtime, RecordingPlan, supervise
from rigidimeter.rig.devices import SimulatedRig
from rigidimeter.rig.guard import DriveModel, consistency_limits, consistency_state

RATE_HZ = 1000.0
WINDOW_TICKS = 2000
SKIPPED_TICKS = 4000
"""Processes start in the first of these windows."""

MODEL = DriveModel(0.9, 0.001, 0.05, 0.3, 0.0, 0.0, 0.033)
"""About what commissioning finds of the virtual drive."""

PERCENTILES = (50.0, 95.0, 99.0)


def _agrees(_: Any, state: Any, *__: Any) -> tuple[Any, int]:
    return state, 0


def tick_us(model: DriveModel | None = None) -> float:
    """Return the CPU time of a tick, in µs; with a model the drive's own torque is compared."""
    settings = parse_settings({})
    rig = SimulatedRig(
        settings.rig, next(iter(settings.subject.values())), np.random.default_rng(1)
    )
    loop = tick.ControlLoop(settings, rig, SimulatedClock(), lambda _: None, drive_model=model)
    perturbation_nm = prbs_nm(settings.prbs, settings.rig.tick_rate_hz).tolist()
    began_s = time.process_time()
    perturb(loop, 0, perturbation_nm)
    go_back(loop, 2.0, 0.35)
    rest(loop, 18.0, 0.35)
    return 1e6 * (time.process_time() - began_s) / loop.tick


def in_turn(settings: Settings, duration_s: float, side: LoopSide) -> None:
    """Run a session whose laws are left out in every other window."""
    laws, ticks = decision.consistency_step, itertools.count()
    new = consistency_state(consistency_limits(settings))

    def step(*arguments: Any) -> Any:
        # Those who have looked away begin anew.
        return laws(*arguments) if next(ticks) // WINDOW_TICKS % 2 == 0 else (new, 0)

    with patch.object(decision, "consistency_step", step):
        virtual_session(settings, duration_s, side)


def lateness(seconds: float, cpu: int) -> None:
    """Print how late the ticks with the laws are, over how late those without are."""
    settings = patient(RATE_HZ)
    with tempfile.TemporaryDirectory() as folder:
        session = Path(folder) / "session"
        ended = supervise(
            partial(in_turn, settings, seconds),
            RecordingPlan(session, settings, virtual=True),
            realtime=Realtime(priority=PRIORITY, cpu=cpu, attended=False),
        )
        samples = read_samples(session / "samples.arrows")
    late_us = 1e6 * samples["lateness_s"]
    windows = len(late_us) // (2 * WINDOW_TICKS) * 2
    pairs = late_us[: windows * WINDOW_TICKS].reshape(-1, 2, WINDOW_TICKS)
    pairs = pairs[SKIPPED_TICKS // (2 * WINDOW_TICKS) :]
    for percentile in PERCENTILES:
        found = np.percentile(pairs, percentile, axis=2)
        logs = np.log(found[:, 0] / found[:, 1])
        half = stats.t.ppf(0.975, len(logs) - 1) * stats.sem(logs)
        ours, without = np.exp(np.log(found).mean(axis=0))
        print(
            f"p{percentile:g} of lateness: {ours:.1f} µs with the laws, {without:.1f} µs without: "
            f"{np.exp(logs.mean()):.2f} ({np.exp(logs.mean() - half):.2f} to "
            f"{np.exp(logs.mean() + half):.2f}), {len(logs)} pairs"
        )
    print(f"samples made and not recorded: {ended.samples - len(late_us)}")


def main() -> None:
    """Print the two costs and their ratio."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--lateness", type=float, metavar="SECONDS", help="in real time instead")
    parser.add_argument("--cpu", type=int, default=1)
    asked = parser.parse_args()
    if asked.lateness:
        lateness(asked.lateness, asked.cpu)
        return
    repeats = asked.repeats
    found: tuple[list[float], list[float]] = ([], [])
    compared = []
    for _ in range(repeats):
        found[0].append(tick_us())
        compared.append(tick_us(MODEL))
        with patch.object(decision, "consistency_step", _agrees):
            found[1].append(tick_us())
    ours, without = min(found[0]), min(found[1])
    print(f"{ours:.1f} µs a tick, {without:.1f} µs without the laws: {ours / without:.2f}")
    more = min(compared)
    print(f"{more:.1f} µs with the drive's own torque compared as well: {more / ours:.2f}")


if __name__ == "__main__":
    main()
