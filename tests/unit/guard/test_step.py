"""One step at a time, against closed forms."""

import math

import pytest

from rigidimeter.guard import (
    Cause,
    GuardLimits,
    Limited,
    Reaction,
    guard_state,
    guard_step,
    released,
    why_ended,
)
from rigidimeter.settings import Settings

LIMITS = GuardLimits(
    position_rad=0.7,
    speed_rad_s=3.0,
    acceleration_rad_s2=100.0,
    reaction_time_s=0.0,
    interval_s=0.001,
)
BINARY = GuardLimits(
    position_rad=64.0,
    speed_rad_s=16.0,
    acceleration_rad_s2=8.0,
    reaction_time_s=0.5,
    interval_s=0.125,
    stale_s=2.0,
    following_rad=1.0,
)
"""Numbers that are whole in base two, so that sums are exact."""


def at(velocity=0.0, limits=LIMITS, **values):
    return guard_state(limits)._replace(velocity_rad_s=velocity, **values)


def step(
    state,
    request=0.0,
    *,
    torque=0.0,
    angle=0.0,
    velocity=0.0,
    age_s=0.0,
    limits=LIMITS,
    torque_age_s=0.0,
    reported=Cause.NONE,
    elapsed=1,
):
    return guard_step(
        limits, state, request, torque, angle, velocity, age_s, torque_age_s, reported, elapsed
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


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("gap_s", [0.0, 0.004])
def test_toward_a_limit_the_speed_is_the_root_of_two_a_d(sign, gap_s):
    # v ≤ √(2 a d), less what the longest time to the next step covers: v T + v²/(2a) = d
    distance = 0.002
    limits = LIMITS._replace(gap_s=gap_s)
    _, sent, limited = step(at(sign), sign, angle=sign * (0.7 - distance), limits=limits)
    assert abs(sent) * (0.001 + gap_s) + sent**2 / 200.0 == pytest.approx(distance, rel=1e-9)
    assert 0.4 * math.sqrt(2 * 100.0 * distance) < abs(sent) < math.sqrt(2 * 100.0 * distance)
    assert math.copysign(1.0, sent) == sign
    assert limited == Limited.POSITION


def test_a_speed_that_can_just_be_stopped_passes():
    # a = 8, T = 1/4: from v = 2, v T + v²/(2a) = 3/4
    limits = BINARY._replace(reaction_time_s=0.0, gap_s=0.125)
    state = at(2.0, limits)
    assert step(state, 2.0, angle=63.25, limits=limits)[1:] == (2.0, Limited.NOT)
    sent, limited = step(at(2.0, limits), 2.0, angle=63.26, limits=limits)[1:]
    assert sent < 2.0
    assert limited == Limited.POSITION


def test_away_from_a_limit_the_speed_is_free():
    _, sent, limited = step(at(-1.0), -1.0, angle=0.699)
    assert (sent, limited) == (-1.0, Limited.NOT)


@pytest.mark.parametrize("request_rad_s", [16.0, -16.0])
@pytest.mark.parametrize(("age_s", "in_flight_s"), [(0.25, 0.75), (0.25001, 0.875)])
def test_the_search_is_spared_only_where_it_could_find_nothing(request_rad_s, age_s, in_flight_s):
    # Full speed for as long as is remembered; then the angle at which the law begins to bind:
    # in flight 16 (0.25 + 0.5) and what a part of a tick adds, T = 0.25 s, stopping 16 · 16 / 16.
    limits = BINARY._replace(gap_s=0.125, following_rad=math.inf)
    room = 16.0 * in_flight_s + 16.0 * 0.25 + 16.0
    sign = math.copysign(1.0, request_rad_s)

    def sent_at(angle):
        state = at(request_rad_s, limits)
        for _ in range(30):
            state, _, _ = step(state, request_rad_s, limits=limits, age_s=age_s)
            state = state._replace(velocity_rad_s=request_rad_s)
        return step(state, request_rad_s, angle=sign * angle, age_s=age_s, limits=limits)[1:]

    assert sent_at(64.0 - room) == (request_rad_s, Limited.NOT)
    sent, limited = sent_at(64.0 - room + 0.125)
    assert limited == Limited.POSITION
    assert 15.9 < abs(sent) < 16.0


def test_what_is_in_flight_is_counted():
    # 30 ticks at 1 rad/s; the reading is 10 ms old and the drive may be 20 ms behind it.
    limits = LIMITS._replace(reaction_time_s=0.02)
    state = at(1.0, limits)
    for _ in range(60):
        state, _, _ = step(state, 1.0, angle=0.0, limits=limits)
    _, sent, _ = step(state, 1.0, angle=0.668, age_s=0.01, limits=limits)
    left = 0.7 - 0.668 - 0.030
    assert sent * 0.001 + sent**2 / 200.0 == pytest.approx(left, rel=1e-6)


def test_what_was_sent_for_a_part_of_a_tick_is_counted_as_a_whole_one():
    # 3.5 and 4 ticks back are the same, 3 are not: 4 ticks of 1/8 rad in flight.
    limits = BINARY._replace(reaction_time_s=0.0, following_rad=math.inf)

    def sent_with(age_s):
        state = at(1.0, limits)
        for _ in range(12):
            state, _, _ = step(state, 1.0, limits=limits)
        return step(state, 1.0, angle=63.375, age_s=age_s, limits=limits)[1]

    assert sent_with(0.4375) == sent_with(0.5)
    assert 0.125 * sent_with(0.5) + sent_with(0.5) ** 2 / 16.0 == pytest.approx(0.125, rel=1e-12)
    assert sent_with(0.375) > sent_with(0.4375)


def test_a_reading_from_the_future_is_taken_as_of_now():
    limits = BINARY._replace(following_rad=math.inf)

    def sent_with(age_s):
        state = at(1.0, limits)
        for _ in range(12):
            state, _, _ = step(state, 1.0, limits=limits)
        return step(state, 1.0, angle=63.375, age_s=age_s, limits=limits)

    assert sent_with(-0.25)[1:] == sent_with(0.0)[1:]
    assert sent_with(-0.25)[0].cause == Cause.NONE
    assert sent_with(-0.75)[0].cause == Cause.STAMP_AHEAD


def test_motion_that_was_taken_back_does_not_hide_what_is_in_flight():
    # Back and forth within the reaction time: the sum is zero, but a slow drive may still be at it.
    limits = LIMITS._replace(reaction_time_s=0.02)
    state = at(0.0, limits)
    for velocity in (-1.0,) * 10 + (1.0,) * 10:
        state = state._replace(velocity_rad_s=velocity)
        state, _, _ = step(state, velocity, angle=0.0, limits=limits)
    state = state._replace(velocity_rad_s=1.0)
    _, sent, limited = step(state, 1.0, angle=0.689, limits=limits)
    assert limited == Limited.POSITION
    assert sent < 0.5


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("angle", [0.7, 0.70001, 0.7005, 0.705])
def test_at_or_beyond_the_limit_nothing_goes_outward(sign, angle):
    state, sent, limited = step(at(sign * 0.05), sign * 0.05, angle=sign * angle)
    assert (abs(sent), limited, state.cause) == (0.0, Limited.POSITION, Cause.NONE)
    _, sent, limited = step(at(), sign * -0.05, angle=sign * angle)
    assert (sent, limited) == (sign * -0.05, Limited.NOT)


def pressed(times, limits, state=None, request=1.0, elapsed=1):
    """Return the state after so many ticks at the limit, of a controller that asks for more."""
    state = at() if state is None else state
    for _ in range(times):
        state, _, _ = step(state, request, angle=0.7, limits=limits, elapsed=elapsed)
    return state


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_joint_that_is_driven_against_the_limit_for_long_is_held(sign):
    limits = BINARY._replace(at_limit_s=1.0, reaction_time_s=0.0)
    state = guard_state(limits)._replace(velocity_rad_s=0.0)
    for tick in range(1, 12):
        state, sent, limited = step(state, sign, angle=sign * 64.0, limits=limits)
        assert (abs(sent), state.cause) == (0.0, Cause.NONE if tick <= 9 else Cause.HELD_AT_LIMIT)
    assert (state.reaction, limited) == (Reaction.HOLD, Limited.LATCHED)


def test_ticks_that_were_missed_at_the_limit_count():
    limits = LIMITS._replace(at_limit_s=0.05)
    assert pressed(6, limits, elapsed=10).cause == Cause.NONE  # 0.06 s, said at the next tick
    assert pressed(7, limits, elapsed=10).cause == Cause.HELD_AT_LIMIT


def test_a_moment_away_from_the_limit_begins_the_time_again():
    limits = LIMITS._replace(at_limit_s=0.05)
    state = pressed(1, limits, pressed(45, limits), request=-0.01)
    assert (state.limited_s, state.cause) == (0.0, Cause.NONE)
    assert pressed(45, limits, state).cause == Cause.NONE


def test_after_the_operator_went_on_the_time_begins_again():
    limits = LIMITS._replace(at_limit_s=0.05)
    state = released(pressed(60, limits))
    assert (state.limited_s, pressed(45, limits, state).cause) == (0.0, Cause.NONE)


def test_just_before_the_limit_something_still_goes_outward():
    assert 0.0 < step(at(0.5), 0.5, angle=0.6995)[1] < 0.5


def test_one_tick_toward_the_limit_after_many_away_from_it_is_counted():
    # one tick of 1/8 rad in flight, of 4 that may be
    state = at(-1.0, BINARY)
    for _ in range(12):
        state, _, _ = step(state, -1.0, limits=BINARY._replace(following_rad=math.inf))
    state = state._replace(velocity_rad_s=1.0)
    limits = BINARY._replace(following_rad=math.inf)
    sent = step(state, 1.0, angle=63.75, limits=limits)[1]
    assert 0.125 * sent + sent**2 / 16.0 == pytest.approx(0.125, rel=1e-12)


def test_at_rest_at_the_limit_nothing_is_limited():
    assert step(at(), 0.0, angle=0.7)[1:] == (0.0, Limited.NOT)
    assert step(at(), 0.0, angle=-0.7)[1:] == (0.0, Limited.NOT)


def test_far_from_the_limit_the_past_makes_no_difference():
    state = at(1.0)
    for _ in range(100):
        state, sent, limited = step(state, 1.0, angle=0.1, age_s=0.05)
        assert (sent, limited) == (1.0, Limited.NOT)


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
    assert state.sent_rad[: filled + 1].tolist() == [0.25 * k for k in range(filled + 1)]


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


def test_of_two_as_grave_the_one_that_was_reported_is_named():
    state, _, _ = step(at(), torque=math.nan, reported=Cause.TORQUE_STATUS)
    assert (state.cause, state.reaction) == (Cause.TORQUE_STATUS, Reaction.RAMP)


def test_while_latched_the_position_limit_still_holds():
    state = at(1.0, cause=int(Cause.SIGNAL), reaction=int(Reaction.RAMP))
    _, sent, limited = step(state, 1.0, angle=0.7)
    assert (sent, limited) == (0.0, Limited.LATCHED)


# --- following


def moving(angles, *, limits=BINARY, velocity=2.0, ages=None, elapsed=1):
    """Return the state after so many steps at one velocity, and the origin at the first."""
    state = at(velocity, limits)
    for k, angle in enumerate(angles):
        age_s = 0.0 if ages is None else ages[k]
        state, _, _ = step(
            state, velocity, angle=angle, limits=limits, age_s=age_s, elapsed=elapsed
        )
        state = state._replace(velocity_rad_s=velocity)
    return state


def test_the_origin_is_where_the_first_reading_was():
    state, _, _ = step(at(limits=BINARY), limits=BINARY, angle=5.0)
    assert state.origin_rad == 5.0


@pytest.mark.parametrize("lag", range(5))
def test_a_drive_of_any_delay_up_to_the_reaction_time_follows(lag):
    # a quarter radian a tick, from 5 rad on
    limits = BINARY._replace(following_rad=1e-9)
    angles = [5.0, *(5.0 + 0.25 * max(k - lag, 0) for k in range(2, 60))]
    state = moving(angles, limits=limits)
    assert state.cause == Cause.NONE
    assert state.origin_rad == 5.0


@pytest.mark.parametrize(("lag", "cause"), [(5, Cause.NOT_FOLLOWING), (-1, Cause.NOT_FOLLOWING)])
def test_a_drive_outside_of_it_does_not(lag, cause):
    limits = BINARY._replace(following_rad=0.2)
    angles = [5.0, *(5.0 + 0.25 * max(k - lag, 0) for k in range(2, 20))]
    assert moving(angles, limits=limits).cause == cause


@pytest.mark.parametrize("lag", range(-3, 5))
def test_a_stamp_may_be_wrong_by_the_reaction_time_either_way(lag):
    # readings 0.5 s old by their stamps, really taken up to 4 ticks before or 4 after
    limits = BINARY._replace(following_rad=1e-9)
    angles = [5.0 + 0.25 * max(k - 4 - lag, 0) for k in range(1, 60)]
    assert moving(angles, limits=limits, ages=[0.5] * 59).cause == Cause.NONE


def test_a_part_of_a_tick_counts_for_the_drive():
    # age + R = 4.5 ticks, age − R = 0: up to 5 ticks behind is within
    limits = BINARY._replace(following_rad=1e-9)
    angles = [5.0 + 0.25 * max(k - 5, 0) for k in range(1, 40)]
    assert moving(angles, limits=limits, ages=[0.0625] * 39).cause == Cause.NONE


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_jump_of_the_angle_is_found_at_once(sign):
    state, _, _ = step(at(limits=BINARY), limits=BINARY, angle=3.0)
    state, _, _ = step(state, limits=BINARY, angle=3.0 + sign)
    assert state.cause == Cause.NONE
    state, _, _ = step(at(limits=BINARY), limits=BINARY, angle=3.0)
    state, _, _ = step(state, limits=BINARY, angle=3.0 + sign * 1.001)
    assert (state.cause, state.reaction) == (Cause.NOT_FOLLOWING, Reaction.RAMP)


@pytest.mark.parametrize(
    ("jump", "elapsed", "drift"),
    [
        (0.5, 1, 0.0),  # half the limit is looked at no closer
        (0.5625, 1, 0.03125),  # 0.25 rad/s, a tick of 0.125 s
        (0.75, 1, 0.03125),
        (0.75, 3, 0.09375),
        (-0.75, 2, -0.0625),
        (0.75, 100, 0.75),  # no farther than the joint itself
    ],
)
def test_the_origin_drifts_after_a_joint_that_goes_astray(jump, elapsed, drift):
    limits = BINARY._replace(drift_rad_s=0.25)
    state, _, _ = step(at(limits=limits), limits=limits, angle=3.0)
    state, _, _ = step(state, limits=limits, angle=3.0 + jump, elapsed=elapsed)
    assert state.origin_rad == 3.0 + drift
    assert state.cause == Cause.NONE


@pytest.mark.parametrize(("speed", "found"), [(0.25, False), (0.5, True), (-0.5, True)])
def test_a_joint_that_moves_uncommanded_is_found_unless_a_zero_offset_explains_it(speed, found):
    # The first half of the limit passes at the joint's speed, the second at what is left of it.
    limits = BINARY._replace(drift_rad_s=0.25)
    state = at(limits=limits)
    for k in range(200):
        state, _, _ = step(state, limits=limits, angle=speed * 0.125 * k)
        if state.cause != Cause.NONE:
            break
    assert (state.cause == Cause.NOT_FOLLOWING) is found
    if found:
        assert 0.125 * k == pytest.approx(0.5 / 0.5 + 0.5 / 0.25, abs=0.25)


def test_the_middle_of_the_stretch_is_half_the_reaction_time_ago():
    # At 0.25 rad a tick: age 2 ticks, half the reaction time 2, so the origin is 4 ticks behind.
    state = moving([1.0], ages=[0.25], elapsed=9)
    assert state.origin_rad == 1.0 - 0.25 * 5
    state = moving([1.0], ages=[-0.25], elapsed=9)
    assert state.origin_rad == 1.0 - 0.25 * 7


def test_of_the_middle_parts_of_a_tick_are_left_out():
    # 1.99 ticks are one
    state = moving([1.0], limits=BINARY._replace(reaction_time_s=0.4975), elapsed=9)
    assert state.origin_rad == 1.0 - 0.25 * 8


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_encoder_that_counts_the_other_way_is_found(sign):
    # as far on the other side as the commands brought it on this one
    state, velocity = at(sign * 2.0, BINARY), sign * 2.0
    state, _, _ = step(state, velocity, limits=BINARY, angle=0.0)
    for k in range(2, 14):
        told = sign * 0.25 * max(k - 2, 0)
        state = state._replace(velocity_rad_s=velocity)
        after, _, _ = step(state, velocity, limits=BINARY, angle=told)
        if k < 13:
            state = after
    assert after.cause == Cause.NONE
    state = state._replace(newest=state.newest - 1)
    after, _, _ = step(state, velocity, limits=BINARY, angle=-told)
    assert after.cause == Cause.NOT_FOLLOWING


FINE = BINARY._replace(
    interval_s=2.0**-10, reaction_time_s=2.0**-8, stale_s=2.0**-5, following_rad=2.0**-10
)
"""The same at 1024 ticks a second; the reaction time is 4 of them; 2 rad/s are 2⁻⁹ rad a tick."""


@pytest.mark.parametrize(
    ("age_ticks", "really", "follows"),
    [
        # no older than the stamp says less 4 ticks, no newer than now, no older than 4 ticks more
        *((0, 0, True), (0, 4, True), (0, 5, False), (0, -1, False)),
        *((4, 0, True), (4, 8, True), (4, 9, False), (4, -1, False)),
        *((9, 5, True), (9, 13, True), (9, 14, False), (9, 4, False)),
        *((5.75, 1, True), (5.75, 10, True), (5.75, 11, False), (5.75, 0, False)),
    ],
)
def test_the_stretch_is_the_reaction_time_before_and_after_the_stamp(age_ticks, really, follows):
    angles = [0.0] * 20 + [2.0**-9 * (k - really) for k in range(21, 60)]
    state = at(2.0, FINE)
    for k, angle in enumerate(angles, start=1):
        values = {"angle": angle, "age_s": age_ticks * FINE.interval_s}
        free = FINE._replace(following_rad=math.inf) if k <= 20 else FINE
        state, _, _ = step(state, 2.0, limits=free, **values)
        state = state._replace(velocity_rad_s=2.0, origin_rad=0.0)
    assert (state.cause == Cause.NONE) is follows


# --- why an epoch does not count


def test_a_cause_is_why_an_epoch_ended():
    why = why_ended(Settings(), Cause.TORQUE_NOT_FINITE, 1.0)
    assert why == f"the guard stopped the rig: {Cause.TORQUE_NOT_FINITE.sentence}"


def test_a_limit_that_was_reached_is_why_it_does_not_count():
    why = why_ended(Settings(), Cause.NONE, 1.23456)
    assert why == "the arm came to the position limit of ±40 deg at 1.235 s"


def test_a_sound_epoch_counts():
    assert why_ended(Settings(), Cause.NONE, math.nan) == ""
