import math
import os
import time
from pathlib import Path

import pytest

from rigidimeter.core.session import Sample
from rigidimeter.core.settings import Settings
from rigidimeter.rig.acquisition import NOTHING, Command, Order, Phase, Run, State
from rigidimeter.rig.acquisition.processes import (
    NOTE_BYTES,
    PAUSE_NEXT,
    STOP_NEXT,
    EventRing,
    Flag,
    LiveEstimate,
    LoopStatus,
    ProcessCondition,
    RingSink,
    Role,
    SampleRing,
    SessionMemory,
    SharedStatus,
    SharedSupervision,
    shared_memory,
)
from rigidimeter.rig.guard import Cause, guard_limits, guard_state


class Time:
    def __init__(self) -> None:
        self.ns = 1_000_000_000_000

    def __call__(self) -> int:
        return self.ns


@pytest.fixture(autouse=True)
def where(tmp_path, monkeypatch):
    monkeypatch.setattr(shared_memory, "WHERE", tmp_path)  # goes with the test, also a killed one


@pytest.fixture
def now():
    return Time()


@pytest.fixture
def shared_status(now):
    made = SharedStatus.create()
    yield SharedStatus(made.memory, now)
    made.close()


@pytest.fixture
def rings():
    rings = SampleRing.create(10), EventRing.create(16, 512)
    yield rings
    for ring in rings:
        ring.close()


def test_what_one_process_shows_another_sees(shared_status):
    other = SharedStatus.attach(shared_status.name)
    assert other.loop() == LoopStatus(
        **{k: pytest.approx(v, nan_ok=True) for k, v in LoopStatus()._asdict().items()}
    )
    status = LoopStatus(1, 12, 3, 5, 9, 4, 2, 1.5, 0.1, 0.2, 0.3, 0.4, 0.5, 21.5, 0.6)
    live = LiveEstimate(12, 1, 7, 3, 0.5, 1.5, 0.08, 0.001, 0.4, 0.1, 1.7, 0.2, 4.0, 0.01)
    shared_status.show_loop(status)
    shared_status.show_live(live)
    shared_status.set_condition(Role.RECORDER, ProcessCondition.TROUBLE, "the disk is full: µ")
    assert (other.loop(), other.live()) == (status, live)
    assert other.condition(Role.RECORDER) is ProcessCondition.TROUBLE
    assert other.note(Role.RECORDER) == "the disk is full: µ"
    assert other.pid(Role.LOOP) == 0
    other.close()


def test_what_is_half_written_is_not_read(shared_status):
    shared_status.show_loop(LoopStatus(tick=1))
    words = shared_status.memory.words
    words[104] += 1  # as a writer that was killed between the two counts leaves it
    assert shared_status.loop() is None
    shared_status.show_loop(LoopStatus(tick=2))
    assert shared_status.loop().tick == 2


def test_heartbeats_age(shared_status, now):
    assert shared_status.age_s(Role.LOOP) == math.inf
    shared_status.beat(Role.LOOP)
    now.ns += 250_000_000
    assert shared_status.age_s(Role.LOOP) == pytest.approx(0.25)


def test_orders_come_in_order_and_once(shared_status):
    assert shared_status.take() == NOTHING
    orders = [Order(Command.CHANGE, "damping_nm_s_rad", 0.5), Order(Command.PAUSE)]
    assert [shared_status.post(order) for order in orders] == [1, 2]
    assert shared_status.take() == orders[0]
    assert shared_status.taken == 1
    assert shared_status.take().command is Command.PAUSE
    assert shared_status.take() is NOTHING


def test_orders_that_nobody_takes_are_refused(shared_status):
    for _ in range(16):
        shared_status.post(Order(Command.PAUSE))
    with pytest.raises(ValueError, match="the loop does not take them"):
        shared_status.post(Order(Command.PAUSE))
    with pytest.raises(ValueError, match="at most 48 bytes"):
        shared_status.post(Order(Command.CHANGE, "x" * 49, 1.0))


def test_a_note_is_given_whole_and_the_next_when_it_was_taken(shared_status):
    long = "ä" * (NOTE_BYTES // 2)
    assert shared_status.post_note(long) == 1
    assert shared_status.post_note("second") is None
    assert shared_status.take() == pytest.approx((Command.NOTE, long, math.nan), nan_ok=True)
    assert shared_status.post_note("second") == 2
    assert shared_status.take().name == "second"
    with pytest.raises(ValueError, match=f"takes {NOTE_BYTES + 2} bytes; {NOTE_BYTES} are"):
        shared_status.post_note(long + "ä")


def test_a_heartbeat_may_be_that_of_an_earlier_moment(shared_status, now):
    earlier_ns = now() - 300_000_000
    shared_status.beat(Role.CONSOLE, earlier_ns)
    assert shared_status.age_s(Role.CONSOLE) == pytest.approx(0.3)


def sample(k: int) -> Sample:
    return Sample(k, k / 10, 0.2 if k == 3 else 0.0, 1, *[1.0] * 9, 0)


def test_causes_to_stop(shared_status, rings, now):
    samples, _ = rings
    supervision = SharedSupervision(
        SessionMemory(*rings, shared_status),
        console_lost_s=0.5,
        recorder_lost_s=2.0,
        max_lag=6,
        now_ns=now,
        boot_ns=now,
    )
    shared_status.beat(Role.CONSOLE)
    shared_status.beat(Role.RECORDER)
    assert supervision.cause(0.0) == Cause.NONE
    for k in range(7):
        samples.push(sample(k))
    assert supervision.cause(0.0) == Cause.RECORD_OVERFLOW
    assert supervision.measured == 7
    samples.recorded = 7
    assert supervision.cause(0.0) == Cause.NONE
    now.ns += 600_000_000
    assert supervision.cause(0.0) == Cause.CONSOLE_LOST
    assert supervision.measured == pytest.approx(0.6)
    shared_status.beat(Role.CONSOLE)
    now.ns += 1_500_000_000
    shared_status.beat(Role.CONSOLE)
    assert supervision.cause(0.0) == Cause.RECORDER_LOST
    assert supervision.measured == pytest.approx(2.1)
    shared_status.raise_flag(Flag.END_ASKED)
    assert supervision.cause(0.0) == Cause.SIGNAL
    shared_status.raise_flag(Flag.EMERGENCY_STOP)
    assert supervision.cause(0.0) == Cause.EMERGENCY_STOP


def test_a_console_that_was_killed_is_lost_at_once(shared_status, rings, now, monkeypatch):
    shared_status.beat(Role.CONSOLE)
    shared_status.beat(Role.RECORDER)
    supervision = SharedSupervision(
        SessionMemory(*rings, shared_status), console_pid=os.getppid(), now_ns=now, boot_ns=now
    )
    assert supervision.cause(0.0) == Cause.NONE
    monkeypatch.setattr("rigidimeter.rig.acquisition.processes.ring_writer.getppid", lambda: 1)
    assert supervision.cause(0.0) == Cause.CONSOLE_LOST
    assert math.isnan(supervision.measured)


def test_an_interrupt_is_one_order_to_abort(shared_status, rings):
    supervision = SharedSupervision(SessionMemory(*rings, shared_status))
    shared_status.post(Order(Command.PAUSE))
    shared_status.raise_flag(Flag.ABORT_ASKED)
    taken = [supervision.order().command for _ in range(3)]
    assert taken == [Command.ABORT, Command.PAUSE, NOTHING.command]


def test_folders_are_shown_and_asked_for(shared_status, tmp_path):
    assert shared_status.folder() is None
    assert shared_status.asked_folder() is None
    shared_status.show_folder(tmp_path / "µ")
    shared_status.ask_folder(Path("other"))
    assert shared_status.folder() == tmp_path / "µ"
    assert shared_status.asked_folder() == Path.cwd() / "other"
    with pytest.raises(ValueError, match="4080 are possible"):
        shared_status.ask_folder(Path("x" * 5000))


@pytest.fixture
def supervision(shared_status, rings, now):
    shared_status.beat(Role.CONSOLE)
    shared_status.beat(Role.RECORDER)
    before = Time()
    before.ns = now.ns + 7_000_000_000  # suspended for 7 s since it was started, but not by us
    return SharedSupervision(
        SessionMemory(*rings, shared_status), stall_s=0.1, now_ns=now, boot_ns=before
    ), before


def test_a_suspended_computer_has_stood_still(shared_status, supervision, now):
    supervision, boot = supervision
    assert supervision.cause(0.0) == Cause.NONE
    for clock in (now, boot):  # time goes by: no difference
        clock.ns += 400_000_000
    assert supervision.cause(0.0) == Cause.NONE
    boot.ns += 99_000_000  # less than a stall
    assert supervision.cause(0.0) == Cause.NONE
    boot.ns += 2_000_000
    assert supervision.cause(0.0) == Cause.STALLED
    assert supervision.measured == pytest.approx(0.101)
    shared_status.raise_flag(
        Flag.END_ASKED
    )  # the ramp that a signal asks for would set the arm going
    for clock in (now, boot):
        clock.ns += 500_000_000
    assert supervision.cause(0.0) == Cause.STALLED
    shared_status.raise_flag(Flag.EMERGENCY_STOP)
    assert supervision.cause(0.0) == Cause.EMERGENCY_STOP


def test_a_loop_held_up_between_two_clocks_was_not_suspended(shared_status, rings, now):
    shared_status.beat(Role.CONSOLE)
    shared_status.beat(Role.RECORDER)
    held_up_ns = 0

    def held_up():
        at = now.ns
        now.ns += held_up_ns
        return at

    supervision = SharedSupervision(
        SessionMemory(*rings, shared_status), stall_s=0.1, now_ns=held_up, boot_ns=held_up
    )
    held_up_ns = 500_000_000
    assert supervision.cause(0.0) == Cause.NONE


@pytest.mark.realtime(resolves_s=0.5)
def test_the_two_clocks_are_those_of_the_machine(shared_status, rings):
    real = SharedStatus(shared_status.memory)
    real.beat(Role.CONSOLE)
    real.beat(Role.RECORDER)
    supervision = SharedSupervision(SessionMemory(*rings, real), stall_s=0.1)
    time.sleep(0.15)
    assert supervision.cause(0.0) == Cause.NONE


def test_each_sample_is_a_heartbeat_of_the_loop(shared_status, rings):
    sink = RingSink(SessionMemory(*rings, shared_status), tick_rate_hz=10.0)
    real = SharedStatus(shared_status.memory)
    assert real.age_s(Role.LOOP) == math.inf
    sink.sample(sample(0))
    assert real.age_s(Role.LOOP) < math.inf
    heart = shared_status.places()[-1]
    shared_status.memory.words[heart] = 1
    sink.sample(sample(1))
    assert shared_status.memory.words[heart] > 1


def test_the_sink_keeps_events_in_their_place(shared_status, rings):
    samples, events = rings
    sink = RingSink(SessionMemory(*rings, shared_status), tick_rate_hz=10.0)
    sink.event("session_started", time_s=0.0)
    sink.state_changed(Run(State.RUNNING))
    sink.event("epoch_started", epoch=1, time_s=0.0, planned_s=0.4)
    for k in range(4):
        sink.sample(sample(k))
    assert shared_status.condition(Role.LOOP) is ProcessCondition.RUNNING
    sink.event("epoch_ended", epoch=1, time_s=0.4, outcome="success", reason="")
    sink.sample(sample(4))
    sink.close(0.5, "success", "")
    sink.close(9.9, "fail", "again")
    found = [events.get(k) for k in range(events.written)]
    assert [(event.facts["event"], event.samples_before) for event in found] == [
        ("session_started", 0),
        ("epoch_started", 0),
        ("epoch_ended", 4),
        ("session_ended", 5),
    ]
    assert found[-1].facts["outcome"] == "success"
    assert samples.lag() == 5
    status = shared_status.loop()
    assert (status.state, status.tick) == (State.RUNNING, 4)
    assert (status.late_ticks, status.missed_ticks) == (1, 2)
    assert shared_status.condition(Role.LOOP) is ProcessCondition.STOPPING


class Loop:
    """What the sink looks at of a loop."""

    until_tick, rate_hz, phase, still = 30, 10.0, Phase.REST, True
    guard = guard_state(guard_limits(Settings()))._replace(energy_j=0.7)


def test_the_sink_shows_what_comes_next(shared_status, rings):
    sink = RingSink(SessionMemory(*rings, shared_status), 10.0)
    sink.sample(sample(0))
    first = shared_status.loop()
    assert (first.pending, math.isnan(first.until_s), math.isnan(first.energy_j)) == (0, True, True)
    sink.watch(Loop())
    for k, (run, pending) in enumerate(
        (
            (Run(State.RUNNING, pause_next=True), PAUSE_NEXT),
            (Run(State.RUNNING, stop_next=True), STOP_NEXT),
            (Run(State.RUNNING, pause_next=True, stop_next=True), PAUSE_NEXT + STOP_NEXT),
        ),
        start=1,
    ):
        sink.state_changed(run)
        sink.sample(sample(k))
        shown = shared_status.loop()
        assert (shown.pending, shown.until_s, shown.energy_j) == (pending, 3.0, 0.7)


@pytest.mark.parametrize(
    ("state", "stands", "still"),
    [
        (State.PAUSED, True, 1),
        (State.PAUSED, False, 0),  # it comes to rest, or was pushed away
        (State.RUNNING, True, 0),  # zeroing: what follows moves it without an order
    ],
)
def test_the_sink_says_that_the_arm_is_still_by_the_loop_and_not_by_the_state(
    shared_status, rings, state, stands, still
):
    sink, loop = RingSink(SessionMemory(*rings, shared_status), 10.0), Loop()
    loop.still = stands
    sink.watch(loop)
    sink.state_changed(Run(state))
    sink.sample(sample(1))
    shown = shared_status.loop()
    assert (shown.still, shown.phase) == (still, Phase.REST)
