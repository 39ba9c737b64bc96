import math

import pytest

from rigidimeter.guard import Cause, GuardLimits, Limited, guard_state, guard_step

LIMITS = GuardLimits(
    position_rad=0.7,
    speed_rad_s=3.0,
    acceleration_rad_s2=100.0,
    reaction_time_s=0.0,
    interval_s=0.001,
)


def at(velocity=0.0, limits=LIMITS):
    return guard_state(limits)._replace(velocity_rad_s=velocity)


def step(state, request, *, torque=0.0, angle=0.0, velocity=0.0, age_s=0.0, limits=LIMITS):
    return guard_step(limits, state, request, torque, angle, velocity, age_s)


def test_a_harmless_request_passes_untouched():
    _, sent, limited = step(at(0.5), 0.55)
    assert (sent, limited) == (0.55, Limited.NOT)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_acceleration_is_limited_both_ways(sign):
    _, sent, limited = step(at(), sign * 2.0)
    assert sent == pytest.approx(sign * 0.1)
    assert limited == Limited.ACCELERATION


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_speed_is_limited_both_ways(sign):
    _, sent, limited = step(at(sign * 2.95), sign * 3.04)
    assert (sent, limited) == (sign * 3.0, Limited.SPEED)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_toward_a_limit_the_speed_is_the_root_of_two_a_d(sign):
    # v ≤ √(2 a d), less what the tick itself covers: v Δt + v²/(2a) = d
    distance = 0.002
    _, sent, limited = step(at(sign * 1.0), sign * 1.0, angle=sign * (0.7 - distance))
    assert abs(sent) * 0.001 + sent**2 / 200.0 == pytest.approx(distance, rel=1e-9)
    assert 0.8 * math.sqrt(2 * 100.0 * distance) < abs(sent) < math.sqrt(2 * 100.0 * distance)
    assert math.copysign(1.0, sent) == sign
    assert limited == Limited.POSITION


def test_away_from_a_limit_the_speed_is_free():
    _, sent, limited = step(at(-1.0), -1.0, angle=0.699)
    assert (sent, limited) == (-1.0, Limited.NOT)


def test_what_is_in_flight_is_counted():
    # 30 ticks at 1 rad/s; the reading is 10 ms old and the drive may be 20 ms behind it.
    limits = LIMITS._replace(reaction_time_s=0.02)
    state = at(1.0, limits)
    for _ in range(60):
        state, _, _ = step(state, 1.0, angle=0.0, limits=limits)
    _, sent, _ = step(state, 1.0, angle=0.668, age_s=0.01, limits=limits)
    left = 0.7 - 0.668 - 0.030
    assert sent * 0.001 + sent**2 / 200.0 == pytest.approx(left, rel=1e-6)


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


def test_at_or_beyond_the_limit_nothing_goes_outward():
    _, sent, limited = step(at(0.05), 0.05, angle=0.7)
    assert (sent, limited) == (0.0, Limited.POSITION)


def test_far_from_the_limit_the_past_makes_no_difference():
    state = at(1.0)
    for _ in range(100):
        state, sent, limited = step(state, 1.0, angle=0.1, age_s=0.05)
        assert (sent, limited) == (1.0, Limited.NOT)


def test_a_reading_that_never_renews_latches():
    state = at(0.01)
    for k in range(600):
        state, _, _ = step(state, 0.01, angle=0.0, age_s=k * 0.001)
    assert state.cause == Cause.MOTION_STALE


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


@pytest.mark.parametrize("angle", [0.72, -0.72])
def test_an_angle_beyond_the_limit_is_a_fault(angle):
    state, _, _ = step(at(), 0.0, angle=angle)
    assert state.cause == Cause.POSITION_LIMIT_EXCEEDED


@pytest.mark.parametrize("angle", [0.709, -0.709])
def test_a_reading_within_the_tolerance_is_not(angle):
    state, _, _ = step(at(), 0.0, angle=angle)
    assert state.cause == Cause.NONE


def test_every_cause_has_words():
    assert all(cause.sentence for cause in Cause)
