import math
import time

import pytest

from rigidimeter.acquisition.processes.ring import EventRing, SampleRing
from rigidimeter.acquisition.processes.shared_status import (
    Board,
    Condition,
    Flag,
    LiveEstimate,
    LoopStatus,
    Role,
)
from rigidimeter.acquisition.processes.sink import BoardOutside, RingSink
from rigidimeter.acquisition.run_states import NOTHING, Command, Order, Run, State
from rigidimeter.guard import Cause
from rigidimeter.recording.sample_log import Sample


class Time:
    def __init__(self) -> None:
        self.ns = 1_000_000_000_000

    def __call__(self) -> int:
        return self.ns


@pytest.fixture
def now():
    return Time()


@pytest.fixture
def board(now):
    made = Board.create()
    board = Board(made.memory, now)
    yield board
    made.memory.unlink()
    made.close()


@pytest.fixture
def rings():
    rings = SampleRing.create(10), EventRing.create(16, 512)
    yield rings
    for ring in rings:
        ring.memory.unlink()
        ring.close()


def test_what_one_process_shows_another_sees(board):
    other = Board.attach(board.name)
    assert other.status() == LoopStatus(
        **{k: pytest.approx(v, nan_ok=True) for k, v in LoopStatus()._asdict().items()}
    )
    status = LoopStatus(1, 12, 3, 5, 0, 1.5, 0.1, 0.2, 0.3, 0.4, 0.5)
    live = LiveEstimate(12, 1, 7, 1.5, 0.08, 0.001, 0.4, 0.1, 1.7, 0.2, 4.0)
    board.show(status)
    board.show_live(live)
    board.set_condition(Role.RECORDER, Condition.TROUBLE, "the disk is full: µ")
    assert (other.status(), other.live()) == (status, live)
    assert other.condition(Role.RECORDER) is Condition.TROUBLE
    assert other.note(Role.RECORDER) == "the disk is full: µ"
    assert other.pid(Role.LOOP) == 0
    other.close()


def test_what_is_half_written_is_not_read(board):
    board.show(LoopStatus(tick=1))
    words = board.memory.words
    words[96] += 1  # as a writer that was killed between the two counts leaves it
    assert board.status() is None
    board.show(LoopStatus(tick=2))
    assert board.status().tick == 2


def test_heartbeats_age(board, now):
    assert board.age_s(Role.LOOP) == math.inf
    board.beat(Role.LOOP)
    now.ns += 250_000_000
    assert board.age_s(Role.LOOP) == pytest.approx(0.25)


def test_orders_come_in_order_and_once(board):
    assert board.take() == NOTHING
    orders = [Order(Command.CHANGE, "damping_nm_s_rad", 0.5), Order(Command.PAUSE)]
    assert [board.post(order) for order in orders] == [1, 2]
    assert board.take() == orders[0]
    assert board.taken == 1
    assert board.take().command is Command.PAUSE
    assert board.take() is NOTHING


def test_orders_that_nobody_takes_are_refused(board):
    for _ in range(16):
        board.post(Order(Command.PAUSE))
    with pytest.raises(ValueError, match="the loop does not take them"):
        board.post(Order(Command.PAUSE))
    with pytest.raises(ValueError, match="at most 48 bytes"):
        board.post(Order(Command.CHANGE, "x" * 49, 1.0))


def sample(k: int) -> Sample:
    return Sample(k, k / 10, 0.2 if k == 3 else 0.0, 1, *[1.0] * 9, 0)


def test_causes_to_stop(board, rings, now):
    samples, _ = rings
    outside = BoardOutside(
        board,
        samples,
        console_lost_s=0.5,
        recorder_lost_s=2.0,
        most_lag=6,
        now_ns=now,
        boot_ns=now,
    )
    board.beat(Role.CONSOLE)
    board.beat(Role.RECORDER)
    assert outside.cause(0.0) == Cause.NONE
    for k in range(7):
        samples.push(sample(k))
    assert outside.cause(0.0) == Cause.RECORD_OVERFLOW
    samples.recorded = 7
    assert outside.cause(0.0) == Cause.NONE
    now.ns += 600_000_000
    assert outside.cause(0.0) == Cause.CONSOLE_LOST
    board.beat(Role.CONSOLE)
    now.ns += 1_500_000_000
    board.beat(Role.CONSOLE)
    assert outside.cause(0.0) == Cause.RECORDER_LOST
    board.raise_flag(Flag.END_ASKED)
    assert outside.cause(0.0) == Cause.SIGNAL
    board.raise_flag(Flag.EMERGENCY_STOP)
    assert outside.cause(0.0) == Cause.EMERGENCY_STOP


@pytest.fixture
def outside(board, rings, now):
    board.beat(Role.CONSOLE)
    board.beat(Role.RECORDER)
    before = Time()
    before.ns = now.ns + 7_000_000_000  # suspended for 7 s since it was started, but not by us
    return BoardOutside(board, rings[0], stall_s=0.1, now_ns=now, boot_ns=before), before


def test_a_suspended_computer_has_stood_still(board, outside, now):
    outside, boot = outside
    assert outside.cause(0.0) == Cause.NONE
    for clock in (now, boot):  # time goes by: no difference
        clock.ns += 400_000_000
    assert outside.cause(0.0) == Cause.NONE
    boot.ns += 99_000_000  # less than a stall
    assert outside.cause(0.0) == Cause.NONE
    boot.ns += 2_000_000
    assert outside.cause(0.0) == Cause.STALLED
    board.raise_flag(Flag.END_ASKED)  # the ramp that a signal asks for would set the arm going
    for clock in (now, boot):
        clock.ns += 500_000_000
    assert outside.cause(0.0) == Cause.STALLED
    board.raise_flag(Flag.EMERGENCY_STOP)
    assert outside.cause(0.0) == Cause.EMERGENCY_STOP


def test_a_loop_held_up_between_two_clocks_was_not_suspended(board, rings, now):
    board.beat(Role.CONSOLE)
    board.beat(Role.RECORDER)
    held_up_ns = 0

    def held_up():
        at = now.ns
        now.ns += held_up_ns
        return at

    outside = BoardOutside(board, rings[0], stall_s=0.1, now_ns=held_up, boot_ns=held_up)
    held_up_ns = 500_000_000
    assert outside.cause(0.0) == Cause.NONE


def test_the_two_clocks_are_those_of_the_machine(board, rings):
    real = Board(board.memory)
    real.beat(Role.CONSOLE)
    real.beat(Role.RECORDER)
    outside = BoardOutside(real, rings[0], stall_s=0.1)
    time.sleep(0.15)
    assert outside.cause(0.0) == Cause.NONE


def test_the_sink_keeps_events_in_their_place(board, rings):
    samples, events = rings
    sink = RingSink(samples, events, board, tick_rate_hz=10.0)
    sink.session_started()
    sink.state_changed(Run(State.RUNNING))
    sink.epoch_started(1, "one", "prbs", "rest", 0.0, planned_s=0.4)
    for k in range(4):
        sink.sample(sample(k))
    assert board.condition(Role.LOOP) is Condition.RUNNING
    sink.epoch_ended(1, 0.4, "success", "")
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
    assert sink.lag() == 5
    status = board.status()
    assert (status.state, status.tick, status.missed_deadlines) == (State.RUNNING, 4, 1)
    assert board.condition(Role.LOOP) is Condition.STOPPING
