"""Units with both conditions and units with one, against t-tests and against what was drawn."""

import numpy as np
import pytest
from scipy.stats import t as t_distribution
from scipy.stats import ttest_ind, ttest_rel

from rigidimeter.analysis.statistics import PartiallyPaired, partially_paired


def drawn(seed: int, *sizes: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [rng.standard_normal(size) for size in sizes]


def p_of(found: PartiallyPaired) -> float:
    return 2 * float(t_distribution.sf(abs(found.estimate) / found.se, found.df))


@pytest.mark.parametrize("n", [2, 3, 8])
def test_units_with_both_alone_are_the_paired_t_test(n: int) -> None:
    x, y = drawn(1, n, n)
    found = partially_paired(x, y, [], [])
    assert p_of(found) == pytest.approx(ttest_rel(x, y).pvalue, rel=1e-12)
    assert (found.df, found.n_both, found.n_x, found.n_y) == (pytest.approx(n - 1), n, 0, 0)


def test_as_many_units_of_each_condition_are_welchs_test() -> None:
    x, y = drawn(2, 6, 6)
    found = partially_paired([], [], x, 3 * y)
    assert p_of(found) == pytest.approx(ttest_ind(x, 3 * y, equal_var=False).pvalue, rel=1e-12)
    assert (found.weight_x, found.weight_y) == (1.0, 1.0)


@pytest.mark.parametrize("scale", [0.1, 1.0, 10.0])
def test_few_units_have_at_most_welchs_degrees_of_freedom(scale: float) -> None:
    x, y = drawn(3, 9, 3)
    found, welch = partially_paired([], [], x, scale * y), ttest_ind(x, scale * y, equal_var=False)
    assert found.estimate / found.se == pytest.approx(welch.statistic, rel=1e-12)
    assert found.df <= welch.df + 1e-12


def test_two_units_of_a_condition_have_the_degrees_of_freedom_of_equal_variances() -> None:
    """From two values 1 − 1/k is nothing: with s²_y = 0 Welch's are those of x, 7."""
    x = np.arange(8.0)
    found = partially_paired([], [], x, [2.0, 2.0])
    assert found.df == pytest.approx((1 / 8 + 1 / 2) ** 2 / (1 / 8**2 / 7 + 1 / 2**2 / 1))


def test_the_weights_are_least_squares_at_a_correlation_of_one_half() -> None:
    """By lstsq on whitened values, all sides present."""
    n, n_x, n_y = 4, 5, 2
    x_both, y_both, x_only, y_only = drawn(4, n, n, n_x, n_y)
    design = np.zeros((2 * n + n_x + n_y, 2))
    design[: n + n_x, 0] = design[n + n_x :, 1] = 1
    covariance = np.eye(len(design))
    for i in range(n):
        covariance[i, n + n_x + i] = covariance[n + n_x + i, i] = 0.5
    white = np.linalg.inv(np.linalg.cholesky(covariance))
    values = np.concatenate([x_both, x_only, y_both, y_only])
    means = np.linalg.lstsq(white @ design, white @ values)[0]
    found = partially_paired(x_both, y_both, x_only, y_only)
    assert found.estimate == pytest.approx(means[0] - means[1], rel=1e-12)


def test_one_side_alone_has_half_the_weight_it_would_have_of_independent_units() -> None:
    x_both, y_both, x_only = drawn(5, 4, 4, 5)
    found = partially_paired(x_both, y_both, x_only, [])
    assert (found.weight_x, found.weight_y) == (pytest.approx(0.5 * 5 / 9), 0.0)
    paired = (1 - found.weight_x) * x_both - y_both
    variance = paired.var(ddof=1) / 4 + found.weight_x**2 * x_only.var(ddof=1) / 5
    assert found.se == pytest.approx(np.sqrt(variance), rel=1e-12)


def test_a_single_unit_takes_its_variance_and_its_freedom_from_those_with_both() -> None:
    x_both, y_both, x_only = drawn(10, 4, 4, 1)
    found = partially_paired(x_both, y_both, x_only, [])
    paired = (1 - found.weight_x) * x_both - y_both
    variance = paired.var(ddof=1) / 4 + found.weight_x**2 * x_both.var(ddof=1)
    assert found.se == pytest.approx(np.sqrt(variance), rel=1e-12)
    assert found.df == pytest.approx(3)


def test_what_units_share_cancels_where_all_have_both_only() -> None:
    x, y, shared = drawn(6, 5, 5, 5)
    assert partially_paired(x + 9 * shared, y + 9 * shared, [], []).se == pytest.approx(
        partially_paired(x, y, [], []).se, rel=1e-9
    )


@pytest.mark.parametrize(("n", "n_x", "n_y"), [(1, 3, 2), (2, 6, 0)])
def test_fewer_than_three_pairs_beside_others_count_as_separate(n: int, n_x: int, n_y: int) -> None:
    x_both, y_both, x_only, y_only = drawn(7, n, n, n_x, n_y)
    separate = partially_paired(
        [], [], np.concatenate([x_both, x_only]), np.concatenate([y_both, y_only])
    )
    assert partially_paired(x_both, y_both, x_only, y_only) == separate


def test_exchanging_the_conditions_turns_the_sign() -> None:
    x_both, y_both, x_only, y_only = drawn(8, 3, 3, 1, 4)
    one = partially_paired(x_both, y_both, x_only, y_only)
    other = partially_paired(y_both, x_both, y_only, x_only)
    assert one.estimate == pytest.approx(-other.estimate, rel=1e-12)
    assert (one.se, one.df) == pytest.approx((other.se, other.df), rel=1e-12)


@pytest.mark.parametrize("correlation", [-0.5, 0.0, 0.9])
def test_the_variance_is_unbiased_whatever_the_correlation_and_the_variances(
    correlation: float,
) -> None:
    """Of 4,000 draws the mean se² against the variance of the estimate, to 4 standard errors."""
    rng, draws = np.random.default_rng(9), 4000
    root = np.linalg.cholesky([[1, 3 * correlation], [3 * correlation, 9]])
    found = np.empty((draws, 2))
    for k in range(draws):
        pairs = root @ rng.standard_normal((2, 3))
        one = partially_paired(*pairs, rng.standard_normal(2), 3 * rng.standard_normal(1))
        found[k] = one.estimate, one.se**2
    error = np.sqrt(2 / draws) + found[:, 1].std() / np.sqrt(draws) / found[:, 1].mean()
    assert found[:, 1].mean() == pytest.approx(found[:, 0].var(), rel=4 * error)


def test_what_cannot_be_tested_is_refused() -> None:
    with pytest.raises(ValueError, match="one value"):
        partially_paired([], [], [1.0, 2.0], [3.0])
    with pytest.raises(ValueError, match="one value"):
        partially_paired([1.0], [2.0], [3.0], [])
    with pytest.raises(ValueError, match="do not vary"):
        partially_paired([1.0, 2.0], [2.0, 3.0], [], [])
