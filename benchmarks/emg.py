"""Ticks late and missed without EMG, beside two channels at 2 kHz, and beside a stream that stalls.

    python -m benchmarks.emg --seconds 20 --runs 3

The loop of the virtual rig runs as on a rig, with recorder and live estimator. EMG comes from an
outlet of Lab Streaming Layer in a program of its own, which runs in all three cases; in the third
it sends nothing from 6 s after it was found. The cases take turns, so that what else the machine
does is shared by them; the ratio is that of each session to the one without EMG of the same turn.
`cyclictest` of the loop's priority runs beside it, where it is installed. The first second is left
out: processes start then.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.loop import Timed, cyclictest, histogram_us, late_and_missed, quantiles_us
from benchmarks.quiet import Beside, Others, quiet_words, ratio_words
from rigidimeter.core.session import read_emg, read_samples
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.planning import plan
from rigidimeter.rig.acquisition import DeadlineClock, run_session
from rigidimeter.rig.acquisition.processes import (
    LoopSide,
    Realtime,
    RecordingPlan,
    SessionMemory,
    supervise,
)
from rigidimeter.rig.devices import SimulatedRig, open_emg

SKIPPED_S = 1.0
CPU = 1
CASES = ("without EMG", "two channels at 2 kHz", "a stream that stalls")
OUTLET = """\
import sys, time
import numpy as np
from pylsl import StreamInfo, StreamOutlet, local_clock
stalls = sys.argv[2] == "stalls"
out = StreamOutlet(StreamInfo(sys.argv[1], "EMG", 2, 2000.0, "float32", sys.argv[1]))
print("ready", flush=True)
start_s, sent, first_s = local_clock(), 0, None
while True:
    now = int((local_clock() - start_s) * 2000.0)
    if out.have_consumers() and first_s is None:
        first_s = local_clock()
    stalled = stalls and first_s is not None and local_clock() - first_s > 6.0
    if now > sent and not stalled:
        count = np.arange(sent, now)
        out.push_chunk(np.column_stack([count, count]).astype(np.float32),
                       (start_s + count / 2000.0).tolist())
    sent = now
    time.sleep(0.01)
"""


class Run(NamedTuple):
    """Ticks of one session, its lateness, and the EMG beside it."""

    ran: int
    late: int
    missed: int
    p99_us: float
    emg: int
    lost: int
    beside: Beside


def session(settings: Settings, duration_s: float, side: LoopSide) -> None:
    """Run the settings' protocol on the virtual rig in real time."""
    protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed)
    first = settings.subject[protocol.epochs[0].condition]
    rig = SimulatedRig(settings.rig, first, np.random.default_rng(settings.seed))
    clock, supervision = DeadlineClock(), Timed(side, duration_s)
    side.sink.event("clock_started", monotonic_s=clock.origin_s)
    side.ready()
    run_session(
        *(protocol, settings, rig, clock, side.sink),
        supervision=supervision,
        state_changed=side.sink.state_changed,
    )


def measured(case: str, seconds: float, folder: Path, priority: int) -> Run:
    """Run one session of a case."""
    name = f"Emg{os.getpid()}-{folder.name}"
    emg = {"source": "lsl", "stream": name, "muscles": ["biceps", "triceps"]}
    patient = {"missed_in_a_row": 1000, "stall_s": 1.0}
    settings = parse_settings({"loop": patient, **({} if case == CASES[0] else {"emg": emg})})
    others, rate_hz = Others(), settings.rig.tick_rate_hz
    reference: list[subprocess.Popen[str]] = []

    def console(shared: SessionMemory) -> None:
        status = shared.status.loop()
        if not reference and status is not None and status.time_s >= SKIPPED_S:
            reference.append(cyclictest(rate_hz, seconds - SKIPPED_S, CPU, priority))

    how = "stalls" if case == CASES[2] else "sends"
    command = [sys.executable, "-c", OUTLET, name, how]
    outlet = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        assert outlet.stdout is not None
        outlet.stdout.readline()
        ended = supervise(
            partial(session, settings, seconds),
            RecordingPlan(folder, settings, virtual=True),
            realtime=Realtime(priority=priority, attended=False),
            console=console if shutil.which("cyclictest") else lambda _: None,
            open_emg=open_emg,
        )
    finally:
        outlet.kill()
        outlet.communicate()
        counts = [histogram_us(one.communicate()[0]) for one in reference]
    beside = Beside(others.percent())
    if counts and counts[0].any():
        p99_us = quantiles_us(counts[0])[1]
        beside = beside._replace(
            reference_us=p99_us, reference_late=late_and_missed(counts[0], rate_hz)[0]
        )
    samples = read_samples(folder / "samples.arrows")
    later = samples["time_s"] >= SKIPPED_S
    late_s, tick = samples["lateness_s"][later], samples["tick"][later]
    found = read_emg(folder)
    run = Run(
        tick.size,
        int(np.sum(late_s > 0.5 / rate_hz)),
        int(np.sum(np.diff(tick) - 1)),
        1e6 * float(np.quantile(late_s, 0.99)),
        0 if found is None else found.time_s.size,
        0 if found is None else int(np.sum(np.round(np.diff(found.emg_v["emg_v"])) != 1)),
        beside,
    )
    said = "; ".join(ended.remarks) or "nothing is missing"
    print(f"  {case}: {run.late} late, {run.missed} missed; {said}", file=sys.stderr)
    return run


def main() -> None:
    parser = argparse.ArgumentParser(description="Ticks late with and without EMG.")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--priority", type=int, default=80)
    parser.add_argument("--cases", nargs="+", choices=CASES, default=CASES)
    asked = parser.parse_args()
    runs: dict[str, list[Run]] = {case: [] for case in asked.cases}
    with tempfile.TemporaryDirectory() as place:
        for k in range(asked.runs):
            for case in asked.cases:
                folder = Path(place) / f"{k}-{CASES.index(case)}"
                runs[case].append(measured(case, asked.seconds, folder, asked.priority))
    names = ("", "ticks run", "late", "missed", "p99 of lateness, µs", "ratio to that without EMG",
             "p99 of cyclictest, µs", "others, % of processors", "samples of EMG",
             "gaps in them")  # fmt: skip
    print(f"| {' | '.join(names)} |\n| --- |{' ---: |' * (len(names) - 1)}")
    for case, found in runs.items():
        print(f"| {case} | {' | '.join(_cells(found, runs.get(CASES[0], [])))} |")
    print(f"\n{quiet_words([run.beside for found in runs.values() for run in found])}")


def _cells(found: list[Run], without: list[Run]) -> list[str]:
    ratio = "–"
    if without and without is not found:
        ratio = ratio_words([run.p99_us for run in found], [run.p99_us for run in without])
    medians = (
        np.median([run.p99_us for run in found]),
        np.median([run.beside.reference_us for run in found]),
        np.median([run.beside.others_percent for run in found]),
    )
    ours_us, theirs_us, others = (f"{value:.0f}" for value in medians)
    ran, late, missed, emg, lost = (
        str(sum(getattr(run, name) for run in found))
        for name in ("ran", "late", "missed", "emg", "lost")
    )
    return [ran, late, missed, ours_us, ratio, theirs_us, others, emg, lost]


if __name__ == "__main__":
    main()
