"""How late the loop's ticks are, beside `cyclictest` on the same processor at the same time.

    python -m benchmarks.loop --seconds 60 --runs 3

The loop runs as it does on a rig: in a process of its own, with recorder, live estimator and
console beside it, and a Python program that never rests. Its lateness is read from the session
folder, where every tick that was run must be. `cyclictest` is C, does nothing but wake up, and has
the same priority: what it shows is the machine. A late tick wakes up by more than half a tick after
its time. Both leave out a tick whose time has gone by when the one before it wakes up, and
`cyclictest` does not count what it left out: whoever wakes up by n whole ticks late misses n. The
figures are medians over the runs.
"""

from __future__ import annotations

import argparse
import math
import shutil
import statistics
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rigidimeter.core.session import read_samples
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.planning import plan
from rigidimeter.rig.acquisition import Command, DeadlineClock, Order, run_session
from rigidimeter.rig.acquisition.processes import (
    Ended,
    LoopSide,
    Realtime,
    RecordingPlan,
    SessionMemory,
    supervise,
)
from rigidimeter.rig.devices import SimulatedRig

PRIORITY = 80
SHARES = (0.5, 0.99, 0.999)
HISTOGRAM_US = 50_000
SKIPPED_S = 1.0
"""The first second is left out, of both: processes start then."""


class Timed:
    """What is supervision a session, and an order to end it after some time."""

    def __init__(self, side: LoopSide, duration_s: float) -> None:
        self.attended = False
        self._supervision, self._end_s, self._now_s = side.supervision, duration_s, 0.0

    def cause(self, now_s: float) -> int:
        self._now_s = now_s
        return self._supervision.cause(now_s)

    @property
    def measured(self) -> float:
        return self._supervision.measured

    def order(self) -> Order:
        if self._now_s >= self._end_s:
            self._end_s = math.inf
            return Order(Command.ABORT)
        return self._supervision.order()


def virtual_session(settings: Settings, duration_s: float, side: LoopSide) -> None:
    """Run the settings' protocol on the virtual rig in real time."""
    protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed)
    first = settings.subject[protocol.epochs[0].condition]
    rig = SimulatedRig(settings.rig, first, np.random.default_rng(settings.seed))
    clock = DeadlineClock()
    supervision = Timed(side, duration_s)
    side.ready()
    run_session(
        protocol,
        settings,
        rig,
        clock,
        side.sink,
        supervision=supervision,
        state_changed=side.sink.state_changed,
    )


class Lateness(NamedTuple):
    """Of one run. Quantiles in µs, of ours and of cyclictest; the rest counts ticks."""

    ours_us: tuple[float, ...]
    theirs_us: tuple[float, ...]
    ours_late: int
    theirs_late: int
    ours_missed: int
    theirs_missed: int
    recorded: int
    not_recorded: int
    ended: Ended


def cyclictest(
    rate_hz: float, seconds: float, cpu: int, priority: int = PRIORITY
) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [
            *["cyclictest", "--quiet", "--mlockall", "--threads=1", f"--priority={priority}"],
            *[f"--affinity={cpu}", f"--interval={round(1e6 / rate_hz)}"],
            *[f"--duration={math.ceil(seconds)}", f"--histogram={HISTOGRAM_US}"],
        ],
        stdout=subprocess.PIPE,
        text=True,
    )


def histogram_us(text: str) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Return how often cyclictest was so many µs late; what was later counts in the last place."""
    counts = np.zeros(HISTOGRAM_US + 1, dtype=np.int64)
    for line in text.splitlines():
        if line.startswith("# Histogram Overflows:"):
            counts[-1] = int(line.split()[-1])
        elif line and line[0].isdigit():
            late_us, count = line.split()
            counts[int(late_us)] = int(count)
    return counts


def late_and_missed(counts: np.ndarray[Any, np.dtype[np.int64]], rate_hz: float) -> tuple[int, int]:
    """Return how many ticks of a histogram were late, and how many were left out after them."""
    late_us, tick_us = np.arange(counts.size), 1e6 / rate_hz
    return int(counts[late_us > 0.5 * tick_us].sum()), int(
        counts @ (late_us // tick_us).astype(int)
    )


def quantiles_us(counts: np.ndarray[Any, np.dtype[np.int64]]) -> tuple[float, ...]:
    below = np.cumsum(counts)
    return tuple(float(np.searchsorted(below, share * below[-1])) for share in SHARES)


def measure(settings: Settings, seconds: float, folder: Path, cpu: int) -> Lateness:
    """Run the loop once, beside cyclictest and a busy program."""
    rate_hz = settings.rig.tick_rate_hz
    busy = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    beside: list[subprocess.Popen[str]] = []

    def console(shared: SessionMemory) -> None:
        status = shared.status.loop()
        if not beside and status is not None and status.time_s >= SKIPPED_S:
            beside.append(cyclictest(rate_hz, seconds - SKIPPED_S, cpu))

    try:
        ended = supervise(
            partial(virtual_session, settings, seconds),
            RecordingPlan(folder, settings, virtual=True),
            realtime=Realtime(priority=PRIORITY, cpu=cpu, attended=False),
            console=console,
        )
    finally:
        busy.kill()
        busy.wait()
    if not beside:
        raise SystemExit(f"the loop did not run long enough: {ended.reason} {ended.remarks}")
    counts = histogram_us(beside[0].communicate()[0])
    samples = read_samples(folder / "samples.arrows")
    late_s = samples["lateness_s"][samples["time_s"] >= SKIPPED_S]
    missed = int(np.sum(np.diff(samples["tick"][samples["time_s"] >= SKIPPED_S]) - 1))
    theirs_late, theirs_missed = late_and_missed(counts, rate_hz)
    recorded = np.unique(samples["tick"]).size
    return Lateness(
        tuple(1e6 * float(q) for q in np.quantile(late_s, SHARES)),
        quantiles_us(counts),
        int(np.sum(late_s > 0.5 / rate_hz)),
        theirs_late,
        missed,
        theirs_missed,
        recorded,
        ended.samples - recorded,
        ended,
    )


def rows(found: list[Lateness], rate_hz: float) -> list[str]:
    """Return the table of some runs."""
    lines = []
    for k, share in enumerate(SHARES):
        ours = statistics.median(run.ours_us[k] for run in found)
        theirs = statistics.median(run.theirs_us[k] for run in found)
        ratio = statistics.median(run.ours_us[k] / max(run.theirs_us[k], 1.0) for run in found)
        lines.append(
            f"| {rate_hz:g} Hz: p{100 * share:g} of lateness / cyclictest "
            f"| {ours:.0f} µs | {theirs:.0f} µs | {ratio:.2f} |"
        )
    for what in ("late", "missed"):
        ours, theirs = (
            statistics.median(getattr(run, f"{whose}_{what}") for run in found)
            for whose in ("ours", "theirs")
        )
        lines.append(f"| {rate_hz:g} Hz: {what} ticks / of cyclictest | {ours:g} | {theirs:g} | |")
    lines.append(
        f"| {rate_hz:g} Hz: ticks recorded / not recorded "
        f"| {sum(run.recorded for run in found)} | {sum(run.not_recorded for run in found)} | |"
    )
    return lines


def patient(rate_hz: float) -> Settings:
    """Return settings with which a slow machine is measured rather than stopped."""
    return parse_settings(
        {
            "rig": {"tick_rate_hz": rate_hz, "torque": {"rate_hz": rate_hz},
                    "motion": {"rate_hz": rate_hz}},
            "loop": {"missed_in_a_row": 1000, "stall_s": 1.0},
        }
    )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description="How late the loop's ticks are.")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--rates", type=float, nargs="+", default=[1000.0, 100.0])
    parser.add_argument("--cpu", type=int, default=1)
    asked = parser.parse_args()
    if shutil.which("cyclictest") is None:
        raise SystemExit("cyclictest is not installed; it is in the package rt-tests")
    print("| what / reference | ours | reference | ratio |\n| --- | ---: | ---: | ---: |")
    for rate_hz in asked.rates:
        settings = patient(rate_hz)
        found = []
        for _ in range(asked.runs):
            with tempfile.TemporaryDirectory() as folder:
                found.append(measure(settings, asked.seconds, Path(folder) / "s", asked.cpu))
            print(f"run: {found[-1]}", file=sys.stderr)
        print("\n".join(rows(found, rate_hz)), flush=True)


if __name__ == "__main__":
    main()
