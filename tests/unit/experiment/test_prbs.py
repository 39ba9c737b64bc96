"""The torque perturbation against sequences and chip boundaries known by hand."""

from fractions import Fraction

import numpy as np
import pytest

from rigidimeter.errors import UserError
from rigidimeter.experiment import chip_count, period_s, prbs_levels, prbs_nm
from rigidimeter.settings import PrbsSettings


def test_three_bits_give_the_sequence_of_the_register_by_hand() -> None:
    # from 111, each chip is the sum modulo 2 of the one before it and the one three before it
    np.testing.assert_array_equal(prbs_levels(3), [1, 1, 1, -1, 1, -1, -1])


def test_one_whole_period_has_the_levels_of_the_closed_form() -> None:
    # Seven chips, four up: the mean is 1/7, so the levels are 2·(3/7)·A and −2·(4/7)·A.
    settings = PrbsSettings(register_bits=3, clock_hz=7.0, amplitude_nm=3.5, duration_s=1.0)
    torque = prbs_nm(settings, 70.0)
    assert torque.shape == (70,)
    assert set(torque.tolist()) == {3.0, -4.0}
    np.testing.assert_array_equal(torque[::10] > 0, prbs_levels(3) > 0)
    np.testing.assert_array_equal(torque, np.repeat(torque[::10], 10))


def test_default_is_three_periods_and_a_bit_of_zero_mean() -> None:
    torque = prbs_nm(PrbsSettings(), 1000.0)
    assert torque.shape == (20_000,)
    low, high = np.unique(torque)
    assert high - low == pytest.approx(2.0, abs=1e-15)
    counts = [np.count_nonzero(torque == level) for level in (low, high)]
    assert abs(counts[0] * low + counts[1] * high) < 1e-9
    np.testing.assert_array_equal(torque[:6350], torque[6350:12700])


@pytest.mark.parametrize("clock_hz", [22.6, 0.7, 333.3, 19.999])
def test_no_chip_boundary_slips_by_rounding(clock_hz: float) -> None:
    settings = PrbsSettings(register_bits=9, clock_hz=clock_hz, duration_s=60.0)
    signs = np.sign(prbs_nm(settings, 1000.0))
    levels = prbs_levels(9)
    per_tick = Fraction(str(clock_hz)) / 1000
    expected = [levels[int(tick * per_tick) % 511] for tick in range(60_000)]
    np.testing.assert_array_equal(signs, expected)


def test_a_clock_at_the_tick_rate_changes_chip_every_tick() -> None:
    settings = PrbsSettings(register_bits=4, clock_hz=100.0, duration_s=1.5)
    np.testing.assert_array_equal(np.sign(prbs_nm(settings, 100.0)), np.tile(prbs_levels(4), 10))


def test_the_same_settings_give_the_same_sequence() -> None:
    np.testing.assert_array_equal(prbs_nm(PrbsSettings(), 1000.0), prbs_nm(PrbsSettings(), 1000.0))


def test_period_is_chips_over_clock() -> None:
    assert chip_count(PrbsSettings()) == 127
    assert period_s(PrbsSettings()) == pytest.approx(6.35)


@pytest.mark.parametrize("rate_hz", [10.0, 0.0, -1.0, float("nan"), float("inf")])
def test_a_rate_that_cannot_carry_the_clock_is_refused(rate_hz: float) -> None:
    with pytest.raises(ValueError, match=r"needs at least as many ticks|rate_hz must be"):
        prbs_nm(PrbsSettings(), rate_hz)


def test_an_epoch_that_never_changes_level_says_what_would_help() -> None:
    settings = PrbsSettings(register_bits=7, clock_hz=1.0, duration_s=5.0)
    with pytest.raises(UserError, match=r"prbs\.duration_s = 5 s .* after 7 chips .* \(7 s\)"):
        prbs_nm(settings, 1000.0)
