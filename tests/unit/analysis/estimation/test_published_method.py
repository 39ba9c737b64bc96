"""Eq. 6 as printed, checked on numbers small enough to do by hand."""

import numpy as np
import pytest
from scipy import signal

from rigidimeter.analysis.estimation import fit_epoch
from rigidimeter.analysis.estimation.published_method import published_signals
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import EstimationSettings, parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.virtual.batch import simulate_epochs

SETTINGS = EstimationSettings()


def epoch(command, torque, rate_hz=100.0):
    t = np.arange(len(torque)) / rate_hz
    return Epoch(
        "file",
        "1",
        {
            "torque_nm": Channel("torque_nm", t, torque),
            "velocity_command_rad_s": Channel("velocity_command_rad_s", t, command),
        },
    )


def test_each_signal_is_the_one_the_paper_prints():
    rng = np.random.default_rng(1)
    v, torque = rng.standard_normal(50), rng.standard_normal(50)
    s = published_signals(epoch(v, torque), SETTINGS)
    dt = 0.01
    position = np.zeros(50)
    for k in range(49):
        position[k + 1] = v[k + 1] * dt + position[k]
    highpass = signal.butter(2, 0.2, "highpass", fs=100.0, output="sos")
    np.testing.assert_allclose(s.velocity_rad_s, v[:49])
    np.testing.assert_allclose(s.acceleration_rad_s2, (v[1:] - v[:-1]) / dt, rtol=1e-9)
    np.testing.assert_allclose(s.angle_rad, signal.sosfilt(highpass, position)[:49], rtol=1e-9)
    np.testing.assert_allclose(s.torque_nm, torque[:49])


def test_the_command_is_held_until_the_next():
    t = np.arange(100) / 100.0
    torque = Channel("torque_nm", t[::2] + 0.004, np.sin(t[::2]))
    command = Channel("velocity_command_rad_s", t, np.arange(100.0))
    s = published_signals(
        Epoch("file", "1", {"torque_nm": torque, "velocity_command_rad_s": command}), SETTINGS
    )
    np.testing.assert_array_equal(s.velocity_rad_s[:4], [0.0, 2.0, 4.0, 6.0])


def test_its_inertia_beside_eq_6_row_by_row():
    """A torque that is 1 ms old at its tick: J 13 % larger, B 11 % smaller, as documented."""
    settings = parse_settings({"subject": {"OFF": {"voluntary_sd_nm": 0.0}}})
    joint = JointDynamics(0.0045, 0.1368, 1.751)
    batch = simulate_epochs(settings, 1, joints=[joint], conditions="OFF")
    dt, v = 1.0 / settings.rig.tick_rate_hz, batch.velocity_command_rad_s[0]
    position = np.concatenate(([0.0], np.cumsum(v[1:]) * dt))
    highpass = signal.butter(2, 0.2, "highpass", fs=1.0 / dt, output="sos")
    rows = np.column_stack([np.diff(v) / dt, v[:-1], signal.sosfilt(highpass, position)[:-1]])
    kept = slice(round(1.0 / dt), -round(1.0 / dt))
    J, B, _ = np.linalg.lstsq(rows[kept], batch.torque_nm[0][:-1][kept], rcond=None)[0]
    found = fit_epoch(batch.epoch(0), "published", settings)
    assert found.inertia_kg_m2 / J == pytest.approx(1.13, abs=0.01)
    assert found.damping_nm_s_rad / B == pytest.approx(0.89, abs=0.01)


def test_without_a_command_the_measured_velocity_stands_in():
    t = np.arange(500) / 100.0
    channels = {
        "torque_nm": Channel("torque_nm", t, np.cos(t)),
        "velocity_rad_s": Channel("velocity_rad_s", t, np.sin(3 * t)),
    }
    s = published_signals(Epoch("file", "1", channels), SETTINGS)
    np.testing.assert_allclose(s.velocity_rad_s, np.sin(3 * t)[:499], atol=1e-12)


def test_the_rate_is_that_of_the_torque():
    s = published_signals(epoch(np.ones(50), np.ones(50), 250.0), SETTINGS)
    assert s.rate_hz == pytest.approx(250.0)
