"""How the estimate changes with the band: exactly, with its own error, and by chance."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from rigidimeter.analysis.estimation.closedloop.band_sensitivity import Member, band_changes
from rigidimeter.analysis.estimation.closedloop.spectral_lines import Lines, epoch_grid
from rigidimeter.core.records import Channel, Epoch

TIME_S = np.arange(2000) / 100.0
TRUTH = np.array([0.0045, 0.1368, 1.751])
FIT_HZ, WIDE_HZ = (0.15, 20.0), (0.075, 28.0)


def grid(band_hz):
    channels = {n: Channel(n, TIME_S, np.zeros(2000)) for n in ("torque_nm", "angle_rad")}
    return epoch_grid(Epoch("made", "1", channels), band_hz, 1.0)


def noise(rng, size):
    return rng.standard_normal(size) + 1j * rng.standard_normal(size)


def member(rng, sd_nm=1.0, missing_nm_s=0.0, truth=TRUTH):
    """Return lines of a joint, white noise on its torque; what is missing grows with frequency."""
    wide, fit = grid(WIDE_HZ), grid(FIT_HZ)
    omega = wide.omega_rad_s
    angle = noise(rng, omega.size)
    motion = angle[:, None] * np.stack([-(omega**2), 1j * omega, np.ones(omega.size)], axis=1)
    missing = missing_nm_s * np.abs(omega) * angle
    torque = motion @ truth + missing + sd_nm * noise(rng, omega.size)
    first = int(fit.line[0] - wide.line[0])
    fitted = slice(first, first + fit.line.size)
    return Member(Lines(wide, torque, motion), motion, fitted, truth)


def test_joints_that_differ_between_epochs_are_no_change_with_the_band():
    """Each alone says the same in every band."""
    rng = np.random.default_rng(3)
    joints = [TRUTH * factors for factors in ((1, 1, 0.8), (1, 1.2, 1), (1, 0.9, 1.3))]
    _, changes = band_changes([member(rng, 1e-6, truth=joint) for joint in joints])
    for found in changes:
        assert found.change / TRUTH == pytest.approx(np.zeros(3), abs=1e-6)


def test_the_error_of_a_change_is_its_own():
    """From 300 epochs: the SD of a change is known to 4 %."""
    rng = np.random.default_rng(2)
    found = [band_changes([member(rng)])[1] for _ in range(300)]
    change = np.array([[one.change for one in changes] for changes in found])
    claimed = np.array([[one.change_se for one in changes] for changes in found])
    np.testing.assert_allclose(change.std(axis=0), np.sqrt(np.mean(claimed**2, axis=0)), rtol=0.2)
    p = np.array([[one.p for one in changes] for changes in found])
    assert np.mean(p < 0.05) == pytest.approx(0.05, abs=0.02)


def test_probabilities_are_evenly_distributed():
    rng = np.random.default_rng(7)
    p = [band_changes([member(rng) for _ in range(2)])[1][4].p[0] for _ in range(200)]
    assert stats.kstest(p, "uniform").pvalue > 1e-3


def test_a_band_with_too_few_lines_is_refused():
    with pytest.raises(ValueError, match="at least 8 are needed"):
        grid((1.0, 1.2))
