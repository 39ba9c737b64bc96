"""Measured and modelled torque in the band of the live estimate."""

import numpy as np
from scipy import signal
from tests.unit.rig.acquisition.test_live_estimate import RATE_HZ, rows

from rigidimeter.core.settings import OnlineSettings
from rigidimeter.rig.acquisition.processes import ROW
from rigidimeter.rig.console import BandTorque

SETTINGS = OnlineSettings()


def test_measured_passed_the_filters_that_the_settings_name():
    whole = rows(1, 0, 6_000, 1.7)
    measured_nm, _ = BandTorque(SETTINGS, RATE_HZ).take(whole, 0)
    torque_nm = whole["torque_nm"]
    sections = np.vstack(
        [
            signal.butter(2, SETTINGS.band_low_hz, "high", fs=RATE_HZ, output="sos"),
            signal.butter(4, SETTINGS.band_high_hz, fs=RATE_HZ, output="sos"),
        ]
    )
    begun = signal.sosfilt_zi(sections) * torque_nm[0]
    expected_nm, _ = signal.sosfilt(sections, torque_nm, zi=begun)
    np.testing.assert_allclose(measured_nm, expected_nm, atol=1e-9)


def test_modelled_is_the_equation_of_the_live_estimate():
    """A linear joint without noise is foreseen; with the torque's sign turned, its mirror image."""
    whole = rows(1, 0, 15_000, 1.7)
    measured_nm, modelled_nm = BandTorque(SETTINGS, RATE_HZ).take(whole, 0)
    late = slice(10_000, None)
    assert np.std((measured_nm - modelled_nm)[late]) < 0.02 * np.std(measured_nm[late])
    turned = whole.copy()
    turned["torque_nm"] *= -1.0
    _, mirrored_nm = BandTorque(SETTINGS, RATE_HZ).take(turned, 0)
    np.testing.assert_allclose(mirrored_nm[late], -modelled_nm[late], atol=1e-9)


def test_what_the_joint_does_not_explain_is_not_modelled():
    """A torque far above the joint's, of which the estimate knows nothing before it comes."""
    whole = rows(1, 0, 12_000, 1.7)
    whole["torque_nm"][10_000:10_050] += 1.0
    measured_nm, modelled_nm = BandTorque(SETTINGS, RATE_HZ).take(whole, 0)
    assert np.max((measured_nm - modelled_nm)[10_000:10_100]) > 0.5


def test_in_parts_it_is_the_same_and_a_rest_has_none():
    whole = np.concatenate((rows(1, 0, 3_000, 1.7), rows(-1, 3_000, 200, 1.7)))
    whole = np.concatenate((whole, rows(2, 3_200, 2_000, 3.4)))
    once, parts = BandTorque(SETTINGS, RATE_HZ), BandTorque(SETTINGS, RATE_HZ)
    at_once = np.stack(once.take(whole, 0))
    found = [np.stack(parts.take(part, 0)) for part in np.array_split(whole, 41)]
    np.testing.assert_array_equal(np.hstack(found), at_once)
    assert np.isnan(at_once[:, 3_000:3_200]).all()
    assert np.isfinite(at_once[0, 3_200:]).all()
    assert once.since_s == 3.2
    assert parts.take(np.empty(0, ROW), 0)[0].size == 0
