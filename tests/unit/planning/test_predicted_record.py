"""The record an epoch will leave, its noise, and the lines of `iv` against matrices."""

import numpy as np
import pytest
from scipy.linalg import toeplitz

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import (
    EstimationSettings,
    RigSettings,
    Settings,
    SubjectSettings,
    parse_settings,
)
from rigidimeter.model import SubjectTorque, closed_loop_motion, median_joint, subject_density
from rigidimeter.planning import (
    PredictedRecord,
    expected_record,
    layout,
    noise_covariance,
    noise_spectrum,
    prbs_nm,
    weighted_products,
)
from rigidimeter.virtual import PAPER_RATES
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


COARSE = {"tick_rate_hz": 250.0, "torque": {"rate_hz": 125.0}, "motion": {"rate_hz": 250.0}}


@pytest.mark.parametrize("voluntary_sd_nm", [0.0, 0.2])
@pytest.mark.parametrize("trim_s", [0.0, 1.0])
def test_the_products_are_those_of_matrices(voluntary_sd_nm: float, trim_s: float) -> None:
    """p = A⁻¹ Re(Uᴴ F Y) with F the windowed Fourier matrix has the covariance A⁻¹ Q A⁻¹."""
    settings = parse_settings(
        {
            "rig": {**COARSE, "drive_bandwidth_hz": 40.0},
            "prbs": {"duration_s": 4.0},
            "estimation": {"trim_s": trim_s},
            "subject": {"OFF": {"voluntary_sd_nm": voluntary_sd_nm}},
        }
    )
    record, subject = expected(settings), settings.subject["OFF"]
    lines = layout(record, settings.estimation)
    n = lines.window.size
    turn = np.exp(-2j * np.pi * np.outer(lines.line, np.arange(n)) / n)
    F = turn * lines.window
    C = toeplitz(noise_covariance(settings.rig, subject, n))
    S = np.real(np.sum((F @ C) * F.conj(), axis=1))
    # Without the mean, as a projection: least squares of a constant under the window.
    centred = np.eye(n) - np.outer(np.ones(n), lines.window**2) / np.sum(lines.window**2)
    Z = F @ centred @ record.motion[:, :n].T
    U = Z / S[:, None]
    A = np.real(U.conj().T @ Z)
    linear = np.real(U.conj().T @ F)  # from the samples of ν to the right-hand side
    Q = linear @ C @ linear.T
    found = weighted_products(record, settings.rig, subject, lines)
    np.testing.assert_allclose(found[0], A, rtol=1e-6, atol=1e-9 * np.abs(A).max())
    np.testing.assert_allclose(found[1], Q, rtol=1e-6, atol=1e-9 * np.abs(Q).max())


def test_without_a_window_lines_of_white_noise_are_independent() -> None:
    """Then Q = A/2, and the covariance is (2A)⁻¹."""
    settings = parse_settings({"estimation": {"trim_s": 0.0}})
    record = expected(settings)
    lines = layout(record, settings.estimation)
    A, Q = weighted_products(record, settings.rig, settings.subject["OFF"], lines)
    np.testing.assert_allclose(Q, A / 2, rtol=1e-9, atol=1e-12 * np.abs(A).max())


def test_the_window_rises_and_falls_over_the_trimming() -> None:
    lines = layout(PredictedRecord(100.0, np.zeros((3, 1010))), EstimationSettings(trim_s=1.0))
    assert lines.window.size == 1000  # 2³ 5³, the next fast length below
    np.testing.assert_allclose(lines.window, lines.window[::-1])
    assert lines.window[50] == pytest.approx(0.5, abs=0.01)
    assert np.all(lines.window[100:900] == 1.0)
    assert lines.window[0] < 1e-3


def test_the_lines_begin_one_below_the_band_and_end_with_the_torque() -> None:
    record = PredictedRecord(100.0, np.zeros((3, 2000)))  # lines every 0.05 Hz
    lines = layout(record, EstimationSettings(band_high_closed_loop_hz=50.0))

    def band(low_hz: float, high_hz: float) -> EstimationSettings:
        return EstimationSettings(band_low_hz=low_hz, band_high_closed_loop_hz=high_hz)

    assert lines.band_hz == (pytest.approx(0.1), pytest.approx(40.0))
    assert layout(record, band(2.0, 3.0)).band_hz == (1.95, 3.0)
    with pytest.raises(UserError, match=r"the band 2 to 2\.2 Hz holds 6 lines of an epoch of 20 s"):
        layout(record, band(2.0, 2.2))
