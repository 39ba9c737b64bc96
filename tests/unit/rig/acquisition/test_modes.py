"""What is asked of the joint at each tick, against the closed form of each mode."""

import math

import pytest
from tests.unit.rig.acquisition.exact_rig import INTERVAL_S, Desk, made

from rigidimeter.core.settings import parse_settings
from rigidimeter.model import minimum_jerk
from rigidimeter.rig.acquisition import (
    REST,
    Command,
    Order,
    change_parameter,
    follow,
    go_back,
    hold,
    perturb,
    ramp_to_rest,
    rest,
    return_duration_s,
)
from rigidimeter.rig.guard import Cause

SETTINGS = parse_settings({})
GAIN_PER_S = 3.0
STIFF = parse_settings({"controller": {"tracking_gain_per_s": GAIN_PER_S}})
J, B = SETTINGS.controller.inertia_kg_m2, SETTINGS.controller.damping_nm_s_rad
PERTURBATION_NM = [0.01 * (k + 1) * (-1) ** (k // 3) for k in range(20)]


def requests(samples):
    return [s.velocity_request_rad_s for s in samples]


def over(ticks, velocity_rad_s, perturbation_nm):
    """Return v after so many ticks of J v' + B v = M, the torque at rest."""
    decay = math.exp(-B / J * ticks * INTERVAL_S)
    return decay * velocity_rad_s + (1 - decay) / B * perturbation_nm


def test_the_perturbation_drives_the_admittance_and_is_recorded():
    loop, samples = made(SETTINGS)
    perturb(loop, 4, PERTURBATION_NM)
    velocity, expected = 0.0, []
    for value in PERTURBATION_NM:
        velocity = over(1, velocity, value)
        expected.append(velocity)
    assert requests(samples) == pytest.approx(expected, rel=1e-9)
    assert [s.perturbation_nm for s in samples] == PERTURBATION_NM
    assert {s.epoch for s in samples} == {4}
    assert all(math.isnan(s.target_angle_rad) for s in samples)


def test_the_joint_yields_to_the_torque_that_is_measured():
    """A push toward positive angle: the drive must apply a negative torque to the joint."""
    loop, samples = made(SETTINGS, change=lambda _, r: r._replace(torque_nm=-0.5))
    perturb(loop, 1, [0.0] * 200)
    velocity_rad_s = requests(samples)
    assert sorted(set(velocity_rad_s)) == velocity_rad_s
    assert velocity_rad_s[-1] == pytest.approx(0.5 / B, rel=0.01)  # J/B = 29 ms


@pytest.mark.parametrize("missed", [1, 3, 4, 8])
def test_after_missed_ticks_the_admittance_steps_over_all_of_them_up_to_five(missed):
    late_s = (missed + 0.5) * INTERVAL_S
    loop, samples = made(SETTINGS, late={5: late_s})
    perturb(loop, 1, [0.05] * 30)
    before = samples[4].velocity_command_rad_s
    steps = min(missed + 1, 5)
    assert samples[5].velocity_request_rad_s == pytest.approx(over(steps, before, 0.05))
    after = samples[5].velocity_command_rad_s
    assert samples[6].velocity_request_rad_s == pytest.approx(over(1, after, 0.05))


def test_the_admittance_goes_on_from_what_was_sent_not_from_what_was_asked_for():
    loop, samples = made(SETTINGS)
    perturb(loop, 1, [9.0] * 10)  # more than the acceleration limit allows
    sent = [s.velocity_command_rad_s for s in samples]
    assert requests(samples)[1:] == pytest.approx([over(1, v, 9.0) for v in sent[:-1]])


@pytest.mark.parametrize("cause", [Cause.TORQUE_HIGH, Cause.SIGNAL])
def test_the_perturbation_ends_with_a_hold_as_with_a_stop(cause):
    loop, samples = made(SETTINGS, desk=Desk({5: cause}))
    ended = perturb(loop, 1, PERTURBATION_NM)
    hold(loop, 0.005)
    ramp_to_rest(loop)
    assert (ended.cause, loop.tick >= 11) == (cause, True)
    assert [s.perturbation_nm for s in samples[:6]] == PERTURBATION_NM[:6]
    assert not any(s.perturbation_nm for s in samples[6:])
    assert samples[-1].velocity_command_rad_s == 0.0


@pytest.mark.parametrize("age_ticks", [0, 3])
def test_an_imposed_motion_corrects_the_error_of_when_the_reading_was_taken(age_ticks):
    """v = v_target + k (θ_target(then) − θ): as old as the reading is its target."""
    age_s = age_ticks * INTERVAL_S
    loop, samples = made(
        STIFF,
        change=lambda k, r: r._replace(angle_rad=0.002, motion_time_s=r.motion_time_s - age_s),
    )
    target = [0.001 * k for k in range(10)]
    follow(loop, 2, target, [0.01] * 10)
    then = [target[max(k - age_ticks, 0)] for k in range(10)]
    assert requests(samples) == pytest.approx([0.01 + GAIN_PER_S * (t - 0.002) for t in then])
    assert [s.target_angle_rad for s in samples] == target
    assert not any(s.perturbation_nm for s in samples)
    assert {s.epoch for s in samples} == {2}


@pytest.mark.parametrize(
    ("angle_deg", "lasts_s"), [(0.0, 3.0), (32.0, 3.0), (-40.0, 3.75), (80.0, 7.5)]
)
def test_a_return_takes_its_time_or_as_long_as_its_peak_speed_needs(angle_deg, lasts_s):
    """15/8 · 40 deg / 3.75 s is 20 deg/s."""
    angle_rad, speed_rad_s = math.radians(angle_deg), math.radians(20.0)
    assert return_duration_s(angle_rad, 3.0, speed_rad_s) == pytest.approx(lasts_s)
    ticks = 4000
    way = (minimum_jerk(angle_rad, lasts_s, k * lasts_s / ticks)[1] for k in range(ticks))
    assert max(map(abs, way)) == pytest.approx(15 / 8 * abs(angle_rad) / lasts_s)


FAST = 10.0
"""In rad/s: faster than any way back here."""


def test_a_return_goes_back_from_where_the_arm_is():
    loop, samples = made(STIFF)
    loop.angle_rad = loop.rig.angle_rad = 0.05
    go_back(loop, 0.5, FAST)
    targets, velocities = zip(
        *(minimum_jerk(0.05, 0.5, k * INTERVAL_S) for k in range(500)), strict=True
    )
    assert [s.target_angle_rad for s in samples] == list(targets)
    errors = [t - s.angle_rad for t, s in zip(targets, samples, strict=True)]
    expected = [v + GAIN_PER_S * e for v, e in zip(velocities, errors, strict=True)]
    assert requests(samples) == pytest.approx(expected)
    assert abs(samples[-1].angle_rad) < 1e-4
    assert {s.epoch for s in samples} == {REST}
    assert not any(s.perturbation_nm for s in samples)


def test_a_rest_keeps_the_arm_where_epochs_begin():
    loop, samples = made(STIFF)
    loop.rig.angle_rad = 0.001
    rest(loop, 0.6, FAST)
    assert len(samples) == 600
    assert {s.target_angle_rad for s in samples} == {0.0}
    assert requests(samples) == pytest.approx([-GAIN_PER_S * s.angle_rad for s in samples])
    assert {s.epoch for s in samples} == {REST}


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_no_reading_makes_a_return_or_a_rest_faster_than_its_limit(sign):
    """An arm that was pushed away: the correction alone would ask for 0.1 · gain."""
    for led in (lambda loop: go_back(loop, 0.5, 0.3), lambda loop: rest(loop, 0.5, 0.3)):
        loop, samples = made(STIFF, change=lambda _, r: r._replace(angle_rad=sign * 0.1))
        led(loop)
        assert requests(samples)[-1] == -sign * 0.3
        assert max(map(abs, requests(samples))) == 0.3


def test_a_return_before_any_reading_begins_where_the_rig_was_enabled():
    loop, samples = made(SETTINGS)
    go_back(loop, 0.01, FAST)
    assert {s.target_angle_rad for s in samples} == {0.0}


def test_a_return_compares_an_old_reading_with_the_target_of_its_time():
    loop, samples = made(
        SETTINGS, change=lambda k, r: r._replace(motion_time_s=r.motion_time_s - 0.004)
    )
    loop.angle_rad = loop.rig.angle_rad = 0.05
    go_back(loop, 0.5, FAST)
    gain = SETTINGS.controller.tracking_gain_per_s
    for k in (2, 50):
        (_, velocity), (then, _) = (
            minimum_jerk(0.05, 0.5, at * INTERVAL_S) for at in (k, max(k - 4, 0))
        )
        expected = velocity + gain * (then - samples[k].angle_rad)
        assert samples[k].velocity_request_rad_s == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("stamp_s", [math.nan, math.inf, -math.inf])
def test_a_stamp_that_is_no_number_is_for_the_guard_to_name(stamp_s):
    """The reading is compared with the target of that tick, and nothing of it is sent."""
    loop, samples = made(
        SETTINGS, change=lambda k, r: r._replace(motion_time_s=stamp_s) if k == 5 else r
    )
    target = [0.001 * k for k in range(10)]
    ended = follow(loop, 2, target, [0.01] * 10)
    assert ended.cause in (Cause.MOTION_NOT_FINITE, Cause.MOTION_STALE, Cause.STAMP_AHEAD)
    gain = SETTINGS.controller.tracking_gain_per_s
    assert requests(samples)[5] == pytest.approx(0.01 + gain * (0.005 - samples[5].angle_rad))


def test_a_hold_asks_for_nothing_and_hands_on_every_reading():
    taken = []
    loop, samples = made(SETTINGS, change=lambda k, r: r._replace(torque_nm=0.01 * k))
    hold(loop, 0.01, taken.append)
    assert [reading.torque_nm for reading in taken] == pytest.approx([0.01 * k for k in range(10)])
    assert not any(requests(samples))
    assert not any(s.perturbation_nm for s in samples)
    assert all(math.isnan(s.target_angle_rad) for s in samples)
    assert {s.epoch for s in samples} == {REST}


def test_a_joint_that_is_held_already_stands_for_the_whole_time_but_for_something_graver():
    loop, samples = made(SETTINGS, desk=Desk({0: Cause.TORQUE_HIGH, 8: Cause.DRIVE_FAULT}))
    hold(loop, 0.005)
    assert len(samples) == 1  # the hold itself ends what runs
    hold(loop, 0.005)
    assert len(samples) == 6
    hold(loop, 0.005)
    assert len(samples) == 9


# Parameters


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("inertia_kg_m2", J, 10.0 * J),
        ("damping_nm_s_rad", B, 10.0 * B),
        ("perturbation_scale", 0.0, 1.0),
    ],
)
def test_a_parameter_changes_within_its_bounds_and_the_others_stay(name, low, high):
    loop, _ = made(SETTINGS)
    before = {
        "inertia_kg_m2": J,
        "damping_nm_s_rad": B,
        "perturbation_scale": 1.0,
    }

    def change(value):
        return change_parameter(loop, SETTINGS.controller, Order(Command.CHANGE, name, value))

    for value in (low, high):
        assert change(value) == {"name": name, "value": value, "before": before[name]}
        before[name] = value
        assert {key: getattr(loop, key) for key in before} == before
    for value in (math.nextafter(low, -1.0), math.nextafter(high, math.inf), math.inf):
        facts = change(value)
        assert facts["refused"] == f"must be between {low:g} and {high:g}"
        assert "before" not in facts
        assert {key: getattr(loop, key) for key in before} == before
    assert change(math.nan)["value"] is None
    decay = math.exp(-loop.damping_nm_s_rad / loop.inertia_kg_m2 * INTERVAL_S)
    assert loop.admittances[0].decay == pytest.approx(decay)


def test_a_parameter_that_is_none_is_refused():
    loop, _ = made(SETTINGS)
    order = Order(Command.CHANGE, "position_limit_deg", 90.0)
    facts = change_parameter(loop, SETTINGS.controller, order)
    assert (facts["name"], facts["value"]) == ("position_limit_deg", 90.0)
    assert "refused" in facts


def test_a_smaller_perturbation_is_what_acts_and_what_is_recorded():
    loop, samples = made(SETTINGS)
    loop.perturbation_scale = 0.25
    perturb(loop, 1, [0.4] * 5)
    assert {s.perturbation_nm for s in samples} == {0.1}
    assert requests(samples)[0] == pytest.approx(over(1, 0.0, 0.1))
