"""The torque that the virtual rig's drive reports, against the equation, from what it did."""

import numpy as np
import pytest

from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.devices import SimulatedRig

EXACT = {
    "torque": {"noise_sd_nm": 0.0, "resolution_nm": 0.0, "latency_s": 0.0, "stamp_latency_s": 0.0},
    "motion": {"latency_s": 0.0, "stamp_latency_s": 0.0, "velocity_resolution_deg_s": 0.0},
}
SIDE = {"friction_ripple_percent": 0.0, "torque_resolution_percent": 0.0, "torque_latency_ticks": 0}


def readings(commands_rad_s, enable=True, seed=1, pushing_nm=0.0, **side):
    subject = {"OFF": {"voluntary_sd_nm": pushing_nm}}
    values = {"rig": {**EXACT, "drive_side": {**SIDE, **side}}, "subject": subject}
    settings = parse_settings(values)
    rig = SimulatedRig(settings.rig, settings.subject["OFF"], np.random.default_rng(seed))
    if enable:
        rig.enable()
    found = []
    for command in commands_rad_s:
        found.append(rig.read())
        rig.write(command)
    return found


@pytest.mark.parametrize(("inertia", "friction"), [(0.05, 0.3), (1.0, 3.0)])
def test_in_steady_motion_it_is_the_torque_on_the_joint_and_friction(inertia, friction):
    found = readings([0.3] * 1000, reflected_inertia_kg_m2=inertia, friction_nm=friction)
    for reading in found[500:]:
        motor_nm = 0.9 * reading.drive_torque_nm
        assert motor_nm == pytest.approx(reading.torque_nm + friction, rel=1e-6)
        assert reading.drive_torque_time_s == reading.motion_time_s


def test_under_acceleration_it_has_the_inertia_of_the_motor():
    n = 1000
    commands = 0.5 * np.sin(2 * np.pi * 3.0 * np.arange(n) / 1000.0)
    found = readings(commands, friction_nm=0.0, reflected_inertia_kg_m2=1.0, torque_scale=1.0)
    torque_nm, drive_nm, velocity = np.array(
        [(r.torque_nm, r.drive_torque_nm, r.velocity_rad_s) for r in found]
    ).T
    acceleration, own_nm = np.gradient(velocity, 1e-3)[200:-1], (drive_nm - torque_nm)[200:-1]
    # At a tick it is 1 % off its mean about it: the command is held from tick to tick.
    assert np.abs(own_nm - acceleration).max() < 0.012 * np.abs(acceleration).max()


def test_it_comes_in_steps_and_one_tick_late():
    commands = 0.5 * np.sin(2 * np.pi * 3.0 * np.arange(1000) / 1000.0)
    true = [r.drive_torque_nm for r in readings(commands)]
    late = [r.drive_torque_nm for r in readings(commands, torque_latency_ticks=1)]
    assert late[1:] == true[:-1]
    steps = np.array([r.drive_torque_nm for r in readings(commands, torque_resolution_percent=0.1)])
    np.testing.assert_allclose(steps, np.round(np.array(true) / 0.01) * 0.01, atol=1e-12)


def test_without_power_the_motor_has_no_torque():
    for enable in (True, False):
        found = readings([0.0] * 200, enable=enable, pushing_nm=1.0)
        assert any(abs(r.torque_nm) > 0.1 for r in found)
        assert any(abs(r.drive_torque_nm) > 0.0 for r in found) == enable


def test_a_drive_without_torque_says_so_and_the_facts_too():
    found = readings([0.2] * 20, reports_torque=False)
    assert np.isnan([[r.drive_torque_nm, r.drive_torque_time_s] for r in found]).all()
    for reports, facts in ((True, {"rated_torque_nm": 10.0}), (False, {})):
        settings = parse_settings({"rig": {"drive_side": {"reports_torque": reports}}})
        rig = SimulatedRig(settings.rig, settings.subject["OFF"], np.random.default_rng(1))
        assert rig.configure()["drive"]["values"] == facts


def test_the_drives_side_changes_nothing_else():
    """Torque, angle and velocity are to the bit what they are beside any other motor."""
    commands = 0.5 * np.sin(2 * np.pi * 3.0 * np.arange(500) / 1000.0)
    one = readings(commands)
    for side in ({"reports_torque": False}, {"reflected_inertia_kg_m2": 1.0, "friction_nm": 3.0}):
        assert [r[:10] for r in readings(commands, **side)] == [r[:10] for r in one]
