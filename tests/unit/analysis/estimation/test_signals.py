"""Samples brought together and filtered alike."""

import numpy as np
import pytest
from scipy import signal

from rigidimeter.analysis.estimation import epoch_signals, zero_phase_band
from rigidimeter.core.records import Channel, Epoch, LeftOut
from rigidimeter.core.settings import parse_settings
from rigidimeter.model import JointDynamics

W = 2 * np.pi * 1.3
WIDE = parse_settings({"estimation": {"band_high_unknown_hz": 20.0}})


def sine(rate_hz, jitter_s=0.0):
    t = np.arange(round(40 * rate_hz)) / rate_hz
    t = t + np.random.default_rng(0).uniform(0, jitter_s, t.size)
    return t, np.sin(W * t), W * np.cos(W * t)


def epoch(left_out=(), **channels):
    made = {name: Channel(name, *both) for name, both in channels.items()}
    return Epoch("file", "1", made, left_out=left_out)


def found_in(made, settings=WIDE):
    return epoch_signals(made, settings, "bandlimited")


def of_motion(made):
    """Return motion and torque, a sine, far from the ends, where the filter has settled."""
    found = found_in(made)
    inner = slice(len(found.torque_nm) // 3, 2 * len(found.torque_nm) // 3)
    slope = np.gradient(found.torque_nm, found.time_s)[inner]
    x = found.torque_nm[inner]
    return found.motion[inner], np.column_stack([-(W**2) * x, slope, x])


@pytest.mark.parametrize("motion", ["angle_rad", "velocity_rad_s"])
def test_derivatives_and_integrals_are_those_of_the_signal(motion):
    t, x, v = sine(1000.0)
    recorded = {"angle_rad": (t, x), "velocity_rad_s": (t, v)}[motion]
    found, true = of_motion(epoch(torque_nm=(t, x), **{motion: recorded}))
    np.testing.assert_allclose(found, true, atol=1e-3)


def test_jittered_stamps_are_read_as_they_are():
    t, x, _ = sine(1000.0)
    at, _, jittered = sine(50.0, jitter_s=0.005)
    found, true = of_motion(epoch(torque_nm=(t, x), velocity_rad_s=(at, jittered)))
    np.testing.assert_allclose(found[:, 1], true[:, 1], atol=W * 1e-3)


def test_the_grid_is_where_all_channels_are():
    rng = np.random.default_rng(4)
    early, late = np.arange(0.0, 10.0, 0.01), np.arange(0.5, 12.0, 0.02)
    noise = {"torque_nm": early, "angle_rad": late}
    found = found_in(epoch(**{n: (t, rng.standard_normal(t.size)) for n, t in noise.items()}))
    trimmed_s = WIDE.estimation.trim_s
    assert found.time_s[[0, -1]] == pytest.approx([0.5 + trimmed_s, 9.99 - trimmed_s], abs=0.01)


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
    t, dt = np.arange(8000) / 200.0, 1 / 200.0
    x = signal.sosfiltfilt(signal.butter(4, 5.0, fs=200.0, output="sos"), rng.normal(size=8000))
    v = np.gradient(x, dt, edge_order=2)
    torque = joint.torque_nm(x, v, np.gradient(v, dt, edge_order=2))
    made = epoch((LeftOut(8.0, 9.0),), torque_nm=(t, torque), angle_rad=(t, x))
    found = found_in(made, parse_settings({}))
    assert found.time_s.size / found.rate_hz == pytest.approx(40 - 2 - 3, abs=0.02)
    left = np.std(found.motion @ np.array([0.0045, 0.1368, 1.751]) - found.torque_nm)
    assert left < 0.02 * np.std(found.torque_nm)
