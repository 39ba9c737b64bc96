import math

import pytest

from rigidimeter.guard import Cause, GuardLimits, GuardState, Limited, guard_step

LIMITS = GuardLimits(
    position_rad=0.7,
    speed_rad_s=3.0,
    acceleration_rad_s2=100.0,
    reaction_time_s=0.0,
    interval_s=0.001,
)


def step(state, request, *, torque=0.0, angle=0.0, velocity=0.0, time_s=0.0, limits=LIMITS):
    return guard_step(limits, state, request, torque, angle, velocity, time_s)


def test_a_harmless_request_passes_untouched():
    _, sent, limited = step(GuardState(velocity_rad_s=0.5), 0.55)
    assert (sent, limited) == (0.55, Limited.NOT)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_acceleration_is_limited_both_ways(sign):
    _, sent, limited = step(GuardState(), sign * 2.0)
    assert sent == pytest.approx(sign * 0.1)
    assert limited == Limited.ACCELERATION


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_speed_is_limited_both_ways(sign):
    _, sent, limited = step(GuardState(velocity_rad_s=sign * 2.95), sign * 3.04)
    assert (sent, limited) == (sign * 3.0, Limited.SPEED)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_toward_a_limit_the_speed_is_the_root_of_two_a_d(sign):
    distance = 0.002
    angle = sign * (0.7 - distance)
    # A short tick, and nothing in flight: the bound is then the root itself.
    limits = LIMITS._replace(interval_s=1e-9)
    state = GuardState(velocity_rad_s=sign * 1.0, rest_angle_rad=angle)
    _, sent, limited = step(state, sign * 1.0, angle=angle, time_s=1.0, limits=limits)
    assert sent == pytest.approx(sign * math.sqrt(2 * 100.0 * distance), rel=1e-5)
    assert abs(sent) <= math.sqrt(2 * 100.0 * distance)
    assert limited == Limited.POSITION


def test_the_way_of_one_tick_is_kept_in_hand():
    state = GuardState(rest_angle_rad=0.695, velocity_rad_s=0.9)
    _, sent, _ = step(state, 1.0, angle=0.695, time_s=1.0)
    left = 0.7 - 0.695 - 0.9 * 0.001  # the reading, and what the last tick sent
    assert sent * 0.001 + sent**2 / 200.0 == pytest.approx(left, rel=1e-9)


def test_away_from_a_limit_the_speed_is_free():
    state = GuardState(velocity_rad_s=-1.0, rest_angle_rad=0.699)
    _, sent, limited = step(state, -1.0, angle=0.699, time_s=1.0)
    assert (sent, limited) == (-1.0, Limited.NOT)


def test_the_reaction_time_of_the_drive_is_paid_for():
    # At a steady 1 rad/s the drive is one reaction time (and the tick) behind what was sent.
    limits = LIMITS._replace(reaction_time_s=0.02)
    state = GuardState(velocity_rad_s=1.0)
    for k in range(300):
        state, _, _ = step(state, 1.0, angle=0.0, time_s=float(k + 1), limits=limits)
    assert state.in_flight_rad == pytest.approx(0.021, rel=1e-4)
    assert state.rest_angle_rad == pytest.approx(0.021, rel=1e-4)


def test_at_or_beyond_the_limit_nothing_goes_outward():
    state = GuardState(velocity_rad_s=0.05, rest_angle_rad=0.7)
    _, sent, limited = step(state, 0.05, angle=0.7, time_s=1.0)
    assert (sent, limited) == (0.0, Limited.POSITION)


def test_between_readings_the_way_covered_is_counted():
    state = GuardState(velocity_rad_s=1.0, rest_angle_rad=0.5, reading_time_s=5.0)
    for _ in range(10):
        state, _, _ = step(state, 1.0, angle=0.5, time_s=5.0)
    assert state.rest_angle_rad == pytest.approx(0.51)
    state, _, _ = step(state, 1.0, angle=0.505, time_s=5.02)
    assert state.rest_angle_rad == pytest.approx(0.505 + 0.001)


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
    values = {"request": 1.0, "torque": 0.0, "angle": 0.0, "velocity": 0.0, "time_s": 1.0}
    values[field] = bad
    request = values.pop("request")
    state, sent, limited = step(GuardState(velocity_rad_s=1.0), request, **values)
    assert state.cause == cause
    assert limited == Limited.LATCHED
    assert sent == pytest.approx(0.9)
    assert math.isfinite(state.rest_angle_rad)
    # A sound request afterwards changes nothing: the latch holds, down to rest.
    for _ in range(20):
        state, sent, _ = step(state, 1.0, time_s=2.0)
    assert sent == 0.0
    assert state.cause == cause


def test_the_first_cause_is_kept():
    state, _, _ = step(GuardState(), math.nan)
    state, _, _ = step(state, 0.0, torque=math.nan)
    assert state.cause == Cause.COMMAND_NOT_FINITE


@pytest.mark.parametrize("angle", [0.72, -0.72])
def test_an_angle_beyond_the_limit_is_a_fault(angle):
    state, _, _ = step(GuardState(), 0.0, angle=angle, time_s=1.0)
    assert state.cause == Cause.POSITION_LIMIT_EXCEEDED


@pytest.mark.parametrize("angle", [0.709, -0.709])
def test_a_reading_within_the_tolerance_is_not(angle):
    state, _, _ = step(GuardState(), 0.0, angle=angle, time_s=1.0)
    assert state.cause == Cause.NONE


def test_every_cause_has_words():
    assert all(cause.sentence for cause in Cause)
