"""The record an epoch will leave: stamps, motion at them, and the noise of its samples."""

import numpy as np
import pytest

from rigidimeter.cli.simulate import PAPER_RATES
from rigidimeter.dynamics import SubjectTorque, closed_loop_motion, median_joint, subject_density
from rigidimeter.experiment import prbs_nm
from rigidimeter.experiment.predicted_record import (
    expected_record,
    noise_covariance,
    noise_spectrum,
)
from rigidimeter.settings import RigSettings, Settings, SubjectSettings, parse_settings
from rigidimeter.virtual.batch import simulate_epochs

PUSHING = SubjectSettings(voluntary_sd_nm=0.2, tremor_amplitude_nm=0.1)


def expected(settings: Settings):
    torque_nm = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
    joint = median_joint(settings.subject["OFF"])
    return expected_record(closed_loop_motion(torque_nm, settings, joint), settings.rig)


@pytest.mark.parametrize(
    "rig",
    [
        {},
        PAPER_RATES,
        {"torque": {"rate_hz": 250.0, "latency_s": 0.0, "stamp_latency_s": 0.0}},
        {"torque": {"latency_s": 0.0045, "stamp_latency_s": 0.0045}},
    ],
)
def test_it_holds_the_samples_that_a_session_will_have(rig: dict) -> None:
    settings = parse_settings({"rig": rig})
    epoch = simulate_epochs(settings, 1, seed=3).epoch(0)
    torque, angle = epoch.channels["torque_nm"], epoch.channels["angle_rad"]
    both = (torque.time_s >= -1e-9) & (torque.time_s <= angle.time_s[-1] + 1e-9)
    found = expected(settings)
    assert found.rate_hz == pytest.approx(torque.rate_hz)
    assert found.motion.shape == (3, np.count_nonzero(both))


def test_it_is_the_motion_at_the_stamps() -> None:
    """The torque of a passive arm without noise is J θ'' + B v + K θ at its own stamps."""
    quiet = {"noise_sd_nm": 0.0, "resolution_nm": 0.0, "rate_hz": 100.0}
    settings = parse_settings({"rig": {"torque": quiet}})
    epoch = simulate_epochs(settings, 1, seed=3).epoch(0)
    torque = epoch.channels["torque_nm"]
    inside = torque.time_s >= 0.0
    joint = median_joint(settings.subject["OFF"])
    parameters = [joint.inertia_kg_m2, joint.damping_nm_s_rad, joint.stiffness_nm_rad]
    found = parameters @ expected(settings).motion
    measured = torque.values[inside][: found.size]
    # Not to the bit: the design takes the mean over the phases of a slow sensor.
    assert np.std(found - measured) < 0.01 * np.std(measured)


def test_its_noise_is_that_of_the_virtual_subject_and_sensor() -> None:
    """From 2000 s: the autocovariance up to 3 s is known to a few percent of the variance."""
    rig = RigSettings.model_validate({"torque": {"rate_hz": 100.0, "noise_sd_nm": 0.05}})
    rng = np.random.default_rng(8)
    own = SubjectTorque(PUSHING, 1000.0, rng).block(2_000_000)[::10]
    noise = own + rng.normal(0.0, 0.05, own.size)
    found = noise_covariance(rig, PUSHING, 301)
    measured = [np.mean(noise[: noise.size - k] * noise[k:]) for k in range(301)]
    np.testing.assert_allclose(measured, found, atol=0.06 * found[0])
    assert found[0] == pytest.approx(0.04 + 0.005 + 0.0025, rel=0.01)
    assert found[0] - found[1] > 0.0025  # white noise is in the first lag alone


def test_covariance_and_folded_spectrum_are_a_pair() -> None:
    """Σ r(k) e^(−iωk), for a torque so slow that its samples fold the voluntary torque."""
    rig = RigSettings.model_validate({"torque": {"rate_hz": 10.0}})
    subject = SubjectSettings(voluntary_sd_nm=0.2, voluntary_low_hz=1.0, voluntary_high_hz=6.0)
    half = 400
    lags = noise_covariance(rig, subject, half + 1)
    spectrum = np.fft.rfft(np.concatenate([lags, lags[half - 1 : 0 : -1]])).real
    frequency = np.fft.rfftfreq(2 * half, 0.1)
    found = noise_spectrum(rig, subject, frequency)
    np.testing.assert_allclose(found, spectrum, rtol=1e-3, atol=1e-4 * found.max())
    unfolded = 10.0 * subject_density(subject, frequency, 1000.0)
    assert np.all(found[-100:] > 1.4 * unfolded[-100:])


def test_without_noise_there_is_none() -> None:
    rig = RigSettings.model_validate({"torque": {"noise_sd_nm": 0.0, "resolution_nm": 0.0}})
    assert not np.any(noise_covariance(rig, SubjectSettings(), 10))
    assert not np.any(noise_spectrum(rig, SubjectSettings(), np.linspace(0.0, 500.0, 11)))


def test_few_lags_are_as_exact_as_many() -> None:
    rig = RigSettings()
    many = noise_covariance(rig, PUSHING, 5000)
    for lags in (1, 20, 1000):
        np.testing.assert_allclose(
            noise_covariance(rig, PUSHING, lags), many[:lags], atol=1e-4 * many[0]
        )
