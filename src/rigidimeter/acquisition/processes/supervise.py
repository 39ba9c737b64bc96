"""Start the processes of a real-time session, see them through, and clean up after them.

    console    this process: the operator's. It starts the others and may be killed.
    loop       the rig, the control loop, nothing else. It stops the rig when the console is silent.
    recorder   from the rings into the session folder. It ends when the session is closed.
    estimator  J, B and K for the operator's eyes. It may fail without anybody minding.

They share two rings and a board, and nothing that one could make another wait for. Whoever is left
completes the session: the recorder if the loop dies, the loop if the recorder dies, the console
after both, the loop after the console and the recorder.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from types import FrameType
from typing import Any

from rigidimeter.acquisition.processes.board import Board, Condition, Flag, Role
from rigidimeter.acquisition.processes.realtime import Prepared, prepare_loop_process
from rigidimeter.acquisition.processes.recorder import Patience, Recording, recorder_main
from rigidimeter.acquisition.processes.ring import EventRing, SampleRing
from rigidimeter.acquisition.processes.salvage import Salvage, salvage
from rigidimeter.acquisition.processes.sink import BoardOutside, RingSink
from rigidimeter.acquisition.processes.watched import Watched, leave_signals_to_the_console
from rigidimeter.acquisition.states import Command, Order
from rigidimeter.errors import UserError
from rigidimeter.recording.folder import EVENTS
from rigidimeter.recording.log import read_events

__all__ = ["Ended", "LoopSide", "LoopTarget", "Realtime", "supervise"]

RING_S = 60.0
"""For how long the recorder may write nothing before samples are lost."""
LOOK_S = 0.05


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
    """

    priority: int = 80
    cpu: int | None = None
    lock_memory: bool = True
    live_estimate: bool = True
    attended: bool = True


@dataclass(frozen=True)
class LoopSide:
    """What the loop's target is given.

    `ready` is to be called once the rig is configured and all objects are made, just before the
    first tick: it prepares the process, stores what was permitted, and returns it.
    """

    sink: RingSink
    outside: BoardOutside
    board: Board
    ready: Callable[[], Prepared]


LoopTarget = Callable[[LoopSide], object]
"""Runs the session and closes the sink. It must be picklable: a function of a module, or a
`functools.partial` of one."""


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
    salvaged : Salvage or None
        What had to be brought from the rings by another process than the recorder.
    remarks : tuple of str
        What else the operator should know.
    """

    outcome: str
    reason: str
    loop_exit: int | None
    samples: int
    salvaged: Salvage | None
    remarks: tuple[str, ...]


class _Shared:
    """Rings and board, made or attached to."""

    def __init__(self, samples: SampleRing, events: EventRing, board: Board) -> None:
        self.samples, self.events, self.board = samples, events, board

    @classmethod
    def create(cls, tick_rate_hz: float, ring_s: float) -> _Shared:
        samples = SampleRing.create(max(16, round(ring_s * tick_rate_hz)))
        try:
            events = EventRing.create()
            try:
                return cls(samples, events, Board.create())
            except BaseException:
                _drop(events.memory)
                raise
        except BaseException:
            _drop(samples.memory)
            raise

    @classmethod
    def attach(cls, names: tuple[str, str, str]) -> _Shared:
        return cls(SampleRing.attach(names[0]), EventRing.attach(names[1]), Board.attach(names[2]))

    @property
    def names(self) -> tuple[str, str, str]:
        return self.samples.name, self.events.name, self.board.name

    def unlink(self) -> None:
        for part in (self.samples, self.events, self.board):
            part.memory.unlink()

    def close(self) -> None:
        for part in (self.samples, self.events, self.board):
            part.close()


def _drop(memory: Any) -> None:
    memory.unlink()
    memory.close()


def supervise(
    target: LoopTarget,
    recording: Recording,
    *,
    realtime: Realtime | None = None,
    patience: Patience | None = None,
    console: Callable[[Board], object] = lambda _: None,
    ring_s: float = RING_S,
) -> Ended:
    """Run a session in processes of its own and return how it ended.

    Ctrl-C asks the loop to abort; a second one, and SIGTERM, make it stop as for a fault.

    Parameters
    ----------
    target : callable
        Runs in the loop's process.
    recording : Recording
    realtime : Realtime
    patience : Patience
    console : callable
        Called in this process about 20 times a second with the board; it must return soon, for the
        loop stops when this process is silent.
    ring_s : float
        How much the rings hold.

    Raises
    ------
    UserError
        If the session folder cannot be made.
    """
    realtime, patience = realtime or Realtime(), patience or Patience()
    context = multiprocessing.get_context("spawn")
    shared = _Shared.create(recording.settings.rig.tick_rate_hz, ring_s)
    board = shared.board
    board.join(Role.CONSOLE)
    processes: list[BaseProcess] = []

    def start(name: str, main: Callable[..., None], *arguments: object) -> BaseProcess:
        process = context.Process(target=main, args=arguments, name=f"rigidimeter-{name}")
        process.start()
        processes.append(process)
        return process

    try:
        with _Interrupts(board):
            me = os.getpid()
            recorder = start("recorder", recorder_main, recording, shared.names, patience, me)
            loop = start(
                "loop", _loop_main, target, recording, shared.names, realtime, patience, me
            )
            _await_recorder(recorder, board)
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
            remarks = _see_through(loop, recorder, board, patience, console)
            watched = Watched(recorder.pid or 0)
            try:
                _complete(Role.CONSOLE, shared, recording, watched, patience, remarks)
            finally:
                watched.close()
            if estimator is not None:
                _end(estimator, 2.0)
        outcome, reason, salvaged = _outcome(recording)
        if shared.samples.refused:
            remarks.append(f"{shared.samples.refused} samples found no room and are not recorded")
        samples = shared.samples.written
        return Ended(outcome, reason, loop.exitcode, samples, salvaged, tuple(remarks))
    finally:
        # Whatever happened here, the loop is given the time to stop the rig in order.
        board.raise_flag(Flag.END_ASKED)
        for process in reversed(processes):
            _end(process, patience.stopping_s)
        shared.unlink()
        shared.close()


class _Interrupts:
    """Turns Ctrl-C and SIGTERM into orders to the loop while the session runs."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self._count = 0
        self._before: dict[int, Any] = {}

    def __enter__(self) -> _Interrupts:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._before[number] = signal.signal(number, self._asked)
        return self

    def _asked(self, number: int, _: FrameType | None) -> None:
        self._count += 1
        if number == signal.SIGINT and self._count == 1:
            try:
                self._board.post(Order(Command.ABORT))
            except ValueError:  # so many orders wait that nobody takes them
                self._board.raise_flag(Flag.END_ASKED)
        else:
            self._board.raise_flag(Flag.END_ASKED)

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)


def _await_recorder(recorder: BaseProcess, board: Board) -> None:
    """Wait until the session folder is made."""
    until_s = time.monotonic() + 60.0
    while board.condition(Role.RECORDER) in (Condition.ABSENT, Condition.STARTING):
        board.beat(Role.CONSOLE)
        if not recorder.is_alive() or time.monotonic() > until_s:
            break
        time.sleep(0.01)
    if board.condition(Role.RECORDER) not in (Condition.READY, Condition.RUNNING):
        raise UserError(board.note(Role.RECORDER) or "the recorder's process did not start")


def _see_through(
    loop: BaseProcess,
    recorder: BaseProcess,
    board: Board,
    patience: Patience,
    console: Callable[[Board], object],
) -> list[str]:
    """Keep the operator's heart beating until the loop has ended; return remarks."""
    remarks: list[str] = []
    recorder_told = console_failed = False
    while loop.is_alive():
        board.beat(Role.CONSOLE)
        try:
            if not console_failed:
                console(board)
        except Exception as error:
            console_failed = True
            traceback.print_exc()
            remarks.append(f"the console failed ({type(error).__name__}: {error})")
            board.raise_flag(Flag.END_ASKED)
        if not recorder_told and not recorder.is_alive() and not _is_over(board):
            recorder_told = True
            remarks.append(f"the recorder ended while the loop ran ({_how(recorder)})")
        silent = board.age_s(Role.LOOP) > patience.hung_s
        if silent and board.condition(Role.LOOP) in (Condition.RUNNING, Condition.STOPPING):
            remarks.append(f"the loop did not answer for {patience.hung_s:g} s and was ended")
            loop.kill()
            loop.join(1.0)
            break
        loop.join(LOOK_S)
    if loop.exitcode:
        remarks.append(f"the loop's process ended badly ({_how(loop)})")
    return remarks


def _is_over(board: Board) -> bool:
    return board.condition(Role.RECORDER) is Condition.DONE


def _how(process: BaseProcess) -> str:
    code = process.exitcode
    if code is None:
        return "it still runs"
    return f"signal {signal.Signals(-code).name}" if code < 0 else f"exit status {code}"


def _complete(
    me: Role,
    shared: _Shared,
    recording: Recording,
    recorder: Watched,
    patience: Patience,
    remarks: list[str],
) -> None:
    """See the recorder to its end; if that is not a good one, do its work."""
    board = shared.board
    since_s = time.monotonic()
    hung = False
    # One that has done its work no longer beats, and may take a while to leave.
    while recorder.alive() and not hung and not _is_over(board):
        board.beat(me)
        # A heart that beat before the wait began may have been silent for a good reason.
        silent_s = min(board.age_s(Role.RECORDER), time.monotonic() - since_s)
        hung = silent_s > patience.hung_s
        time.sleep(0.02)
    if hung:
        remarks.append(f"the recorder did not answer for {patience.hung_s:g} s and was ended")
        recorder.kill()
        until_s = time.monotonic() + 2.0
        while recorder.alive() and time.monotonic() < until_s:
            time.sleep(0.01)
    if _is_over(board):
        late = shared.samples.lag()
        if late:
            remarks.append(f"{late} samples came after the session was closed")
        return
    note = board.note(Role.RECORDER)
    reason = note or ("the recorder hung" if hung else "the recorder was killed")
    try:
        salvage(
            recording.folder,
            shared.samples,
            shared.events,
            reason,
            recording.settings.rig.tick_rate_hz,
        )
    except (UserError, OSError) as error:
        remarks.append(f"{recording.folder}: the session could not be completed ({error})")


def _outcome(recording: Recording) -> tuple[str, str, Salvage | None]:
    """Return how the folder says the session ended, and what was salvaged."""
    try:
        events, _ = read_events(recording.folder / EVENTS)
    except (UserError, OSError) as error:
        return "", str(error), None
    salvaged = None
    for event in events:
        if event.get("event") == "record_salvaged":
            salvaged = Salvage(event["samples"], event["events"], event["missing_samples"])
    for event in reversed(events):
        if event.get("event") == "session_ended":
            return event["outcome"], event["reason"], salvaged
    return "", "the session was not closed", salvaged


def _end(process: BaseProcess, wait_s: float) -> None:
    """End a process that was started here."""
    process.join(wait_s)
    if process.is_alive():
        process.kill()
        process.join(2.0)


def _estimator_main(*arguments: Any) -> None:
    """Run the live estimate; what it needs is loaded in its own process alone."""
    from rigidimeter.acquisition.processes.live import estimator_main

    estimator_main(*arguments)


def _loop_main(
    target: LoopTarget,
    recording: Recording,
    names: tuple[str, str, str],
    realtime: Realtime,
    patience: Patience,
    console_pid: int,
) -> None:
    """Run the target; the main function of the loop's process."""
    leave_signals_to_the_console()
    shared = _Shared.attach(names)
    board = shared.board
    signal.signal(signal.SIGTERM, lambda *_: board.raise_flag(Flag.END_ASKED))
    board.join(Role.LOOP)
    if not _recorder_is_there(board, console_pid):
        shared.close()
        sys.exit(1)
    recorder = Watched(board.pid(Role.RECORDER))
    rate_hz = recording.settings.rig.tick_rate_hz
    sink = RingSink(shared.samples, shared.events, board, rate_hz)
    outside = BoardOutside(
        board,
        shared.samples,
        console_lost_s=patience.console_lost_s,
        recorder_lost_s=patience.recorder_lost_s,
        attended=realtime.attended,
    )

    def ready() -> Prepared:
        for part in (shared.samples, shared.events, shared.board):
            part.memory.touch()
        prepared = prepare_loop_process(
            priority=realtime.priority, cpu=realtime.cpu, lock_memory=realtime.lock_memory
        )
        sink.event("loop_prepared", **prepared.facts())
        print(prepared, file=sys.stderr, flush=True)
        return prepared

    code = 0
    try:
        target(LoopSide(sink, outside, board, ready))
        sink.close(sink.last_time_s, "fail", "the loop ended without closing the session")
    except UserError as error:  # a sentence, which stands in the record and is shown at the end
        code = 1
        sink.close(sink.last_time_s, "fail", str(error))
    except BaseException as error:
        code = 1
        traceback.print_exc()
        with suppress(ValueError):
            sink.close(sink.last_time_s, "fail", f"{type(error).__name__}: {error}")
    finally:
        board.set_condition(Role.LOOP, Condition.FAILED if code else Condition.DONE)
        _leave_real_time()
        remarks: list[str] = []
        _complete(Role.LOOP, shared, recording, recorder, patience, remarks)
        for remark in remarks:
            print(remark, file=sys.stderr, flush=True)
        if os.getppid() != console_pid:
            shared.unlink()
        shared.close()
    sys.exit(code)


def _recorder_is_there(board: Board, console_pid: int) -> bool:
    """Wait for the recorder; return False if it will not come."""
    while board.condition(Role.RECORDER) not in (Condition.READY, Condition.RUNNING):
        failed = board.condition(Role.RECORDER) is Condition.FAILED
        if failed or board.flag(Flag.END_ASKED) or os.getppid() != console_pid:
            return False
        time.sleep(0.005)
    return True


def _leave_real_time() -> None:
    """Be an ordinary process again: what follows takes time and touches files."""
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
