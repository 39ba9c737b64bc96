"""Counting ticks as the decimals that were written."""

from fractions import Fraction

import numpy as np
import pytest

from rigidimeter.experiment.tick_count import as_written, tick_count, tick_times_s


def test_a_float_reads_as_its_decimal() -> None:
    assert as_written(22.6, "clock_hz") == Fraction(226, 10)
    assert as_written(np.float64(0.1), "step_s") == Fraction(1, 10)


def test_counts_and_times() -> None:
    assert tick_count(20.0, 1000.0) == 20_000
    assert tick_count(0.29, 100.0) == 29  # 0.29 * 100 is 28.999… in floats
    np.testing.assert_array_equal(tick_times_s(3, 4.0), [0.0, 0.25, 0.5])


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_only_finite_values_above_zero(value: float) -> None:
    with pytest.raises(ValueError, match="rate_hz must be finite and greater than 0"):
        as_written(value, "rate_hz")


def test_less_than_half_a_tick_is_refused() -> None:
    with pytest.raises(ValueError, match="holds no tick"):
        tick_count(0.001, 100.0)
