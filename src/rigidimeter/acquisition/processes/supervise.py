"""Start the processes of a real-time session, see them through, and clean up after them.

    console    this process: the operator's. It starts the others and may be killed.
    loop       the rig, the control loop, nothing else. It stops the rig when the console is silent.
    recorder   from the rings into the session folder. It ends when the session is closed.
    estimator  J, B and K for the operator's eyes. The session goes on without it.

They share two rings and a page of status, and nothing that could make one wait for another. A
process that is left completes the session: the recorder if the loop dies, the loop if the recorder
dies, the console after both, the loop after the console and the recorder.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from types import FrameType
from typing import Any

from rigidimeter.acquisition.processes.loop_process import LoopTarget, Realtime, loop_main
from rigidimeter.acquisition.processes.recorder import Patience, Recording
from rigidimeter.acquisition.processes.recorder_process import recorder_main
from rigidimeter.acquisition.processes.ring_recovery import Recovered, complete
from rigidimeter.acquisition.processes.session_memory import SessionMemory
from rigidimeter.acquisition.processes.shared_status import Condition, Flag, Role, SharedStatus
from rigidimeter.acquisition.processes.watchdog import WatchedProcess
from rigidimeter.acquisition.run_states import Command, Order
from rigidimeter.errors import UserError
from rigidimeter.recording.event_log import read_events
from rigidimeter.recording.session_folder import EVENTS

RING_S = 60.0
"""For how long the recorder may write nothing before samples are lost."""
LOOK_S = 0.05
OF_THE_TERMINAL = (signal.SIGINT, signal.SIGHUP, signal.SIGTSTP)
"""What a terminal sends to every process of a group."""


@dataclass(frozen=True)
class Ended:
    """How a session ended.

    Attributes
    ----------
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
    """

    outcome: str
    reason: str
    loop_exit: int | None
    samples: int
    recovered: Recovered | None
    remarks: tuple[str, ...]


def supervise(
    target: LoopTarget,
    recording: Recording,
    *,
    realtime: Realtime | None = None,
    patience: Patience | None = None,
    console: Callable[[SharedStatus], object] = lambda _: None,
    ring_s: float = RING_S,
) -> Ended:
    """Run a session in processes of its own and return how it ended.

    Ctrl-C asks the loop to abort; a second one, SIGTERM, and the closing of the terminal make it
    stop as for a fault.

    Parameters
    ----------
    target : callable
        Runs in the loop's process.
    recording : Recording
    realtime : Realtime
    patience : Patience
    console : callable
        Called in this process about 20 times a second with the shared status. It must return soon:
        the loop stops when this process is silent.
    ring_s : float
        How much the rings hold.

    Raises
    ------
    UserError
        If the session folder cannot be made.
    """
    realtime, patience = realtime or Realtime(), patience or Patience()
    context = multiprocessing.get_context("spawn")
    shared = SessionMemory.create(recording.settings.rig.tick_rate_hz, ring_s)
    status = shared.status
    status.join(Role.CONSOLE)
    processes: list[BaseProcess] = []

    def start(name: str, main: Callable[..., None], *arguments: object) -> BaseProcess:
        process = context.Process(target=main, args=arguments, name=f"rigidimeter-{name}")
        with _undisturbed():
            process.start()
        processes.append(process)
        return process

    try:
        with _signals_are_orders(status):
            me = os.getpid()
            recorder = start("recorder", recorder_main, recording, shared.names, patience, me)
            loop = start("loop", loop_main, target, recording, shared.names, realtime, patience, me)
            _await_recorder(recorder, status)
            rig = recording.settings.rig
            estimator = None
            if realtime.live_estimate:
                estimator = start(
                    "estimator",
                    _estimator_main,
                    recording.settings.online,
                    rig.tick_rate_hz,
                    shared.names,
                    patience.stopping_s,
                )
            remarks = _see_through(loop, recorder, status, patience, console)
            recorder_watch = WatchedProcess(recorder.pid or 0)
            try:
                remarks += complete(Role.CONSOLE, shared, recording, recorder_watch, patience)
            finally:
                recorder_watch.close()
            if estimator is not None:
                _end(estimator, 2.0)
        outcome, reason, recovered = _outcome(recording)
        if shared.samples.refused:
            remarks.append(f"{shared.samples.refused} samples found no room and are not recorded")
        samples = shared.samples.written
        return Ended(outcome, reason, loop.exitcode, samples, recovered, tuple(remarks))
    finally:
        # Whatever happened here, the loop is given the time to stop the rig in order.
        status.raise_flag(Flag.END_ASKED)
        for process in reversed(processes):
            _end(process, patience.stopping_s)
        shared.unlink()
        shared.close()


@contextlib.contextmanager
def _undisturbed() -> Iterator[None]:
    """Start a process that Ctrl-C and the terminal's end do not reach while it still loads.

    Those go to the whole group of processes, and a new one has not yet come to where it ignores
    them. It inherits what is blocked here; what comes meanwhile comes to this process afterwards.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, OF_THE_TERMINAL)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _signals_are_orders(status: SharedStatus) -> Iterator[None]:
    """Turn the signals of the terminal and SIGTERM into orders to the loop."""
    count = 0

    def asked(number: int, _: FrameType | None) -> None:
        nonlocal count
        count += 1
        if number == signal.SIGINT and count == 1:
            with contextlib.suppress(ValueError):  # so many orders wait that nobody takes them
                status.post(Order(Command.ABORT))
                return
        status.raise_flag(Flag.END_ASKED)

    numbers: list[int] = []
    if threading.current_thread() is threading.main_thread():
        numbers = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
        if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
            numbers.remove(signal.SIGHUP)  # started with `nohup`, which is meant so
    before = {number: signal.signal(number, asked) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _await_recorder(recorder: BaseProcess, status: SharedStatus) -> None:
    """Wait until the session folder is made."""
    until_s = time.monotonic() + 60.0
    while status.condition(Role.RECORDER) in (Condition.ABSENT, Condition.STARTING):
        status.beat(Role.CONSOLE)
        if not recorder.is_alive() or time.monotonic() > until_s:
            break
        time.sleep(0.01)
    if status.condition(Role.RECORDER) not in (Condition.READY, Condition.RUNNING):
        raise UserError(status.note(Role.RECORDER) or "the recorder's process did not start")


def _see_through(
    loop: BaseProcess,
    recorder: BaseProcess,
    status: SharedStatus,
    patience: Patience,
    console: Callable[[SharedStatus], object],
) -> list[str]:
    """Keep the operator's heart beating until the loop has ended; return remarks."""
    remarks: list[str] = []
    recorder_told = console_failed = False
    while loop.is_alive():
        status.beat(Role.CONSOLE)
        try:
            if not console_failed:
                console(status)
        except Exception as error:
            console_failed = True
            with contextlib.suppress(OSError):  # of a terminal that is gone
                traceback.print_exc()
            remarks.append(f"the console failed ({type(error).__name__}: {error})")
            status.raise_flag(Flag.END_ASKED)
        if (
            not recorder_told
            and not recorder.is_alive()
            and status.condition(Role.RECORDER) is not Condition.DONE
        ):
            recorder_told = True
            remarks.append(f"the recorder ended while the loop ran ({_how(recorder)})")
        silent = status.age_s(Role.LOOP) > patience.hung_s
        if silent and status.condition(Role.LOOP) in (Condition.RUNNING, Condition.STOPPING):
            remarks.append(f"the loop did not answer for {patience.hung_s:g} s and was ended")
            loop.kill()
            loop.join(1.0)
            break
        loop.join(LOOK_S)
    if loop.exitcode:
        remarks.append(f"the loop's process ended badly ({_how(loop)})")
    return remarks


def _how(process: BaseProcess) -> str:
    code = process.exitcode
    if code is None:
        return "it still runs"
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit status {code}"


def _outcome(recording: Recording) -> tuple[str, str, Recovered | None]:
    """Return how the folder says the session ended, and what was recovered."""
    try:
        events, _ = read_events(recording.folder / EVENTS)
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


def _estimator_main(*arguments: Any) -> None:
    """Run the live estimate; what it needs is loaded in its own process alone."""
    from rigidimeter.acquisition.processes.live_estimate import estimator_main

    estimator_main(*arguments)
