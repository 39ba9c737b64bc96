import math

import numpy as np
import pytest

from rigidimeter.model import JointDynamics, arm_response, arm_torque_nm


def test_torque_of_a_sinusoid_has_its_closed_form():
    # θ = A sin ωt: M = (K − Jω²) A sin ωt + B ω A cos ωt
    joint = JointDynamics(0.0045, 0.1368, 1.751)
    t = np.linspace(0, 3, 1001)
    A, w = 0.3, 2 * math.pi
    torque = joint.torque_nm(A * np.sin(w * t), A * w * np.cos(w * t), -A * w**2 * np.sin(w * t))
    expected = (1.751 - 0.0045 * w**2) * A * np.sin(w * t) + 0.1368 * w * A * np.cos(w * t)
    np.testing.assert_allclose(torque, expected, atol=1e-14)


def test_bandwidth_is_where_the_compliance_has_lost_3_db():
    joint = JointDynamics(0.0026, 0.044, 0.75)  # Eq. 8
    frequency = joint.bandwidth_hz()
    ratio = abs(joint.compliance_rad_nm(frequency)) / abs(joint.compliance_rad_nm(0.0))
    assert ratio == pytest.approx(1 / math.sqrt(2), rel=1e-12)
    assert frequency == pytest.approx(3.44, abs=0.005)


def test_without_inertia_to_speak_of_the_bandwidth_is_k_over_b():
    assert JointDynamics(1e-9, 0.1, 2.0).bandwidth_hz() == pytest.approx(
        2.0 / 0.1 / (2 * math.pi), rel=1e-6
    )


@pytest.mark.parametrize("values", [(0.0, 1.0, 1.0), (-1.0, 1.0, 1.0), (math.nan, 1.0, 1.0)])
def test_an_impossible_joint_is_refused(values):
    with pytest.raises(ValueError, match=r"inertia|finite"):
        JointDynamics(*values)


def test_bandwidth_needs_a_stiffness():
    with pytest.raises(ValueError, match="stiffness greater than 0"):
        JointDynamics(0.01, 0.1, 0.0).bandwidth_hz()


def step_response(joint, t):
    """Angle after a unit step of torque, underdamped or overdamped, from rest."""
    J, B, K = joint.inertia_kg_m2, joint.damping_nm_s_rad, joint.stiffness_nm_rad
    s1, s2 = np.roots([J, B, K]).astype(complex)
    return ((1 + (s2 * np.exp(s1 * t) - s1 * np.exp(s2 * t)) / (s1 - s2)) / K).real


@pytest.mark.parametrize("damping", [0.02, 0.1368, 0.6])
def test_the_arm_under_a_step_of_torque_is_exact(damping):
    joint = JointDynamics(0.0045, damping, 1.751)
    angle, _ = arm_response(joint, np.ones(3001), 0.001)
    for k in (1, 10, 100, 3000):
        assert angle[k] == pytest.approx(float(step_response(joint, k / 1000)), rel=1e-9)


def test_an_arm_without_stiffness_coasts_down():
    # v = v0 e^(−B t / J)
    torque = np.zeros(221)
    torque[:20] = 1.0
    angle, velocity = arm_response(JointDynamics(0.01, 0.05, 0.0), torque, 0.001)
    assert velocity[20] == pytest.approx((1 - math.exp(-0.05 * 0.02 / 0.01)) / 0.05, rel=1e-9)
    assert velocity[220] == pytest.approx(velocity[20] * math.exp(-0.05 * 0.2 / 0.01), rel=1e-9)
    coasted = (velocity[20] - velocity[220]) * 0.01 / 0.05
    assert angle[220] - angle[20] == pytest.approx(coasted, rel=1e-9)


def test_the_torque_is_that_of_equation_5():
    assert arm_torque_nm(0.01, 0.2, 3.0, 0.5, 2.0, 10.0, 0.7) == pytest.approx(
        0.1 + 0.4 + 1.5 - 0.7
    )
