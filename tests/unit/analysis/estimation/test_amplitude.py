"""How far the joint moved stands beside every K."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation import fit_epoch, fit_epochs
from rigidimeter.core.records import Channel, Epoch, LeftOut
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.core.units import rad_from_deg
from rigidimeter.virtual.batch import simulate_epochs

SETTINGS = Settings()
A = rad_from_deg(5.0)


def swinging(amplitude_rad, *, sway_rad=0.0, label="1", duration_s=20.0):
    """A sine of 2 Hz, with others a thousand times smaller that tell J, B and K apart.

    The sway goes to and fro once.
    """
    time_s = np.arange(round(500 * duration_s)) / 500
    small = 1e-3 * amplitude_rad
    parts = [(2.0, amplitude_rad), (1.1, small), (5.3, small), (9.7, small)]
    w, a = np.array(parts).T
    w, phase = 2 * np.pi * w, np.outer(time_s, 2 * np.pi * w)
    angle, velocity = np.sin(phase) @ a, np.cos(phase) @ (a * w)
    torque = 0.0045 * (-np.sin(phase) @ (a * w**2)) + 0.137 * velocity + 1.75 * angle
    angle = angle + sway_rad * np.sin(np.pi * time_s / duration_s) ** 2
    values = {"torque_nm": torque, "angle_rad": angle, "velocity_rad_s": velocity}
    channels = {name: Channel(name, time_s, value) for name, value in values.items()}
    return Epoch("made", label, channels, task="prbs")


@pytest.mark.parametrize("method", ["bandlimited", "published"])
def test_a_sine_has_its_amplitude_over_root_two_and_twice_its_amplitude(method):
    fit = fit_epoch(swinging(A), method, SETTINGS)
    assert fit.angle_rms_rad == pytest.approx(A / math.sqrt(2), rel=0.01)
    assert fit.angle_range_rad == pytest.approx(2 * A, rel=0.01)


def test_what_is_below_the_band_is_in_the_range_alone():
    fit = fit_epoch(swinging(A, sway_rad=2 * A, duration_s=60.0), "bandlimited", SETTINGS)
    assert fit.angle_rms_rad == pytest.approx(A / math.sqrt(2), rel=0.01)
    assert fit.angle_range_rad == pytest.approx(4 * A, rel=0.01)


@pytest.mark.parametrize("method", ["bandlimited", "published"])
def test_epochs_together_have_the_rms_of_all_samples_and_the_largest_range(method):
    epochs = [swinging(A), swinging(3 * A, label="2")]
    fits, (together,) = fit_epochs(epochs, method, SETTINGS)
    assert all(fit.outcome.included for fit in fits)
    assert together.angle_rms_rad == pytest.approx(A * math.sqrt((1 + 9) / 4), rel=0.01)
    assert together.angle_range_rad == fits[1].angle_range_rad


def test_the_range_needs_a_measured_angle():
    epoch = swinging(A)
    del epoch.channels["angle_rad"]
    fit = fit_epoch(epoch, "bandlimited", SETTINGS)
    assert fit.angle_rms_rad == pytest.approx(A / math.sqrt(2), rel=0.01)
    assert math.isnan(fit.angle_range_rad)


@pytest.mark.parametrize("method", ["bandlimited", "published"])
def test_a_stretch_that_is_left_out_does_not_count(method):
    epoch = swinging(A)
    angle = epoch.channels["angle_rad"]
    away = (angle.time_s > 8.0) & (angle.time_s < 8.5)
    jumped = Channel("angle_rad", angle.time_s, np.where(away, 10 * A, angle.values))
    out = replace(
        epoch,
        channels={**epoch.channels, "angle_rad": jumped},
        left_out=(LeftOut(7.9, 8.6, "the angle jumped"),),
    )
    fit = fit_epoch(out, method, SETTINGS)
    assert fit.angle_range_rad == pytest.approx(2 * A, rel=0.01)


def test_the_method_of_the_perturbation_has_the_sd_of_the_angle(simulated_epoch):
    settings, epoch = simulated_epoch
    fit = fit_epoch(epoch, "iv", settings)
    angle = epoch.channels["angle_rad"].values
    assert fit.angle_rms_rad == pytest.approx(np.std(angle), rel=0.1)
    assert fit.angle_range_rad == pytest.approx(np.ptp(angle), rel=0.1)


@pytest.fixture
def simulated_epoch():
    settings = parse_settings({"subject": {"OFF": {"voluntary_sd_nm": 0.0}}})
    return settings, simulate_epochs(settings, 1, conditions="OFF", seed=2).epoch(0)
