"""PRBS, sinusoid and the counting of ticks."""

import math
from fractions import Fraction

import numpy as np
import pytest
import scipy
from scipy.integrate import cumulative_simpson

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import PrbsSettings, SinusoidSettings
from rigidimeter.planning import (
    chip_count,
    exact_decimal,
    prbs_levels,
    prbs_nm,
    prbs_period_s,
    sinusoid,
    tick_count,
    tick_times_s,
)

AMPLITUDE_RAD = math.radians(20.0)
RATE_HZ = 1000.0


def test_the_middle_eight_cycles_are_a_pure_sinusoid() -> None:
    angle, velocity = sinusoid(SinusoidSettings(), RATE_HZ)
    time_s = np.arange(angle.size) / RATE_HZ
    middle = (time_s >= 1.0) & (time_s <= 9.0)
    omega = 2 * np.pi
    np.testing.assert_allclose(
        angle[middle], AMPLITUDE_RAD * np.sin(omega * time_s[middle]), atol=1e-15
    )
    np.testing.assert_allclose(
        velocity[middle], AMPLITUDE_RAD * omega * np.cos(omega * time_s[middle]), atol=1e-13
    )
    assert np.max(np.abs(velocity)) == pytest.approx(omega * AMPLITUDE_RAD)
    assert np.max(np.abs(angle)) == pytest.approx(AMPLITUDE_RAD)


def test_it_starts_and_ends_at_rest_and_then_holds() -> None:
    angle, velocity = sinusoid(SinusoidSettings(), RATE_HZ)
    assert angle.shape == velocity.shape == (20_000,)
    assert angle[0] == velocity[0] == 0.0
    np.testing.assert_array_equal(angle[10_000:], 0.0)
    np.testing.assert_array_equal(velocity[10_000:], 0.0)
    # the last moving tick is 1 ms from rest: no step in either
    assert abs(angle[9_999]) < 1e-6
    assert abs(velocity[9_999]) < 1e-4


@pytest.mark.parametrize(
    ("frequency_hz", "taper_s"), [(1.0, 1.0), (1.0, 0.3), (0.37, 2.5), (2.6, 5.0), (3.0, 0.0)]
)
def test_the_velocity_integrates_to_the_angle(frequency_hz: float, taper_s: float) -> None:
    settings = SinusoidSettings(frequency_hz=frequency_hz, taper_s=taper_s)
    angle, velocity = sinusoid(settings, 5000.0)
    moving = slice(0, 50_000)
    integral = cumulative_simpson(velocity[moving], dx=1 / 5000.0, initial=0.0)
    np.testing.assert_allclose(integral, angle[moving], atol=2e-8)


def test_the_rising_taper_is_half_way_at_half_its_length() -> None:
    settings = SinusoidSettings(frequency_hz=0.5, taper_s=1.0)  # the sine is 1 at 0.5 s
    angle, velocity = sinusoid(settings, 100.0)
    assert angle[50] == pytest.approx(AMPLITUDE_RAD / 2)
    assert velocity[50] == pytest.approx(AMPLITUDE_RAD * np.pi / 2)  # all of it from the taper


def test_a_motion_that_fills_the_epoch() -> None:
    angle, _ = sinusoid(SinusoidSettings(motion_s=20.0, duration_s=20.0), 100.0)
    assert angle.shape == (2000,)
    assert abs(angle[-1]) < 1e-4


def test_a_rate_of_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="rate_hz"):
        sinusoid(SinusoidSettings(), 0.0)


def test_three_bits_give_the_sequence_of_the_register_by_hand() -> None:
    # from 111, each chip is the sum modulo 2 of the one before it and the one three before it
    np.testing.assert_array_equal(prbs_levels(3), [1, 1, 1, -1, 1, -1, -1])


@pytest.mark.parametrize("bits", range(2, 21))
def test_the_register_is_that_of_scipy(bits):
    expected, _ = scipy.signal.max_len_seq(bits, state=np.ones(bits, dtype=np.int8))
    np.testing.assert_array_equal(prbs_levels(bits) > 0, expected == 1)


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
    assert prbs_period_s(PrbsSettings()) == pytest.approx(6.35)


@pytest.mark.parametrize("rate_hz", [10.0, 0.0, -1.0, float("nan"), float("inf")])
def test_a_rate_that_cannot_carry_the_clock_is_refused(rate_hz: float) -> None:
    with pytest.raises(ValueError, match=r"needs at least as many ticks|rate_hz must be"):
        prbs_nm(PrbsSettings(), rate_hz)


def test_an_epoch_that_never_changes_level_says_what_would_help() -> None:
    settings = PrbsSettings(register_bits=7, clock_hz=1.0, duration_s=5.0)
    with pytest.raises(UserError, match=r"prbs\.duration_s = 5 s .* after 7 chips .* \(7 s\)"):
        prbs_nm(settings, 1000.0)


def test_a_float_reads_as_its_decimal() -> None:
    assert exact_decimal(22.6, "clock_hz") == Fraction(226, 10)
    assert exact_decimal(np.float64(0.1), "step_s") == Fraction(1, 10)


def test_counts_and_times() -> None:
    assert tick_count(20.0, 1000.0) == 20_000
    assert tick_count(0.29, 100.0) == 29  # 0.29 * 100 is 28.999… in floats
    np.testing.assert_array_equal(tick_times_s(3, 4.0), [0.0, 0.25, 0.5])


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_only_finite_values_above_zero(value: float) -> None:
    with pytest.raises(ValueError, match="rate_hz must be finite and greater than 0"):
        exact_decimal(value, "rate_hz")


def test_less_than_half_a_tick_is_refused() -> None:
    with pytest.raises(ValueError, match="holds no tick"):
        tick_count(0.001, 100.0)
