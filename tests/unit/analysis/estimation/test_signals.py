"""Samples brought together, filtered alike, and the power of their lines."""

import numpy as np
import pytest
from scipy import signal

from rigidimeter.analysis.estimation.signals import (
    bandlimited_signals,
    kinematics,
    power_lines,
    sampled,
    uniform_grid,
    values_at,
    zero_phase_band,
)
from rigidimeter.core.records import Channel, Epoch, LeftOut
from rigidimeter.core.settings import EstimationSettings
from rigidimeter.model import JointDynamics

W = 2 * np.pi * 1.3


def sine(rate_hz, jitter_s=0.0):
    t = np.arange(round(10 * rate_hz)) / rate_hz
    t = t + np.random.default_rng(0).uniform(0, jitter_s, t.size)
    return t, np.sin(W * t), W * np.cos(W * t), -(W**2) * np.sin(W * t)


def epoch(left_out=(), **channels):
    made = {name: Channel(name, *both) for name, both in channels.items()}
    return Epoch("file", "1", made, left_out=left_out)


def test_derivatives_and_integrals_are_those_of_the_signal():
    t, x, v, a = sine(1000.0)
    inner = slice(20, -20)
    of_angle = kinematics(epoch(angle_rad=(t, x)), t)[:, inner]
    np.testing.assert_allclose(of_angle, np.stack([a, v, x])[:, inner], atol=1e-4)
    of_velocity = kinematics(epoch(velocity_rad_s=(t, v)), t)[:, inner]
    np.testing.assert_allclose(of_velocity, np.stack([a, v, x])[:, inner], atol=1e-4)


def test_jittered_stamps_are_read_as_they_are():
    t, _, v, _ = sine(50.0, jitter_s=0.005)
    times = np.linspace(1.0, 9.0, 801)
    found = values_at(Channel("velocity_rad_s", t, v), times)
    np.testing.assert_allclose(found, W * np.cos(W * times), atol=W * 5e-4)


def test_samples_at_the_times_asked_for_are_taken_as_they_are():
    t, x, _, _ = sine(100.0)
    channel = Channel("angle_rad", t + 7.0, x)
    inner = channel.time_s[20:60]
    assert sampled(channel, inner + 1e-9) == slice(20, 60)
    assert sampled(channel, inner + 1e-6) is None
    assert sampled(channel, inner[::2]) is None
    np.testing.assert_array_equal(values_at(channel, inner), x[20:60])


def test_the_grid_is_where_all_channels_are():
    early = Channel("torque_nm", np.arange(0.0, 10.0, 0.01), np.zeros(1000))
    late = Channel("angle_rad", np.arange(0.5, 12.0, 0.02), np.zeros(575))
    grid = uniform_grid([early, late], 100.0)
    assert (grid[0], grid.size) == (0.5, 950)
    assert (
        uniform_grid([early, Channel("angle_rad", np.arange(20.0, 30.0), np.zeros(10))], 1).size
        == 0
    )


@pytest.mark.parametrize("f", [0.15, 1.0, 10.0])
def test_the_band_has_no_phase_and_half_its_edges(f):
    t = np.arange(40_000) / 200.0
    x = np.sin(2 * np.pi * f * t)
    expected = 1.0 if f == 1.0 else 0.5
    # The bilinear transform keeps the edges; far from them the gain is 1.
    inner = slice(8000, -8000)
    found = zero_phase_band(x, 200.0, (0.15, 10.0))
    np.testing.assert_allclose(found[inner], expected * x[inner], atol=1e-3)


def test_signals_are_those_of_one_joint_without_ends_and_what_is_left_out():
    rng, joint = np.random.default_rng(1), JointDynamics(0.0045, 0.1368, 1.751)
    t = np.arange(4000) / 200.0
    x = signal.sosfiltfilt(signal.butter(4, 5.0, fs=200.0, output="sos"), rng.normal(size=4000))
    a, v, x = kinematics(epoch(angle_rad=(t, x)), t)
    made = epoch((LeftOut(8.0, 9.0),), torque_nm=(t, joint.torque_nm(x, v, a)), angle_rad=(t, x))
    found = bandlimited_signals(made, EstimationSettings())
    assert found.time_s.size / found.rate_hz == pytest.approx(20 - 2 - 3, abs=0.02)
    left = np.std(found.motion @ np.array([0.0045, 0.1368, 1.751]) - found.torque_nm)
    assert left < 2e-3 * np.std(found.torque_nm)


def test_power_sums_to_the_variance_and_a_line_is_where_it_is():
    rng = np.random.default_rng(2)
    values = rng.normal(size=2000) + 3.0
    _, power = power_lines(values, 100.0)
    assert power.sum() == pytest.approx(np.var(values))
    f, power = power_lines(np.sin(2 * np.pi * 7.3 * np.arange(2000) / 100), 100.0, tapered=True)
    assert f[np.argmax(power)] == pytest.approx(7.3, abs=0.05)
    assert power.sum() == pytest.approx(0.5, rel=1e-3)
