"""The test of days against its closed forms: t-tests, and all ways to deal the days."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import mannwhitneyu, rankdata, ttest_ind, ttest_rel

from rigidimeter.statistics import day_difference, day_medians, difference, exact_ranksum, fit_mixed


def days_of(prefix: str, days: int, epochs: int) -> list[str]:
    return [f"{prefix}{day}" for day in range(days) for _ in range(epochs)]


def made(seed: int, days: int, epochs: int, spread: float) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return spread * rng.standard_normal((days, 1)) + rng.standard_normal((days, epochs))


def test_one_epoch_a_day_is_the_ordinary_t_test() -> None:
    x, y = made(1, 9, 1, 0.5).ravel(), 0.3 + made(2, 6, 1, 0.5).ravel()
    found = day_difference(x, y, days_of("a", 9, 1), days_of("b", 6, 1), confidence=0.9)
    expected = ttest_ind(x, y)
    assert found.p == pytest.approx(expected.pvalue, rel=1e-10)
    assert found.df == pytest.approx(13)
    assert (found.low, found.high) == pytest.approx(expected.confidence_interval(0.9), rel=1e-10)
    assert np.isnan(found.day_share)


def test_balanced_days_are_the_t_test_of_their_means() -> None:
    x, y = made(3, 9, 5, 1.0), 0.4 + made(4, 4, 5, 1.0)
    found = day_difference(x.ravel(), y.ravel(), days_of("a", 9, 5), days_of("b", 4, 5))
    expected = ttest_ind(x.mean(axis=1), y.mean(axis=1))
    assert found.p == pytest.approx(expected.pvalue, rel=1e-9)
    assert found.df == pytest.approx(11, rel=1e-9)
    assert found.estimate == pytest.approx(x.mean() - y.mean(), rel=1e-12)
    assert (found.n_days_x, found.n_days_y) == (9, 4)
    # Mean squares: between days of a condition, and within days.
    within = np.mean([*x.var(axis=1, ddof=1), *y.var(axis=1, ddof=1)])
    sums = 5 * (8 * x.mean(axis=1).var(ddof=1) + 3 * y.mean(axis=1).var(ddof=1))
    between = (sums / 11 - within) / 5
    assert found.day_share == pytest.approx(between / (between + within), rel=1e-8)


def test_without_day_variance_it_tends_to_the_pooled_t_test() -> None:
    """Mean squares between and within days alike: the variance of days is just zero."""
    x, y = made(5, 60, 4, 0.0), 0.2 + made(6, 60, 4, 0.0)
    for sample in (x, y):  # means of days spread by exactly what their epochs explain
        rest = sample - sample.mean(axis=1, keepdims=True)
        mean = sample.mean(axis=1)
        scaled = (mean - mean.mean()) / mean.std(ddof=1)
        sample[:] = rest / rest.std() + mean.mean() + 0.57 * scaled[:, None]
    found = day_difference(x.ravel(), y.ravel(), days_of("a", 60, 4), days_of("b", 60, 4))
    assert found.day_share < 1e-3
    assert found.p == pytest.approx(ttest_ind(x.ravel(), y.ravel()).pvalue, rel=0.05)


def test_days_with_both_conditions_give_the_paired_difference() -> None:
    """One epoch of each condition a day: the paired t-test, for the day's offset cancels."""
    rng = np.random.default_rng(7)
    offsets = 2.0 * rng.standard_normal(8)
    x, y = offsets + rng.standard_normal(8), offsets + 0.5 + rng.standard_normal(8)
    found = day_difference(x, y, days_of("d", 8, 1), days_of("d", 8, 1))
    assert found.p == pytest.approx(ttest_rel(x, y).pvalue, rel=1e-8)
    assert found.df == pytest.approx(7, rel=1e-8)


def test_balanced_days_with_both_conditions_are_the_paired_t_test_of_means() -> None:
    """What a condition had to itself on a day does not cancel, however many epochs it has."""
    rng = np.random.default_rng(16)
    offsets = 2 * rng.standard_normal((8, 1))
    x, y = (
        offsets + rng.standard_normal((8, 1)) + rng.standard_normal((8, 5)) + shift
        for shift in (0.0, 0.8)
    )
    found = day_difference(x.ravel(), y.ravel(), days_of("d", 8, 5), days_of("d", 8, 5))
    assert found.p == pytest.approx(ttest_rel(x.mean(axis=1), y.mean(axis=1)).pvalue, rel=1e-8)
    assert found.df == pytest.approx(7, rel=1e-8)


def test_several_subjects_have_offsets_of_their_own() -> None:
    """As the model written out, and a day belongs to its subject whatever its label."""
    rng = np.random.default_rng(8)
    subjects = [f"s{k}" for k in range(4) for _ in range(12)]
    days = [f"{d}" for _ in range(4) for d in range(4) for _ in range(3)]
    conditions = ["OFF" if int(day) % 2 == 0 else "DBS" for day in days]
    own = [f"{s}-{d}" for s, d in zip(subjects, days, strict=True)]
    shift = {name: rng.standard_normal() for name in {*subjects, *own}}
    values = np.array([shift[s] + shift[o] for s, o in zip(subjects, own, strict=True)])
    values += rng.standard_normal(values.size)
    off = np.array([name == "OFF" for name in conditions])

    def some(labels: list[str], which: np.ndarray) -> list[str]:
        return [label for label, wanted in zip(labels, which, strict=True) if wanted]

    found = day_difference(
        values[off], values[~off], some(days, off), some(days, ~off),
        x_subjects=some(subjects, off), y_subjects=some(subjects, ~off),
    )  # fmt: skip
    fit = fit_mixed(values, conditions, {"subject": subjects, "subject/day": own})
    expected = difference(fit, "OFF", "DBS")
    assert found.p == pytest.approx(expected.p_kenward_roger, rel=1e-8)
    assert found.se == pytest.approx(expected.se_kenward_roger, rel=1e-8)
    assert (found.n_days_x, found.n_days_y) == (8, 8)


def test_one_day_for_each_subject_is_no_refusal() -> None:
    x, y = made(9, 5, 4, 1.0), made(10, 5, 4, 1.0)
    names = days_of("s", 5, 4)
    others = days_of("t", 5, 4)
    found = day_difference(
        x.ravel(), y.ravel(), ["1"] * 20, ["1"] * 20, x_subjects=names, y_subjects=others
    )
    expected = ttest_ind(x.mean(axis=1), y.mean(axis=1))
    assert found.p == pytest.approx(expected.pvalue, rel=1e-8)
    assert 0 < found.day_share < 1
    assert np.isnan(found.p_days)  # nothing to deal within a subject


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
    x, y = made(11, 9, 1, 0).ravel(), 1 + made(12, 30, 1, 0).ravel()
    assert exact_ranksum([(x, y)]) == pytest.approx(
        mannwhitneyu(x, y, method="exact").pvalue, rel=1e-9
    )


def test_strata_are_dealt_apart() -> None:
    """Two subjects with two days each: 6 × 6 equally likely outcomes, 2 of them as extreme."""
    strata = [([3.0, 4.0], [1.0, 2.0]), ([13.0, 14.0], [11.0, 12.0])]
    assert exact_ranksum(strata) == pytest.approx(2 / 36)
    assert exact_ranksum([*strata, ([1.0], [])]) == pytest.approx(2 / 36)
    assert np.isnan(exact_ranksum([([1.0], [])]))


def test_medians_of_days() -> None:
    assert day_medians([1.0, 5.0, 2.0, 9.0], ["b", "a", "b", "b"]) == {"b": 2.0, "a": 5.0}


def test_p_of_days_is_of_the_medians() -> None:
    x, y = made(13, 4, 3, 0.0), 2 + made(14, 3, 3, 0.0)
    found = day_difference(x.ravel(), y.ravel(), days_of("a", 4, 3), days_of("b", 3, 3))
    medians = np.median(x, axis=1), np.median(y, axis=1)
    assert found.p_days == pytest.approx(mannwhitneyu(*medians, method="exact").pvalue)


@pytest.mark.parametrize(
    ("x_days", "y_days", "told"),
    [
        (["1"] * 4, ["1"] * 4, "only one day"),
        (["1"] * 4, ["2"] * 4, "one day in each condition"),
        (["1"] * 3, ["2"] * 4, "3 days"),
    ],
)
def test_days_that_are_the_conditions_are_refused(x_days, y_days, told) -> None:
    rng = np.random.default_rng(1)
    with pytest.raises(ValueError, match=told):
        day_difference(rng.standard_normal(4), rng.standard_normal(4), x_days, y_days)


@pytest.mark.slow
def test_the_test_of_days_keeps_its_word_where_that_of_epochs_does_not() -> None:
    """No effect, days as far apart as epochs, 78 epochs of nine days and 23 of four."""
    rng = np.random.default_rng(15)
    x_days = [f"a{k % 9}" for k in range(78)]
    y_days = [f"b{k % 4}" for k in range(23)]
    days = np.array([int(d[1:]) for d in x_days]), np.array([int(d[1:]) for d in y_days])
    hits = np.zeros(2)
    draws = 400
    for _ in range(draws):
        x = rng.standard_normal(9)[days[0]] + rng.standard_normal(78)
        y = rng.standard_normal(4)[days[1]] + rng.standard_normal(23)
        p = mannwhitneyu(x, y, method="asymptotic").pvalue
        hits += [day_difference(x, y, x_days, y_days).p < 0.05, p < 0.05]
    assert hits[0] / draws < 0.05 + 3 * np.sqrt(0.05 * 0.95 / draws)
    assert hits[1] / draws > 0.3
