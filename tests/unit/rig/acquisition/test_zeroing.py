"""Zeroing the torque sensor before the first epoch, and when a session does not begin on it."""

import math

import pytest
from tests.unit.rig.acquisition.exact_rig import Desk
from tests.unit.rig.acquisition.whole_session import RATE_HZ, SENSOR, VALUES, session

from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.acquisition import MIN_ZEROING_SAMPLES, Command, motion_objection
from rigidimeter.rig.devices.base import Reading
from rigidimeter.rig.guard import Cause

SETTINGS = parse_settings(VALUES)


def torque(bias_nm, ripple_nm=0.01):
    return lambda k, r: r._replace(torque_nm=r.torque_nm + bias_nm + ripple_nm * (-1) ** k)


def creep(tick, reading):
    """Move at 2.5 deg/s."""
    speed_rad_s = math.radians(2.5)
    angle_rad = speed_rad_s * tick / RATE_HZ
    return reading._replace(angle_rad=angle_rad, velocity_rad_s=speed_rad_s)


def test_the_sensor_is_zeroed_with_the_mean_of_the_whole_time():
    ran = session(Desk(), change=torque(0.5), zero_first=True)
    assert ran.rig.of("zero") == [pytest.approx(0.5)]
    (zeroed,) = ran.sink.of("sensor_zeroed")
    assert (zeroed["time_s"], zeroed["refused"]) == (0.4, "")
    assert zeroed["bias_nm"] == pytest.approx(0.5)
    assert zeroed["noise_sd_nm"] == pytest.approx(0.01 * math.sqrt(20 / 19))
    (enabled,) = ran.sink.of("rig_enabled")
    assert (enabled["time_s"], enabled["origin_rad"]) == (0.0, 0.25)
    assert ran.sink.of("epoch_started")[0]["time_s"] == 0.4


def test_without_zeroing_nothing_is_held_first():
    ran = session(Desk())
    assert ran.rig.of("zero") == []
    assert ran.sink.of("rig_enabled") == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (torque(1.01), "at rest the torque sensor reads 1.01 N·m, more than"),
        (torque(-1.01), "at rest the torque sensor reads -1.01 N·m, more than"),
        (torque(0.0, 0.11), "at rest the torque varies by 0.113 N·m (SD), more than"),
        (
            lambda k, r: r._replace(torque_time_s=(k - k % 2 if k > 3 else 0) / RATE_HZ),
            "only 9 torque samples came in 0.4 s",
        ),
        (creep, "the joint moved by"),
    ],
)
def test_a_session_does_not_begin_on_a_zero_that_is_none(change, words):
    ran = session(Desk(), change=change, zero_first=True)
    assert ran.result.outcome == "fail"
    assert words in ran.result.reason
    assert ran.rig.of("zero") == []
    assert ran.labels == []
    (zeroed,) = ran.sink.of("sensor_zeroed")
    assert zeroed["refused"] == ran.result.reason
    if "only" in words:
        assert (zeroed["bias_nm"], zeroed["noise_sd_nm"]) == (None, None)


@pytest.mark.parametrize("change", [torque(0.99), torque(-0.99), torque(0.0, 0.09)])
def test_within_the_limits_it_does(change):
    ran = session(Desk(), change=change, zero_first=True)
    assert ran.result.outcome == "success"


def torques(*deviations_nm):
    """Deviations from the inertia's torque, then none."""
    return lambda k, r: r._replace(
        torque_nm=r.torque_nm + (deviations_nm[k] if k < len(deviations_nm) else 0.0)
    )


@pytest.mark.parametrize(
    ("change", "values"),
    [
        (torque(1.0, 0.0), {}),
        (torque(-1.0, 0.0), {}),
        # Of 20 torques the squares of these are 19 · (1/8 N·m)², to the bit.
        (
            torques(0.375, -0.375, 0.0625, -0.0625, 0.0625, -0.0625),
            {"noise_limit_nm": 0.125},
        ),
    ],
)
def test_at_the_limit_it_does_too(change, values):
    zeroing = {**VALUES["zeroing"], **values}
    ran = session(Desk(), change=change, values={"zeroing": zeroing}, zero_first=True)
    (zeroed,) = ran.sink.of("sensor_zeroed")
    assert zeroed["refused"] == ""
    if values:
        assert zeroed["noise_sd_nm"] == 0.125
    assert ran.result.outcome == "success"


@pytest.mark.parametrize(("moved_deg", "refused"), [(0.15, False), (0.29, False), (0.31, True)])
def test_an_angle_that_changes_by_one_step_of_its_sensor_is_no_motion(moved_deg, refused):
    """Limit 0.2 deg, resolution 0.1 deg: a joint that stands still may show either of two steps."""
    motion = {**SENSOR, "angle_resolution_deg": 0.1}
    ran = session(
        Desk(),
        change=lambda k, r: r._replace(angle_rad=r.angle_rad + math.radians(moved_deg * (k < 5))),
        values={"rig": {**VALUES["rig"], "motion": motion}},
        zero_first=True,
    )
    (zeroed,) = ran.sink.of("sensor_zeroed")
    assert ("the joint moved by" in zeroed["refused"]) == refused


def test_ten_samples_are_enough():
    """Each is read twice."""
    assert round(VALUES["zeroing"]["duration_s"] * RATE_HZ) == 2 * MIN_ZEROING_SAMPLES

    def change(k, reading):
        return reading._replace(torque_time_s=(k - k % 2) / RATE_HZ)

    ran = session(Desk(), change=change, zero_first=True)
    assert ran.result.outcome == "success"


@pytest.mark.parametrize("held", [False, True])
def test_a_zero_that_was_interrupted_is_made_again(held):
    """Until then the torque is another: what was heard is thrown away."""
    orders = {50: Command.RESUME}
    desk = Desk({10: Cause.TORQUE_HIGH} if held else {}, orders)
    if not held:
        orders[10] = desk.orders[10] = Command.PAUSE_NOW
    ran = session(
        desk,
        change=lambda k, r: r._replace(torque_nm=r.torque_nm + (0.9 if k < 15 else 0.1)),
        zero_first=True,
    )
    assert ran.rig.of("zero") == [pytest.approx(0.1)]
    assert ran.result.outcome == "success"


@pytest.mark.parametrize("command", [Command.ABORT, Command.HALT])
def test_an_end_while_zeroing_leaves_no_zero(command):
    ran = session(Desk(orders={5: command}), zero_first=True)
    assert ran.rig.of("zero") == []
    assert ran.labels == []
    assert ran.result.outcome == ("abort" if command is Command.ABORT else "fail")


@pytest.mark.parametrize(
    ("causes", "orders"),
    [
        ({5: Cause.TORQUE_HIGH}, {}),
        ({15: Cause.TORQUE_HIGH}, {5: Command.PAUSE_NOW, 12: Command.RESUME}),
    ],
)
def test_a_hold_that_nobody_ends_leaves_no_zero_and_no_epoch(causes, orders):
    """While zeroing, or on the way back from a pause of it."""
    ran = session(Desk(causes, orders, attended=False), zero_first=True)
    assert ran.rig.of("zero") == []
    assert ran.labels == []
    assert ran.result.cause is Cause.TORQUE_HIGH


@pytest.mark.parametrize("angle_rad", [-0.2, 0.2])
def test_a_joint_at_rest_away_from_the_middle_did_not_move(angle_rad):
    readings = [Reading(0.0, 0.0, angle_rad, 0.0, 0.0)] * 20
    assert motion_objection(readings, SETTINGS) == ""
    limit_rad = math.radians(
        SETTINGS.zeroing.motion_limit_deg + SETTINGS.rig.motion.angle_resolution_deg
    )
    for share, refused in ((0.99, False), (1.01, True)):
        last = readings[0]._replace(angle_rad=angle_rad + share * limit_rad)
        assert bool(motion_objection([*readings, last], SETTINGS)) == refused
