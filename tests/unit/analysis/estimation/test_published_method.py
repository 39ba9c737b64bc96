"""Eq. 6 as printed, row by row."""

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
