"""The rig on true wires: how late its loop is, and whether the paper's protocol gives the arm back.

The wires end in an emulated arm with known J, B, K in another process: torque over UDP as from an
ATI Net F/T, a CiA 402 drive on CANopen over a multicast group.

    python -m benchmarks.wires loop --seconds 60 --runs 3     beside cyclictest
    python -m benchmarks.wires protocol [--epochs 4]          Sec. 2.3 and 2.4; minutes long
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks import loop
from rigidimeter.acquisition.clock import DeadlineClock
from rigidimeter.acquisition.processes.loop_process import LoopSide, LoopTarget, Realtime
from rigidimeter.acquisition.processes.recorder import Recording
from rigidimeter.acquisition.processes.supervise import supervise
from rigidimeter.acquisition.session_run import run_session
from rigidimeter.devices.rigfile import load_rig
from rigidimeter.experiment import Protocol, plan
from rigidimeter.recording import read_session
from rigidimeter.settings import Settings, parse_settings
from rigidimeter.study import estimate

TRUTH = (0.0045, 0.1368, 1.751)


@contextmanager
def emulated(rig: Path, drive: str = "cia402") -> Iterator[None]:
    """Host an emulated rig in a process of its own; `rig` is the file that reaches it."""
    command = [sys.executable, "-m", "rigidimeter", "emulate", "--drive", drive]
    joint = [str(value) for value in TRUTH]
    process = subprocess.Popen(
        [*command, "--rig-out", str(rig), "--joint", *joint],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        if not process.stdout.readline():
            raise SystemExit("the emulated rig did not start")
        yield
    finally:
        process.stdin.close()
        process.wait(10.0)
        process.stdout.close()


def session_on(
    rig_path: Path, settings: Settings, protocol: Protocol, duration_s: float, side: LoopSide
) -> None:
    """Run a protocol on the rig of a file, for at most so long."""
    clock = DeadlineClock()
    rig = load_rig(rig_path).build(clock.now_s, settings.rig.tick_rate_hz)
    try:
        rig.connect()
        side.sink.event("rig_configured", **rig.configure())
        supervision = loop.Timed(side, clock.now_s() + duration_s)
        side.ready()
        run_session(
            protocol,
            settings,
            rig,
            clock,
            side.sink,
            supervision=supervision,
            zero_first=True,
            state_changed=side.sink.state_changed,
        )
    finally:
        rig.close()


def workload(rig_path: Path, settings: Settings, duration_s: float) -> LoopTarget:
    """Return the target of a loop's process."""
    protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed)
    return partial(session_on, rig_path, settings, protocol, duration_s)


def paper_protocol(epochs: int) -> None:
    """Run Sec. 2.3 and 2.4 on the wires and print what comes back, beside the truth."""
    settings = parse_settings(
        {
            "protocol": {
                "blocks": [
                    {"task": "prbs", "epochs": epochs},
                    {"task": "sinusoid", "epochs": epochs},
                ]
            }
        }
    )
    protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed)
    with tempfile.TemporaryDirectory() as name:
        folder, rig = Path(name) / "session", Path(name) / "rig.toml"
        with emulated(rig):
            ended = supervise(
                partial(session_on, rig, settings, protocol, protocol.total_s + 60.0),
                Recording(folder, settings, tuple(asdict(epoch) for epoch in protocol.epochs)),
                realtime=Realtime(attended=False),
            )
        print(f"session: {ended.outcome} {ended.reason} {'; '.join(ended.remarks)}")
        epochs_read, notices = read_session(folder)
        for notice in notices:
            print(notice.text)
        analysis = estimate(epochs_read, settings=settings)
    fits = [fit for fit in analysis.fits if fit.outcome.kind == "included"]
    found = np.array(
        [[fit.inertia_kg_m2, fit.damping_nm_s_rad, fit.stiffness_nm_rad] for fit in fits]
    )
    print("| | J, kg·m² | B, N·m·s/rad | K, N·m/rad |\n| --- | ---: | ---: | ---: |")
    print(f"| truth | {TRUTH[0]} | {TRUTH[1]} | {TRUTH[2]} |")
    for fit, row in zip(fits, found, strict=True):
        print(f"| epoch {fit.epoch} | {row[0]:.6f} | {row[1]:.4f} | {row[2]:.4f} |")
    error = 100 * (found.mean(0) / TRUTH - 1)
    print(f"| mean, error in % | {error[0]:+.2f} | {error[1]:+.2f} | {error[2]:+.2f} |")
    for score in analysis.scores:
        print(f"score {score.epoch}: work {score.work_j:.4f} J, {score.outcome.kind}")


def main() -> None:
    if sys.argv[1:2] == ["loop"]:
        del sys.argv[1]
        with tempfile.TemporaryDirectory() as name:
            rig = Path(name) / "rig.toml"
            with emulated(rig):
                loop.main({"RDT + CANopen": partial(workload, rig)})
        return
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["protocol"])
    parser.add_argument("--epochs", type=int, default=4)
    paper_protocol(parser.parse_args().epochs)


if __name__ == "__main__":
    main()
