"""The loop's process: the rig, the control loop, nothing else.

It waits for the recorder, runs its target, and closes the record whatever the target did. Only then
is it an ordinary process again, and completes the session if the recorder could not.
"""

from __future__ import annotations

import os
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from rigidimeter.core.errors import UserError
from rigidimeter.rig.acquisition.processes.end_signals import raise_flags
from rigidimeter.rig.acquisition.processes.realtime_scheduling import Prepared, prepare_loop_process
from rigidimeter.rig.acquisition.processes.recorder import Patience, RecordingPlan
from rigidimeter.rig.acquisition.processes.ring_recovery import complete
from rigidimeter.rig.acquisition.processes.ring_writer import RingSink, SharedSupervision
from rigidimeter.rig.acquisition.processes.session_memory import SessionMemory
from rigidimeter.rig.acquisition.processes.shared_status import SharedStatus
from rigidimeter.rig.acquisition.processes.status_values import Flag, ProcessCondition, Role
from rigidimeter.rig.acquisition.processes.watchdog import WatchedProcess


@dataclass(frozen=True)
class Realtime:
    """What the loop's process asks for; see `prepare_loop_process`.

    Attributes
    ----------
    priority : int
        Of SCHED_FIFO; 0 asks for none.
    cpu : int or None
    lock_memory : bool
    live_estimate : bool
        Whether J, B and K are estimated while the session runs.
    attended : bool
        Whether an operator is there who can go on after a hold.
    confirmed : str
        What was written where nobody is: that nobody is in the rig. Recorded.
    """

    priority: int = 80
    cpu: int | None = None
    lock_memory: bool = True
    live_estimate: bool = True
    attended: bool = True
    confirmed: str = ""


@dataclass(frozen=True)
class LoopSide:
    """What the loop's target is given.

    `ready` is to be called once the rig is configured and all objects are made, just before the
    first tick: it prepares the process, stores what was permitted, and returns it.
    """

    sink: RingSink
    supervision: SharedSupervision
    ready: Callable[[], Prepared]


LoopTarget = Callable[[LoopSide], object]
"""Runs the session and closes the sink. It must be picklable: a function of a module, or a
`functools.partial` of one."""


def loop_main(
    target: LoopTarget,
    recording: RecordingPlan,
    names: tuple[str, str, str],
    realtime: Realtime,
    patience: Patience,
    console_pid: int,
) -> None:
    """Run the target, and see the record closed after it; the target of the loop's process.

    Parameters
    ----------
    target : callable
    recording : RecordingPlan
    names : tuple of str
        Of the sample ring, the event ring and the shared status.
    realtime : Realtime
    patience : Patience
    console_pid : int
        The process that started this one.
    """
    shared = SessionMemory.attach_or_end(names)
    status = shared.status
    raise_flags(status)
    status.join(Role.LOOP)
    if not _recorder_is_there(status, console_pid):
        shared.leave()
        sys.exit(1)
    recorder = WatchedProcess(status.pid(Role.RECORDER))
    rate_hz, limits = recording.settings.rig.tick_rate_hz, recording.settings.loop
    sink = RingSink(shared, rate_hz)
    supervision = SharedSupervision(
        shared,
        console_lost_s=limits.console_lost_s,
        recorder_lost_s=limits.recorder_lost_s,
        # A recorder that is silent is named as that first.
        max_lag=round((limits.recorder_lost_s + 2 * patience.poll_s) * rate_hz),
        stall_s=limits.stall_s,
        attended=realtime.attended,
        console_pid=console_pid,
    )

    if not realtime.attended:
        sink.event("unattended", time_s=0.0, confirmed=realtime.confirmed)

    def ready() -> Prepared:
        shared.touch()
        prepared = prepare_loop_process(
            priority=realtime.priority, cpu=realtime.cpu, lock_memory=realtime.lock_memory
        )
        sink.event("loop_prepared", **prepared.facts())
        _say(str(prepared))
        return prepared

    code = 0
    try:
        target(LoopSide(sink, supervision, ready))
        sink.close(sink.last_time_s, "fail", "the loop ended without closing the session")
    except UserError as error:  # a sentence, which stands in the record and is shown at the end
        code = 1
        sink.close(sink.last_time_s, "fail", str(error))
    except BaseException as error:
        code = 1
        with suppress(OSError):
            traceback.print_exc()
        with suppress(ValueError):
            sink.close(sink.last_time_s, "fail", f"{type(error).__name__}: {error}")
    finally:
        status.set_condition(Role.LOOP, ProcessCondition.FAILED if code else ProcessCondition.DONE)
        _leave_real_time()
        remarks = complete(shared, recording, recorder, patience, lambda: status.beat(Role.LOOP))
        if os.getppid() != console_pid:  # otherwise the console finds the same and says it
            _say("\n".join(remarks))
        shared.leave()
    sys.exit(code)


def _say(text: str) -> None:
    """Tell the operator, if the terminal is still there."""
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)


def _recorder_is_there(status: SharedStatus, console_pid: int) -> bool:
    """Wait for the recorder; return False if it will not come."""
    while status.condition(Role.RECORDER) not in (ProcessCondition.READY, ProcessCondition.RUNNING):
        failed = status.condition(Role.RECORDER) is ProcessCondition.FAILED
        if failed or status.flag(Flag.END_ASKED) or os.getppid() != console_pid:
            return False
        time.sleep(0.005)
    return True


def _leave_real_time() -> None:
    """Be an ordinary process again: what follows takes time and touches files."""
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
