import dataclasses
import math

import numpy as np
import pytest
from scipy.stats import norm

from rigidimeter.analysis.statistics import ranksum
from rigidimeter.core.errors import UserError


def test_a_case_worked_by_hand() -> None:
    # 7 of the 8 pairs have x > y, so U = 7 and the excess over m n / 2 = 4 is 3.
    # σ² = 4·2/12·7 = 14/3.
    test = ranksum([3.0, 5.0, 6.0, 9.0], [1.0, 4.0])
    sigma = math.sqrt(14 / 3)
    assert (test.n_x, test.n_y, test.u) == (4, 2, 7.0)
    assert test.z == pytest.approx(2.5 / sigma, rel=1e-14)
    assert test.z_uncorrected == pytest.approx(3 / sigma, rel=1e-14)
    assert test.r == pytest.approx(2.5 / sigma / math.sqrt(6), rel=1e-14)
    # Differences: 2 4 5 8 and -1 1 2 5; sorted -1 1 2 2 4 5 5 8.
    assert test.shift == 3.0


def test_ties_worked_by_hand() -> None:
    # Pooled 1 1 1 2 2 3: groups of 3 and 2, Σ(t³ − t) = 24 + 6 = 30; σ² = 9/12·(7 − 30/30) = 4.5.
    # U of x = (1, 2, 3): ½ + ½ for 1; 2 + ½ for 2; 3 for 3 = 6.5; excess 2.
    test = ranksum([1.0, 2.0, 3.0], [1.0, 1.0, 2.0])
    assert test.u == 6.5
    assert test.z_uncorrected == pytest.approx(2 / math.sqrt(4.5), rel=1e-14)
    assert test.z == pytest.approx(1.5 / math.sqrt(4.5), rel=1e-14)


def test_interval_worked_by_hand() -> None:
    # m = n = 4 without ties: σ² = 16/12·9 = 12; 1.96·√12 + ½ = 7.29; 8 − 7.29 = 0.71, so the
    # first and the last of the 16 differences bound the 95 % interval; at 80 %
    # 1.2816·√12 + ½ = 4.94 and 8 − 4.94 = 3.06: the fourth from either end.
    x, y = [10.0, 20.0, 30.0, 41.0], [1.0, 3.0, 6.0, 8.5]
    differences = np.sort(np.subtract.outer(x, y), axis=None)
    wide, narrow = ranksum(x, y), ranksum(x, y, confidence=0.8)
    assert (wide.shift_low, wide.shift_high) == (differences[0], differences[-1])
    assert (narrow.shift_low, narrow.shift_high) == (differences[3], differences[-4])
    assert wide.shift_bounded
    assert narrow.shift_bounded


@pytest.mark.parametrize("ties", ["none", "between the samples", "within one"])
def test_interval_holds_exactly_the_shifts_not_rejected(ties: str) -> None:
    rng = np.random.default_rng(4)
    x, y = rng.normal(1.0, 1.0, 14), rng.normal(0.0, 1.0, 9)
    if ties == "between the samples":
        x, y = np.round(x * 2) / 2, np.round(y * 2) / 2
    if ties == "within one":
        # A sample whose interval differs with and without the correction for its own ties.
        x, y = np.repeat([0.3, 1.4], 10), np.random.default_rng(0).normal(0.0, 1.0, 12)
    test = ranksum(x, y)
    nudge = 1e-9
    assert ranksum(x - (test.shift_low + nudge), y).p >= 0.05
    assert ranksum(x - (test.shift_high - nudge), y).p >= 0.05
    assert ranksum(x - (test.shift_low - nudge), y).p < 0.05
    assert ranksum(x - (test.shift_high + nudge), y).p < 0.05


def test_z_and_p_say_the_same() -> None:
    rng = np.random.default_rng(1)
    for m, n, step in [(3, 5, 0.0), (8, 8, 0.5), (40, 13, 0.25), (1, 1, 0.0), (92, 46, 0.1)]:
        x, y = rng.normal(0.4, 1, m), rng.normal(0, 1, n)
        if step:
            x, y = np.round(x / step) * step, np.round(y / step) * step
        test = ranksum(x, y)
        assert test.p == pytest.approx(min(1.0, 2 * norm.sf(abs(test.z))), rel=1e-12)
        assert test.p_uncorrected == pytest.approx(2 * norm.sf(abs(test.z_uncorrected)), rel=1e-12)
        assert test.r == test.z / math.sqrt(m + n)


def test_swapping_the_samples_turns_the_sign() -> None:
    x, y = [1.0, 2.0, 2.0, 7.0, 9.0], [0.5, 2.0, 3.0, 3.5]
    there, back = ranksum(x, y), ranksum(y, x)
    assert there.z == -back.z
    assert there.p == back.p
    assert there.shift == -back.shift
    assert (there.shift_low, there.shift_high) == (-back.shift_high, -back.shift_low)
    assert there.u + back.u == len(x) * len(y)


def test_identical_values_show_nothing() -> None:
    test = ranksum([2.0] * 12, [2.0] * 7)
    assert (test.z, test.p, test.r, test.u) == (0.0, 1.0, 0.0, 42.0)
    assert (test.z_uncorrected, test.p_uncorrected) == (0.0, 1.0)
    assert (test.shift, test.shift_low, test.shift_high) == (0.0, 0.0, 0.0)


def test_small_samples_have_no_bounded_interval() -> None:
    test = ranksum([5.0, 6.0, 7.0], [1.0, 2.0, 3.5])
    assert not test.shift_bounded
    assert (test.shift_low, test.shift_high) == (1.5, 6.0)
    assert ranksum([5.0, 6.0, 7.0], [1.0, 2.0, 3.5], confidence=0.8).shift_bounded


def test_one_value_each_is_no_evidence() -> None:
    test = ranksum([1.0], [2.0])
    assert (test.z, test.p, test.shift) == (0.0, 1.0, -1.0)
    assert math.copysign(1.0, test.z) == 1.0


def test_every_field_is_a_plain_number() -> None:
    for value in dataclasses.asdict(ranksum(np.arange(9.0), np.arange(5.0) + 2)).values():
        assert type(value) in (int, float, bool)


@pytest.mark.parametrize(
    ("x", "y", "message"),
    [
        ([], [1.0], "x is empty"),
        ([1.0], [], "y is empty"),
        ([1.0, math.nan], [1.0], "x must be finite"),
        ([1.0], [math.inf], "y must be finite"),
        ([[1.0]], [1.0], "one-dimensional"),
    ],
)
def test_bad_samples_are_refused(x: list[float], y: list[float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ranksum(x, y)


@pytest.mark.parametrize("confidence", [0.0, 1.0, 95.0, math.nan])
def test_bad_confidence_is_refused(confidence: float) -> None:
    with pytest.raises(ValueError, match="between 0 and 1"):
        ranksum([1.0], [2.0], confidence=confidence)


def test_more_pairs_than_fit_into_memory_are_refused() -> None:
    with pytest.raises(UserError, match=r"make 6\.4e\+07 pairs"):
        ranksum(np.zeros(8000), np.arange(8000.0))
