"""What console, loop and recorder do when another of them hangs, fails or is gone.

Each runs in this process, and what it would start or kill only notes that it was.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from functools import partial
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.unit.rig.acquisition.whole_session import RATE_HZ, VALUES

from rigidimeter.cli.realtime_rig import run_loop
from rigidimeter.core.errors import UserError
from rigidimeter.core.session import Sample, read_events, read_samples
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.planning import plan
from rigidimeter.rig.acquisition import Command, Order, Phase, State
from rigidimeter.rig.acquisition.processes import (
    EndedEarly,
    Flag,
    Patience,
    Prepared,
    ProcessCondition,
    RecordingPlan,
    Role,
    SessionMemory,
    SharedStatus,
    loop_process,
    recorder_process,
    ring_recovery,
    ring_writer,
    shared_memory,
    supervisor,
)
from rigidimeter.rig.guard import Cause

PATIENCE = Patience()
SETTINGS = parse_settings(VALUES)
PREPARED = Prepared(None, None, None, False, None, False, ())
NS = 1_000_000_000
BEGAN = 1000 * NS


@pytest.fixture
def shared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[SessionMemory]:
    monkeypatch.setattr(shared_memory, "WHERE", tmp_path)
    made = SessionMemory.create(tick_rate_hz=RATE_HZ, ring_s=60.0)
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
        (ProcessCondition.READY, None, True, True),
        (ProcessCondition.RUNNING, None, True, True),
        (ProcessCondition.FAILED, None, True, False),
        (ProcessCondition.STARTING, Flag.END_ASKED, True, False),
        (ProcessCondition.STARTING, None, False, False),
    ],
)
def test_the_loop_waits_for_a_recorder_that_may_come(
    shared: SessionMemory,
    monkeypatch: pytest.MonkeyPatch,
    condition: ProcessCondition,
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
    called: list[str] = []
    for name in ("raise_flags", "_leave_real_time"):  # they are for a process of its own
        monkeypatch.setattr(loop_process, name, lambda *_, name=name: called.append(name))
    monkeypatch.setattr(loop_process, "WatchedProcess", lambda _: Watched())
    status = shared.status
    for role in (Role.CONSOLE, Role.RECORDER):
        status.beat(role, time.monotonic_ns() + 1000 * NS)  # silence is not what is tested
    status.set_condition(Role.RECORDER, ProcessCondition.READY)

    def run(
        target: Callable[[loop_process.LoopSide], object],
        console_pid: int = os.getppid(),
        settings: Settings = SETTINGS,
        attended: bool = True,
    ) -> int:
        targeted = []

        def whole(side: loop_process.LoopSide) -> None:
            targeted.append(side)
            assert called == ["raise_flags"]
            try:
                target(side)
            finally:
                status.set_condition(Role.RECORDER, ProcessCondition.DONE)

        with pytest.raises(SystemExit) as ended:
            loop_process.loop_main(
                whole,
                RecordingPlan(tmp_path / "session", settings),
                shared.names,
                loop_process.Realtime(attended=attended),
                PATIENCE,
                console_pid,
            )
        assert called[0] == "raise_flags"
        assert "_leave_real_time" in called or not targeted
        return int(ended.value.code or 0)

    return run


def test_the_loop_of_a_console_that_was_killed_ends_before_it_has_a_rig(
    loop_main: Callable[..., int], shared: SessionMemory, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared.status.set_condition(Role.RECORDER, ProcessCondition.STARTING)
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
        monkeypatch.setattr(ring_writer, "getppid", lambda: 1)
        causes.append(side.supervision.cause(0.0))

    assert loop_main(target) == 0
    assert causes == [Cause.NONE, Cause.CONSOLE_LOST]


def test_the_loop_is_as_patient_as_the_settings_say(
    loop_main: Callable[..., int], monkeypatch: pytest.MonkeyPatch
) -> None:
    told: dict[str, Any] = {}

    def supervision(*_: object, **options: Any) -> SimpleNamespace:
        told.update(options)
        return SimpleNamespace()

    monkeypatch.setattr(loop_process, "SharedSupervision", supervision)
    limits = {"console_lost_s": 0.7, "recorder_lost_s": 3.0, "stall_s": 0.05}
    settings = parse_settings({**VALUES, "loop": limits})
    loop_main(lambda _: None, settings=settings, attended=False)
    lag = round((3.0 + 2 * PATIENCE.poll_s) * RATE_HZ)
    rest = {"max_lag": lag, "attended": False, "console_pid": os.getppid()}
    assert told == {**limits, **rest}


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
    ended = ProcessCondition.FAILED if code else ProcessCondition.DONE
    assert shared.status.condition(Role.LOOP) is ended


class Clock:
    """Is never late, and acts in the first epoch, when the arm moves, and a second later."""

    origin_s = 0.0

    def __init__(self, shared: SessionMemory, *acts: Callable[[], object]) -> None:
        self.samples, self.acts, self.in_epoch = shared.samples, list(acts), 0
        self.acted = -1

    def wait_until(self, deadline_s: float) -> float:
        self.samples.recorded = written = self.samples.written
        assert written < 1000, "it goes on for ever"
        if written:
            self.in_epoch += self.samples.rows(written - 1, written)["epoch"][0] == 1
        if self.acts and self.in_epoch >= 20 and self.acted < 0:
            self.acted = written
            self.acts.pop(0)()
        elif self.acts and self.acted > 0 and written >= self.acted + RATE_HZ:
            self.acts.pop(0)()
        return deadline_s


@pytest.fixture
def run_on_clock(
    loop_main: Callable[..., int], shared: SessionMemory, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., Clock]:
    """Run the target that `run` gives the loop's process, on the virtual rig; return the clock."""

    def run(*acts: Callable[[], object]) -> Clock:
        clock = Clock(shared, *acts)
        monkeypatch.setattr("rigidimeter.rig.acquisition.DeadlineClock", lambda: clock)
        monkeypatch.setattr(loop_process, "prepare_loop_process", lambda **_: PREPARED)
        protocol = plan(SETTINGS.protocol, SETTINGS.prbs, SETTINGS.sinusoid, 1)
        assert loop_main(partial(run_loop, SETTINGS, protocol, None, None, None)) == 0
        return clock

    return run


@pytest.mark.parametrize(
    ("act", "outcome", "reason"),
    [
        ("raise_flag EMERGENCY_STOP", "fail", Cause.EMERGENCY_STOP.sentence),
        ("raise_flag END_ASKED", "fail", Cause.SIGNAL.sentence),
        ("raise_flag ABORT_ASKED", "abort", "aborted by the operator"),
        ("post ABORT", "abort", "aborted by the operator"),
        ("post HALT", "fail", Cause.OPERATOR_HALT.sentence),
        ("the console is killed", "fail", Cause.CONSOLE_LOST.sentence),
        ("the console is silent", "fail", Cause.CONSOLE_LOST.sentence),
        ("the recorder is silent", "fail", Cause.RECORDER_LOST.sentence),
    ],
)
def test_whoever_stops_the_loop_no_velocity_is_commanded_after_it(
    run_on_clock: Callable[..., Clock],
    shared: SessionMemory,
    monkeypatch: pytest.MonkeyPatch,
    act: str,
    outcome: str,
    reason: str,
) -> None:
    status = shared.status

    def acts() -> None:
        kind, _, name = act.partition(" ")
        if kind == "raise_flag":
            status.raise_flag(Flag[name])
        elif kind == "post":
            status.post(Order(Command[name]))
        elif name.endswith("killed"):
            monkeypatch.setattr(ring_writer, "getppid", lambda: 1)
        else:
            status.beat(Role.CONSOLE if "console" in name else Role.RECORDER, 1)

    clock = run_on_clock(acts)
    assert status.loop().until_s > 0.0  # type: ignore[union-attr]
    sent = np.abs(shared.samples.rows(0, shared.samples.written)["velocity_command_rad_s"])
    assert sent[clock.acted - 1] > 0.0
    after = sent[clock.acted :]
    limit = math.radians(SETTINGS.guard.acceleration_limit_deg_s2) / RATE_HZ
    at_once = act.endswith(("EMERGENCY_STOP", "HALT"))
    assert not after[1 if at_once else 1 + math.ceil(sent[clock.acted - 1] / limit) :].any()
    assert np.all(np.diff(after) <= 0.0)
    events = [shared.events.get(k).facts for k in range(shared.events.written)]
    assert "sensor_zeroed" in [event["event"] for event in events]
    assert events[-1]["event"] == "session_ended"
    assert events[-1]["outcome"] == outcome
    assert reason in events[-1]["reason"]


def test_a_loop_that_is_paused_holds_the_arm_and_shows_that_it_is(
    run_on_clock: Callable[..., Clock], shared: SessionMemory
) -> None:
    """By which a page may be away for a while."""
    status, shown = shared.status, []

    def later() -> None:
        shown.append(status.loop())
        status.post(Order(Command.ABORT))

    clock = run_on_clock(lambda: status.post(Order(Command.PAUSE_NOW)), later)
    (loop,) = shown
    assert loop is not None
    assert (loop.state, loop.velocity_command_rad_s) == (State.PAUSED, 0.0)
    assert (loop.still, loop.phase) == (1, Phase.HOLD)
    rows = shared.samples.rows(clock.acted, shared.samples.written)
    limit = math.radians(SETTINGS.guard.acceleration_limit_deg_s2) / RATE_HZ
    ramp = math.ceil(abs(rows["velocity_command_rad_s"][0]) / limit)
    assert not rows["velocity_command_rad_s"][1 + ramp :].any()


# The recorder's process


@pytest.mark.parametrize(
    ("condition", "allowed_s"),
    [
        (ProcessCondition.RUNNING, PATIENCE.loop_lost_s),
        (ProcessCondition.STOPPING, PATIENCE.stopping_s),
    ],
)
def test_the_recorder_ends_a_loop_that_hangs(
    shared: SessionMemory, condition: ProcessCondition, allowed_s: float
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
    shared.status.set_condition(Role.LOOP, ProcessCondition.STARTING)
    assert recorder_process._loop_lost(shared.status, loop, PATIENCE, os.getppid()) == ""  # type: ignore[arg-type]
    assert not loop.killed


def test_the_recorder_waits_for_no_loop_once_the_console_is_gone(shared: SessionMemory) -> None:
    console, status = os.getppid(), shared.status
    assert recorder_process._loop_lost(status, None, PATIENCE, console) == ""
    never = "the loop was never started"
    assert recorder_process._loop_lost(status, None, PATIENCE, console + 1) == never
    status.raise_flag(Flag.END_ASKED)
    assert recorder_process._loop_lost(status, None, PATIENCE, console) == never


def test_a_session_whose_loop_was_killed_is_closed_with_all_that_it_made(
    shared: SessionMemory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    loop = Watched()
    loop.kill()
    monkeypatch.setattr(recorder_process, "raise_flags", lambda _: None)
    monkeypatch.setattr(recorder_process, "WatchedProcess", lambda _: loop)
    naps = iter([time.sleep] * 1000)  # an end to one that waits for ever
    monkeypatch.setattr(recorder_process.time, "sleep", lambda s: next(naps)(min(s, 0.005)))
    shared.status.join(Role.LOOP)
    made = ring_writer.RingSink(shared, RATE_HZ)
    made.event("session_started", time_s=0.0)
    named = {"label": "one", "task": "prbs", "condition": "OFF"}
    made.event("epoch_started", epoch=1, **named, time_s=0.0)
    for k in range(30):
        made.sample(Sample(k, k / RATE_HZ, 0.0, 1, *[0.5] * 9, 0))
    recording = RecordingPlan(tmp_path / "session", Settings())
    recorder_process.recorder_main(recording, shared.names, PATIENCE, os.getppid())
    assert shared.status.condition(Role.RECORDER) is ProcessCondition.DONE
    assert read_samples(recording.folder / "samples.arrows")["tick"].size == 30
    events, torn = read_events(recording.folder / "events.jsonl")
    assert not torn
    kinds = ["session_started", "epoch_started", "epoch_ended", "session_ended"]
    assert [event["event"] for event in events] == kinds
    for event in events[2:]:
        assert event["outcome"] == "fail"
        assert event["reason"].startswith("the loop's process ended without closing the session")


# Whoever is left


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Give a clock that goes on only while it is slept."""
    clock = SimpleNamespace(now_s=1000.0)
    clock.monotonic = lambda: clock.now_s
    clock.sleep = lambda seconds: setattr(clock, "now_s", clock.now_s + seconds)
    monkeypatch.setattr(ring_recovery, "time", clock)
    return clock


def test_a_recorder_that_hangs_is_ended_before_its_work_is_done_by_another(
    shared: SessionMemory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, clock: SimpleNamespace
) -> None:
    recorder, began_s, looks = Watched(), clock.now_s, []
    status = SharedStatus(shared.status.memory, lambda: round(NS * clock.now_s))
    status.beat(Role.RECORDER, 1)
    memory = SessionMemory(shared.samples, shared.events, status)

    def recover(*_: object) -> None:
        assert recorder.killed, "two of them write"
        looks.append("recovered")

    monkeypatch.setattr(ring_recovery, "recover_from_rings", recover)
    remarks = ring_recovery.complete(
        memory,
        RecordingPlan(tmp_path / "session", Settings()),
        recorder,  # type: ignore[arg-type]
        PATIENCE,
        lambda: looks.append(clock.now_s),
    )
    assert remarks == ["the recorder did not answer for 8 s and was ended"]
    assert looks[-1] == "recovered"
    waited_s = [at_s - began_s for at_s in looks[:-1]]
    assert PATIENCE.hung_s - 0.03 < waited_s[-1] < PATIENCE.hung_s + 0.03


def test_a_recorder_that_is_slow_is_left_to_its_work(
    shared: SessionMemory, tmp_path: Path, clock: SimpleNamespace
) -> None:
    recorder = Watched()
    status = SharedStatus(shared.status.memory, lambda: round(NS * clock.now_s))
    memory = SessionMemory(shared.samples, shared.events, status)

    def look() -> None:
        status.beat(Role.RECORDER)
        if clock.now_s > 1060.0:
            status.set_condition(Role.RECORDER, ProcessCondition.DONE)

    recording = RecordingPlan(tmp_path / "session", Settings())
    assert ring_recovery.complete(memory, recording, recorder, PATIENCE, look) == []  # type: ignore[arg-type]
    assert not recorder.killed


# The console's process


def test_the_console_beats_with_the_time_at_which_the_operator_was_seen(
    shared: SessionMemory,
) -> None:
    """A page that is gone was seen long ago, however lively the program is that served it."""
    status = SharedStatus(shared.status.memory, lambda: BEGAN + 7 * NS)
    look = supervisor._Follower(shared, lambda _: None, lambda: BEGAN)
    look()
    assert status.age_s(Role.CONSOLE) == 7.0


def test_a_console_that_fails_ends_the_session_and_its_heart_beats_until_then(
    shared: SessionMemory,
) -> None:
    seen_ns, calls = [BEGAN], []

    def console(_: SessionMemory) -> None:
        calls.append(seen_ns[-1])
        raise ZeroDivisionError("no such value")

    look = supervisor._Follower(shared, console, lambda: seen_ns[-1])
    look()
    assert shared.status.flag(Flag.END_ASKED)
    assert look.remarks == ["the console failed (ZeroDivisionError: no such value)"]
    seen_ns.append(BEGAN + NS)
    look()
    assert calls == [BEGAN]
    assert SharedStatus(shared.status.memory, lambda: BEGAN + NS).age_s(Role.CONSOLE) == 0.0


@pytest.mark.parametrize(
    ("condition", "allowed_s"),
    [
        (ProcessCondition.RUNNING, 2 * PATIENCE.loop_lost_s),
        (ProcessCondition.STOPPING, PATIENCE.hung_s),
    ],
)
def test_the_console_ends_a_loop_that_hangs_where_the_recorder_did_not(
    shared: SessionMemory, condition: ProcessCondition, allowed_s: float
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

    remarks = supervisor._see_through(loop, recorder, status, PATIENCE, look)  # type: ignore[arg-type]
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


def silent_pipe(duplex: bool) -> tuple[Connection, SimpleNamespace]:
    """Return a pipe whose other end stays open and says nothing."""
    ours, theirs = Pipe(duplex)
    return ours, SimpleNamespace(close=lambda: theirs)


def supervised(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, **options: Any) -> list[Started]:
    """Run `supervise`, which fails; return the processes that it started."""
    monkeypatch.setattr(shared_memory, "WHERE", tmp_path)
    monkeypatch.setattr(supervisor, "held_back", nullcontext)
    monkeypatch.setattr(supervisor, "signals_are_orders", lambda _: nullcontext([]))
    context = SimpleNamespace(Process=Started, Pipe=silent_pipe)
    monkeypatch.setattr(supervisor.multiprocessing, "get_context", lambda _: context)
    monkeypatch.setattr(Started, "made", [], raising=False)
    prepare = options.pop("prepare", lambda memory: None)
    monkeypatch.setattr(Started, "prepare", prepare, raising=False)
    error, settings = options.pop("error"), options.pop("settings", Settings())
    with pytest.raises(type(error), match=str(error)):
        supervisor.supervise(
            lambda _: None,
            RecordingPlan(tmp_path / "session", settings),
            realtime=loop_process.Realtime(live_estimate=False),
            **options,
        )
    return Started.made


def test_a_recorder_that_fails_ends_the_loop_in_order(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def refused(memory: SessionMemory) -> None:
        memory.status.set_condition(
            Role.RECORDER, ProcessCondition.FAILED, "the folder is not empty"
        )

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
        memory.status.set_condition(Role.RECORDER, ProcessCondition.READY)

    started = supervised(monkeypatch, tmp_path, prepare=ready, error=error, operator_seen_ns=nobody)
    assert [(one.told, one.killed) for one in started] == [(True, False)] * 2


def test_the_page_is_asked_for_its_operator_while_the_session_runs(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    error = SystemExit("enough")

    def ready(memory: SessionMemory) -> None:
        memory.status.set_condition(Role.RECORDER, ProcessCondition.READY)

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


@pytest.mark.parametrize(
    ("flag", "sentence"),
    [
        (Flag.EMERGENCY_STOP, "the emergency stop was pressed while the session waited for the"),
        (Flag.END_ASKED, "it was ended while the session waited for the source of EMG"),
        (Flag.ABORT_ASKED, "it was ended while the session waited for the source of EMG"),
    ],
)
def test_a_session_that_waits_for_its_emg_can_be_ended(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, flag: Flag, sentence: str
) -> None:
    """The console is asked while the source of EMG does not answer, and the loop never starts."""
    monkeypatch.setattr(supervisor, "EMG_S", 5.0)
    asked: list[SessionMemory] = []

    def ready(memory: SessionMemory) -> None:
        memory.status.set_condition(Role.RECORDER, ProcessCondition.READY)

    def console(memory: SessionMemory) -> None:
        asked.append(memory)
        if len(asked) == 2:
            memory.status.raise_flag(flag)

    started = supervised(
        monkeypatch,
        tmp_path,
        prepare=ready,
        console=console,
        error=EndedEarly(sentence, []),
        settings=parse_settings({"emg": {"muscles": ["biceps"], "source": "virtual"}}),
    )
    assert [one.name for one in started] == ["rigidimeter-recorder", "rigidimeter-emg"]
    assert len(asked) == 2
    assert all(one.told for one in started)
