"""A band that contradicts an estimate: sure, large, and outside what its interval allows."""

from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation.closedloop.band_sensitivity import (
    BandChange,
    band_estimates,
    band_finding,
)
from rigidimeter.core.records import Fit, Outcome
from rigidimeter.core.settings import DiagnosticsSettings

VALUE = np.array([0.0045, 0.1368, 1.751])
HALF = 0.05 * VALUE
FIT = Fit("a", "1", "OFF", "iv", Outcome(), value=VALUE, low=VALUE - HALF, high=VALUE + HALF)
SETTINGS = DiagnosticsSettings()


def changes(percent, p, part="all"):
    """Return what another band does to K, and the halves of the epochs in the band of the fit."""
    change, se = 0.01 * percent * VALUE * [0, 0, 1], 0.001 * VALUE
    other = BandChange(0.1, 21.0, part, change, se, np.array([1.0, 1.0, p]))
    half = BandChange(0.1, 30.0, "second half", 0 * VALUE, se, np.ones(3))
    return [other, half]


def test_a_band_that_contradicts_is_told():
    (found,) = band_finding(FIT, changes(-6.0, 1e-6), SETTINGS)
    assert (found.name, found.level, found.limit) == ("band_sensitivity", "caution", 3.0)
    assert found.value == pytest.approx(6.0)
    facts = found.facts
    assert (facts["symbol"], facts["way"], facts["low_hz"], facts["high_hz"]) == (
        "K",
        "less",
        0.1,
        21,
    )
    assert (facts["error"], facts["of_half"]) == pytest.approx((0.1, 1.2))
    assert found.p == pytest.approx(3e-6)
    assert found.effect.percent == pytest.approx((0.0, 0.0, 6.0 / 0.94))
    assert found.effect.half_intervals == pytest.approx((0.0, 0.0, 1.2))


@pytest.mark.parametrize(
    ("percent", "p", "part", "width"),
    [
        (6.0, 0.004, "all", 1.0),  # of three parameters one is so by chance in 1.2 %
        (2.9, 1e-6, "all", 1.0),
        (6.0, 1e-6, "first half", 1.0),
        (6.0, 1e-6, "all", 2.5),
    ],
    ids=["chance", "small", "a joint that varies", "within the interval"],
)
def test_another_change_is_not(percent, p, part, width):
    wide = replace(FIT, low=VALUE - width * HALF, high=VALUE + width * HALF)
    assert band_finding(wide, changes(percent, p, part), SETTINGS) == []


def test_estimates_of_bands_begin_with_that_of_the_fit():
    own, other, _ = band_estimates("OFF", FIT, VALUE + 1.0, changes(-6.0, 1e-6))
    assert [one.of_fit for one in (own, other)] == [True, False]
    assert (own.low_hz, own.high_hz, own.value) == (0.1, 30.0, tuple(VALUE))
    assert other.value[2] == pytest.approx(0.94 * 1.751)
    assert other.row()["stiffness_nm_rad_change"] == pytest.approx(-0.06 * 1.751)
    assert other.row()["stiffness_nm_rad_p"] == 1e-6
    assert band_estimates("OFF", FIT, VALUE, []) == []
