"""The loop's side of the shared memory, at the edges: what is allowed is no cause, 1 ns more is."""

import math
import time
from types import SimpleNamespace

import pytest

from rigidimeter.core.session import Sample
from rigidimeter.rig.acquisition import NOTHING, Run, State
from rigidimeter.rig.acquisition.processes import (
    Flag,
    LoneSupervision,
    ProcessCondition,
    RingSink,
    Role,
    SessionMemory,
    SharedSupervision,
    shared_memory,
)
from rigidimeter.rig.guard import Cause

START_NS = 1_000_000_000_000
MS = 1_000_000
CAPACITY = 20


@pytest.fixture
def shared(tmp_path, monkeypatch):
    monkeypatch.setattr(shared_memory, "WHERE", tmp_path)  # goes with the test, also a killed one
    memory = SessionMemory.create(tick_rate_hz=10.0, ring_s=CAPACITY / 10.0)
    for role in (Role.CONSOLE, Role.RECORDER):
        memory.status.beat(role, START_NS)
    yield memory
    memory.close()


def sample(time_s: float, lateness_s: float = 0.0) -> Sample:
    """Return a sample whose tick is its time in units of 0.1 ms."""
    return Sample(round(1e4 * time_s), time_s, lateness_s, 1, *[1.0] * 9, limited=0)


def causes(shared, *, gone_by_ns=0, suspended_ns=0, **limits):
    """Return the cause so long after the last heartbeats, the computer suspended for so long."""
    now_ns, boot_ns = START_NS, START_NS
    supervision = SharedSupervision(
        shared, now_ns=lambda: now_ns, boot_ns=lambda: boot_ns, **limits
    )
    assert supervision.cause(0.0) == Cause.NONE
    assert math.isnan(supervision.measured)
    now_ns += gone_by_ns
    boot_ns += gone_by_ns + suspended_ns
    return Cause(supervision.cause(0.0)), supervision.measured


@pytest.mark.parametrize(("limits", "allowed_ms"), [({}, 500), ({"console_lost_s": 0.7}, 700)])
def test_a_console_may_be_silent_for_so_long(shared, limits, allowed_ms):
    assert causes(shared, gone_by_ns=allowed_ms * MS, **limits)[0] is Cause.NONE
    cause, measured = causes(shared, gone_by_ns=allowed_ms * MS + 1, **limits)
    assert cause is Cause.CONSOLE_LOST
    assert measured == pytest.approx(1e-3 * allowed_ms)


@pytest.mark.parametrize(("limits", "allowed_ms"), [({}, 2000), ({"recorder_lost_s": 0.3}, 300)])
def test_a_recorder_may_be_silent_for_so_long(shared, limits, allowed_ms):
    shared.status.beat(Role.CONSOLE, START_NS + allowed_ms * MS)
    assert causes(shared, gone_by_ns=allowed_ms * MS, **limits)[0] is Cause.NONE
    cause, measured = causes(shared, gone_by_ns=allowed_ms * MS + 1, **limits)
    assert cause is Cause.RECORDER_LOST
    assert measured == pytest.approx(1e-3 * allowed_ms)


@pytest.mark.parametrize(("limits", "allowed_ms"), [({}, 100), ({"stall_s": 0.04}, 40)])
def test_a_computer_may_be_suspended_for_so_long(shared, limits, allowed_ms):
    assert causes(shared, suspended_ns=allowed_ms * MS, **limits)[0] is Cause.NONE
    cause, measured = causes(shared, suspended_ns=allowed_ms * MS + 1, **limits)
    assert cause is Cause.STALLED
    assert measured == pytest.approx(1e-3 * allowed_ms)
    assert causes(shared, suspended_ns=7000 * MS, **limits)[1] == pytest.approx(7.0)


@pytest.mark.parametrize(("limits", "allowed"), [({}, CAPACITY // 2), ({"max_lag": 3}, 3)])
def test_so_many_samples_may_wait_for_the_recorder(shared, limits, allowed):
    supervision = SharedSupervision(
        shared, now_ns=lambda: START_NS, boot_ns=lambda: START_NS, **limits
    )
    for k in range(allowed):
        shared.samples.push(sample(0.1 * k))
    assert supervision.cause(0.0) == Cause.NONE
    shared.samples.push(sample(0.1 * allowed))
    assert supervision.cause(0.0) == Cause.RECORD_OVERFLOW
    assert supervision.measured == allowed + 1


def test_the_silence_of_a_console_that_was_killed_is_not_known(shared, monkeypatch):
    monkeypatch.setattr("rigidimeter.rig.acquisition.processes.ring_writer.getppid", lambda: 41)
    supervision = SharedSupervision(
        shared, max_lag=0, console_pid=41, now_ns=lambda: START_NS, boot_ns=lambda: START_NS
    )
    shared.samples.push(sample(0.0))
    assert supervision.cause(0.0) == Cause.RECORD_OVERFLOW
    assert supervision.measured == 1
    monkeypatch.setattr("rigidimeter.rig.acquisition.processes.ring_writer.getppid", lambda: 1)
    assert supervision.cause(0.0) == Cause.CONSOLE_LOST
    assert math.isnan(supervision.measured)


def test_nobody_asked_for_an_end_so_none_is_ordered(shared):
    assert SharedSupervision(shared).order() is NOTHING


def test_an_operator_is_there_unless_it_is_said(shared):
    assert SharedSupervision(shared).attended is True
    assert SharedSupervision(shared, attended=False).attended is False


def test_the_loop_is_shown_every_20_ms_and_at_once_when_its_state_changes(shared):
    sink = RingSink(shared, tick_rate_hz=10_000.0)
    assert sink.last_time_s == 0.0
    assert shared.status.condition(Role.LOOP) is not ProcessCondition.RUNNING
    shown = []
    for time_s in (1.0, 1.0199, 1.02, 1.0399, 1.04):
        sink.sample(sample(time_s))
        shown.append(shared.status.loop().time_s)
    assert shown == [1.0, 1.0, 1.02, 1.02, 1.04]
    assert shared.status.condition(Role.LOOP) is ProcessCondition.RUNNING
    sink.state_changed(Run(State.PAUSED))
    assert shared.status.loop().state == State.IDLE  # with the next sample
    sink.sample(sample(1.0401))
    assert (shared.status.loop().state, shared.status.loop().time_s) == (State.PAUSED, 1.0401)
    assert sink.last_time_s == 1.0401


def test_what_the_loop_shows_is_the_sample(shared):
    columns = [0.1 * k for k in range(1, 10)]
    whole = Sample(12, 1.2, 0.0, 3, *columns, limited=0, cause=int(Cause.SIGNAL))
    RingSink(shared, tick_rate_hz=10.0).sample(whole)
    status = shared.status.loop()
    for name in (
        *("tick", "time_s", "epoch", "cause", "angle_rad", "velocity_rad_s", "torque_nm"),
        *("perturbation_nm", "velocity_command_rad_s"),
    ):
        assert getattr(status, name) == getattr(whole, name), name


def test_a_tick_late_by_more_than_half_is_late_and_whole_ones_were_missed(shared):
    sink = RingSink(shared, tick_rate_hz=10.0)
    for k, late_s in enumerate((0.0, 0.05, 0.051, 0.0995, 0.1, 0.25)):
        sink.sample(sample(0.1 * k, late_s))
    status = shared.status.loop()
    assert (status.late_ticks, status.missed_ticks) == (4, 3)


@pytest.mark.parametrize("state", [State.STOPPING, State.FAULTED])
def test_a_loop_that_stops_says_so_since_its_ticks_may_then_take_longer(shared, state):
    sink = RingSink(shared, tick_rate_hz=10.0)
    sink.sample(sample(0.0))
    for other in (State.RUNNING, State.PAUSED, State.IDLE):
        sink.state_changed(Run(other))
        assert shared.status.condition(Role.LOOP) is ProcessCondition.RUNNING
    stopped_ns = time.monotonic_ns()
    sink.state_changed(Run(state))
    assert shared.status.condition(Role.LOOP) is ProcessCondition.STOPPING
    assert shared.status.memory.words[shared.status.places()[-1]] >= stopped_ns
    sink.sample(sample(0.1))  # of the ramp to rest
    assert shared.status.loop().state == state
    assert shared.status.condition(Role.LOOP) is ProcessCondition.STOPPING


@pytest.mark.parametrize(
    ("run", "at_rest", "ends"),
    [
        (Run(State.STOPPING, at_once=True, aborted=True), False, False),
        (Run(State.FAULTED), False, False),
        (Run(State.FAULTED, at_once=True), False, True),  # halted: its power is cut now
        (Run(State.STOPPING), True, True),
        (Run(State.FAULTED), True, True),
    ],
)
def test_as_long_as_the_arm_is_ramped_down_the_loop_must_not_be_silent(shared, run, at_rest, ends):
    sink = RingSink(shared, tick_rate_hz=10.0)
    sink.sample(sample(0.0))
    sink.watch(SimpleNamespace(at_rest=at_rest))
    sink.state_changed(run)
    stopping = shared.status.condition(Role.LOOP) is ProcessCondition.STOPPING
    assert stopping is ends


def test_a_session_is_closed_once(shared):
    sink = RingSink(shared, tick_rate_hz=10.0)
    assert not sink.closed
    closed_ns = time.monotonic_ns()
    sink.close(1.5, "abort", "as the operator said")
    sink.close(9.9, "fail", "again")
    assert sink.closed
    assert shared.events.written == 1
    assert shared.events.get(0).facts == {
        "event": "session_ended",
        "time_s": 1.5,
        "outcome": "abort",
        "reason": "as the operator said",
    }
    assert shared.status.condition(Role.LOOP) is ProcessCondition.STOPPING
    assert shared.status.memory.words[shared.status.places()[-1]] >= closed_ns


def test_a_loop_held_up_twice_as_it_begins_was_not_suspended(shared):
    """Two of the three looks at both clocks are late by 0.5 s; the third shows what is true."""
    now_ns, held_up = START_NS, [500 * MS, 500 * MS, 0]

    def boot():
        nonlocal now_ns
        at_ns = now_ns
        now_ns += held_up.pop(0) if held_up else 0
        return at_ns

    supervision = SharedSupervision(
        shared, console_lost_s=10.0, now_ns=lambda: now_ns, boot_ns=boot
    )
    assert not held_up
    assert supervision.cause(0.0) == Cause.NONE


@pytest.mark.parametrize("flag", [Flag.END_ASKED, Flag.ABORT_ASKED])
def test_a_signal_does_not_hide_that_the_computer_was_suspended(shared, flag):
    """By its cause the ramp would begin at the velocity before, which the drive has long left."""
    shared.status.raise_flag(flag)
    now_ns = boot_ns = START_NS
    supervision = SharedSupervision(shared, now_ns=lambda: now_ns, boot_ns=lambda: boot_ns)
    boot_ns += 1000 * MS
    assert supervision.cause(0.0) == Cause.STALLED


def lone(**options):
    clock = {"now": START_NS, "boot": START_NS, "seen": START_NS}
    options.setdefault("operator_seen_ns", lambda: clock["seen"])
    return clock, LoneSupervision(
        now_ns=lambda: clock["now"], boot_ns=lambda: clock["boot"], **options
    )


def test_a_check_stops_where_nobody_says_that_somebody_is_there():
    clock, supervision = lone(console_lost_s=0.5)
    clock["now"] += 500 * MS
    clock["boot"] += 500 * MS
    assert supervision.cause(0.0) == Cause.NONE
    clock["now"] += 1
    assert supervision.cause(0.0) == Cause.CONSOLE_LOST
    assert supervision.measured == pytest.approx(0.5)
    clock["seen"] = clock["now"]
    assert supervision.cause(0.0) == Cause.NONE
    assert (supervision.order(), supervision.attended) == (NOTHING, False)


def test_a_check_at_a_terminal_needs_no_beats_but_notices_a_suspension():
    clock, supervision = lone(operator_seen_ns=None, stall_s=0.1)
    clock["now"] += 10_000 * MS
    clock["boot"] += 10_100 * MS
    assert supervision.cause(0.0) == Cause.NONE
    clock["boot"] += 1
    assert supervision.cause(0.0) == Cause.STALLED
    assert supervision.measured == pytest.approx(0.1)
