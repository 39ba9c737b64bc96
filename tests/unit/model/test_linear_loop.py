"""The linear loop against the real one's parts and against closed forms."""

from fractions import Fraction

import numpy as np
import pytest

from rigidimeter.core.settings import ControllerSettings, RigSettings, TorqueSensorSettings
from rigidimeter.model import JointDynamics, Loop, reading_pattern

JOINT = JointDynamics(0.0045, 0.1368, 1.751)


def pattern(**sensor: float) -> list[float]:
    return [float(reading.age_ticks) for reading in reading_pattern(rig(**sensor))[0]]


def rig(**sensor: float) -> RigSettings:
    return RigSettings(torque=TorqueSensorSettings(**sensor))


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
    found = Loop(controller, fast).at_frequency(frequency).gain(JOINT.parameters)
    np.testing.assert_allclose(found, expected, rtol=0.05)


def test_a_constant_torque_ends_in_a_constant_speed_without_stiffness() -> None:
    free = JointDynamics(0.0045, 0.2, 0.0).parameters
    slowest = [1e-7]
    loop = Loop(ControllerSettings(), RigSettings()).at_frequency(slowest)
    resistance = ControllerSettings().damping_nm_s_rad + 0.2
    assert loop.command(free)[0] == pytest.approx(1.0 / resistance, rel=1e-6)
    assert abs(loop.command(JOINT.parameters)[0]) < 1e-6
    undamped = Loop(ControllerSettings(damping_nm_s_rad=0.0), RigSettings()).at_frequency(slowest)
    assert undamped.command(free)[0] == pytest.approx(1.0 / 0.2, rel=1e-6)


def test_a_pattern_of_readings_is_summed_exactly() -> None:
    frequency = np.array([0.001, 3.0, 40.0])
    slow = rig(rate_hz=400.0, latency_s=0.0037)
    ages = pattern(rate_hz=400.0, latency_s=0.0037)
    expected = np.mean([np.exp(-2j * np.pi * frequency * age * 1e-3) for age in ages], axis=0)
    found = Loop(ControllerSettings(), slow).at_frequency(frequency).read_torque
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_a_slow_sensor_is_a_delay_and_a_loss_of_gain() -> None:
    """A hold of n ticks: sin(nωT/2) / (n sin(ωT/2)), later by latency + (n − 1) T/2."""
    frequency = np.array([1.0, 10.0, 30.0])
    turned = 2 * np.pi * frequency * 1e-3
    found = Loop(ControllerSettings(), rig(rate_hz=100.0, latency_s=0.002)).at_frequency(frequency)
    gain = np.sin(5 * turned) / (10 * np.sin(turned / 2))
    np.testing.assert_allclose(np.abs(found.read_torque), gain, rtol=1e-12)
    np.testing.assert_allclose(np.angle(found.read_torque), -6.5 * turned, rtol=1e-9)


def test_ages_are_times_whatever_the_rate_of_the_recording() -> None:
    z = np.exp(2j * np.pi * np.array([2.0, 20.0]) / 400.0)
    found = Loop(ControllerSettings(), rig(latency_s=0.003)).at(z, 400.0)
    np.testing.assert_allclose(found.read_torque, z**-1.2, rtol=1e-12)
