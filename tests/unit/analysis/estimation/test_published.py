"""Eq. 6 as printed, and least squares that says what it cannot tell apart."""

import numpy as np
import pytest
from scipy import signal, stats

from rigidimeter.analysis.estimation import (
    Ready,
    Signals,
    epoch_signals,
    fit_inertia_damping_stiffness,
    method_named,
)
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import Settings

RNG = np.random.default_rng(0)
MOTION = RNG.normal(size=(500, 3)) @ np.diag([30.0, 1.0, 0.1])
TORQUE = MOTION @ [0.0045, 0.1368, 1.751] + 0.01 * RNG.normal(size=500)


def signals(motion=MOTION, torque=TORQUE):
    return Signals(np.arange(500) / 100.0, torque, *motion.T, 100.0, (0.0, 50.0))


def test_it_is_least_squares_with_textbook_errors():
    fit = fit_inertia_damping_stiffness(signals())
    values, (rest,), *_ = np.linalg.lstsq(MOTION, TORQUE, rcond=None)
    se = np.sqrt(rest / 497 * np.diag(np.linalg.inv(MOTION.T @ MOTION)))
    assert fit.value == pytest.approx(values, rel=1e-10)
    assert fit.se == pytest.approx(se, rel=1e-10)
    assert fit.high - fit.value == pytest.approx(stats.t.ppf(0.975, 497) * se, rel=1e-10)
    assert fit.bound == pytest.approx(se, rel=0.1)  # white noise leaves nothing to weights
    held = fit_inertia_damping_stiffness(signals(), 0.0045)
    assert (held.inertia_kg_m2, held.inertia_kg_m2_se) == (0.0045, 0.0)


def test_what_the_motion_cannot_tell_apart_is_not_fitted():
    alike = MOTION.copy()
    alike[:, 2] = -2.0 * alike[:, 0]
    with pytest.raises(ValueError, match="linearly dependent"):
        fit_inertia_damping_stiffness(signals(alike))


def test_the_published_method_is_eq_6_row_by_row():
    t = np.arange(2000) / 100.0
    v = signal.lfilter([1.0], [1.0, -0.8], RNG.normal(size=2000))
    torque = 0.1 * v + 0.01 * RNG.normal(size=2000)
    channels = {"torque_nm": torque, "velocity_command_rad_s": v, "velocity_rad_s": -v}
    epoch = Epoch("file", "1", {name: Channel(name, t, x) for name, x in channels.items()})
    position = np.concatenate(([0.0], np.cumsum(v[1:]) / 100.0))
    highpass = signal.butter(2, 0.2, "highpass", fs=100.0, output="sos")
    rows = np.column_stack([np.diff(v) * 100.0, v[:-1], signal.sosfilt(highpass, position)[:-1]])
    fit_published = method_named("published").fit
    fit = fit_published([Ready(epoch, Settings())])
    expected = np.linalg.lstsq(rows, torque[:-1], rcond=None)[0]
    assert fit.value == pytest.approx(expected, rel=1e-8, abs=1e-9)
    assert fit.n_samples == 1999
    np.testing.assert_allclose(epoch_signals(epoch, Settings(), "published").motion, rows)
    with pytest.raises(ValueError, match="torque_nm was not recorded"):
        epoch_signals(Epoch("file", "1", {}), Settings(), "iv")
    twice = fit_published([Ready(epoch, Settings())] * 2)
    assert twice.value == pytest.approx(fit.value, rel=1e-9, abs=1e-9)
    assert twice.angle_rms_rad == pytest.approx(fit.angle_rms_rad)
