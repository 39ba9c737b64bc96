"""The weighted lines of `iv` against matrices, in noise of any colour."""

import numpy as np
import pytest
from scipy.linalg import toeplitz

from rigidimeter.dynamics import closed_loop_motion, median_joint
from rigidimeter.errors import UserError
from rigidimeter.experiment import prbs_nm
from rigidimeter.experiment.predicted_record import Record, expected_record, noise_covariance
from rigidimeter.experiment.weighted_lines import layout, weighted_products
from rigidimeter.settings import EstimationSettings, Settings, parse_settings

COARSE = {"tick_rate_hz": 250.0, "torque": {"rate_hz": 125.0}, "motion": {"rate_hz": 250.0}}


def recorded(settings: Settings) -> Record:
    torque_nm = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
    joint = median_joint(settings.subject["OFF"])
    return expected_record(closed_loop_motion(torque_nm, settings, joint), settings.rig)


@pytest.mark.parametrize("voluntary_sd_nm", [0.0, 0.2])
@pytest.mark.parametrize("trim_s", [0.0, 1.0])
def test_the_products_are_those_of_matrices(voluntary_sd_nm: float, trim_s: float) -> None:
    """p = A⁻¹ Re(Uᴴ F Y) with F the windowed Fourier matrix has the covariance A⁻¹ Q A⁻¹."""
    settings = parse_settings(
        {
            "rig": {**COARSE, "drive_bandwidth_hz": 40.0},
            "prbs": {"duration_s": 8.0},
            "estimation": {"trim_s": trim_s},
            "subject": {"OFF": {"voluntary_sd_nm": voluntary_sd_nm}},
        }
    )
    record, subject = recorded(settings), settings.subject["OFF"]
    lines = layout(record, settings.estimation)
    n = lines.window.size
    turn = np.exp(-2j * np.pi * np.outer(lines.line, np.arange(n)) / n)
    F = turn * lines.window
    C = toeplitz(noise_covariance(settings.rig, subject, n))
    S = np.real(np.einsum("ij,jk,ik->i", F, C, F.conj()))
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
    record = recorded(settings)
    lines = layout(record, settings.estimation)
    A, Q = weighted_products(record, settings.rig, settings.subject["OFF"], lines)
    np.testing.assert_allclose(Q, A / 2, rtol=1e-9, atol=1e-12 * np.abs(A).max())


def test_the_window_rises_and_falls_over_the_trimming() -> None:
    lines = layout(Record(100.0, np.zeros((3, 1010))), EstimationSettings(trim_s=1.0))
    assert lines.window.size == 1000  # 2³ 5³, the next fast length below
    np.testing.assert_allclose(lines.window, lines.window[::-1])
    assert lines.window[50] == pytest.approx(0.5, abs=0.01)
    assert np.all(lines.window[100:900] == 1.0)
    assert lines.window[0] < 1e-3


def test_the_lines_begin_one_below_the_band_and_end_with_the_torque() -> None:
    record = Record(100.0, np.zeros((3, 2000)))  # lines every 0.05 Hz
    lines = layout(record, EstimationSettings(band_high_closed_loop_hz=50.0))
    assert lines.band_hz == (pytest.approx(0.1), pytest.approx(40.0))
    assert layout(record, EstimationSettings(), (2.0, 3.0)).band_hz == (1.95, 3.0)
    with pytest.raises(UserError, match=r"the band 2 to 2\.2 Hz holds 6 lines of an epoch of 20 s"):
        layout(record, EstimationSettings(), (2.0, 2.2))
