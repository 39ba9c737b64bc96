"""Predicted standard errors against least squares in time."""

import numpy as np
import pytest
from scipy.signal import butter, freqs

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import closed_loop_motion, median_joint, sensor_density
from rigidimeter.planning import expected_record, prbs_nm, predicted_precision
from rigidimeter.virtual import PAPER_RATES

RATE_HZ = 1000.0


def predict(settings: Settings):
    perturbation = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
    return predicted_precision(perturbation, settings, settings.subject["OFF"])


def samples(settings: Settings) -> np.ndarray:
    """Return θ'', v and θ at the stamps of the torque, one row a sample."""
    perturbation = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
    motion = closed_loop_motion(perturbation, settings, median_joint(settings.subject["OFF"]))
    return expected_record(motion, settings.rig).motion.T


@pytest.mark.parametrize("rig", [{}, PAPER_RATES])
def test_in_white_noise_the_bound_is_that_of_least_squares_in_time(rig: dict) -> None:
    settings = parse_settings({"rig": rig})
    Z = samples(settings)
    sensor = settings.rig.torque
    variance = sensor_density(sensor) * sensor.rate_hz
    found = predict(settings)
    expected = np.sqrt(variance * np.diag(np.linalg.inv(Z.T @ Z)))
    np.testing.assert_allclose(found.bound.free, expected, rtol=1e-6)
    fixed = np.sqrt(variance * np.diag(np.linalg.inv(Z[:, 1:].T @ Z[:, 1:])))
    np.testing.assert_allclose(found.bound.fixed_inertia, fixed, rtol=1e-6)
    # The tapers, the steady torque and what is above the band are all that `iv` does without.
    np.testing.assert_allclose(found.iv.free, expected, rtol=0.15)


def test_least_squares_of_a_passive_arm_is_least_squares_in_the_band() -> None:
    settings = Settings()
    perturbation = prbs_nm(settings.prbs, RATE_HZ)
    motion = closed_loop_motion(perturbation, settings, median_joint(settings.subject["OFF"]))
    columns = (motion.acceleration_rad_s2, motion.velocity_rad_s, motion.angle_rad)
    lines = np.fft.rfft(np.column_stack(columns)[1000:-1000], axis=0)
    omega = 2 * np.pi * np.fft.rfftfreq(perturbation.size - 2000, 1 / RATE_HZ)
    band = [
        np.abs(freqs(*butter(order, 2 * np.pi * edge, kind, analog=True), omega)[1])
        for order, edge, kind in ((2, 0.15, "high"), (4, 10.0, "low"))
    ]
    gain = (band[0] * band[1]) ** 2  # forwards and backwards
    once, twice = (
        np.fft.irfft(lines * gain[:, None] ** n, perturbation.size - 2000, axis=0) for n in (1, 2)
    )
    variance = sensor_density(settings.rig.torque) * RATE_HZ
    # The filtered motion on the filtered noise is the motion, filtered twice, on the noise.
    inverse = np.linalg.inv(once.T @ once)
    expected = np.sqrt(variance * np.diag(inverse @ twice.T @ twice @ inverse))
    found = predict(settings)
    assert found.least_squares_band_hz == (0.15, 10.0)
    np.testing.assert_allclose(found.least_squares.free, expected, rtol=1e-6)


def test_a_band_has_the_lines_of_the_estimation() -> None:
    assert predict(Settings()).iv_band_hz == pytest.approx((0.1016, 29.97), rel=1e-3)
    wide = {"band_high_closed_loop_hz": 50.0}
    paper = parse_settings({"rig": PAPER_RATES, "estimation": wide})
    assert predict(paper).iv_band_hz[1] == pytest.approx(40, abs=0.1)
    assert predict(parse_settings({"rig": PAPER_RATES})).least_squares_band_hz == (0.15, 10.0)
    narrow = predict(parse_settings({"estimation": {"band_high_closed_loop_hz": 10.0}}))
    assert narrow.iv_band_hz[1] == pytest.approx(10.0, abs=0.05)
    assert np.all(np.array(narrow.iv.free) > predict(Settings()).iv.free)


def test_errors_scale_as_they_must() -> None:
    base = predict(Settings())
    twice = predict(parse_settings({"prbs": {"amplitude_nm": 2.0}}))
    noisier = predict(
        parse_settings({"rig": {"torque": {"noise_sd_nm": 0.01, "resolution_nm": 0.001}}})
    )
    for which in ("bound", "iv", "least_squares"):
        own = np.array(getattr(base, which).free)
        np.testing.assert_allclose(getattr(twice, which).free, own / 2, rtol=1e-9)
        np.testing.assert_allclose(getattr(noisier, which).free, own * 2, rtol=1e-9)
        assert np.all(np.array(getattr(base, which).fixed_inertia) <= own[1:] * (1 + 1e-9))
    longer = predict(parse_settings({"prbs": {"duration_s": 80.0}}))
    ratio = np.array(base.iv.free) / longer.iv.free
    np.testing.assert_allclose(ratio, np.sqrt(79.0 / 19.0), rtol=0.1)


@pytest.mark.parametrize("rig", [{}, PAPER_RATES])
@pytest.mark.parametrize("voluntary_sd_nm", [0.0, 0.01, 0.2, 1.0])
def test_the_bound_is_a_bound(rig: dict, voluntary_sd_nm: float) -> None:
    subject = {"OFF": {"voluntary_sd_nm": voluntary_sd_nm}}
    found = predict(parse_settings({"rig": rig, "subject": subject}))
    assert np.all(np.array(found.bound.free) < found.iv.free)
    assert np.all(np.array(found.bound.fixed_inertia) < found.iv.fixed_inertia)
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), found.iv.free)


def test_lines_are_weighed_by_their_noise() -> None:
    """J is read above the voluntary torque and hardly minds it; K is read beside it."""
    wide = {"band_high_closed_loop_hz": 50.0}
    quiet = predict(parse_settings({"estimation": wide}))
    moved = predict(
        parse_settings({"estimation": wide, "subject": {"OFF": {"voluntary_sd_nm": 0.2}}})
    )
    J, B, K = np.array(moved.iv.free) / quiet.iv.free
    assert J < 20 < 70 < B < K
    # A band below which nothing is pushed leaves K as it was.
    high = {"voluntary_sd_nm": 0.2, "voluntary_low_hz": 3.0, "voluntary_high_hz": 4.0}
    above = predict(parse_settings({"subject": {"OFF": high}}))
    assert above.iv.free[2] < 0.25 * moved.iv.free[2]


def test_voluntary_torque_leaves_least_squares_exact_and_wrong() -> None:
    settings = parse_settings({"subject": {"OFF": {"voluntary_sd_nm": 0.2}}})
    quiet, moved = predict(Settings()), predict(settings)
    np.testing.assert_allclose(moved.least_squares.free, quiet.least_squares.free)
    assert quiet.least_squares_bias == (0.0, 0.0, 0.0)
    # A subject who pushes looks less rigid to least squares.
    off = np.array(moved.least_squares_bias) / moved.values
    assert off[0] == pytest.approx(-0.43, abs=0.02)
    assert off[1] == pytest.approx(-0.69, abs=0.02)


def test_no_noise_no_error(noiseless) -> None:
    found = predict(noiseless())
    assert found.bound.free == found.iv.free == (0.0, 0.0, 0.0)
    assert found.bound.fixed_inertia == (0.0, 0.0)
    assert not np.any(found.covariance)
    pushed = predict(noiseless(subject={"OFF": {"voluntary_sd_nm": 0.2}}))
    assert pushed.bound.free == (0.0, 0.0, 0.0)  # at 0 Hz nothing hides the joint
    assert min(pushed.iv.free) > 0.0


def test_what_cannot_be_predicted_is_said() -> None:
    with pytest.raises(UserError, match=r"estimation\.trim_s = 1 s at either end leaves nothing"):
        predict(parse_settings({"prbs": {"duration_s": 2.0}}))
    narrow = {"band_high_closed_loop_hz": 0.2}
    with pytest.raises(UserError, match=r"the band 0\.15 to 0\.2 Hz holds 2 lines"):
        predict(parse_settings({"estimation": narrow}))
