import math

import numpy as np
import pytest

from rigidimeter.dynamics.joint import JointDynamics


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
