import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from rigidimeter.analysis.estimation.signals import (
    kinematics,
    sampled,
    spline_slopes,
    uniform_grid,
    values_and_slopes,
)
from rigidimeter.core.records import Channel, Epoch


def epoch(**channels):
    made = {name: Channel(name, time, values) for name, (time, values) in channels.items()}
    return Epoch("file", "1", made)


def sine(rate_hz, jitter_s=0.0, seed=0, duration_s=10.0, f=1.3):
    t = np.arange(round(duration_s * rate_hz)) / rate_hz
    t = t + np.random.default_rng(seed).uniform(0, jitter_s, t.size)
    w = 2 * np.pi * f
    return t, np.sin(w * t), w * np.cos(w * t), -(w**2) * np.sin(w * t)


def test_derivatives_of_a_recorded_angle_are_exact_for_a_sinusoid():
    t, x, v, a = sine(1000.0)
    angle, velocity, acceleration = kinematics(epoch(angle_rad=(t, x)), t)
    inner = slice(20, -20)
    np.testing.assert_allclose(angle, x, atol=1e-12)
    np.testing.assert_allclose(velocity[inner], v[inner], atol=1e-7)
    np.testing.assert_allclose(acceleration[inner], a[inner], atol=1e-4)


def test_jittered_stamps_are_read_as_they_are():
    t, x, v, _ = sine(50.0, jitter_s=0.005)
    grid = np.linspace(1.0, 9.0, 801)
    _, velocity, _ = kinematics(epoch(angle_rad=(t, x), velocity_rad_s=(t, v)), grid)
    w = 2 * np.pi * 1.3
    np.testing.assert_allclose(velocity, w * np.cos(w * grid), atol=w * 5e-4)
    # Taken as equally spaced, the same samples would be off by far more.
    spaced = np.interp(grid, np.arange(t.size) / 50.0, v)
    assert np.abs(spaced - w * np.cos(w * grid)).max() > 0.02 * w


@pytest.mark.parametrize("n", [2, 3, 4, 5, 200])
def test_slopes_are_those_of_the_spline(n):
    t, x, _, _ = sine(50.0, jitter_s=0.01)
    expected = CubicSpline(t[:n], x[:n]).derivative()(t[:n])
    np.testing.assert_allclose(spline_slopes(t[:n], x[:n]), expected, rtol=1e-9, atol=1e-9)


def test_samples_at_the_times_asked_for_need_no_spline():
    t, x, _, _ = sine(100.0)
    channel = Channel("angle_rad", t + 7.0, x)
    inner = channel.time_s[20:60]
    assert sampled(channel, inner) == slice(20, 60)
    for late_s in (1e-9, 1e-6):  # rounding of a clock, and a time of its own
        values, slopes = values_and_slopes(channel, inner + late_s)
        found = CubicSpline(channel.time_s, x)
        np.testing.assert_allclose(values, found(inner + late_s), atol=1e-7)
        np.testing.assert_allclose(slopes, found.derivative()(inner + late_s), atol=1e-6)
        assert (sampled(channel, inner + late_s) is None) == (late_s == 1e-6)
    assert sampled(channel, channel.time_s[20:60:2]) is None
    assert sampled(channel, t) is None


def test_the_grid_is_where_all_channels_are():
    early = Channel("torque_nm", np.arange(0.0, 10.0, 0.01), np.zeros(1000))
    late = Channel("angle_rad", np.arange(0.5, 12.0, 0.02), np.zeros(575))
    grid = uniform_grid([early, late], 100.0)
    assert grid[0] == 0.5
    assert grid[-1] <= 9.99
    np.testing.assert_allclose(np.diff(grid), 0.01)
    apart = Channel("angle_rad", np.arange(20.0, 30.0), np.zeros(10))
    assert uniform_grid([early, apart], 100.0).size == 0
