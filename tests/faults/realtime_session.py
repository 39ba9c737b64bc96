"""A session in processes of its own, for tests that kill one of them; not a test itself.

`python realtime_session.py FOLDER SECONDS [live] [save=OTHER]` prints how it ended as JSON. The
file `pids.json` beside the folder names the processes and their memory. With `save=` the console
orders another folder as soon as the recorder is in trouble.
"""

import ctypes
import json
import os
import signal
import sys
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from rigidimeter.core.session import Sample
from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.acquisition import Command, DeadlineClock
from rigidimeter.rig.acquisition.processes import (
    Patience,
    ProcessCondition,
    Realtime,
    RecordingPlan,
    Role,
    supervise,
)
from rigidimeter.rig.guard import Cause

RATE_HZ = 500
PR_SET_PDEATHSIG = 1  # of prctl(2)
PATIENCE = Patience(poll_s=0.05, loop_lost_s=1.0, hung_s=2.0, disk_s=1.0)
SETTINGS = parse_settings({"loop": {"console_lost_s": 1.0, "recorder_lost_s": 1.0}})


def ticks(duration_s, side):
    """Write an epoch of ticks until it is over or there is a cause to stop."""
    sink = side.sink
    side.ready()
    sink.event("session_started", time_s=0.0)
    sink.event("epoch_started", epoch=1, label="one", task="prbs", condition="rest", time_s=0.0)
    clock = DeadlineClock()
    cause = tick = 0
    aborted = False
    while not cause and not aborted and tick < duration_s * RATE_HZ:
        due_s = tick / RATE_HZ
        now_s = clock.wait_until(due_s)
        sink.sample(Sample(tick, now_s, now_s - due_s, 1, 0.0, *[float(tick)] * 8, 0))
        cause = side.supervision.cause(now_s)
        aborted = side.supervision.order().command is Command.ABORT
        tick += 1
    outcome, reason = ("fail", Cause(cause).sentence) if cause else ("success", "")
    if aborted and not cause:
        outcome, reason = "abort", "aborted"
    sink.event("epoch_ended", epoch=1, time_s=tick / RATE_HZ, outcome=outcome, reason=reason)
    sink.close(tick / RATE_HZ, outcome, reason)


def main() -> None:
    # A test that is killed ends nothing itself, and a full disk keeps a session for ever.
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    test = os.getppid()
    folder, duration_s = Path(sys.argv[1]), float(sys.argv[2])
    options = dict(option.partition("=")[::2] for option in sys.argv[3:])
    save_to = Path(options["save"]) if "save" in options else None
    seen: dict[str, Any] = {}

    def console(shared) -> None:
        shared_status = shared.status
        pids = {
            **{role.name: shared_status.pid(role) for role in Role},
            "MEMORY": shared_status.name.rpartition("-")[0],
        }
        if seen.get("pids") != pids:
            seen["pids"] = pids
            part = folder.with_name("pids.part")
            part.write_text(json.dumps(pids))
            part.replace(folder.with_name("pids.json"))
        if shared_status.condition(Role.RECORDER) is ProcessCondition.TROUBLE:
            seen["trouble"] = shared_status.note(Role.RECORDER)
            if save_to is not None:
                shared_status.ask_folder(save_to)
        status, live = shared_status.loop(), shared_status.live()
        if status is not None:
            seen["tick"] = status.tick
        if live is not None:
            seen["live_tick"] = live.tick

    ended = supervise(
        partial(ticks, duration_s),
        RecordingPlan(folder, SETTINGS, virtual=True),
        realtime=Realtime(priority=0, lock_memory=False, live_estimate="live" in sys.argv),
        patience=PATIENCE,
        console=console,
    )
    if os.getppid() != test:  # nobody will bring in what is in memory
        for path in Path("/dev/shm").glob(f"{seen['pids']['MEMORY']}-*"):
            path.unlink()
    print(json.dumps({**asdict(ended), "folder": str(ended.folder), "seen": seen}))


if __name__ == "__main__":
    main()
