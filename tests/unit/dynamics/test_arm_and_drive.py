import math

import numpy as np
import pytest

from rigidimeter.dynamics import DriveState, arm, arm_step, arm_torque_nm, drive, drive_step
from rigidimeter.dynamics.joint import JointDynamics


def step_response(joint, t):
    """Angle after a unit step of torque, underdamped or overdamped, from rest."""
    J, B, K = joint.inertia_kg_m2, joint.damping_nm_s_rad, joint.stiffness_nm_rad
    s1, s2 = np.roots([J, B, K]).astype(complex)
    return ((1 + (s2 * np.exp(s1 * t) - s1 * np.exp(s2 * t)) / (s1 - s2)) / K).real


@pytest.mark.parametrize("damping", [0.02, 0.1368, 0.6])
def test_the_arm_under_a_step_of_torque_is_exact(damping):
    joint = JointDynamics(0.0045, damping, 1.751)
    one_tick = arm(joint, 0.001)
    angle = velocity = 0.0
    for k in range(1, 3001):
        angle, velocity = arm_step(one_tick, angle, velocity, 1.0)
        if k in (1, 10, 100, 3000):
            assert angle == pytest.approx(float(step_response(joint, k / 1000)), rel=1e-9)


def test_an_arm_without_stiffness_coasts_down():
    # v = v0 e^(−B t / J)
    one_tick = arm(JointDynamics(0.01, 0.05, 0.0), 0.001)
    angle, velocity = 0.0, 1.0
    for _ in range(200):
        angle, velocity = arm_step(one_tick, angle, velocity, 0.0)
    assert velocity == pytest.approx(math.exp(-0.05 * 0.2 / 0.01), rel=1e-9)
    assert angle == pytest.approx((1 - velocity) * 0.01 / 0.05, rel=1e-9)


@pytest.mark.parametrize("interval_s", [1e-5, 0.001, 0.02])
def test_the_drive_under_a_step_is_exact_for_any_interval(interval_s):
    omega, zeta = 2 * math.pi * 50.0, 0.7071
    one = drive(50.0, zeta, interval_s)
    state = DriveState()
    n = round(0.02 / interval_s)
    for _ in range(n):
        state = drive_step(one, state, 1.0)
    t, wd = n * interval_s, omega * math.sqrt(1 - zeta**2)
    decay = math.exp(-zeta * omega * t)
    velocity = 1 - decay * (math.cos(wd * t) + zeta * omega / wd * math.sin(wd * t))
    assert state.velocity_rad_s == pytest.approx(velocity, rel=1e-9)
    assert state.acceleration_rad_s2 == pytest.approx(
        decay * omega**2 / wd * math.sin(wd * t), rel=1e-8
    )


def test_the_drive_ends_where_the_commands_add_up_to():
    # The drive has unit gain at rest, so the angle is the integral of the command.
    one = drive(50.0, 0.7071, 0.001)
    state = DriveState()
    for k in range(2000):
        state = drive_step(one, state, 0.3 if k < 1000 else 0.0)
    assert state.angle_rad == pytest.approx(0.3, rel=1e-9)


def test_the_torque_is_that_of_equation_5():
    assert arm_torque_nm(0.01, 0.2, 3.0, 0.5, 2.0, 10.0, 0.7) == pytest.approx(
        0.1 + 0.4 + 1.5 - 0.7
    )


def test_an_overdamped_drive_is_refused():
    with pytest.raises(ValueError, match="damping ratio"):
        drive(50.0, 1.0, 0.001)
