"""The linear loop against the real one's parts and against closed forms."""

from fractions import Fraction

import numpy as np
import pytest

from rigidimeter.control import admittance, butterworth_lowpass
from rigidimeter.dynamics import (
    DriveState,
    command_response,
    drive,
    drive_step,
    loop_model,
    open_loop,
)
from rigidimeter.dynamics.joint import JointDynamics
from rigidimeter.dynamics.loop_response import (
    admittance_coefficients,
    drive_advance,
    lowpass_coefficients,
    reading_pattern,
)
from rigidimeter.settings import ControllerSettings, RigSettings, TorqueSensorSettings

JOINT = JointDynamics(0.0045, 0.1368, 1.751)


def pattern(**sensor: float) -> list[float]:
    return [float(reading.age_ticks) for reading in reading_pattern(rig(**sensor))[0]]


def rig(**sensor: float) -> RigSettings:
    return RigSettings(torque=TorqueSensorSettings(**sensor))


@pytest.mark.parametrize("damping", [0.0, 1.6])
def test_the_parts_are_those_of_the_loop(damping: float) -> None:
    controller = ControllerSettings(damping_nm_s_rad=damping)
    real = admittance(controller.inertia_kg_m2, damping, 1e-3)
    assert admittance_coefficients(controller, 1000.0) == pytest.approx(tuple(real))
    b, a = lowpass_coefficients(controller, 1000.0)
    assert [*b, *a[1:]] == pytest.approx(list(butterworth_lowpass(20.0, 1000.0)))
    step, push = drive_advance(RigSettings(), 1e-3)
    state, command = np.array([0.1, -0.7, 20.0]), 0.4
    expected = drive_step(drive(50.0, 0.7071, 1e-3), DriveState(*state), command)
    np.testing.assert_allclose(step @ state + push * command, expected, rtol=1e-12)


def test_how_old_the_reading_is() -> None:
    assert pattern(latency_s=0.0) == [0.0]
    assert pattern(latency_s=0.0024) == pytest.approx([2.4])
    assert pattern(rate_hz=100.0, latency_s=0.0037) == pytest.approx(np.arange(10) + 3.7)
    # A sample that is half a tick late is read at the next tick.
    assert pattern(latency_s=0.0, jitter_s=0.0005) == pytest.approx([0.5])
    readings, per_sample = reading_pattern(rig(rate_hz=400.0, latency_s=0.0))
    assert per_sample == Fraction(5, 2)
    assert [float(r.age_ticks) for r in readings] == pytest.approx([0.0, 1.0, 2.0, 0.5, 1.5])


def test_a_fast_loop_is_the_ratio_of_impedances() -> None:
    """Without delays L = (J s + B + K/s) / (J_c s + B_c)."""
    controller = ControllerSettings(torque_cutoff_hz=1000.0)
    fast = RigSettings(
        tick_rate_hz=5000.0,
        drive_bandwidth_hz=400.0,  # slow beside the tick, fast beside the arm
        torque=TorqueSensorSettings(rate_hz=5000.0, latency_s=0.0),
    )
    frequency = np.array([0.1, 1.0, 5.0])
    s = 2j * np.pi * frequency
    J, B, K = JOINT.inertia_kg_m2, JOINT.damping_nm_s_rad, JOINT.stiffness_nm_rad
    expected = (J * s + B + K / s) / (controller.inertia_kg_m2 * s + controller.damping_nm_s_rad)
    found = open_loop(loop_model(controller, fast, frequency), JOINT)
    np.testing.assert_allclose(found, expected, rtol=0.05)


def test_a_constant_torque_ends_in_a_constant_speed_without_stiffness() -> None:
    model = loop_model(ControllerSettings(), RigSettings(), [0.0, 1.0])
    free = command_response(model, JointDynamics(0.0045, 0.2, 0.0))
    assert free[0] == pytest.approx(1.0 / (ControllerSettings().damping_nm_s_rad + 0.2))
    assert command_response(model, JOINT)[0] == 0.0
    undamped = loop_model(ControllerSettings(damping_nm_s_rad=0.0), RigSettings(), [0.0, 1.0])
    resisted = command_response(undamped, JointDynamics(0.0045, 0.2, 0.0))
    assert resisted[0] == pytest.approx(1.0 / 0.2)
    assert np.all(np.isfinite(resisted))


def test_a_pattern_of_readings_is_summed_exactly() -> None:
    frequency = np.array([0.0, 3.0, 40.0])
    slow = rig(rate_hz=400.0, latency_s=0.0037)
    ages = pattern(rate_hz=400.0, latency_s=0.0037)
    expected = np.mean([np.exp(-2j * np.pi * frequency * age * 1e-3) for age in ages], axis=0)
    found = loop_model(ControllerSettings(), slow, frequency).read_torque
    np.testing.assert_allclose(found, expected, rtol=1e-12)
