"""Whether the drive follows what it was sent, and where the origin is."""

import math

import pytest
from tests.unit.rig.guard.one_step import BINARY, at, step

from rigidimeter.rig.guard import Cause, Reaction


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
        (0.501953125, 1, 0.03125),  # anything above half is
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


@pytest.mark.parametrize(("moved", "cause"), [(25.0, Cause.NONE), (5.25, Cause.NOT_FOLLOWING)])
def test_a_gap_longer_than_what_is_remembered_is_counted_whole(moved, cause):
    # 100 ticks late, of which the ring holds 21
    state = moving([5.0, 5.25, 5.5])
    after, _, _ = step(state, 2.0, angle=5.5 + moved, limits=BINARY, elapsed=100)
    assert after.cause == cause
