"""Ticks late and missed without EMG, beside two channels at 2 kHz, and beside a stream that stalls.

    python -m benchmarks.emg --seconds 20 --runs 3

The loop of the virtual rig runs as on a rig, with recorder and live estimator. EMG comes from an
outlet of Lab Streaming Layer in a program of its own, which runs in all three cases; in the third
it sends nothing from 6 s after it was found. The cases take turns, so that what else the machine
does is shared by them. The first second is left out: processes start then.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.loop import Timed
from rigidimeter.core.session import read_emg, read_samples
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.planning import plan
from rigidimeter.rig.acquisition import DeadlineClock, run_session
from rigidimeter.rig.acquisition.processes import LoopSide, Realtime, RecordingPlan, supervise
from rigidimeter.rig.devices import SimulatedRig, open_emg

SKIPPED_S = 1.0
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
            open_emg=open_emg,
        )
    finally:
        outlet.kill()
        outlet.communicate()
    samples = read_samples(folder / "samples.arrows")
    later = samples["time_s"] >= SKIPPED_S
    late_s, tick = samples["lateness_s"][later], samples["tick"][later]
    found = read_emg(folder)
    rate_hz = settings.rig.tick_rate_hz
    run = Run(
        tick.size,
        int(np.sum(late_s > 0.5 / rate_hz)),
        int(np.sum(np.diff(tick) - 1)),
        1e6 * float(np.quantile(late_s, 0.99)),
        0 if found is None else found.time_s.size,
        0 if found is None else int(np.sum(np.round(np.diff(found.emg_v["emg_v"])) != 1)),
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
    print("| | ticks run | late | missed | p99 of lateness, µs | samples of EMG | gaps in them |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    runs: dict[str, list[Run]] = {case: [] for case in asked.cases}
    with tempfile.TemporaryDirectory() as place:
        for k in range(asked.runs):
            for case in asked.cases:
                folder = Path(place) / f"{k}-{CASES.index(case)}"
                runs[case].append(measured(case, asked.seconds, folder, asked.priority))
    for case, found in runs.items():
        ran, late, missed, _, emg, lost = map(sum, zip(*found, strict=True))
        p99_us = float(np.median([run.p99_us for run in found]))
        print(f"| {case} | {ran} | {late} | {missed} | {p99_us:.0f} | {emg} | {lost} |")


if __name__ == "__main__":
    main()
