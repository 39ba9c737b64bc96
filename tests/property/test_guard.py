"""Whatever is asked for, the guard keeps its limits, on the drive of the virtual rig too."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from rigidimeter.guard import Cause, GuardLimits, GuardState, guard_step
from rigidimeter.simulation import DriveState, drive, drive_step

LIMITS = GuardLimits(
    position_rad=0.5,
    speed_rad_s=3.0,
    acceleration_rad_s2=100.0,
    reaction_time_s=0.02,
    interval_s=0.001,
)

requests = st.lists(
    st.one_of(st.floats(-50, 50), st.just(1e6), st.just(-1e6)), min_size=1, max_size=40
)


@given(requests, st.integers(1, 25), st.floats(20.0, 200.0))
@settings(max_examples=60, deadline=None)
def test_the_limit_is_never_crossed(wanted, reading_every, bandwidth_hz):
    one_tick = drive(bandwidth_hz, 0.7071, LIMITS.interval_s)
    state, plant = GuardState(), DriveState()
    angle, velocity, stamp = 0.0, 0.0, 0.0
    before = 0.0
    for k in range(len(wanted) * 50):
        if k % reading_every == 0:
            angle, velocity, stamp = plant.angle_rad, plant.velocity_rad_s, k * 0.001
        state, sent, _ = guard_step(LIMITS, state, wanted[k // 50], 0.0, angle, velocity, stamp)
        plant = drive_step(one_tick, plant, sent)
        assert abs(plant.angle_rad) <= LIMITS.position_rad
        assert abs(sent) <= LIMITS.speed_rad_s
        # Only braking for the position limit may be harder than the acceleration limit.
        if abs(sent) > abs(before):
            assert abs(sent - before) <= 0.1 + 1e-12
        before = sent
    assert state.cause == Cause.NONE


@given(st.floats(allow_nan=True, allow_infinity=True), st.floats(-3, 3))
def test_what_is_sent_is_always_finite(request, velocity):
    _, sent, _ = guard_step(LIMITS, GuardState(velocity), request, 0.0, 0.0, 0.0, 0.0)
    assert math.isfinite(sent)
