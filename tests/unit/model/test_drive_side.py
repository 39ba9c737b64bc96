"""The motor's torque against closed forms: T = M + J_d θ″ + F, F by Dahl's model."""

import math

import numpy as np
import pytest

from rigidimeter.core.settings import DriveSideSettings
from rigidimeter.model import DriveSideState, drive_side, drive_side_step, reported_torque_nm

SMALL = DriveSideSettings(torque_scale=1.0, torque_resolution_percent=0.0)
ELBOW = DriveSideSettings(
    reflected_inertia_kg_m2=1.0,
    friction_nm=3.0,
    rated_torque_nm=50.0,
    torque_scale=1.0,
    torque_resolution_percent=0.0,
)


def changed(settings, **values):
    return settings.model_copy(update=values)


def torques(settings, angle_rad, acceleration_rad_s2, torque_nm, state=None):
    """Return what the drive reports along a motion, from the state before it."""
    side, state = drive_side(settings), state or DriveSideState()
    found = []
    for values in zip(*np.broadcast_arrays(angle_rad, acceleration_rad_s2, torque_nm), strict=True):
        state = drive_side_step(side, state, *map(float, values))
        found.append(reported_torque_nm(side, state))
    return np.array(found)


def test_without_friction_the_motor_accelerates_itself_and_the_arm():
    time_s = np.arange(0.0, 0.5, 1e-3)
    free = changed(ELBOW, friction_nm=0.0)
    found = torques(free, 0.5 * 2.0 * time_s**2, 2.0, 0.7)
    np.testing.assert_allclose(found, 0.7 + 1.0 * 2.0, rtol=1e-12)


@pytest.mark.parametrize("settings", [SMALL, ELBOW])
@pytest.mark.parametrize("direction", [1, -1])
def test_at_constant_speed_friction_opposes_the_motion(settings, direction):
    angle_rad = direction * 0.3 * np.arange(0.0, 2.0, 1e-3)
    even = changed(settings, friction_ripple_percent=0.0)
    found = torques(even, angle_rad, 0.0, 0.7)
    np.testing.assert_allclose(found[100:], 0.7 + direction * settings.friction_nm, rtol=1e-9)


@pytest.mark.parametrize("settings", [SMALL, ELBOW])
def test_friction_varies_with_the_angle_by_its_ripple(settings):
    angle_rad = 0.05 * np.arange(0.0, 4.0, 1e-3)
    found = torques(settings, angle_rad, 0.0, 0.0)[500:]
    assert found.max() == pytest.approx(1.2 * settings.friction_nm, rel=0.01)
    assert found.min() == pytest.approx(0.8 * settings.friction_nm, rel=0.01)
    period_rad = math.radians(settings.friction_ripple_deg)
    crests = angle_rad[500:][1:-1][(found[1:-1] > found[:-2]) & (found[1:-1] >= found[2:])]
    np.testing.assert_allclose(np.diff(crests), period_rad, rtol=0.01)


def test_friction_turns_round_within_the_distance_of_its_spring():
    """From +F_c, a displacement of −x leaves F_c (2 exp(−x / 1 mrad) − 1)."""
    even = changed(ELBOW, friction_ripple_percent=0.0)
    back_rad = np.linspace(0.0, 5e-3, 51)
    way = np.concatenate((np.linspace(0.0, 0.1, 1000), 0.1 - back_rad))
    found = torques(even, way, 0.0, 0.0)[1000:]
    np.testing.assert_allclose(found, 3.0 * (2.0 * np.exp(-back_rad / 1e-3) - 1.0), rtol=1e-6)


@pytest.mark.parametrize("steps", [1, 7, 1000])
def test_a_drive_at_rest_leaves_part_of_a_growing_load_to_its_friction(steps):
    """T = M − F_c (1 − exp(−M / 2 F_c)), however the load grows."""
    even = changed(ELBOW, friction_ripple_percent=0.0)
    load_nm = np.linspace(0.0, 10.0, steps + 1)[1:]
    found = torques(even, 0.0, 0.0, load_nm)
    np.testing.assert_allclose(found, load_nm - 3.0 * (1.0 - np.exp(-load_nm / 6.0)), rtol=1e-9)


def test_a_drive_at_rest_keeps_the_friction_of_the_motion_before_it():
    even = changed(SMALL, friction_ripple_percent=0.0)
    there, back = np.linspace(0.0, 0.1, 500), np.linspace(0.2, 0.1, 500)
    after = [torques(even, way, 0.0, 0.5)[-1] for way in (there, back)]
    still = [torques(even, [*way, *[0.1] * 100], 0.0, 0.5)[-1] for way in (there, back)]
    assert after == pytest.approx([0.8, 0.2]) == still


def test_friction_never_exceeds_itself_and_never_drives():
    rng = np.random.default_rng(1)
    angle_rad = np.cumsum(rng.normal(0.0, 1e-3, 20_000))
    found = torques(ELBOW, angle_rad, 0.0, 0.0)
    assert np.abs(found).max() <= 1.2 * 3.0 + 1e-12
    assert np.sum(found[1:] * np.diff(angle_rad)) > 0.0


def test_the_reported_torque_has_the_drives_scale_and_steps():
    reports = changed(SMALL, torque_scale=0.8, torque_resolution_percent=0.1, friction_nm=0.0)
    found = torques(reports, 0.0, 0.0, [1.0, 1.006, -3.0])
    np.testing.assert_allclose(found, [1.25, 1.26, -3.75], rtol=1e-12)  # steps of 0.01 N·m
