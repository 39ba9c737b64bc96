"""What the laws of agreement remember, how long, and that their limits themselves are allowed."""

import math

import pytest

from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.guard import (
    Cause,
    ConsistencyLimits,
    MeansState,
    answer_state,
    consistency_limits,
    larger_gain,
    means_step,
)

STEP_S = 0.008
LIMITS = ConsistencyLimits(0.001, old_memory_s=0.5)


def state(**values):
    return MeansState(answer_state())._replace(**values)


def step(
    before, *, limits=LIMITS, torque=0.0, angle=0.0, stamp_s=0.0, old=(0.0, 0.0), elapsed_s=STEP_S
):
    return means_step(limits, before, 0.0, torque, angle, 0.0, stamp_s, *old, elapsed_s, 0.0)


# --- the share of old readings


@pytest.mark.parametrize("sensor", ["torque_old", "motion_old"])
def test_the_share_rises_to_that_of_the_steps_and_falls_again_as_a_memory_does(sensor):
    """By (1 − h/T) a step: 1 − (1 − h/T)^n of a pause, of which (1 − h/T)^m are left later."""
    after, kept = state(), 1.0 - STEP_S / 0.5
    one = (1.0, 0.0) if sensor == "torque_old" else (0.0, 1.0)
    for _ in range(10):
        after, cause = step(after, old=one)
        assert cause == Cause.NONE
    assert getattr(after, sensor) == pytest.approx(1.0 - kept**10)
    for _ in range(50):
        after, _ = step(after)
    assert getattr(after, sensor) == pytest.approx((1.0 - kept**10) * kept**50)


@pytest.mark.parametrize("one", [(0.1, 0.0), (0.0, 0.1), (0.19, 0.19)])
def test_readings_that_are_old_now_and_then_for_hours_pass(one):
    after = state()
    for _ in range(3000):
        after, cause = step(after, old=one)
        assert cause == Cause.NONE
    assert (after.torque_old, after.motion_old) == pytest.approx(one)


@pytest.mark.parametrize("elapsed_s", [0.5, 0.7, 60.0])
def test_after_a_step_as_long_as_the_memory_nothing_is_left_of_before(elapsed_s):
    after, cause = step(
        state(torque_old=0.19, motion_old=0.07), old=(0.1, 0.15), elapsed_s=elapsed_s
    )
    assert (after.torque_old, after.motion_old) == pytest.approx((0.1, 0.15))
    assert cause == Cause.NONE


@pytest.mark.parametrize(("stale_s", "memory_s"), [(0.05, 0.5), (0.1, 0.5), (0.3, 1.5)])
def test_one_pause_as_long_as_a_reading_may_be_old_does_not_fill_the_share(stale_s, memory_s):
    limits = consistency_limits(parse_settings({"guard": {"stale_s": stale_s}}))
    assert limits.old_memory_s == pytest.approx(memory_s)
    after = state()
    for _ in range(round(stale_s / STEP_S)):
        after, cause = step(after, limits=limits, old=(1.0, 1.0))
        assert cause == Cause.NONE
    assert after.torque_old < 1.0 - math.exp(-0.2) + 0.01


# --- one sample after another


@pytest.mark.parametrize(("passed_s", "is_new"), [(0.995e-6, False), (1.005e-6, True)])
def test_stamps_less_than_a_microsecond_apart_are_of_one_sample(passed_s, is_new):
    """One that is read again is at 0 but for rounding: any change over that would be a blow."""
    after, _ = step(state(angle_rad=0.0), angle=0.001, stamp_s=passed_s)
    assert after.angle_rad == (0.001 if is_new else 0.0)
    assert after.moved_rad == pytest.approx(0.001 if is_new else 0.0)
    assert (after.pace_rad_s > 0.0) == is_new


# --- what is just allowed


def allowed(law, at):
    """Return limits and a state in which one law's measure is `at` times its limit."""
    values = {
        "torque old": {"torque_old": 0.2 * at},
        "motion old": {"motion_old": 0.2 * at},
        "energy": {"energy_j": 4.0 * at},
        "resolution": {"disagreement_rad2": 0.25 * at, "moved_rad2": 0.125, "reported_rad2": 0.125},
        "share": {"disagreement_rad2": 0.375 * at, "moved_rad2": 0.5, "reported_rad2": 0.5},
        # With <p q> = 1.5 at: the gain on the smaller of the two.
        "gain": {"disagreement_rad2": 3.25 - 3.0 * at, "moved_rad2": 1.0, "reported_rad2": 2.25},
    }[law]
    unseen_rad = {"resolution": 0.5, "share": 0.1, "gain": 0.1}.get(law, math.inf)
    return LIMITS._replace(energy_j=4.0, unseen_rad=unseen_rad), state(angle_rad=0.0, **values)


@pytest.mark.parametrize(
    ("law", "cause"),
    [
        ("torque old", Cause.SELDOM_FRESH),
        ("motion old", Cause.SELDOM_FRESH),
        ("energy", Cause.ENERGY_HIGH),
        ("resolution", Cause.VELOCITY_WRONG),
        ("share", Cause.VELOCITY_WRONG),
        ("gain", Cause.VELOCITY_WRONG),
    ],
)
def test_what_is_at_a_limit_is_allowed_and_what_is_above_is_not(law, cause):
    # No time passes, so that what is remembered stays as it is.
    for at, expected in ((1.0, Cause.NONE), (1.001, cause)):
        limits, before = allowed(law, at)
        assert step(before, limits=limits, elapsed_s=0.0)[1] == expected


def test_the_torque_answers_the_angle_of_its_own_time():
    """Motion taken 10 ms before the torque, at 2 rad/s: the joint is 0.02 rad further."""
    after, _ = means_step(LIMITS, state(), 0.0, 0.0, 0.5, 2.0, 0.0, 0.0, 0.0, STEP_S, 0.01)
    assert after.angle_rad == 0.5
    assert after.answer.angle[0] == pytest.approx(0.52)


def test_a_mean_as_often_old_as_a_reading_may_be_is_answered():
    for share, unanswered_s in ((0.2, 0.0), (0.201, STEP_S)):
        after = step(state(), old=(0.0, share))[0]
        assert after.unanswered_s == pytest.approx(unanswered_s)


@pytest.mark.parametrize("unanswered_s", [0.0, 0.0005, 0.008])
def test_after_a_mean_that_was_not_answered_the_velocity_may_be_that_of_before(unanswered_s):
    """From rest to 1 rad/s in 10 ms, and no motion: what agrees best is the velocity of before."""
    before = state(angle_rad=0.0, unanswered_s=unanswered_s)
    after, _ = means_step(LIMITS, before, 0, 0, 0.0, 1.0, 0.01, 0, 0, 0.01, 0)
    assert after.reported_rad == pytest.approx(0.0 if unanswered_s else 0.005)


def test_a_step_longer_than_the_memory_of_the_squares_leaves_nothing_of_before():
    before = state(angle_rad=0.0, disagreement_rad2=9.0, moved_rad2=9.0, reported_rad2=9.0)
    after, _ = means_step(LIMITS, before, 0, 0, 0.5, 0.0, 0.6, 0, 0, 0.6, 0)
    assert after[6:9] == pytest.approx((0.25, 0.25, 0.0))


@pytest.mark.parametrize(
    ("moved2", "reported2", "apart2", "gain"),
    [
        (1.0, 2.25, 0.25, 1.5),  # the velocity 1.5 times the change
        (2.25, 1.0, 0.25, 1.5),  # or the change 1.5 times the velocity
        (1.0, 4.0, 9.0, -2.0),  # with the sign turned
        (0.0005, 0.0005, 0.0, 1.0),
        (0.0, 1.0, 1.0, math.inf),
        (0.0, 0.0, 0.0, math.inf),
    ],
)
def test_the_gain_is_that_of_the_larger_on_the_smaller(moved2, reported2, apart2, gain):
    means = state(moved_rad2=moved2, reported_rad2=reported2, disagreement_rad2=apart2)
    assert larger_gain(means) == pytest.approx(gain)
