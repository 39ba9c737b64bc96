"""The exact rank-sum test against all ways to deal the values."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import mannwhitneyu, rankdata

from rigidimeter.analysis.statistics import exact_ranksum


def by_enumeration(x: list[float], y: list[float]) -> float:
    ranks = rankdata([*x, *y])
    mean = len(x) * ranks.mean()
    found = abs(ranks[: len(x)].sum() - mean)
    sums = [abs(sum(some) - mean) for some in itertools.combinations(ranks, len(x))]
    return float(np.mean(np.array(sums) >= found - 1e-9))


@settings(max_examples=50, deadline=None)
@given(
    st.lists(st.integers(0, 4), min_size=1, max_size=6),
    st.lists(st.integers(0, 4), min_size=1, max_size=6),
)
def test_exact_rank_sum_is_the_enumeration_ties_and_all(x: list[int], y: list[int]) -> None:
    p = exact_ranksum([(x, y)])
    assert p == pytest.approx(by_enumeration(list(map(float, x)), list(map(float, y))), rel=1e-9)
    assert exact_ranksum([(y, x)]) == pytest.approx(p, rel=1e-9)


def test_exact_rank_sum_without_ties_is_scipys() -> None:
    x, y = (
        np.random.default_rng(11).standard_normal(9),
        1 + np.random.default_rng(12).standard_normal(30),
    )
    assert exact_ranksum([(x, y)]) == pytest.approx(
        mannwhitneyu(x, y, method="exact").pvalue, rel=1e-9
    )


def test_strata_are_dealt_apart() -> None:
    """Two subjects with two days each: 6 × 6 equally likely outcomes, 2 of them as extreme."""
    strata = [([3.0, 4.0], [1.0, 2.0]), ([13.0, 14.0], [11.0, 12.0])]
    assert exact_ranksum(strata) == pytest.approx(2 / 36)
    assert exact_ranksum([*strata, ([1.0], [])]) == pytest.approx(2 / 36)
    assert np.isnan(exact_ranksum([([1.0], [])]))
