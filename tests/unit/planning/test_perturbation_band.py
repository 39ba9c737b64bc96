"""Spectrum and envelope against their closed forms, and the verdict on the wanted band."""

import math

import numpy as np
import pytest

from rigidimeter.core.settings import PrbsSettings
from rigidimeter.planning import (
    HALF_POWER_DB,
    check_band,
    envelope_db,
    envelope_edge_hz,
    line_spacing_hz,
    plateau_n2m2_hz,
    power_spectrum,
    prbs_nm,
)


def test_a_sine_has_half_its_square_in_one_line() -> None:
    time_s = np.arange(1000) / 100.0
    spectrum = power_spectrum(3.0 * np.sin(2 * np.pi * 5.0 * time_s) + 7.0, 100.0)
    peak = int(np.argmax(spectrum.density_n2m2_hz))
    assert spectrum.frequency_hz[peak] == pytest.approx(5.0)
    assert spectrum.density_n2m2_hz[peak] * 0.1 == pytest.approx(4.5)
    assert spectrum.share(4.95, 5.05) == pytest.approx(1.0)


@pytest.mark.parametrize("count", [2000, 2001])
def test_parseval(count: int) -> None:
    torque = np.random.default_rng(1).normal(size=count)
    spectrum = power_spectrum(torque, 250.0)
    total = np.sum(spectrum.density_n2m2_hz) * spectrum.frequency_hz[1]
    assert total == pytest.approx(np.var(torque), rel=1e-12)


def test_the_default_sequence_sums_to_its_variance() -> None:
    torque = prbs_nm(PrbsSettings(), 1000.0)
    spectrum = power_spectrum(torque, 1000.0)
    total = np.sum(spectrum.density_n2m2_hz) * spectrum.frequency_hz[1]
    assert total == pytest.approx(np.var(torque), rel=1e-12)


def test_every_line_of_one_period_is_where_the_formula_puts_it() -> None:
    # One exact period: line k carries the plateau times the envelope of a chip of 50 ticks,
    # (sin(πx) / (50 sin(πx/50)))² with x = k/127, which for many ticks is sinc²(x).
    settings = PrbsSettings(duration_s=6.35)
    spectrum = power_spectrum(prbs_nm(settings, 1000.0), 1000.0)
    lines = np.arange(1, 127)
    x = lines / 127.0
    envelope = (np.sin(np.pi * x) / (50 * np.sin(np.pi * x / 50))) ** 2
    np.testing.assert_allclose(
        spectrum.frequency_hz[lines], lines * line_spacing_hz(settings), rtol=1e-12
    )
    np.testing.assert_allclose(
        spectrum.density_n2m2_hz[lines], plateau_n2m2_hz(settings) * envelope, rtol=1e-9
    )
    np.testing.assert_allclose(
        10 * np.log10(envelope[:64]), envelope_db(lines[:64] * 20.0 / 127.0, 20.0), atol=0.01
    )


def test_plateau_grows_with_the_square_of_the_amplitude() -> None:
    assert plateau_n2m2_hz(PrbsSettings()) == pytest.approx(2 * 128 / (127 * 20))
    assert plateau_n2m2_hz(PrbsSettings(amplitude_nm=3.0)) == pytest.approx(
        9 * plateau_n2m2_hz(PrbsSettings())
    )


def test_envelope_at_half_the_clock_is_two_over_pi_squared() -> None:
    expected = 20 * np.log10(2 / np.pi)
    np.testing.assert_allclose(envelope_db([0.0, 5.0], 10.0), [0.0, expected], atol=1e-12)
    assert envelope_db(10.0, 10.0) == -120.0


def test_edges_solve_the_envelope() -> None:
    assert envelope_edge_hz(1.0, -20 * np.log10(2 / np.pi)) == pytest.approx(0.5)
    assert envelope_edge_hz(1.0) == pytest.approx(0.442946, abs=1e-6)
    assert envelope_edge_hz(1.0, 6.0) == pytest.approx(0.602480, abs=1e-6)
    for drop_db in (0.1, HALF_POWER_DB, 6.0, 40.0):
        assert envelope_db(envelope_edge_hz(8.0, drop_db), 8.0) == pytest.approx(-drop_db)


@pytest.mark.parametrize("drop_db", [0.0, -3.0, 101.0, float("nan")])
def test_a_drop_out_of_range_is_refused(drop_db: float) -> None:
    with pytest.raises(ValueError, match="drop_db"):
        envelope_edge_hz(20.0, drop_db)


def test_a_constant_torque_has_nothing_to_share() -> None:
    with pytest.raises(ValueError, match="no power"):
        power_spectrum(np.ones(10), 10.0).share(0.0, 5.0)


def test_spectrum_is_read_only() -> None:
    spectrum = power_spectrum([1.0, -1.0, 1.0, 1.0], 4.0)
    with pytest.raises(ValueError, match="read-only"):
        spectrum.density_n2m2_hz[0] = 1.0


def test_default_is_covered_and_says_why() -> None:
    check = check_band(PrbsSettings(), 1000.0)
    assert check.covered
    assert check.line_spacing_hz == check.lowest_hz == pytest.approx(20 / 127)
    assert check.power_high_db == pytest.approx(20 * math.log10(2 / math.pi))
    assert check.power_low_db == pytest.approx(0.0, abs=1e-3)
    assert "0.15–10 Hz is covered" in check.verdict
    assert "0.1575 Hz, 5 % above" in check.verdict
    assert "within half a line spacing, which counts as covered" in check.verdict
    assert "3.92 dB below the plateau" in check.verdict
    assert "To cover it" not in check.verdict
    assert check.enough == PrbsSettings()
    assert check.enough_rate_hz == 1000.0


def test_a_slow_clock_misses_the_upper_edge() -> None:
    check = check_band(PrbsSettings(clock_hz=15.0), 1000.0)
    assert (check.low_covered, check.high_covered, check.covered) == (True, False, False)
    assert check.enough.clock_hz == 16.6  # 10 / 0.60248 = 16.598
    assert "is not covered" in check.verdict
    assert "To cover it: prbs.clock_hz ≥ 16.6 Hz." in check.verdict


def test_few_bits_miss_the_lower_edge() -> None:
    # 20/63 = 0.317 Hz is more than twice 0.15 Hz; 20/127 is not
    check = check_band(PrbsSettings(register_bits=6), 1000.0)
    assert (check.low_covered, check.high_covered) == (False, True)
    assert check.enough.register_bits == 7
    assert "more than half a line spacing" in check.verdict
    assert "To cover it: prbs.register_bits ≥ 7." in check.verdict


def test_half_a_line_spacing_is_the_boundary() -> None:
    at = PrbsSettings(register_bits=3, clock_hz=7.0, wanted_low_hz=0.5, wanted_high_hz=2.0)
    assert check_band(at, 100.0).low_covered
    beyond = at.model_copy(update={"wanted_low_hz": 0.499})
    assert not check_band(beyond, 100.0).low_covered


def test_a_short_epoch_misses_the_lower_edge_whatever_the_bits() -> None:
    check = check_band(PrbsSettings(register_bits=12, duration_s=2.0), 1000.0)
    assert check.lowest_hz == 0.5
    assert not check.low_covered
    assert check.enough.duration_s == 3.4
    assert "frequency that the epoch resolves is at 0.5 Hz" in check.verdict
    assert "holds only 1 % of a period" in check.verdict
    assert "To cover it: prbs.duration_s ≥ 3.4 s." in check.verdict


def test_a_slow_tick_misses_the_upper_edge() -> None:
    settings = PrbsSettings(clock_hz=60.0, wanted_high_hz=35.0, register_bits=10)
    check = check_band(settings, 60.0)
    assert not check.high_covered
    assert check.enough_rate_hz == 70.0
    assert "above half the tick rate of 60 Hz" in check.verdict
    assert "To cover it: rig.tick_rate_hz ≥ 70 Hz." in check.verdict


def test_a_first_line_below_the_edge_needs_no_excuse() -> None:
    verdict = check_band(PrbsSettings(register_bits=8), 1000.0).verdict
    assert "at or below the lower edge" in verdict
    assert "counts as covered" not in verdict


def test_lines_are_counted_with_their_ends() -> None:
    # 7 chips at 7 Hz: lines at 1, 2, 3, … Hz
    settings = PrbsSettings(register_bits=3, clock_hz=7.0, wanted_low_hz=1.0, wanted_high_hz=3.0)
    assert check_band(settings, 100.0).lines_in_band == 3
