"""A joint told to stand still, step by step and in closed form."""

import math

import pytest
from tests.unit.rig.guard.many_steps import DT, NOTHING, run

from rigidimeter.rig.guard import Cause, consistency_state, consistency_step

REST = NOTHING._replace(settle_s=0.0405, hold_rad=0.2505)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_joint_told_to_rest_may_move_by_the_hold_limit(sign):
    # 1 rad/s, held from 0.040 s on: 0.2505 rad are passed at 0.291 s, not at 0.290 s.
    k, cause, _ = run(REST, 1000, lambda t: sign * t, sign, sent=0.0)
    assert (k, cause) == (291, Cause.MOVED_AT_REST)
    assert run(REST._replace(hold_rad=2.0), 1000, lambda t: sign * t, sign, sent=0.0)[0] == 1000


def test_a_joint_may_settle_first_and_move_when_told():
    assert run(REST, 1000, lambda t: min(100.0 * t, 3.0), 0.0, sent=0.0)[1] == Cause.NONE
    assert run(REST, 3000, lambda t: t, 1.0, sent=1e-9)[1] == Cause.NONE

    def now_and_then(t):
        return 1.0 if round(t / DT) % 30 == 0 else 0.0

    assert run(REST, 3000, lambda t: t, 1.0, sent=now_and_then)[1] == Cause.NONE


def test_a_reading_from_before_the_joint_had_settled_is_no_place_to_hold():
    late_s = 0.05

    def late(t):  # comes to rest at 0.04 s, seen 50 ms later
        return min(max(t - late_s, 0.0), 0.04) * 20.0

    assert run(REST, 1000, late, 0.0, sent=0.0, ages=(late_s, 0.0))[1] == Cause.NONE
    assert run(REST, 1000, late, 0.0, sent=0.0)[1] == Cause.MOVED_AT_REST


def test_a_joint_that_was_told_to_move_holds_at_a_new_place():
    assert (
        run(REST, 1000, lambda t: min(t, 0.5), 0.0, sent=lambda t: float(t < 0.5))[1] == Cause.NONE
    )
    state = consistency_state(REST)
    for angle, sent in ((0.0, 0.0), (0.5, 1.0), (1.0, 0.0)):
        for _ in range(100):
            state, cause = consistency_step(REST, state, sent, 0.0, 0.0, angle, 0.0, 0.0, 0.0)
            assert cause == Cause.NONE


def test_no_tick_and_fewer_count_as_one():
    for elapsed in (0, -3):
        state, _ = consistency_step(REST, consistency_state(REST), *(0.0,) * 7, elapsed)
        assert state.still_s == DT


# --- to the tick


def test_a_joint_has_the_time_to_settle_from_the_last_command_on():
    # As above, 0.7 s later: the last command is at 0.699 s, and 0.2505 rad are passed at 0.991 s.
    k, cause, _ = run(REST, 2000, lambda t: t, 1.0, sent=lambda t: float(t < 0.6995))
    assert (k, cause) == (991, Cause.MOVED_AT_REST)


@pytest.mark.parametrize("ahead_s", [0.005, 0.03])
def test_a_stamp_that_is_ahead_spares_no_time_to_settle(ahead_s):
    k, cause, _ = run(REST, 1000, lambda t: t, 1.0, sent=0.0, ages=(-ahead_s, 0.0))
    assert (k, cause) == (291, Cause.MOVED_AT_REST)


@pytest.mark.parametrize(("age_s", "held_at"), [(-0.25, 4), (0.0, 4), (0.25, 6)])
def test_until_the_end_of_the_time_to_settle_no_reading_is_a_place_to_hold(age_s, held_at):
    """Numbers that are whole in base two: 4 ticks of 1/8 s, and 2 more if readings are so late."""
    limits = NOTHING._replace(interval_s=0.125, settle_s=0.5, hold_rad=0.5)
    state = consistency_state(limits)
    for k in range(10):
        state, _ = consistency_step(limits, state, 0.0, 0.0, 0.0, 0.01 * k, 0.0, age_s, 0.0)
        assert math.isnan(state.held_rad) == (k < held_at)
    assert state.held_rad == 0.01 * held_at


def test_a_joint_may_be_as_far_from_its_place_as_the_limit():
    state = consistency_state(REST)._replace(still_s=1.0, held_rad=1.0)
    limits = REST._replace(hold_rad=0.5)
    for angle, cause in ((1.5, Cause.NONE), (0.5, Cause.NONE), (1.501, Cause.MOVED_AT_REST)):
        assert consistency_step(limits, state, 0.0, 0.0, 0.0, angle, *(0.0,) * 3)[1] == cause


def test_a_slow_loop_whose_every_tick_is_a_mean_finds_it_too():
    limits = REST._replace(interval_s=0.02, mean_of_ticks=1)
    k, cause, _ = run(limits, 100, lambda t: t, 1.0, sent=0.0)
    # Held at 0.04 rad from the third tick on: 0.2505 rad more are passed at 0.30 rad, tick 15.
    assert (k, cause) == (15, Cause.MOVED_AT_REST)
