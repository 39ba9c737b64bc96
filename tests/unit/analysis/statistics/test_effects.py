"""Effect sizes: closed forms, the bootstrap against scipy's, and what pairing is worth."""

import math

import numpy as np
import pytest
from scipy.stats import bootstrap as scipy_bootstrap
from statsmodels.stats.multitest import multipletests

from rigidimeter.analysis.statistics import (
    bootstrap,
    compare_effects,
    compare_published,
    effect_from_p,
    effect_sizes,
    holm,
    largest_r,
    rank_biserial,
    rank_biserial_interval,
    ranksum,
    two_groups,
)


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def test_rank_biserial_is_the_share_of_pairs() -> None:
    assert rank_biserial([3.0, 4.0], [1.0, 3.0]) == 0.75  # above, equal, above, above
    x, y = rng().standard_normal(20), rng(1).standard_normal(13)
    assert rank_biserial(x, y) == pytest.approx(2 * ranksum(x, y).u / (20 * 13) - 1)
    assert rank_biserial(x, y) == -rank_biserial(y, x)
    assert rank_biserial(np.exp(x), np.exp(y)) == rank_biserial(x, y)


def test_r_of_groups_that_do_not_overlap_depends_on_their_sizes() -> None:
    for m, n in ((78, 23), (27, 12), (50, 50)):
        test = ranksum(np.arange(m) + 1000.0, np.arange(n) * 1.0)
        assert largest_r(m, n) == pytest.approx(test.z_uncorrected / math.sqrt(m + n))
    assert largest_r(78, 23) == pytest.approx(0.723, abs=1e-3)
    assert largest_r(50, 50) == pytest.approx(0.862, abs=1e-3)


def test_a_published_p_gives_z_r_and_back() -> None:
    x, y = rng(2).normal(1.0, 1, 30), rng(3).standard_normal(17)
    test = ranksum(x, y)
    effect = effect_from_p(test.p_uncorrected, 30, 17)
    assert effect.z == pytest.approx(abs(test.z_uncorrected))
    assert effect.r == pytest.approx(abs(test.z_uncorrected) / math.sqrt(47))
    assert effect.rank_biserial == pytest.approx(abs(rank_biserial(x, y)))
    assert effect_from_p(1.0, 5, 5).r == 0
    for p in (0.0, -0.1, 1.1, math.nan):
        with pytest.raises(ValueError, match="p must be above 0"):
            effect_from_p(p, 5, 5)


def test_newcombe_s_interval_solves_its_equation_and_holds_at_the_end() -> None:
    low, high = rank_biserial_interval(0.5, 30, 20)
    for end in (low, high):
        area = (1 + end) / 2
        spread = 1 + 24 * ((1 - area) / (2 - area) + area / (1 + area))
        se = math.sqrt(area * (1 - area) * spread / 600)
        assert abs(0.75 - area) == pytest.approx(1.959964 * se, rel=1e-5)
    low, high = rank_biserial_interval(1.0, 30, 20)
    assert high == 1
    assert 0.8 < low < 0.99
    assert rank_biserial_interval(-1.0, 30, 20) == (-high, -low)


def test_published_effects_are_compared_as_independent() -> None:
    one, two = effect_from_p(1e-4, 78, 23), effect_from_p(0.02, 92, 46)
    found = compare_published(one, two)
    assert found.estimate == pytest.approx(one.rank_biserial - two.rank_biserial)
    assert found.low < found.estimate < found.high
    other = compare_published(two, one)
    assert (other.low, other.high) == pytest.approx((-found.high, -found.low))
    assert compare_published(one, one).p == pytest.approx(1.0)


def test_the_bootstrap_is_scipy_s_bca() -> None:
    """Our interval from our resamples, against scipy's from the same."""
    sample = rng(4).exponential(size=25)

    def mean(counts: np.ndarray) -> np.ndarray:
        return counts @ sample / counts.sum(axis=1)

    found = bootstrap(mean, [25], rng(5), resamples=2000)
    known = scipy_bootstrap((sample,), np.mean, n_resamples=10, method="BCa", rng=rng(6))
    known.bootstrap_distribution = found.distribution
    theirs = scipy_bootstrap(
        (sample,), np.mean, n_resamples=0, bootstrap_result=known, method="BCa", rng=rng(7)
    ).confidence_interval
    assert (found.low, found.high) == pytest.approx((theirs.low, theirs.high), rel=1e-9)


def test_p_is_where_the_interval_ends_at_zero() -> None:
    sample = rng(8).normal(0.45, 1.0, 30)

    def mean(counts: np.ndarray) -> np.ndarray:
        return counts @ sample / counts.sum(axis=1)

    p = bootstrap(mean, [30], rng(9)).p
    assert 0.001 < p < 0.2
    touching = bootstrap(mean, [30], rng(9), confidence=1 - p)
    assert min(abs(touching.low), abs(touching.high)) < 0.005


def test_the_same_seed_gives_the_same_interval() -> None:
    groups = two_groups(rng(1).normal(1, 1, 20), rng(2).standard_normal(15))
    assert effect_sizes(groups, rng(3)) == effect_sizes(groups, rng(3))
    assert effect_sizes(groups, rng(3)) != effect_sizes(groups, rng(4))


def test_r_at_the_estimate_is_the_test_s() -> None:
    x, y = (
        np.round(rng(1).normal(2, 0.6, 27) * 2) / 2,
        np.round(rng(2).normal(1.5, 0.6, 12) * 2) / 2,
    )
    found = effect_sizes(two_groups(x, y), rng())
    assert found.r == ranksum(x, y).r
    assert found.r_low < found.r < found.r_high
    assert found.rank_biserial_low < found.rank_biserial < found.rank_biserial_high
    assert found.method == "BCa"


def test_groups_that_do_not_overlap_are_not_called_certain() -> None:
    found = effect_sizes(two_groups(np.arange(9) + 20.0, np.arange(4) * 1.0), rng())
    assert found.method == "Newcombe"
    assert found.rank_biserial == found.rank_biserial_high == 1
    assert found.rank_biserial_low < 0.9
    assert found.r_high == pytest.approx(found.r)


def test_values_that_are_all_equal_have_no_effect() -> None:
    found = effect_sizes(two_groups(np.ones(5), np.ones(6)), rng())
    assert (found.r, found.rank_biserial, found.r_low, found.r_high) == (0, 0, 0, 0)


def _two_measures(seed: int, common: float):
    g = rng(seed)
    shift = np.repeat([1.0, 0.0], [60, 40])
    shared = g.standard_normal(100)
    one = shift + common * shared + math.sqrt(1 - common**2) * g.standard_normal(100)
    two = 0.6 * shift + common * shared + math.sqrt(1 - common**2) * g.standard_normal(100)
    return two_groups(one[:60], one[60:]), two_groups(two[:60], two[60:])


def test_a_measure_does_not_differ_from_itself() -> None:
    one, _ = _two_measures(1, 0.9)
    found = compare_effects(one, one, rng(), paired=True)
    assert found.estimate == 0
    assert math.isnan(found.low)
    assert math.isnan(found.p)
    apart = compare_effects(one, one, rng(), paired=False)
    assert apart.low < 0 < apart.high
    assert apart.p > 0.9


def test_pairing_narrows_the_interval_of_measures_that_agree() -> None:
    one, two = _two_measures(2, 0.95)
    paired = compare_effects(one, two, rng(), paired=True)
    apart = compare_effects(one, two, rng(), paired=False)
    assert paired.estimate == pytest.approx(apart.estimate)
    assert paired.high - paired.low < 0.6 * (apart.high - apart.low)


def test_the_direction_of_a_measure_does_not_count() -> None:
    one, two = _two_measures(3, 0.5)
    turned = two_groups(-two.x, -two.y)
    a = compare_effects(one, two, rng(5), paired=True)
    b = compare_effects(one, turned, rng(5), paired=True)
    assert (b.estimate, b.low, b.high, b.p) == pytest.approx((a.estimate, a.low, a.high, a.p))


def test_sessions_stay_together_and_may_lack_a_measure() -> None:
    g = rng(6)
    x, y = g.normal(1, 1, 60), g.normal(0, 1, 30)
    labels_x, labels_y = [f"d{k // 5}" for k in range(60)], [f"s{k // 5}" for k in range(30)]
    copies = effect_sizes(
        two_groups(np.repeat(x[:12], 5), np.repeat(y[:6], 5), labels_x, labels_y), rng()
    )
    single = effect_sizes(two_groups(x[:12], y[:6]), rng())
    assert copies.rank_biserial == pytest.approx(single.rank_biserial)
    # Five copies of each value are no more information than one.
    assert copies.rank_biserial_low == pytest.approx(single.rank_biserial_low, abs=1e-12)
    whole = two_groups(x, y, labels_x, labels_y)
    part = two_groups(x[5:], y, labels_x[5:], labels_y)
    assert compare_effects(whole, part, rng(), paired=True).paired
    with pytest.raises(ValueError, match="units that both measures have"):
        compare_effects(whole, two_groups(x, y), rng(), paired=True)


def test_holm_orders_and_keeps_what_is_no_test() -> None:
    assert holm([0.01, 0.04, 0.03]) == pytest.approx((0.03, 0.06, 0.06))
    first, second, third = holm([0.01, math.nan, 0.02])
    assert (first, third) == pytest.approx((0.02, 0.02))
    assert math.isnan(second)
    assert holm([0.9, 0.8]) == (1.0, 1.0)
    assert holm([]) == ()
    assert math.isnan(holm([math.nan])[0])


def test_holms_adjustment_is_that_of_statsmodels() -> None:
    p = np.random.default_rng(0).uniform(size=9) ** 3
    assert holm(p) == pytest.approx(multipletests(p, method="holm")[1])


def test_what_cannot_be_resampled_is_refused() -> None:
    groups = two_groups([1.0, 2.0], [3.0])
    with pytest.raises(ValueError, match="at least 100"):
        effect_sizes(groups, rng(), resamples=10)
    with pytest.raises(ValueError, match="confidence"):
        effect_sizes(groups, rng(), confidence=1.0)
    with pytest.raises(ValueError, match="x must be finite"):
        two_groups([np.inf], [1.0])
    with pytest.raises(ValueError, match="y has 1 values and 2 units"):
        two_groups([1.0], [1.0], ["a"], ["a", "b"])
