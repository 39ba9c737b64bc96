"""The live estimate against exact data, a batch solution by another filter, steps, and rests."""

import math

import numpy as np
import pytest
from scipy import signal

from rigidimeter.core.session import read_session
from rigidimeter.core.settings import OnlineSettings
from rigidimeter.model import STATE_SIZE, online_design, online_reading, online_step

TRUTH = np.array([0.0045, 0.1368, 1.751])
RATE_HZ = 1000.0
SETTINGS = OnlineSettings()


def sines(duration_s, seed=0, rate_hz=RATE_HZ):
    """Time, angle, velocity and acceleration: sinusoids that set out from rest, exact."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(duration_s * rate_hz)) / rate_hz
    f = np.arange(0.2, 9.0, 0.37)
    w, size = 2 * np.pi * f, 0.03 / (1 + f)
    phase = rng.uniform(0, 2 * np.pi, f.size)[:, None]
    x = size @ np.sin(np.outer(w, t) + phase)
    v = (size * w) @ np.cos(np.outer(w, t) + phase)
    a = -(size * w**2) @ np.sin(np.outer(w, t) + phase)
    return t, *faded(0.5 - np.clip(t, None, 0.5), -1.0 * (t < 0.5), x, v, a)


def faded(ago_s, pace, x, v, a):
    """Return the motion times (1 + cos w s) / 2, s = `ago_s`, growing by `pace`, w = π / 0.5 s."""
    w = math.pi / 0.5
    fade, slope = (1 + np.cos(w * ago_s)) / 2, -pace * w * np.sin(w * ago_s) / 2
    bend = -((pace * w) ** 2) * np.cos(w * ago_s) / 2
    return x * fade, v * fade + x * slope, a * fade + 2 * v * slope + x * bend


def run(torque, angle, velocity, settings=SETTINGS, rate_hz=RATE_HZ):
    """Return the final state, and J, B, K and whether at rest after each sample."""
    design = online_design(settings, rate_hz)
    state = [0.0] * STATE_SIZE
    found = np.empty((len(torque), 4))
    for k, (m, x, v) in enumerate(zip(torque, angle, velocity, strict=True)):
        online_step(design, state, float(m), float(x), float(v))
        found[k] = *state[31:34], state[37]
    return design, state, found


def filtered(values, settings=SETTINGS, rate_hz=RATE_HZ, derivative=False):
    """The same band by scipy's Butterworth filters; the bilinear derivative takes a zero at −1."""
    high = signal.butter(2, settings.band_low_hz, "highpass", fs=rate_hz, output="sos")
    values, _ = signal.sosfilt(high, values, zi=signal.sosfilt_zi(high) * values[0])
    z, p, k = signal.butter(4, settings.band_high_hz, fs=rate_hz, output="zpk")
    if derivative:
        z, k = np.array([-1.0, -1.0, -1.0, 1.0]), k * 2 * rate_hz
    return signal.sosfilt(signal.zpk2sos(z, p, k), values)


def test_exact_data_give_the_exact_joint():
    # Without inertia nothing hangs on how well the derivative is made.
    _, x, v, _ = sines(10.0)
    torque = TRUTH[1] * v + TRUTH[2] * x
    design, state, _ = run(torque, x, v)
    reading = online_reading(design, state, RATE_HZ)
    assert reading.damping_nm_s_rad == pytest.approx(TRUTH[1], rel=1e-9)
    assert reading.stiffness_nm_rad == pytest.approx(TRUTH[2], rel=1e-9)
    assert abs(reading.inertia_kg_m2) < 1e-9
    assert reading.residual_sd_nm < 1e-9
    assert not reading.resting


def test_with_inertia_it_is_as_exact_as_the_derivative():
    _, x, v, a = sines(20.0)
    design, state, _ = run(TRUTH @ np.array([a, v, x]), x, v)
    reading = online_reading(design, state, RATE_HZ)
    assert reading.inertia_kg_m2 == pytest.approx(TRUTH[0], rel=1e-3)
    assert reading.damping_nm_s_rad == pytest.approx(TRUTH[1], rel=1e-3)
    assert reading.stiffness_nm_rad == pytest.approx(TRUTH[2], rel=1e-3)


@pytest.mark.parametrize("rate_hz", [1000.0, 200.0])
def test_it_is_the_batch_solution_with_the_same_filters_and_weights(rate_hz):
    t, x, v, a = sines(12.0, rate_hz=rate_hz)
    rng = np.random.default_rng(1)
    torque = TRUTH @ np.array([a, v, x]) + 0.05 * rng.standard_normal(t.size)
    x, v = x + 0.1, v + 1e-3 * rng.standard_normal(t.size)
    _, state, found = run(torque, x, v, rate_hz=rate_hz)
    assert not np.any(found[:, 3])
    A = np.column_stack(
        [filtered(v, rate_hz=rate_hz, derivative=True), filtered(v, rate_hz=rate_hz),
         filtered(x, rate_hz=rate_hz)]
    )  # fmt: skip
    b = filtered(torque, rate_hz=rate_hz)
    for n in (t.size // 2, t.size):
        root = np.exp(-(np.arange(n)[::-1]) / (2 * rate_hz * SETTINGS.forgetting_s))
        expected, rss, *_ = np.linalg.lstsq(A[:n] * root[:, None], b[:n] * root, rcond=None)
        np.testing.assert_allclose(found[n - 1, :3], expected, rtol=1e-8)
    assert state[28] == pytest.approx(float(rss[0]), rel=1e-8)
    assert state[29] == pytest.approx(float(np.sum(root**2)), rel=1e-10)
    assert state[30] == pytest.approx(float(np.sum(root**4)), rel=1e-10)


def test_an_offset_of_torque_and_angle_makes_no_transient():
    _, x, v, a = sines(3.0)
    torque = TRUTH @ np.array([a, v, x])
    one = run(torque - torque[0], x - x[0], v)[2]
    other = run(torque - torque[0] + 2.0, x - x[0] - 0.5, v)[2]
    np.testing.assert_allclose(other[200:], one[200:], rtol=1e-6)


def test_a_step_of_stiffness_is_followed_in_the_time_designed():
    settings = OnlineSettings(forgetting_s=4.0)
    t, x, v, a = sines(60.0)
    stiffness = np.where(t < 30.0, 1.0, 3.0)
    torque = TRUTH[0] * a + TRUTH[1] * v + stiffness * x
    _, _, found = run(torque, x, v, settings)
    # What is forgotten exponentially is followed as 1 − exp(−t/τ): from 10 to 90 % in τ ln 9.
    done = (found[t >= 30.0, 2] - 1.0) / 2.0
    rise_s = (np.argmax(done >= 0.9) - np.argmax(done >= 0.1)) / RATE_HZ
    assert rise_s == pytest.approx(4.0 * math.log(9.0), rel=0.15)
    assert found[t.size // 2 - 1, 2] == pytest.approx(1.0, rel=0.01)
    assert found[-1, 2] == pytest.approx(3.0, rel=0.01)


def test_a_rest_neither_winds_up_nor_forgets():
    t, x, v, a = sines(10.0)
    # The motion dies down within its last half second.
    x, v, a = faded(np.clip(t - 9.5, 0.0, None), 1.0 * (t > 9.5), x, v, a)
    torque = TRUTH @ np.array([a, v, x])
    # Two minutes of rest with the noise of the sensors.
    noise = 1e-3 * np.random.default_rng(2).standard_normal((2, 120_000))
    design, state, found = run(
        np.concatenate([torque, noise[0]]),
        np.concatenate([x, np.zeros(120_000)]),
        np.concatenate([v, noise[1]]),
    )
    reading = online_reading(design, state, RATE_HZ)
    assert reading.resting
    assert reading.gain == 0.0
    # From the last movement on nothing may change: not the values, not their errors.
    resting = np.flatnonzero(found[:, 3])
    np.testing.assert_array_equal(found[resting[0], :3], found[-1, :3])
    assert resting[0] < t.size + 12_000
    np.testing.assert_allclose(found[-1, 1:3], TRUTH[1:], rtol=0.05)
    assert 1.0 < reading.memory_s <= 5.0
    # And what follows is learnt at once, not after as long a time as was rested.
    state_after = list(state)
    for m, angle, speed in zip(2 * torque, x, v, strict=True):
        online_step(design, state_after, float(m), float(angle), float(speed))
    assert state_after[37] == 0.0
    assert state_after[33] == pytest.approx(2 * TRUTH[2], rel=0.25)


def test_standard_errors_are_the_scatter():
    # The lower edge is put below the slowest sinusoid, so that the noise is white where they are.
    settings = OnlineSettings(forgetting_s=2.0, band_low_hz=0.02)
    _, x, v, a = sines(8.0, rate_hz=200.0)
    exact = TRUTH @ np.array([a, v, x])
    design = online_design(settings, 200.0)
    found, claimed = [], []
    for seed in range(150):
        noise = 0.1 * np.random.default_rng([5, seed]).standard_normal(exact.size)
        noise[0] = 0.0  # the first value is taken for the offset
        state = [0.0] * STATE_SIZE
        for m, angle, speed in zip((exact + noise).tolist(), x.tolist(), v.tolist(), strict=True):
            online_step(design, state, m, angle, speed)
        reading = online_reading(design, state, 200.0)
        found.append(reading[:6:2])
        claimed.append(reading[1:6:2])
    np.testing.assert_allclose(np.mean(claimed, axis=0), np.std(found, axis=0), rtol=0.2)


def test_a_reading_is_what_the_triangle_says():
    t, x, v, a = sines(4.0)
    noise = 0.05 * np.random.default_rng(4).standard_normal(t.size)
    torque = TRUTH @ np.array([a, v, x]) + noise
    design, state, _ = run(torque[:-1], x[:-1], v[:-1])
    rss = state[28]
    innovation = online_step(design, state, float(torque[-1]), float(x[-1]), float(v[-1]))
    reading = online_reading(design, state, RATE_HZ)
    # What the fit did not take up of the innovation went into the residual.
    grown = state[28] - design.forgetting * rss
    assert grown == pytest.approx(innovation**2 * (1 - reading.gain), rel=1e-6)
    triangle = np.zeros((3, 3))
    triangle[np.triu_indices(3)] = state[19:25]
    weight, weight2 = state[29], state[30]
    n_eff = weight**2 / weight2 * 2 * (10.0 - 0.15) / RATE_HZ
    variance = state[28] / weight * n_eff / (n_eff - 3)
    assert reading.residual_sd_nm == pytest.approx(math.sqrt(variance), rel=1e-12)
    spread = variance * weight2 / weight * RATE_HZ / (2 * (10.0 - 0.15))
    expected = np.sqrt(spread * np.diag(np.linalg.inv(triangle.T @ triangle)))
    np.testing.assert_allclose(reading[1:6:2], expected, rtol=1e-8)


def test_before_anything_was_seen_nothing_is_claimed():
    design = online_design(SETTINGS, RATE_HZ)
    state = [0.0] * STATE_SIZE
    assert math.isnan(online_step(design, state, 0.1, 0.2, 0.0))
    reading = online_reading(design, state, RATE_HZ)
    assert math.isnan(reading.inertia_kg_m2)
    assert math.isinf(reading.stiffness_nm_rad_se)
    reading = online_reading(design, np.zeros(STATE_SIZE), RATE_HZ)
    assert math.isnan(reading.inertia_kg_m2)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_sample_that_is_not_a_number_is_passed_over(bad):
    _, x, v, a = sines(3.0)
    torque = TRUTH @ np.array([a, v, x])
    design, state, _ = run(torque, x, v)
    before = list(state)
    assert math.isnan(online_step(design, state, bad, 0.0, 0.0))
    assert math.isnan(online_step(design, state, 0.0, bad, 0.0))
    assert math.isnan(online_step(design, state, 0.0, 0.0, -bad))
    assert state == before


def test_a_band_beyond_half_the_rate_is_refused():
    with pytest.raises(ValueError, match="below half the rate"):
        online_design(SETTINGS, 20.0)


def test_over_a_virtual_session_it_comes_to_the_joint(simulate):
    (epoch,), _ = read_session(simulate(rig={}))
    motion = epoch.channels["angle_rad"].time_s
    torque = np.interp(
        motion, *(getattr(epoch.channels["torque_nm"], n) for n in ("time_s", "values"))
    )
    design, state, _ = run(
        torque, epoch.channels["angle_rad"].values, epoch.channels["velocity_rad_s"].values
    )
    reading = online_reading(design, state, RATE_HZ)
    assert reading.inertia_kg_m2 == pytest.approx(TRUTH[0], rel=0.03)
    assert reading.damping_nm_s_rad == pytest.approx(TRUTH[1], rel=0.02)
    assert reading.stiffness_nm_rad == pytest.approx(TRUTH[2], rel=0.01)
    assert reading.residual_sd_nm < 0.005
