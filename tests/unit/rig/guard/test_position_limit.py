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
@pytest.mark.parametrize(
    ("arrival_rad_s", "stopping_rad"),
    [(math.inf, 16.0), (16.0, 16.0), (20.0, 16.0), (8.0, (256.0 - 64.0) / 1.6 + 4.0)],
)
def test_the_search_is_spared_only_where_it_could_find_nothing(
    request_rad_s, age_s, in_flight_s, arrival_rad_s, stopping_rad
):
    # Full speed for as long as is remembered; then the angle at which the law begins to bind:
    # in flight 16 (0.25 + 0.5) and what a part of a tick adds, T = 0.25 s, stopping 16 · 16 / 16.
    limits = BINARY._replace(
        position_rad=256.0, gap_s=0.125, following_rad=math.inf, arrival_rad_s=arrival_rad_s
    )
    room = 16.0 * in_flight_s + 16.0 * 0.25 + stopping_rad
    sign = math.copysign(1.0, request_rad_s)

    def sent_at(angle):
        state = at(request_rad_s, limits)
        for _ in range(30):
            state, _, _ = step(state, request_rad_s, limits=limits, age_s=age_s)
            state = state._replace(velocity_rad_s=request_rad_s)
        return step(state, request_rad_s, angle=sign * angle, age_s=age_s, limits=limits)[1:]

    assert sent_at(256.0 - room) == (request_rad_s, Limited.NOT)
    sent, limited = sent_at(256.0 - room + 0.03125)
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
    state = at(limits=limits) if state is None else state
    for _ in range(times):
        state, _, _ = step(state, request, angle=0.7, limits=limits, elapsed=elapsed)
    return state


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_joint_that_is_driven_against_the_limit_for_long_is_held(sign):
    limits = BINARY._replace(at_limit_s=1.0, at_limit_of_s=5.0, reaction_time_s=0.0)
    state = guard_state(limits)._replace(velocity_rad_s=0.0)
    for tick in range(1, 12):
        state, sent, limited = step(state, sign, angle=sign * 64.0, limits=limits)
        assert (abs(sent), state.cause) == (0.0, Cause.NONE if tick <= 9 else Cause.HELD_AT_LIMIT)
    assert (state.reaction, limited) == (Reaction.HOLD, Limited.LATCHED)


def test_ticks_that_were_missed_at_the_limit_count():
    limits = LIMITS._replace(at_limit_s=0.05, at_limit_of_s=0.2)
    assert pressed(6, limits, elapsed=10).cause == Cause.NONE  # 0.06 s, said at the next tick
    assert pressed(7, limits, elapsed=10).cause == Cause.HELD_AT_LIMIT


def test_a_moment_away_from_the_limit_does_not_begin_the_time_again():
    limits = LIMITS._replace(at_limit_s=0.05, at_limit_of_s=0.2)
    state = pressed(10, limits, pressed(41, limits), request=-0.01)
    assert (state.contact.ticks, state.contact.touching) == (41, False)
    assert state.cause == Cause.NONE
    assert pressed(11, limits, state).cause == Cause.HELD_AT_LIMIT
    # What is longer ago than the memory does not count.
    state = pressed(190, limits, state, request=-0.01)
    assert state.contact.ticks == 0
    assert pressed(51, limits, state).cause == Cause.NONE


def come_and_go(limits, apart_s, times):
    """Return the state after so many arrivals of one tick each, this time apart."""
    state = at(limits=limits)
    for _ in range(times):
        state = pressed(1, limits, state)
        state = pressed(round(apart_s / limits.interval_s) - 1, limits, state, request=-0.01)
    return state


ARRIVE = LIMITS._replace(arrivals_s=1.0, apart_s=0.2)


@pytest.mark.parametrize(
    ("apart_s", "times", "arrivals", "cause"),
    [
        (0.4, 2, 2, Cause.NONE),
        (0.4, 3, 3, Cause.HELD_AT_LIMIT),
        (0.49, 3, 3, Cause.HELD_AT_LIMIT),
        (0.51, 4, 4, Cause.NONE),  # three take more than a second
        (0.125, 3, 2, Cause.NONE),  # 0, 0.25 s: the second is too near to the first
        (0.125, 5, 3, Cause.HELD_AT_LIMIT),
    ],
)
def test_the_third_arrival_within_a_time_is_held(apart_s, times, arrivals, cause):
    state = come_and_go(ARRIVE, apart_s, times)
    assert (state.contact.arrivals, state.cause) == (arrivals, cause)
    assert state.reaction == cause.reaction


def test_what_stays_at_the_limit_has_arrived_once():
    assert pressed(900, ARRIVE).contact.arrivals == 1


def test_time_that_was_missed_lies_between_arrivals():
    state = pressed(1, ARRIVE, pressed(1, ARRIVE, elapsed=3), request=-0.01)
    state = pressed(1, ARRIVE, state, elapsed=199)
    assert (state.contact.arrivals, state.contact.before_s) == (2, pytest.approx(0.2))


def test_after_the_operator_went_on_the_time_and_the_arrivals_begin_again():
    limits = ARRIVE._replace(at_limit_s=0.05, at_limit_of_s=0.2)
    state = released(pressed(60, limits))
    assert state.contact.ticks == 0
    state = pressed(45, limits, state)
    assert (state.contact.ticks, state.cause) == (45, Cause.NONE)
    state = released(come_and_go(limits, 0.3, 3))
    state = pressed(1, limits, state)
    assert (state.contact.arrivals, state.cause, state.contact.three_s) == (4, 0, math.inf)


SOFT = LIMITS._replace(arrival_rad_s=0.5)
NEAR = 0.5 * 0.001 + 0.25 / 200.0
"""From here a joint at 0.5 rad/s stops at 100 rad/s², told to after another tick."""


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_speed_of_arrival_is_bounded(sign):
    # nearer than that the law is the one without a bound
    for left in (0.5 * NEAR, 0.999 * NEAR):
        bounded = step(at(sign), sign, angle=sign * (0.7 - left), limits=SOFT)[1:]
        assert bounded == step(at(sign), sign, angle=sign * (0.7 - left))[1:]
        assert abs(bounded[0]) < 0.5
    # farther away it can brake to that speed with 10 rad/s²
    for more in (1e-9, 0.01, 0.03):
        left = NEAR + more
        _, sent, limited = step(at(sign), sign, angle=sign * (0.7 - left), limits=SOFT)
        speed = abs(sent)
        assert (speed - 0.5) * 0.001 + (speed**2 - 0.25) / 20.0 == pytest.approx(more, rel=1e-6)
        assert 0.5 < speed < 1.0
        assert limited == Limited.POSITION


def test_a_bound_above_the_speed_limit_bounds_nothing():
    loose = LIMITS._replace(arrival_rad_s=3.0)
    for k in range(1, 400):
        angle = 0.7 - 0.0002 * k
        assert (
            step(at(3.0), 3.0, angle=angle, limits=loose)[1:] == step(at(3.0), 3.0, angle=angle)[1:]
        )


RANGE = LIMITS._replace(lowest_rad=-0.25, highest_rad=0.5)


@pytest.mark.parametrize(("sign", "end"), [(1.0, 0.5), (-1.0, 0.25)])
def test_a_range_cuts_the_limit_on_each_side_by_itself(sign, end):
    distance = 0.002
    _, sent, limited = step(at(sign), sign, angle=sign * (end - distance), limits=RANGE)
    assert abs(sent) * 0.001 + sent**2 / 200.0 == pytest.approx(distance, rel=1e-9)
    assert limited == Limited.POSITION
    state, sent, _ = step(at(), sign * 0.05, angle=sign * end, limits=RANGE)
    assert (abs(sent), state.cause) == (0.0, Cause.NONE)
    _, sent, limited = step(at(), -sign * 0.05, angle=sign * end, limits=RANGE)
    assert (sent, limited) == (-sign * 0.05, Limited.NOT)
    beyond = sign * (end + RANGE.tolerance_rad)
    assert step(at(), angle=beyond * 0.9999, limits=RANGE)[0].cause == Cause.NONE
    assert step(at(), angle=beyond * 1.0001, limits=RANGE)[0].cause == Cause.POSITION_LIMIT_EXCEEDED


def test_a_range_wider_than_the_limit_changes_nothing():
    wide = LIMITS._replace(lowest_rad=-0.7, highest_rad=2.0)
    for angle in (0.699, -0.699, 0.705, -0.705, 0.72, -0.72):
        for speed in (1.0, -1.0):
            with_range = step(at(speed), speed, angle=angle, limits=wide)
            assert with_range[1:] == step(at(speed), speed, angle=angle)[1:]
            assert with_range[0].cause == step(at(speed), speed, angle=angle)[0].cause
    assert wide.extent_rad == (-0.7, 0.7)
    assert RANGE.extent_rad == (-0.25, 0.5)


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
