"""Start the processes of a real-time session, see them through, and clean up after them.

    console    this process: the operator's. It starts the others and may be killed.
    loop       the rig, the control loop, nothing else. It stops the rig when the console is silent.
    recorder   from the rings into the session folder. It ends when the session is closed.
    estimator  J, B and K for the operator's eyes. The session goes on without it.
    emg        EMG from its source into a file beside the samples, where settings ask. The same.
    lsl        what is recorded, as streams for other programs, where settings ask for it. The same.

They share two rings and a page of status, and nothing that could make one wait for another. A
process that is left completes the session: the recorder if the loop dies, the loop if the recorder
dies, the console after both, the loop after the console and the recorder.
"""

from __future__ import annotations

import contextlib
import math
import multiprocessing
import os
import signal
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import EVENTS, read_events
from rigidimeter.core.settings import EmgSettings
from rigidimeter.rig.acquisition.processes.end_signals import held_back, signals_are_orders
from rigidimeter.rig.acquisition.processes.loop_process import LoopTarget, Realtime, loop_main
from rigidimeter.rig.acquisition.processes.recorder import Patience, RecordingPlan
from rigidimeter.rig.acquisition.processes.recorder_process import recorder_main
from rigidimeter.rig.acquisition.processes.ring_recovery import Recovered, complete
from rigidimeter.rig.acquisition.processes.session_memory import SessionMemory
from rigidimeter.rig.acquisition.processes.shared_status import SharedStatus
from rigidimeter.rig.acquisition.processes.status_values import Flag, ProcessCondition, Role
from rigidimeter.rig.acquisition.processes.watchdog import WatchedProcess
from rigidimeter.rig.devices.base import EmgSource

RING_S = 60.0
"""For how long the recorder may write nothing before samples are lost."""
POLL_S = 0.05
EMG_S = 30.0
"""For how long a source of EMG is waited for before the session."""
_AWAITING_EMG = "while the session waited for the source of EMG"


@dataclass(frozen=True)
class Ended:
    """How a session ended.

    Attributes
    ----------
    folder : Path
        Where the session is: another than was wanted if the disk was full and that was ordered.
    outcome, reason : str
        Of the session, as they stand in its folder; `outcome` is empty if it could not be closed.
    loop_exit : int or None
        Exit status of the loop's process, negative for a signal.
    samples : int
        How many the loop made; those that found no room in the ring are not among them.
    recovered : Recovered or None
        What had to be brought from the rings by another process than the recorder.
    remarks : tuple of str
        What else the operator should know.
    signals : sequence of int
        The signals that this process was sent meanwhile.
    """

    folder: Path
    outcome: str
    reason: str
    loop_exit: int | None
    samples: int
    recovered: Recovered | None
    remarks: tuple[str, ...]
    signals: Sequence[int] = ()


class EndedEarly(UserError):
    """A session was to end before it began; `signals` are those that this process was sent."""

    def __init__(self, sentence: str, signals: Sequence[int]) -> None:
        super().__init__(sentence)
        self.signals = tuple(signals)


def supervise(
    target: LoopTarget,
    recording: RecordingPlan,
    *,
    realtime: Realtime | None = None,
    patience: Patience | None = None,
    console: Callable[[SessionMemory], object] = lambda _: None,
    operator_seen_ns: Callable[[], int] | None = None,
    ring_s: float = RING_S,
    open_emg: Callable[[EmgSettings], EmgSource] | None = None,
) -> Ended:
    """Run a session in processes of its own and return how it ended.

    Ctrl-C asks the loop to abort; a second one, SIGTERM, SIGQUIT, and the closing of the terminal
    make it stop as for a fault.

    Parameters
    ----------
    target : callable
        Runs in the loop's process.
    recording : RecordingPlan
    realtime : Realtime
    patience : Patience
    console : callable
        Called in this process about 20 times a second with the rings and the shared status. It
        must return soon: the loop stops when this process is silent.
    operator_seen_ns : callable
        When the operator was last known to be there, in nanoseconds of CLOCK_MONOTONIC, for a
        console of which this process is only a part: the loop stops when that is too long ago.
        Now, as long as this process lives, if not given.
    ring_s : float
        How much the rings hold.
    open_emg : callable, optional
        Connects to the source of EMG where settings name one, in a process of its own; without it
        EMG is that of the virtual subject.

    Raises
    ------
    UserError
        If the session folder cannot be made, or the source of EMG does not answer.
    EndedEarly
        If the session was to end before the source of EMG answered.
    """
    realtime, patience = realtime or Realtime(), patience or Patience()
    context = multiprocessing.get_context("spawn")
    shared = SessionMemory.create(recording.settings.rig.tick_rate_hz, ring_s)
    status = shared.status
    status.join(Role.CONSOLE)
    processes: list[BaseProcess] = []

    def start(name: str, main: Callable[..., None], *arguments: object) -> BaseProcess:
        process = context.Process(target=main, args=arguments, name=f"rigidimeter-{name}")
        with held_back():
            process.start()
        processes.append(process)
        return process

    follow = _Follower(shared, console, operator_seen_ns or time.monotonic_ns)
    with signals_are_orders(status) as signals:
        try:
            me = os.getpid()
            recorder = start("recorder", recorder_main, recording, shared.names, patience, me)
            muscles, emg_remarks = None, None
            if recording.settings.emg.channels:
                _await_recorder(recorder, status)
                emg_remarks, theirs = context.Pipe(duplex=False)
                emg = (recording.settings, open_emg, shared.names, patience.stopping_s, me, theirs)
                muscles = start("emg", _emg_main, *emg)
                theirs.close()
                _await_emg(emg_remarks, status, follow, signals)
            loop = start("loop", loop_main, target, recording, shared.names, realtime, patience, me)
            _await_recorder(recorder, status)
            rig = recording.settings.rig
            estimator = None
            if realtime.live_estimate:
                online, stopping_s = recording.settings.online, patience.stopping_s
                estimating = (online, rig.tick_rate_hz, shared.names, stopping_s, me)
                estimator = start("estimator", _estimator_main, *estimating)
            streamer = None
            if recording.settings.sharing.lsl:
                sending = (recording.settings, shared.names, patience.stopping_s, me)
                streamer = start("lsl", _streamer_main, *sending)
            remarks = _see_through(loop, recorder, status, patience, follow)
            recorder_watch = WatchedProcess(recorder.pid or 0)
            try:
                remarks += complete(shared, recording, recorder_watch, patience, follow)
            finally:
                recorder_watch.close()
            for process in filter(None, (estimator, streamer, muscles)):
                _end(process, 2.0)
            if emg_remarks is not None:
                remarks += _said_of_emg(emg_remarks)
            folder = status.folder() or recording.folder
            outcome, reason, recovered = _outcome(folder)
            if shared.samples.refused:
                remarks.append(
                    f"{shared.samples.refused} samples found no room and are not recorded"
                )
            return Ended(
                folder,
                outcome,
                reason,
                loop.exitcode,
                shared.samples.written,
                recovered,
                (*follow.remarks, *remarks),
                signals,
            )
        finally:
            # Whatever happened here, the loop is given the time to stop the rig in order.
            status.raise_flag(Flag.END_ASKED)
            for process in reversed(processes):
                _end(process, patience.stopping_s)
            shared.leave()


class _Follower:
    """Keeps the console's heart beating and shows the session; an error in it ends the session."""

    def __init__(
        self,
        shared: SessionMemory,
        console: Callable[[SessionMemory], object],
        operator_seen_ns: Callable[[], int],
    ) -> None:
        self._shared, self._status, self._console = shared, shared.status, console
        self._operator_seen_ns = operator_seen_ns
        self.remarks: list[str] = []

    def __call__(self) -> None:
        self._status.beat(Role.CONSOLE, self._operator_seen_ns())
        if self.remarks:
            return
        try:
            self._console(self._shared)
        except Exception as error:
            with contextlib.suppress(OSError):  # of a terminal that is gone
                traceback.print_exc()
            self.remarks.append(f"the console failed ({type(error).__name__}: {error})")
            self._status.raise_flag(Flag.END_ASKED)


def _await_recorder(recorder: BaseProcess, status: SharedStatus) -> None:
    """Wait until the session folder is made."""
    until_s = time.monotonic() + 60.0
    while status.condition(Role.RECORDER) in (ProcessCondition.ABSENT, ProcessCondition.STARTING):
        status.beat(Role.CONSOLE)
        if not recorder.is_alive() or time.monotonic() > until_s:
            break
        time.sleep(0.01)
    if status.condition(Role.RECORDER) not in (ProcessCondition.READY, ProcessCondition.RUNNING):
        raise UserError(status.note(Role.RECORDER) or "the recorder's process did not start")


def _see_through(
    loop: BaseProcess,
    recorder: BaseProcess,
    status: SharedStatus,
    patience: Patience,
    follow: Callable[[], object],
) -> list[str]:
    """Keep the operator's heart beating until the loop has ended; return remarks."""
    remarks: list[str] = []
    recorder_warned = False
    while loop.is_alive():
        follow()
        if (
            not recorder_warned
            and not recorder.is_alive()
            and status.condition(Role.RECORDER) is not ProcessCondition.DONE
        ):
            recorder_warned = True
            remarks.append(f"the recorder ended while the loop ran ({_how(recorder)})")
        # The recorder ends a loop that no longer answers; this is for where it cannot.
        limits_s = {
            ProcessCondition.RUNNING: 2 * patience.loop_lost_s,
            ProcessCondition.STOPPING: patience.hung_s,
        }
        limit_s = limits_s.get(status.condition(Role.LOOP), math.inf)
        if status.age_s(Role.LOOP) > limit_s:
            remarks.append(f"the loop did not answer for {limit_s:g} s and was ended")
            loop.kill()
            loop.join(1.0)
            break
        loop.join(POLL_S)
    if loop.exitcode:
        remarks.append(f"the loop's process ended badly ({_how(loop)})")
    return remarks


def _how(process: BaseProcess) -> str:
    code = process.exitcode
    if code is None:
        return "it still runs"
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit status {code}"


def _outcome(folder: Path) -> tuple[str, str, Recovered | None]:
    """Return how the folder says the session ended, and what was recovered."""
    try:
        events, _ = read_events(folder / EVENTS)
    except (UserError, OSError) as error:
        return "", str(error), None
    recovered = None
    for event in events:
        if event.get("event") == "record_salvaged":
            recovered = Recovered(event["samples"], event["events"], event["missing_samples"])
    for event in reversed(events):
        if event.get("event") == "session_ended":
            return event["outcome"], event["reason"], recovered
    return "", "the session was not closed", recovered


def _end(process: BaseProcess, wait_s: float) -> None:
    """End a process that was started here."""
    process.join(wait_s)
    if process.is_alive():
        process.kill()
        process.join(2.0)


def _await_emg(
    remarks: Connection,
    status: SharedStatus,
    follow: Callable[[], object],
    signals: Sequence[int],
) -> None:
    """Wait until the source of EMG is connected: nothing moves before.

    The console is asked meanwhile, so that it can be ended there.
    """
    until_s = time.monotonic() + EMG_S
    while not remarks.poll(POLL_S):
        follow()
        if status.flag(Flag.EMERGENCY_STOP):
            raise EndedEarly(f"the emergency stop was pressed {_AWAITING_EMG}", signals)
        if status.flag(Flag.END_ASKED) or status.flag(Flag.ABORT_ASKED):
            raise EndedEarly(f"it was ended {_AWAITING_EMG}", signals)
        if time.monotonic() > until_s:
            raise UserError(f"the source of EMG did not answer within {EMG_S:g} s")
    try:
        refusal = remarks.recv()
    except EOFError:
        refusal = ["the process of the EMG ended before its source was connected"]
    if refusal:
        raise UserError(*refusal)


def _said_of_emg(remarks: Connection) -> list[str]:
    """Return what the process of the EMG left to say."""
    with remarks:
        try:
            return list(remarks.recv())
        except EOFError:
            return ["EMG ended before the session did: its process was ended"]


def _emg_main(*arguments: Any) -> None:
    """Record EMG; what it needs is loaded in its own process alone."""
    from rigidimeter.rig.acquisition.processes.emg_process import emg_main

    emg_main(*arguments)


def _estimator_main(*arguments: Any) -> None:
    """Run the live estimate; what it needs is loaded in its own process alone."""
    from rigidimeter.rig.acquisition.processes.live_estimate import estimator_main

    estimator_main(*arguments)


def _streamer_main(*arguments: Any) -> None:
    """Send what is recorded as streams; what that needs is loaded in its own process alone."""
    from rigidimeter.rig.acquisition.processes.lsl_streams import streamer_main

    streamer_main(*arguments)
