import math

import numpy as np
import pytest
from scipy import signal

from rigidimeter.analysis.estimation import band_hz, epoch_signals, fit_epoch
from rigidimeter.core.records import Channel, Epoch, Outcome
from rigidimeter.core.settings import Settings
from rigidimeter.model import JointDynamics

SETTINGS = Settings()
JOINT = JointDynamics(0.0175, 1.25, 103.0)


def moving_epoch(joint=JOINT, rate_hz=500.0, duration_s=20.0, seed=0, closed=None, **changes):
    """An imposed broad-band motion and the torque of Eq. 3, both exact: a sum of sinusoids."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(duration_s * rate_hz)) / rate_hz
    f = np.arange(0.2, 40.0, 0.35)
    amplitude = 0.02 / (1 + (f / 5.0) ** 2)
    phase = rng.uniform(0, 2 * np.pi, f.size)
    w = 2 * np.pi * f
    x = amplitude @ np.sin(np.outer(w, t) + phase[:, None])
    v = (amplitude * w) @ np.cos(np.outer(w, t) + phase[:, None])
    a = -(amplitude * w**2) @ np.sin(np.outer(w, t) + phase[:, None])
    channels = {
        "torque_nm": Channel("torque_nm", t, joint.torque_nm(x, v, a)),
        "angle_rad": Channel("angle_rad", t, x),
    } | changes
    return Epoch("file", "1", channels, closed=closed or Outcome())


def test_an_exact_recording_of_angle_and_torque_gives_the_joint_back():
    fit = fit_epoch(moving_epoch(), "bandlimited", SETTINGS)
    assert fit.outcome.included
    assert fit.inertia_kg_m2 == pytest.approx(0.0175, rel=2e-3)
    assert fit.damping_nm_s_rad == pytest.approx(1.25, rel=2e-3)
    assert fit.stiffness_nm_rad == pytest.approx(103.0, rel=2e-3)
    assert fit.vaf_percent > 99.99


def test_an_epoch_of_the_least_length_is_fitted_whatever_the_sampling_rate():
    """Its last sample begins one interval before its end; half a second less is too short."""
    for rate_hz in (125.0, 1000.0):
        assert fit_epoch(
            moving_epoch(rate_hz=rate_hz, duration_s=5.0), "bandlimited", SETTINGS
        ).outcome.included
    short = fit_epoch(moving_epoch(duration_s=4.5), "bandlimited", SETTINGS)
    assert "is 4.5 s long; at least 5 s are needed" in short.outcome.reason


def test_filtering_the_position_alone_is_what_biases_the_published_stiffness():
    published = fit_epoch(moving_epoch(), "published", SETTINGS)
    alike = fit_epoch(moving_epoch(), "bandlimited", SETTINGS)
    assert abs(published.stiffness_nm_rad / 103.0 - 1) > 10 * abs(alike.stiffness_nm_rad / 103 - 1)


def test_the_second_stage_holds_the_inertia():
    fit = fit_epoch(moving_epoch(), "bandlimited", SETTINGS, inertia_kg_m2=0.02)
    assert fit.inertia_kg_m2 == 0.02
    assert fit.inertia_kg_m2_se == 0.0


def test_the_band_follows_what_is_known_of_the_perturbation():
    epoch = moving_epoch()
    assert band_hz(epoch, SETTINGS.estimation) == (0.15, 50.0)
    slow = moving_epoch(rate_hz=100.0)
    assert band_hz(slow, SETTINGS.estimation)[1] == pytest.approx(40.0)
    t = epoch.channels["torque_nm"].time_s
    known = moving_epoch(perturbation_nm=Channel("perturbation_nm", t, np.sign(np.sin(9 * t))))
    assert band_hz(known, SETTINGS.estimation) == (0.15, 10.0)


def test_edges_are_trimmed_after_filtering():
    signals = epoch_signals(moving_epoch(), "bandlimited", SETTINGS.estimation)
    assert signals.time_s[0] == pytest.approx(1.0)
    assert signals.time_s[-1] == pytest.approx(18.998, abs=0.01)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t, n: {"torque_nm": Channel("torque_nm", t, np.full(n, 0.3))}, "is constant"),
        (lambda t, n: {"angle_rad": Channel("angle_rad", t, np.zeros(n))}, "is constant"),
        (lambda t, n: {"torque_nm": Channel("torque_nm", t[:500], np.sin(t[:500]))}, "overlap for"),
        (
            lambda t, n: {"torque_nm": Channel("torque_nm", t, np.where(t > 3, np.nan, t))},
            "finite numbers",
        ),
        (
            lambda t, n: {
                "velocity_command_rad_s": Channel(
                    "velocity_command_rad_s", t, np.where(t > 3, np.inf, t)
                )
            },
            "velocity_command_rad_s is inf",
        ),
    ],
)
def test_an_epoch_that_cannot_be_fitted_says_why(change, words):
    t = moving_epoch().channels["torque_nm"].time_s
    fit = fit_epoch(moving_epoch(**change(t, t.size)), "bandlimited", SETTINGS)
    assert fit.outcome.kind == "failed"
    assert words in fit.outcome.reason
    assert math.isnan(fit.inertia_kg_m2)


def test_an_epoch_that_touched_a_limit_is_excluded_by_name_with_its_numbers():
    closed = Outcome("excluded", "the arm came to the position limit")
    fit = fit_epoch(moving_epoch(closed=closed), "bandlimited", SETTINGS)
    assert fit.outcome == closed
    assert fit.stiffness_nm_rad == pytest.approx(103.0, rel=0.01)


def test_r_squared_below_zero_excludes():
    # A torque that answers a stiffer joint at low frequency than the held inertia allows.
    fit = fit_epoch(moving_epoch(), "bandlimited", SETTINGS, inertia_kg_m2=3.0)
    assert fit.r_squared < 0
    assert fit.outcome.kind == "excluded"
    assert "R² is" in fit.outcome.reason


def test_a_single_frequency_is_excluded_with_the_reason():
    t = np.arange(10_000) / 500.0
    x = 0.3 * np.sin(2 * np.pi * t)
    noise = signal.sosfilt(
        signal.butter(2, 5.0, fs=500.0, output="sos"),
        np.random.default_rng(0).standard_normal(t.size),
    )
    channels = {
        "torque_nm": Channel("torque_nm", t, x + 0.01 * noise),
        "angle_rad": Channel("angle_rad", t, x + 1e-5 * noise),
    }
    fit = fit_epoch(Epoch("file", "1", channels), "bandlimited", SETTINGS)
    assert fit.outcome.kind == "excluded"
    assert "cannot distinguish J, B and K" in fit.outcome.reason
