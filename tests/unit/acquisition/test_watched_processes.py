"""What console, loop and recorder do when another of them hangs, fails or is gone.

Each runs in this process, and what it would start or kill only notes that it was.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rigidimeter.acquisition.processes import (
    loop_process,
    recorder_process,
    shared_memory,
    sink,
    supervise,
)
from rigidimeter.acquisition.processes.recorder import Patience, Recording
from rigidimeter.acquisition.processes.session_memory import SessionMemory
from rigidimeter.acquisition.processes.shared_status import SharedStatus
from rigidimeter.acquisition.processes.status_values import Condition, Flag, Role
from rigidimeter.errors import UserError
from rigidimeter.guard import Cause
from rigidimeter.settings import Settings

PATIENCE = Patience()
NS = 1_000_000_000
BEGAN = 1000 * NS


@pytest.fixture
def shared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[SessionMemory]:
    monkeypatch.setattr(shared_memory, "WHERE", tmp_path)
    made = SessionMemory.create(tick_rate_hz=100.0, ring_s=1.0)
    yield made
    made.close()


class Watched:
    """A process that another watches: alive until it is killed."""

    pid, exitcode = 0, None

    def __init__(self) -> None:
        self.killed = False

    def alive(self) -> bool:
        return not self.killed

    is_alive = alive

    def kill(self) -> None:
        self.killed = True

    def join(self, wait_s: float) -> None: ...


# The loop's process


def waits_once(then: Callable[[], object]) -> Callable[[float], None]:
    """Return a sleep that does something the first time and fails the second."""
    left = [then]

    def sleep(_: float) -> None:
        assert left, "it waits on"
        left.pop()()

    return sleep


@pytest.mark.parametrize(
    ("condition", "flag", "parent", "comes"),
    [
        (Condition.READY, None, True, True),
        (Condition.RUNNING, None, True, True),
        (Condition.FAILED, None, True, False),
        (Condition.STARTING, Flag.END_ASKED, True, False),
        (Condition.STARTING, None, False, False),
    ],
)
def test_the_loop_waits_for_a_recorder_that_may_come(
    shared: SessionMemory,
    monkeypatch: pytest.MonkeyPatch,
    condition: Condition,
    flag: Flag | None,
    parent: bool,
    comes: bool,
) -> None:
    """Not for one that failed, not once it is told to end, not once its console was killed."""
    parents = [os.getppid()]

    def meanwhile() -> None:
        shared.status.set_condition(Role.RECORDER, condition)
        if flag is not None:
            shared.status.raise_flag(flag)
        if not parent:
            parents.append(1)

    monkeypatch.setattr(loop_process.time, "sleep", waits_once(meanwhile))
    monkeypatch.setattr(loop_process.os, "getppid", lambda: parents[-1])
    assert loop_process._recorder_is_there(shared.status, parents[0]) == comes


@pytest.fixture
def loop_main(
    shared: SessionMemory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., int]:
    """Run the loop's process in this one with a target; return its exit status."""
    for name in ("raise_flags", "_leave_real_time"):  # they are for a process of its own
        monkeypatch.setattr(loop_process, name, lambda *_: None)
    monkeypatch.setattr(loop_process, "WatchedProcess", lambda _: Watched())
    status = shared.status
    for role in (Role.CONSOLE, Role.RECORDER):
        status.beat(role, time.monotonic_ns() + 1000 * NS)  # silence is not what is tested
    status.set_condition(Role.RECORDER, Condition.READY)

    def run(
        target: Callable[[loop_process.LoopSide], object], console_pid: int = os.getppid()
    ) -> int:
        def whole(side: loop_process.LoopSide) -> None:
            try:
                target(side)
            finally:
                status.set_condition(Role.RECORDER, Condition.DONE)

        with pytest.raises(SystemExit) as ended:
            loop_process.loop_main(
                whole,
                Recording(tmp_path / "session", Settings()),
                shared.names,
                loop_process.Realtime(),
                PATIENCE,
                console_pid,
            )
        return int(ended.value.code or 0)

    return run


def test_the_loop_of_a_console_that_was_killed_ends_before_it_has_a_rig(
    loop_main: Callable[..., int], shared: SessionMemory, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared.status.set_condition(Role.RECORDER, Condition.STARTING)
    monkeypatch.setattr(loop_process.time, "sleep", waits_once(lambda: None))
    ran: list[object] = []
    assert loop_main(ran.append, os.getppid() + 1) == 1
    assert ran == []


def test_the_loop_stops_for_a_console_that_was_killed_however_long_silence_is_allowed(
    loop_main: Callable[..., int], monkeypatch: pytest.MonkeyPatch
) -> None:
    causes = []

    def target(side: loop_process.LoopSide) -> None:
        causes.append(side.supervision.cause(0.0))
        monkeypatch.setattr(sink, "getppid", lambda: 1)
        causes.append(side.supervision.cause(0.0))

    assert loop_main(target) == 0
    assert causes == [Cause.NONE, Cause.CONSOLE_LOST]


@pytest.mark.parametrize(
    ("error", "code", "reason"),
    [
        (None, 0, "the loop ended without closing the session"),
        (UserError("the drive is not there"), 1, "the drive is not there"),
        (KeyboardInterrupt("now"), 1, "KeyboardInterrupt: now"),
    ],
)
def test_a_target_that_ends_without_closing_the_session_has_it_closed(
    loop_main: Callable[..., int],
    shared: SessionMemory,
    error: BaseException | None,
    code: int,
    reason: str,
) -> None:
    def target(_: loop_process.LoopSide) -> None:
        if error is not None:
            raise error

    assert loop_main(target) == code
    assert shared.events.get(0).facts == {
        **{"event": "session_ended", "time_s": 0.0},
        **{"outcome": "fail", "reason": reason},
    }
    ended = Condition.FAILED if code else Condition.DONE
    assert shared.status.condition(Role.LOOP) is ended


# The recorder's process


@pytest.mark.parametrize(
    ("condition", "allowed_s"),
    [(Condition.RUNNING, PATIENCE.loop_lost_s), (Condition.STOPPING, PATIENCE.stopping_s)],
)
def test_the_recorder_ends_a_loop_that_hangs(
    shared: SessionMemory, condition: Condition, allowed_s: float
) -> None:
    """It would move the arm when it goes on, and nothing would be recorded of it."""
    now_ns, loop = BEGAN, Watched()
    status = SharedStatus(shared.status.memory, lambda: now_ns)
    status.beat(Role.LOOP)
    status.set_condition(Role.LOOP, condition)

    def lost() -> str:
        return recorder_process._loop_lost(status, loop, PATIENCE, os.getppid())  # type: ignore[arg-type]

    now_ns = BEGAN + round(allowed_s * NS)
    assert (lost(), loop.killed) == ("", False)
    now_ns += 1
    assert f"did not answer for {allowed_s:g} s and was ended" in lost()
    assert loop.killed
    assert "ended without closing the session" in lost()


def test_a_loop_that_starts_may_wait_for_its_devices(shared: SessionMemory) -> None:
    loop = Watched()
    shared.status.beat(Role.LOOP, 1)
    shared.status.set_condition(Role.LOOP, Condition.STARTING)
    assert recorder_process._loop_lost(shared.status, loop, PATIENCE, os.getppid()) == ""  # type: ignore[arg-type]
    assert not loop.killed


def test_the_recorder_waits_for_no_loop_once_the_console_is_gone(shared: SessionMemory) -> None:
    console, status = os.getppid(), shared.status
    assert recorder_process._loop_lost(status, None, PATIENCE, console) == ""
    never = "the loop was never started"
    assert recorder_process._loop_lost(status, None, PATIENCE, console + 1) == never
    status.raise_flag(Flag.END_ASKED)
    assert recorder_process._loop_lost(status, None, PATIENCE, console) == never


# The console's process


def test_the_console_beats_with_the_time_at_which_the_operator_was_seen(
    shared: SessionMemory,
) -> None:
    """A page that is gone was seen long ago, however lively the program is that served it."""
    status = SharedStatus(shared.status.memory, lambda: BEGAN + 7 * NS)
    look = supervise._Look(shared, lambda _: None, lambda: BEGAN)
    look()
    assert status.age_s(Role.CONSOLE) == 7.0


def test_a_console_that_fails_ends_the_session_and_its_heart_beats_until_then(
    shared: SessionMemory,
) -> None:
    seen_ns, calls = [BEGAN], []

    def console(_: SessionMemory) -> None:
        calls.append(seen_ns[-1])
        raise ZeroDivisionError("no such value")

    look = supervise._Look(shared, console, lambda: seen_ns[-1])
    look()
    assert shared.status.flag(Flag.END_ASKED)
    assert look.remarks == ["the console failed (ZeroDivisionError: no such value)"]
    seen_ns.append(BEGAN + NS)
    look()
    assert calls == [BEGAN]
    assert SharedStatus(shared.status.memory, lambda: BEGAN + NS).age_s(Role.CONSOLE) == 0.0


@pytest.mark.parametrize(
    ("condition", "allowed_s"),
    [(Condition.RUNNING, 2 * PATIENCE.loop_lost_s), (Condition.STOPPING, PATIENCE.hung_s)],
)
def test_the_console_ends_a_loop_that_hangs_where_the_recorder_did_not(
    shared: SessionMemory, condition: Condition, allowed_s: float
) -> None:
    now_ns, loop, recorder = BEGAN, Watched(), Watched()
    status = SharedStatus(shared.status.memory, lambda: now_ns)
    status.beat(Role.LOOP)
    status.set_condition(Role.LOOP, condition)
    seen = []

    def look() -> None:
        nonlocal now_ns
        assert len(seen) < 2, "it waits on"
        seen.append(now_ns - BEGAN)
        now_ns = BEGAN + round(allowed_s * NS) + len(seen) - 1

    remarks = supervise._see_through(loop, recorder, status, PATIENCE, look)  # type: ignore[arg-type]
    assert len(seen) == 2  # once at the limit, which is allowed, once 1 ns after it
    assert loop.killed
    assert remarks == [f"the loop did not answer for {allowed_s:g} s and was ended"]


class Started(Watched):
    """A process as `supervise` starts it; the loop ends once it is asked to."""

    made: list[Started]
    prepare: Callable[[SessionMemory], object]

    def __init__(self, target: Any, args: tuple[Any, ...], name: str) -> None:
        super().__init__()
        self.name, self.told = name, False
        names = next(a for a in args if isinstance(a, tuple) and len(a) == 3)
        self.memory = SessionMemory.attach(names)
        self.made.append(self)

    def start(self) -> None:
        type(self).prepare(self.memory)

    def join(self, wait_s: float) -> None:
        status = self.memory.status
        self.told = status.flag(Flag.END_ASKED) and wait_s >= PATIENCE.stopping_s
        self.heart_ns = status.memory.words[status.places()[3]]
        self.memory.close()

    def alive(self) -> bool:
        return not self.told

    is_alive = alive


def supervised(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, **options: Any) -> list[Started]:
    """Run `supervise`, which fails; return the processes that it started."""
    monkeypatch.setattr(shared_memory, "WHERE", tmp_path)
    monkeypatch.setattr(supervise, "held_back", nullcontext)
    monkeypatch.setattr(supervise, "signals_are_orders", lambda _: nullcontext([]))
    context = SimpleNamespace(Process=Started)
    monkeypatch.setattr(supervise.multiprocessing, "get_context", lambda _: context)
    monkeypatch.setattr(Started, "made", [], raising=False)
    prepare = options.pop("prepare", lambda memory: None)
    monkeypatch.setattr(Started, "prepare", prepare, raising=False)
    error = options.pop("error")
    with pytest.raises(type(error), match=str(error)):
        supervise.supervise(
            lambda _: None,
            Recording(tmp_path / "session", Settings()),
            realtime=loop_process.Realtime(live_estimate=False),
            **options,
        )
    return Started.made


def test_a_recorder_that_fails_ends_the_loop_in_order(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def refused(memory: SessionMemory) -> None:
        memory.status.set_condition(Role.RECORDER, Condition.FAILED, "the folder is not empty")

    started = supervised(
        monkeypatch, tmp_path, prepare=refused, error=UserError("the folder is not empty")
    )
    assert [one.name for one in started] == ["rigidimeter-recorder", "rigidimeter-loop"]
    assert [(one.told, one.killed) for one in started] == [(True, False)] * 2


def test_a_console_that_cannot_say_who_is_there_ends_the_loop_in_order(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    error = RuntimeError("no page")

    def nobody() -> int:
        raise error

    def ready(memory: SessionMemory) -> None:
        memory.status.set_condition(Role.RECORDER, Condition.READY)

    started = supervised(monkeypatch, tmp_path, prepare=ready, error=error, operator_seen_ns=nobody)
    assert [(one.told, one.killed) for one in started] == [(True, False)] * 2


def test_the_page_is_asked_for_its_operator_while_the_session_runs(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    error = SystemExit("enough")

    def ready(memory: SessionMemory) -> None:
        memory.status.set_condition(Role.RECORDER, Condition.READY)

    def console(_: SessionMemory) -> None:
        raise error

    started = supervised(
        monkeypatch,
        tmp_path,
        prepare=ready,
        error=error,
        console=console,
        operator_seen_ns=lambda: BEGAN,
    )
    assert {one.heart_ns for one in started} == {BEGAN}
