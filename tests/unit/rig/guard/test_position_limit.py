"""Toward the position limit: one step at a time, against closed forms."""

import math

import pytest
from tests.unit.rig.guard.one_step import BINARY, LIMITS, at, step

from rigidimeter.rig.guard import Cause, Limited, Reaction, guard_state, released


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
