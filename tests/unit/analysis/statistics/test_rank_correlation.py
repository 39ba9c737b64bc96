"""Spearman's correlation against SciPy's, its interval against its formula and by chance."""

import math

import numpy as np
import pytest
from scipy.stats import spearmanr

from rigidimeter.analysis.statistics import rank_correlation


def test_it_is_spearmans_with_bonett_and_wrights_interval() -> None:
    rng = np.random.default_rng(3)
    x = rng.integers(0, 6, 20).astype(float)  # with ties
    y = x + rng.normal(0, 2, 20)
    found = rank_correlation(x, y)
    assert found.rho == pytest.approx(spearmanr(x, y).statistic, rel=1e-12)
    half = 1.959964 * math.sqrt((1 + found.rho**2 / 2) / 17)
    assert math.atanh(found.high) - math.atanh(found.rho) == pytest.approx(half, rel=1e-6)
    assert math.atanh(found.rho) - math.atanh(found.low) == pytest.approx(half, rel=1e-6)


def test_within_groups_what_sets_them_apart_does_not_count() -> None:
    rng = np.random.default_rng(4)
    x, y = rng.normal(size=(2, 24))
    groups = ["a"] * 12 + ["b"] * 12
    moved = np.repeat([0.0, 50.0], 12)
    within = rank_correlation(x, y, groups)
    assert rank_correlation(x + moved, y + moved, groups) == pytest.approx(within)
    assert rank_correlation(x + moved, y + moved).rho > 0.6
    assert abs(within.rho) < 0.4


def test_what_cannot_be_known_is_not_a_number() -> None:
    assert all(map(math.isnan, rank_correlation([1.0, 1.0, 1.0], [1.0, 2.0, 3.0])))
    few = rank_correlation([1.0, 2.0, 3.0], [1.0, 3.0, 2.0])
    assert few.rho == pytest.approx(0.5)
    assert math.isnan(few.low)
    perfect = rank_correlation(range(9), range(9))
    assert (perfect.rho, math.isnan(perfect.low)) == (1.0, True)


@pytest.mark.parametrize("grouped", [False, True])
def test_the_interval_misses_an_absent_correlation_in_five_per_cent(grouped: bool) -> None:
    rng = np.random.default_rng(5)
    groups = ["a"] * 9 + ["b"] * 4 if grouped else None
    missed = 0
    for _ in range(1000):
        found = rank_correlation(*rng.normal(size=(2, 13)), groups)
        missed += found.low > 0 or found.high < 0
    assert 30 <= missed <= 75  # three standard errors of 5 % are 2.1 %
