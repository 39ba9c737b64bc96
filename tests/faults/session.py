"""A session in processes of its own, on a rig that its file describes: for tests to kill.

    python -m tests.faults.session RIG.toml FOLDER [usual]

RIG.toml may be `virtual`: the simulated rig. With `usual` the processes wait for each other as long
as `rigidimeter run` has them. Prints one line of JSON with the process ids when the loop runs, and
one with the ending.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.planning import plan
from rigidimeter.rig.acquisition import DeadlineClock, run_session
from rigidimeter.rig.acquisition.processes import (
    LoopSide,
    Patience,
    ProcessCondition,
    Realtime,
    RecordingPlan,
    Role,
    SessionMemory,
    supervise,
)
from rigidimeter.rig.devices import SimulatedRig, load_rig
from rigidimeter.rig.devices.base import Rig

RATE_HZ = {"cia402": 500.0, "ascii": 50.0, "virtual": 500.0}
SPEED_DEG_S = {"cia402": 126.0, "ascii": 38.0, "virtual": 126.0}
VIRTUAL = Path("virtual")
PATIENCE = Patience(loop_lost_s=0.5, stopping_s=3.0, hung_s=1.5)
CONSOLE_LOST_S, RECORDER_LOST_S = 0.5, 1.0
ALONE = {"console_lost_s": CONSOLE_LOST_S, "recorder_lost_s": RECORDER_LOST_S}


def settings_for(drive: str, usual: bool = False) -> Settings:
    """Return settings under which the arm swings to and fro for a while.

    With `usual` the loop goes on alone for as long as by default.
    """
    rate_hz = RATE_HZ[drive]
    slow = drive == "ascii"
    guard: dict[str, Any] = {"reaction_time_s": 0.03}
    if slow:
        guard = {
            "reaction_time_s": 0.12,
            "speed_limit_deg_s": 60.0,
            "acceleration_limit_deg_s2": 1500.0,
            "stale_s": 0.2,
            "following_limit_deg": 4.0,
        }
    return parse_settings(
        {
            "rig": {
                "tick_rate_hz": rate_hz,
                "torque": {"rate_hz": rate_hz},
                "motion": {"rate_hz": rate_hz},
            },
            "controller": {"torque_cutoff_hz": 10.0},
            "guard": guard,
            "loop": {"missed_in_a_row": 100, "stall_s": 0.4, **({} if usual else ALONE)},
            "sinusoid": {
                "amplitude_deg": 3.0 if slow else 10.0,
                "frequency_hz": 2.0,
                "motion_s": 20.0,
                "duration_s": 20.0,
            },
            "protocol": {
                "blocks": [{"task": "sinusoid", "epochs": 1}],
                "rests_s": [0.5],
                "return_s": 0.5,
            },
        }
    )


def run_loop(settings: Settings, rig_path: Path, side: LoopSide) -> None:
    """Run the session; the target of the loop's process."""
    clock = DeadlineClock()
    rig: Rig
    if rig_path == VIRTUAL:
        rig = SimulatedRig(settings.rig, settings.subject["OFF"], np.random.default_rng(1))
    else:
        rig = load_rig(rig_path).build(clock.now_s, settings.rig.tick_rate_hz)
    protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, 1)
    try:
        rig.connect()
        rig.configure()
        side.ready()
        run_session(
            protocol,
            settings,
            rig,
            clock,
            side.sink,
            supervision=side.supervision,
            state_changed=side.sink.state_changed,  # as `run` does: the recorder waits for the end
        )
    finally:
        rig.close()


class Console:
    """Says who is who, once, and if asked what the names of the shared memory begin with."""

    def __init__(self, memory: bool) -> None:
        self.said = False
        self.memory = memory

    def __call__(self, shared: SessionMemory) -> None:
        shared_status = shared.status
        if not self.said and shared_status.condition(Role.LOOP) is ProcessCondition.RUNNING:
            self.said = True
            said: dict[str, int | str] = {role.name: shared_status.pid(role) for role in Role}
            if self.memory:
                said["MEMORY"] = shared_status.name.rpartition("-")[0]
            print(json.dumps(said), flush=True)


def drive_of(rig: Path) -> str:
    """Return which drive a rig file names."""
    if rig == VIRTUAL:
        return "virtual"
    return "ascii" if 'driver = "ascii"' in rig.read_text() else "cia402"


def main(rig: str, folder: str, patience: str = "") -> None:
    usual = patience == "usual"
    settings = settings_for(drive_of(Path(rig)), usual)
    ended = supervise(
        partial(run_loop, settings, Path(rig)),
        RecordingPlan(Path(folder), settings, seeds={"session": 1}),
        realtime=Realtime(live_estimate=False, attended=False),
        patience=Patience() if usual else PATIENCE,
        console=Console(usual),
    )
    print(json.dumps({**asdict(ended), "folder": str(ended.folder)}), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
