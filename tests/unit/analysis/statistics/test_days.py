"""The test of days against its closed forms: t-tests of the means of days and of subjects."""

import numpy as np
import pytest
from scipy.stats import mannwhitneyu, ttest_ind, ttest_rel

from rigidimeter.analysis.statistics import (
    DayDifference,
    day_difference,
    day_medians,
    partially_paired,
)


def days_of(prefix: str, days: int, epochs: int) -> list[str]:
    return [f"{prefix}{day}" for day in range(days) for _ in range(epochs)]


def made(seed: int, days: int, epochs: int, spread: float) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return spread * rng.standard_normal((days, 1)) + rng.standard_normal((days, epochs))


def of_subjects(
    x: np.ndarray, y: np.ndarray, x_names: list[str], y_names: list[str], shared: bool = True
) -> DayDifference:
    """Test values of shape (subjects, days, epochs)."""
    labels = [
        ([name for name in names for _ in range(values[0].size)],
         [f"{prefix}{day}" for _ in names for day in range(values.shape[1])
          for _ in range(values.shape[2])])
        for names, values, prefix in ((x_names, x, "a"), (y_names, y, "a" if shared else "b"))
    ]  # fmt: skip
    return day_difference(
        x.ravel(), y.ravel(), labels[0][1], labels[1][1],
        x_subjects=labels[0][0], y_subjects=labels[1][0], names=("OFF", "DBS"),
    )  # fmt: skip


def test_separate_days_are_welchs_test_of_their_means() -> None:
    x, y = made(3, 6, 5, 1.0), 0.4 + made(4, 6, 5, 2.0)
    found = day_difference(
        x.ravel(), y.ravel(), days_of("a", 6, 5), days_of("b", 6, 5), confidence=0.9
    )
    expected = ttest_ind(x.mean(axis=1), y.mean(axis=1), equal_var=False)
    assert found.p == pytest.approx(expected.pvalue, rel=1e-10)
    assert (found.low, found.high) == pytest.approx(expected.confidence_interval(0.9), rel=1e-10)
    assert found.estimate == pytest.approx(x.mean() - y.mean(), rel=1e-12)
    assert (found.n_days_x, found.n_days_y, found.n_days_both) == (6, 6, 0)
    assert found.offsets == ("day",)
    assert found.test.startswith("Welch's t-test of 6 days of x and 6 days of y")


def test_days_with_both_conditions_are_the_paired_test_of_their_means() -> None:
    """Whatever the number of epochs: the means of a day are not weighted by it."""
    x, y = made(5, 5, 6, 2.0), made(6, 5, 2, 2.0)
    found = day_difference(x.ravel(), y.ravel(), days_of("d", 5, 6), days_of("d", 5, 2))
    expected = ttest_rel(x.mean(axis=1), y.mean(axis=1))
    assert (found.p, found.df) == pytest.approx((expected.pvalue, 4), rel=1e-10)
    interval = expected.confidence_interval(0.95)
    assert (found.low, found.high) == pytest.approx(tuple(interval), rel=1e-10)
    assert found.test == "paired t-test of 5 days"


def test_days_with_both_and_days_with_one_are_combined() -> None:
    x, y = made(7, 9, 4, 1.0), made(8, 4, 3, 1.0)
    found = day_difference(
        x.ravel(), y.ravel(), days_of("d", 9, 4), days_of("d", 4, 3), names=("OFF", "DBS")
    )
    means = x.mean(axis=1)
    expected = partially_paired(means[:4], y.mean(axis=1), means[4:], [])
    assert (found.estimate, found.se, found.df) == pytest.approx(
        (expected.estimate, expected.se, expected.df), rel=1e-12
    )
    assert (found.n_days_x, found.n_days_y, found.n_days_both) == (9, 4, 4)
    assert found.test == "t-test paired by 4 days, with 5 days of OFF alone at weight 0.28"
    assert found.offsets == ("day", "condition in day")


def test_the_order_of_epochs_does_not_matter() -> None:
    x, y, order = made(7, 9, 4, 1.0).ravel(), made(8, 4, 3, 1.0).ravel(), np.arange(36)
    days = np.array(days_of("d", 9, 4))
    np.random.default_rng(1).shuffle(order)
    first = day_difference(x, y, days.tolist(), days_of("d", 4, 3))
    other = day_difference(x[order], y, days[order].tolist(), days_of("d", 4, 3))
    assert (first.p, first.p_days) == pytest.approx((other.p, other.p_days), rel=1e-9)


def test_three_subjects_with_both_are_compared_as_subjects() -> None:
    x, y = (np.stack([made(seed + k, 4, 3, 1.0) for k in range(4)]) for seed in (10, 20))
    found = of_subjects(x, y, list("stuv"), list("stuw"))
    expected = ttest_rel(x[:3].mean(axis=(1, 2)), y[:3].mean(axis=(1, 2)))
    assert (found.p, found.df) == pytest.approx((expected.pvalue, 2), rel=1e-9)
    assert found.test == ("paired t-test of 3 subjects, 2 subjects with one condition left out")
    assert (found.n_days_x, found.n_days_y, found.n_days_both) == (16, 16, 12)


def test_two_subjects_are_the_mean_over_these_two() -> None:
    x, y = (np.stack([made(seed + k, 4, 3, 1.0) for k in range(2)]) for seed in (30, 40))
    found = of_subjects(x, y, ["s", "t"], ["s", "t"])
    each = [ttest_rel(a.mean(axis=1), b.mean(axis=1)) for a, b in zip(x, y, strict=True)]
    se = [np.std(a.mean(axis=1) - b.mean(axis=1), ddof=1) / 2 for a, b in zip(x, y, strict=True)]
    assert all(abs(one.statistic) > 0 for one in each)
    assert found.estimate == pytest.approx(np.mean(x) - np.mean(y))
    assert found.se == pytest.approx(np.hypot(*se) / 2)
    assert found.df == pytest.approx((se[0] ** 2 + se[1] ** 2) ** 2 / (se[0] ** 4 + se[1] ** 4) * 3)
    assert found.test.startswith("mean of 2 subjects, each by its days (")


def test_subjects_of_one_condition_each_are_welchs_test_of_subjects() -> None:
    x, y = (np.stack([made(seed + k, 1, 4, 1.0) for k in range(5)]) for seed in (50, 60))
    found = of_subjects(x, y, list("stuvw"), list("STUVW"))
    expected = ttest_ind(x.mean(axis=(1, 2)), y.mean(axis=(1, 2)), equal_var=False)
    assert found.p == pytest.approx(expected.pvalue, rel=1e-9)
    assert np.isnan(found.p_days)  # nothing to deal within a subject
    assert found.offsets == ("subject", "day")


def test_the_share_between_days_is_that_of_mean_squares() -> None:
    x, y = made(3, 9, 5, 1.0), 0.4 + made(4, 4, 5, 1.0)
    found = day_difference(x.ravel(), y.ravel(), days_of("a", 9, 5), days_of("b", 4, 5))
    within = np.mean([*x.var(axis=1, ddof=1), *y.var(axis=1, ddof=1)])
    sums = 5 * (8 * x.mean(axis=1).var(ddof=1) + 3 * y.mean(axis=1).var(ddof=1))
    between = (sums / 11 - within) / 5
    assert found.day_share == pytest.approx(between / (between + within), rel=1e-12)
    one = day_difference(x[:, 0], y[:, 0], days_of("a", 9, 1), days_of("b", 4, 1))
    assert np.isnan(one.day_share)


def test_medians_of_days() -> None:
    assert day_medians([1.0, 5.0, 2.0, 9.0], ["b", "a", "b", "b"]) == {"b": 2.0, "a": 5.0}


def test_p_of_days_is_of_the_medians() -> None:
    x, y = made(13, 4, 3, 0.0), 2 + made(14, 3, 3, 0.0)
    found = day_difference(x.ravel(), y.ravel(), days_of("a", 4, 3), days_of("b", 3, 3))
    medians = np.median(x, axis=1), np.median(y, axis=1)
    assert found.p_days == pytest.approx(mannwhitneyu(*medians, method="exact").pvalue)


def test_two_days_that_agree_by_chance_have_the_error_of_their_epochs() -> None:
    """Differences of 1 and 1.001 on two days, epochs with a variance of 0.5 about each mean."""
    x, y = np.array([[0.5, 1.5], [1.0, 2.0]]), np.array([[-0.5, 0.5], [-0.001, 0.999]])
    found = day_difference(x.ravel(), y.ravel(), days_of("d", 2, 2), days_of("d", 2, 2))
    assert found.se == pytest.approx(np.sqrt(2 * 0.5 * (1 / 2 + 1 / 2) / 2**2))
    assert found.p > 0.2
    assert found.test.endswith("with the standard error of the epochs alone, which is larger")
    one = day_difference(x[:, 0], y[:, 0], days_of("d", 2, 1), days_of("d", 2, 1))
    assert one.p == pytest.approx(ttest_rel(x[:, 0], y[:, 0]).pvalue)


@pytest.mark.parametrize(
    ("x_days", "y_days", "told"),
    [
        (["1"] * 4, ["1"] * 4, "only one day"),
        (["1"] * 4, ["2"] * 4, "one day in each condition"),
        (["1"] * 4, ["2", "3"] * 2, "one day of x, so how much x differs between days is unknown"),
        (["1", "2"] * 2, ["2"] * 4, "one day of y"),
        (["1"] * 3, ["2"] * 4, "3 days"),
    ],
)
def test_one_day_of_a_condition_is_refused(x_days, y_days, told) -> None:
    rng = np.random.default_rng(1)
    with pytest.raises(ValueError, match=told):
        day_difference(rng.standard_normal(4), rng.standard_normal(4), x_days, y_days)


def test_two_subjects_with_one_day_are_refused_by_name() -> None:
    x, y = (np.stack([made(seed + k, 1, 4, 1.0) for k in range(2)]) for seed in (70, 80))
    with pytest.raises(ValueError, match="subject s: there is only one day"):
        of_subjects(x, y, ["s", "t"], ["s", "t"])


@pytest.mark.slow
def test_the_test_of_days_keeps_its_word_where_that_of_epochs_does_not() -> None:
    """No effect, 78 epochs of nine days and 23 of four of them, a day alike or each by itself."""
    rng, draws = np.random.default_rng(15), 2000
    place = np.arange(78) % 9, np.arange(23) % 4
    labels = [[f"a{k}" for k in days] for days in place]
    for alike in (True, False):
        hits = np.zeros(2)
        for _ in range(draws):
            days = rng.standard_normal((2, 9))
            x, y = (
                days[k * (not alike)][where] + rng.standard_normal(where.size)
                for k, where in enumerate(place)
            )
            p = mannwhitneyu(x, y, method="asymptotic").pvalue
            hits += [day_difference(x, y, *labels).p < 0.05, p < 0.05]
        assert 0.035 < hits[0] / draws < 0.065
        assert hits[1] / draws > 0.1


Epoch = tuple[str, str, float]
"""Subject, day and value."""


def epochs_of(condition: int, subjects: dict[str, tuple[str, str]]) -> list[Epoch]:
    """Return the epochs of a condition: each subject names the days with it, one letter each.

    The number of epochs differs from day to day, and so does the level.
    """
    rng = np.random.default_rng(5 + condition)
    return [
        (subject, day, 2.0 - 0.4 * condition + 0.3 * ord(day) % 0.7 + 0.05 * value)
        for subject, days in subjects.items()
        for day in days[condition]
        for value in rng.standard_normal(1 + (ord(day) + condition) % 3)
    ]


WEIGHED = {
    "one subject, paired": {"M1": ("abc", "abc")},
    "one subject, partly paired": {"M1": ("abcde", "abcf")},
    "one subject, no day with both": {"M1": ("abc", "de")},
    "one subject, one day with both": {"M1": ("abc", "cde")},
    "two subjects": {"M1": ("abc", "abcd"), "M2": ("ef", "gh")},
    "five subjects": {f"M{k}": ("abcd"[: 2 + k % 3], "abe"[: 1 + k % 3]) for k in range(5)},
    "a subject with one condition": {
        **{f"M{k}": ("abc"[: 1 + k], "bde"[: 3 - k]) for k in range(3)},
        "M9": ("ab", ""),
    },
    "no subject with both": {
        **{f"M{k}": ("abc"[: 1 + k], "") for k in range(3)},
        **{f"M{k}": ("", "ab"[: k - 2]) for k in (3, 4)},
    },
}


@pytest.mark.parametrize("subjects", WEIGHED.values(), ids=WEIGHED)
def test_means_are_those_of_the_days_with_their_weights(subjects) -> None:
    """mean = Σ w_d m_d, m_d the mean of the epochs of a day, Σ w_d = 1."""
    columns = [list(zip(*epochs_of(k, subjects), strict=True)) for k in (0, 1)]
    (x_subjects, x_days, x), (y_subjects, y_days, y) = columns
    found = day_difference(x, y, x_days, y_days, x_subjects=x_subjects, y_subjects=y_subjects)
    for k, mean in enumerate((found.mean_x, found.mean_y)):
        by_day: dict[tuple[str, str], list[float]] = {}
        for subject, day, value in epochs_of(k, subjects):
            by_day.setdefault((subject, day), []).append(value)
        weights = found.weights[k]
        assert set(weights) == {key for key in by_day if key[0] != "M9"}
        assert sum(weights.values()) == pytest.approx(1.0, rel=1e-12)
        assert min(weights.values()) > 0
        weighted = sum(weight * np.mean(by_day[key]) for key, weight in weights.items())
        assert weighted == pytest.approx(mean, rel=1e-12)
    assert found.estimate == pytest.approx(found.mean_x - found.mean_y, rel=1e-12)


def test_days_of_a_subject_count_alike_and_so_do_subjects() -> None:
    """Three subjects with both conditions, so a day of a subject with m days has 1/(3 m)."""
    subjects = WEIGHED["a subject with one condition"]
    columns = [list(zip(*epochs_of(k, subjects), strict=True)) for k in (0, 1)]
    (x_subjects, x_days, x), (y_subjects, y_days, y) = columns
    found = day_difference(x, y, x_days, y_days, x_subjects=x_subjects, y_subjects=y_subjects)
    assert found.test.endswith("1 subject with one condition left out")
    for k, own in enumerate(found.weights):
        assert own == {
            (subject, day): pytest.approx(1 / (3 * len(days[k])))
            for subject, days in subjects.items()
            if subject != "M9"
            for day in days[k]
        }
