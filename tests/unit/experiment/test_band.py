"""The verdict on the wanted band."""

import math

import pytest

from rigidimeter.experiment import check_band
from rigidimeter.settings import PrbsSettings


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


def test_sidelobes_do_not_count() -> None:
    # In the first sidelobe, at 1.43 f_clock, the envelope is 13.3 dB down: above −14 dB again.
    settings = PrbsSettings(clock_hz=10.0, wanted_high_hz=14.3)
    check = check_band(settings, 1000.0, drop_db=14.0)
    assert check.power_high_db > -14.0
    assert not check.high_covered


def test_a_first_line_below_the_edge_needs_no_excuse() -> None:
    verdict = check_band(PrbsSettings(register_bits=8), 1000.0).verdict
    assert "at or below the lower edge" in verdict
    assert "counts as covered" not in verdict


def test_lines_are_counted_with_their_ends() -> None:
    # 7 chips at 7 Hz: lines at 1, 2, 3, … Hz
    settings = PrbsSettings(register_bits=3, clock_hz=7.0, wanted_low_hz=1.0, wanted_high_hz=3.0)
    assert check_band(settings, 100.0).lines_in_band == 3
