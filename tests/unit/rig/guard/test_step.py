"""Limits of acceleration and speed, what is remembered, and what latches."""

import math

import pytest
from tests.unit.rig.guard.one_step import BINARY, LIMITS, at, step

from rigidimeter.core.settings import Settings
from rigidimeter.rig.guard import (
    Cause,
    Limited,
    Reaction,
    guard_limits,
    guard_step,
    why_ended,
    within_range,
)


def test_the_numbers_of_the_record():
    assert [member.name for member in Limited] == [
        *("NOT", "ACCELERATION", "SPEED", "POSITION", "LATCHED")
    ]
    assert list(Limited) == [0, 1, 2, 3, 4]


def test_a_harmless_request_passes_untouched():
    _, sent, limited = step(at(0.5), 0.55)
    assert (sent, limited) == (0.55, Limited.NOT)


def test_torque_age_report_and_ticks_may_be_left_out():
    state, sent, limited = guard_step(LIMITS, at(0.5), 0.55, 0.0, 0.0, 0.0, 0.0)
    assert (sent, limited, state.cause, state.newest) == (0.55, Limited.NOT, Cause.NONE, 1)
    # The torque is then as new as can be: neither old nor ahead.
    now = LIMITS._replace(stale_s=0.0, interval_s=1e-4)
    assert guard_step(now, at(0.0, now), 0.0, 0.0, 0.0, 0.0, 0.0)[0].cause == Cause.NONE


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_acceleration_is_limited_both_ways(sign):
    _, sent, limited = step(at(), sign * 2.0)
    assert sent == sign * 0.1
    assert limited == Limited.ACCELERATION
    _, sent, limited = step(at(), sign * 0.1)
    assert (sent, limited) == (sign * 0.1, Limited.NOT)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_speed_is_limited_both_ways(sign):
    _, sent, limited = step(at(sign * 2.95), sign * 3.04)
    assert (sent, limited) == (sign * 3.0, Limited.SPEED)
    _, sent, limited = step(at(sign * 2.95), sign * 3.0)
    assert (sent, limited) == (sign * 3.0, Limited.NOT)
    _, sent, limited = step(at(sign * 2.95), sign * 9.0)  # both: the graver is named
    assert (sent, limited) == (sign * 3.0, Limited.SPEED)


def test_the_sum_goes_round_the_ring():
    state = at(2.0, BINARY)
    size = state.sent_rad.size
    assert size == 22
    for k in range(1, size + 4):
        state, _, _ = step(state, 2.0, limits=BINARY, angle=0.25 * k, age_s=0.125)
        assert state.newest == k % size
        assert state.sent_rad[state.newest] == 0.25 * k
    assert state.cause == Cause.NONE


@pytest.mark.parametrize("missed", [1, 3, 21, 22, 1000, 10**12])
def test_what_was_in_force_fills_the_ticks_that_were_missed(missed):
    state, _, _ = step(at(2.0, BINARY), 2.0, limits=BINARY, elapsed=missed)
    filled = min(missed, 21)
    assert state.newest == filled
    longer = missed - filled  # than the ring's memory
    assert state.sent_rad[0] == 0.0
    assert state.sent_rad[1 : filled + 1].tolist() == [
        0.25 * (longer + k) for k in range(1, filled + 1)
    ]


@pytest.mark.parametrize("elapsed", [0, -5])
def test_time_does_not_stand_still(elapsed):
    state, _, _ = step(at(2.0, BINARY), 2.0, limits=BINARY, elapsed=elapsed)
    assert state.newest == 1
    assert state.sent_rad[1] == 0.25


def test_after_missed_ticks_the_command_still_changes_by_one_ticks_worth():
    assert step(at(), 3.0, elapsed=5)[1] == 0.1


def test_energy_grows_with_the_time_that_passed():
    limits = BINARY._replace(stale_s=0.5)
    state, _, _ = step(at(limits=limits), limits=limits, torque=-4.0, velocity=0.5, elapsed=2)
    assert state.energy_j == 2.0 * 0.25
    state, _, _ = step(state, limits=limits, torque=math.nan, velocity=0.5)
    assert state.energy_j == 0.5 * 0.875
    state, _, _ = step(state, limits=limits, torque=4.0, velocity=math.nan)
    assert state.energy_j == 0.5 * 0.875**2


def test_age_grows_while_no_reading_is_a_number():
    state, _, _ = step(at(limits=BINARY), limits=BINARY, angle=0.5, age_s=0.25)
    assert (state.angle_rad, state.age_s) == (0.5, 0.25)
    for bad in ({"angle": math.nan}, {"velocity": math.inf}, {"age_s": math.nan}):
        after, _, _ = step(state, limits=BINARY, elapsed=2, **bad)
        assert (after.angle_rad, after.age_s) == (0.5, 0.5)
        assert after.cause == Cause.MOTION_NOT_FINITE


@pytest.mark.parametrize("age_s", [1e300, -1e300, math.inf, -math.inf, math.nan])
@pytest.mark.parametrize("following_rad", [1.0, 1e-9])
def test_no_age_reaches_beyond_the_ring(age_s, following_rad):
    limits = BINARY._replace(following_rad=following_rad)
    state, sent, _ = step(at(limits=limits), 1.0, angle=60.0, age_s=age_s, limits=limits)
    state, sent, _ = step(state, 1.0, angle=61.0, age_s=age_s, limits=limits)
    assert sent == 0.0
    assert state.reaction == Reaction.RAMP


def test_a_reading_that_never_renews_latches():
    state = at(0.01)
    for k in range(600):
        state, _, _ = step(state, 0.01, angle=0.0, age_s=k * 0.001)
    assert state.cause == Cause.MOTION_STALE


def test_a_stale_torque_latches():
    assert step(at(), torque_age_s=0.501)[0].cause == Cause.TORQUE_STALE


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    ("field", "cause"),
    [
        ("torque", Cause.TORQUE_NOT_FINITE),
        ("angle", Cause.MOTION_NOT_FINITE),
        ("velocity", Cause.MOTION_NOT_FINITE),
        ("request", Cause.COMMAND_NOT_FINITE),
    ],
)
def test_a_number_that_is_not_finite_latches_and_ramps_down(bad, field, cause):
    values = {"request": 1.0, "torque": 0.0, "angle": 0.0, "velocity": 0.0}
    values[field] = bad
    request = values.pop("request")
    state, sent, limited = step(at(1.0), request, **values)
    assert state.cause == cause
    assert limited == Limited.LATCHED
    assert sent == pytest.approx(0.9)
    assert math.isfinite(state.angle_rad)
    # A sound request afterwards changes nothing: the latch holds, down to rest.
    for _ in range(20):
        state, sent, _ = step(state, 1.0)
    assert sent == 0.0
    assert state.cause == cause


def test_the_first_cause_is_kept():
    state, _, _ = step(at(), math.nan)
    state, _, _ = step(state, 0.0, torque=math.nan)
    assert state.cause == Cause.COMMAND_NOT_FINITE


@pytest.mark.parametrize("angle", [0.711, -0.711])
def test_an_angle_beyond_the_limit_is_a_fault(angle):
    state, _, _ = step(at(), 0.0, angle=angle)
    assert state.cause == Cause.POSITION_LIMIT_EXCEEDED


@pytest.mark.parametrize("angle", [0.709, -0.709])
def test_a_reading_within_the_tolerance_is_not(angle):
    state, _, _ = step(at(), 0.0, angle=angle)
    assert state.cause == Cause.NONE


# --- reactions


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_hold_ramps_to_rest_and_stays(sign):
    limits = LIMITS._replace(torque_nm=10.0)
    state, sent, limited = step(at(sign * 0.25), sign * 0.3, torque=11.0, limits=limits)
    assert (state.cause, state.reaction) == (Cause.TORQUE_HIGH, Reaction.HOLD)
    assert (sent, limited) == (sign * 0.15, Limited.LATCHED)
    for expected in (0.05, 0.0, 0.0):
        state, sent, limited = step(state, sign * 0.3, limits=limits)
        assert sent == pytest.approx(sign * expected, abs=1e-12)
        assert limited == Limited.LATCHED
    assert (state.cause, state.reaction) == (Cause.TORQUE_HIGH, Reaction.HOLD)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("elapsed", "ticks"), [(1, 1), (2, 2), (5, 5), (6, 5), (400, 5)])
def test_a_ramp_that_has_begun_makes_up_for_late_steps(sign, elapsed, ticks):
    # 8 rad/s² · 0.125 s is 1 rad/s a tick.
    state, _, _ = step(at(sign * 8.0, BINARY), limits=BINARY, reported=Cause.TORQUE_STALE)
    assert state.velocity_rad_s == sign * 7.0
    _, sent, limited = step(state, limits=BINARY, elapsed=elapsed)
    assert (sent, limited) == (sign * (7.0 - ticks), Limited.LATCHED)


def test_a_ramp_begins_with_one_ticks_worth_however_late():
    _, sent, _ = step(at(8.0, BINARY), limits=BINARY, reported=Cause.TORQUE_STALE, elapsed=4)
    assert sent == 7.0


def test_while_latched_the_speed_limit_still_holds():
    state = at(5.0, cause=int(Cause.SIGNAL), reaction=int(Reaction.RAMP))
    assert step(state, 5.0)[1:] == (3.0, Limited.LATCHED)


def test_a_stronger_cause_after_a_hold_changes_the_reaction_and_not_the_cause():
    limits = LIMITS._replace(torque_nm=10.0)
    state, _, _ = step(at(1.0), 1.0, torque=11.0, limits=limits)
    state, sent, _ = step(state, 1.0, reported=Cause.DRIVE_FAULT, limits=limits)
    assert (state.cause, state.reaction) == (Cause.TORQUE_HIGH, Reaction.RAMP)
    assert sent == pytest.approx(0.8)
    state, sent, _ = step(state, 1.0, reported=Cause.EMERGENCY_STOP, limits=limits)
    assert (state.cause, state.reaction) == (Cause.TORQUE_HIGH, Reaction.CUT)
    assert sent == 0.0
    state, sent, _ = step(state, 1.0, torque=11.0, limits=limits)
    assert (state.cause, state.reaction) == (Cause.TORQUE_HIGH, Reaction.CUT)
    assert sent == 0.0


@pytest.mark.parametrize("velocity", [2.0, -2.0])
def test_a_cut_does_not_ramp(velocity):
    state, sent, limited = step(at(velocity), velocity, reported=Cause.OPERATOR_HALT)
    assert (sent, limited) == (0.0, Limited.LATCHED)
    assert (state.cause, state.reaction) == (Cause.OPERATOR_HALT, Reaction.CUT)


def test_of_two_causes_at_once_the_graver_is_named():
    limits = LIMITS._replace(torque_nm=10.0)
    held, _, _ = step(at(), torque=11.0, reported=Cause.DRIVE_FAULT, limits=limits)
    assert (held.cause, held.reaction) == (Cause.DRIVE_FAULT, Reaction.RAMP)
    found, _, _ = step(at(), torque=math.nan, reported=Cause.POWER_HIGH)
    assert (found.cause, found.reaction) == (Cause.TORQUE_NOT_FINITE, Reaction.RAMP)


@pytest.mark.parametrize(
    ("readings", "named"),
    [
        ({}, Cause.MOVED_AT_REST),
        ({"torque": 11.0}, Cause.MOVED_AT_REST),  # a hold is weaker
        ({"torque": math.nan}, Cause.TORQUE_NOT_FINITE),  # as grave: what the tick itself shows
        ({"reported": Cause.OPERATOR_HALT}, Cause.OPERATOR_HALT),
    ],
)
def test_a_disagreement_is_named_where_it_is_the_gravest(readings, named):
    limits = LIMITS._replace(torque_nm=10.0)
    state, _, _ = step(at(), limits=limits, disagreement=Cause.MOVED_AT_REST, **readings)
    assert state.cause == named


def test_what_may_be_in_flight_is_all_that_the_ring_holds():
    """Of 21 ticks at 2 rad/s, where nobody knows how old the angle is: 5.25 rad."""
    state = at(2.0, BINARY)
    for k in range(1, 22):
        state, _, _ = step(state, 2.0, limits=BINARY, angle=53.375 + 0.25 * k)
    assert state.velocity_rad_s == 2.0
    _, sent, _ = step(state, 2.0, limits=BINARY, angle=58.625, age_s=1e300)
    held_s, left_rad = BINARY.interval_s + BINARY.gap_s, 64.0 - 58.625 - 5.25
    assert sent * held_s + sent**2 / (2.0 * 8.0) == pytest.approx(left_rad)


def test_of_two_as_grave_the_one_that_was_reported_is_named():
    state, _, _ = step(at(), torque=math.nan, reported=Cause.TORQUE_STATUS)
    assert (state.cause, state.reaction) == (Cause.TORQUE_STATUS, Reaction.RAMP)


def test_while_latched_the_position_limit_still_holds():
    state = at(1.0, cause=int(Cause.SIGNAL), reaction=int(Reaction.RAMP))
    _, sent, limited = step(state, 1.0, angle=0.7)
    assert (sent, limited) == (0.0, Limited.LATCHED)


# --- why an epoch does not count


def test_a_cause_is_why_an_epoch_ended():
    why = why_ended(guard_limits(Settings()), Cause.TORQUE_NOT_FINITE, 1.0)
    assert why == f"the guard stopped the rig: {Cause.TORQUE_NOT_FINITE.sentence}"


def test_a_limit_that_was_reached_is_why_it_does_not_count():
    why = why_ended(guard_limits(Settings()), Cause.NONE, 1.23456)
    assert why == "the arm came to the position limit of ±40 deg at 1.235 s"


def test_of_a_range_both_ends_are_named():
    limits = within_range(guard_limits(Settings()), math.radians(-12.0), 2.0)
    why = why_ended(limits, Cause.NONE, 1.0)
    assert why == "the arm came to the position limit of -12 or 40 deg at 1.000 s"


def test_a_sound_epoch_counts():
    assert why_ended(guard_limits(Settings()), Cause.NONE, math.nan) == ""
