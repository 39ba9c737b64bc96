"""Power of the rank-sum test against simulation; wanted differences and epochs needed."""

import math

import numpy as np
import pytest
from scipy.stats import mannwhitneyu, norm

from rigidimeter.analysis.statistics import ranksum
from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.planning import (
    ExpectedEffect,
    WantedDifference,
    detect,
    epoch_sd,
    planned_epochs,
    prbs_nm,
    predicted_precision,
    ranksum_power,
    sample_size,
)


def simulated_power(effect: ExpectedEffect, n_x: int, n_y: int, tests: int = 4000) -> float:
    rng = np.random.default_rng(n_x + 1000 * n_y)
    x = effect.difference + effect.sd_x * rng.standard_normal((tests, n_x))
    y = effect.sd_y * rng.standard_normal((tests, n_y))
    p = mannwhitneyu(x, y, axis=1, method="asymptotic", use_continuity=True).pvalue
    return float(np.mean(p <= 0.05))


@pytest.mark.parametrize("n", [5, 6, 8, 12, 20, 40, 80])
@pytest.mark.parametrize("standard_errors", [0.0, 1.5, 2.8, 3.8])
@pytest.mark.parametrize("ratio", [1.0, 1.25])
def test_the_predicted_power_is_the_simulated_one(
    n: int, standard_errors: float, ratio: float
) -> None:
    """A difference of so many standard errors of the difference: powers from 3 to 97 %."""
    difference = standard_errors * math.sqrt((1.0 + ratio**2) / n)
    effect = ExpectedEffect(difference, 1.0, ratio)
    assert ranksum_power(effect, n, n) == pytest.approx(simulated_power(effect, n, n), abs=0.03)


@pytest.mark.parametrize(("n_x", "n_y"), [(78, 23), (12, 5), (5, 12)])
def test_conditions_of_different_size(n_x: int, n_y: int) -> None:
    effect = ExpectedEffect(2.8 * math.sqrt(1 / n_x + 1.2**2 / n_y), 1.0, 1.2)
    assert ranksum_power(effect, n_x, n_y) == pytest.approx(
        simulated_power(effect, n_x, n_y), abs=0.03
    )


@pytest.mark.parametrize(("n_x", "n_y"), [(3, 3), (4, 4), (5, 8)])
def test_it_is_the_products_test(n_x: int, n_y: int) -> None:
    """With complete separation the power is 1 where `ranksum` is significant, else 0."""
    apart = ranksum(np.arange(n_x) + 100.0, np.arange(n_y)).p <= 0.05
    assert ranksum_power(ExpectedEffect(100.0, 1.0, 1.0), n_x, n_y) == float(apart)


def test_large_samples_lose_3_over_pi_to_the_t_test() -> None:
    n, shift = 2000, 0.08
    noncentral = shift / math.sqrt(2.0 / (n * 3.0 / math.pi))
    expected = norm.sf(norm.isf(0.025) - noncentral)
    assert ranksum_power(ExpectedEffect(shift, 1.0, 1.0), n, n) == pytest.approx(
        expected, abs=0.005
    )


def test_sign_unit_and_order_do_not_matter() -> None:
    power = ranksum_power(ExpectedEffect(0.5, 1.0, 1.3), 20, 12)
    assert ranksum_power(ExpectedEffect(-0.5, 1.0, 1.3), 20, 12) == pytest.approx(power)
    assert ranksum_power(ExpectedEffect(50.0, 100.0, 130.0), 20, 12) == pytest.approx(power)
    assert ranksum_power(ExpectedEffect(0.5, 1.3, 1.0), 12, 20) == pytest.approx(power)


def test_without_a_difference_the_power_is_the_level() -> None:
    assert ranksum_power(ExpectedEffect(0.0, 1.0, 1.0), 80, 80) == pytest.approx(0.05, abs=0.002)
    assert ranksum_power(ExpectedEffect(0.0, 1.0, 1.0), 80, 80, alpha=0.2) == pytest.approx(
        0.2, abs=0.005
    )


@pytest.mark.parametrize("power", [0.5, 0.8, 0.95])
def test_the_sample_size_is_the_smallest_that_will_do(power: float) -> None:
    effect = ExpectedEffect(0.6, 1.0, 1.1)
    found = sample_size(effect, power)
    assert ranksum_power(effect, found, found) >= power
    assert ranksum_power(effect, found - 1, found - 1) < power


def test_certain_differences_need_four_epochs() -> None:
    assert sample_size(ExpectedEffect(1.0, 0.0, 0.0)) == 4  # three and three cannot be significant


def test_an_epoch_scatters_by_estimate_and_joint() -> None:
    assert epoch_sd(3.0, 0.0, 20.0) == 3.0
    assert epoch_sd(0.0, 10.0, 20.0) == pytest.approx(2.0 * math.sqrt(1.04))
    assert epoch_sd(3.0, 400.0, 1.0) == pytest.approx(5.0, rel=1e-4)
    draws = 10.0 * np.exp(
        math.sqrt(math.log1p(0.09)) * np.random.default_rng(2).standard_normal(200_000)
    )
    assert epoch_sd(0.0, 10.0, 30.0) == pytest.approx(np.std(draws), rel=0.01)


def test_impossible_plans_are_refused() -> None:
    with pytest.raises(UserError, match="a difference of 0 cannot be detected"):
        sample_size(ExpectedEffect(0.0, 1.0, 1.0))
    with pytest.raises(UserError, match="a power of 1 cannot be planned"):
        sample_size(ExpectedEffect(1.0, 1.0, 1.0), 1.0)
    with pytest.raises(UserError, match="needs more than 5000 epochs"):
        sample_size(ExpectedEffect(0.001, 1.0, 1.0))
    with pytest.raises(ValueError, match="sizes of at least 1"):
        ranksum_power(ExpectedEffect(1.0, 1.0, 1.0), 0, 5)


VARIED = {
    "subject": {"OFF": {"voluntary_sd_nm": 0.1, "damping_cv_percent": 20.0}, "DBS": {}},
    "protocol": {"blocks": [{"epochs": 40}, {"epochs": 12, "condition": "DBS"}]},
}


def perturbation(settings: Settings) -> np.ndarray:
    return prbs_nm(settings.prbs, settings.rig.tick_rate_hz)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("damping=20%", WantedDifference("damping", 20.0, True)),
        ("stiffness=0.3", WantedDifference("stiffness", 0.3, False)),
        ("inertia = -5 %", WantedDifference("inertia", -5.0, True)),
    ],
)
def test_a_difference_is_read(text: str, wanted: WantedDifference) -> None:
    assert WantedDifference.parse(text) == wanted


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("damping", "names no difference; write inertia, damping or stiffness"),
        ("mass=2", "names no difference"),
        ("damping=", "nothing is not a number other than 0"),
        ("damping=much", "much is not a number other than 0"),
        ("damping=0%", "0% is not a number other than 0"),
        ("damping=nan", "nan is not a number"),
    ],
)
def test_what_is_no_difference_is_a_sentence(text: str, words: str) -> None:
    with pytest.raises(UserError, match=words):
        WantedDifference.parse(text)


def test_epochs_needed_follow_from_error_and_variation() -> None:
    settings = parse_settings(VARIED)
    found = detect(settings, perturbation(settings), WantedDifference.parse("damping=20%"))
    off = predicted_precision(perturbation(settings), settings, settings.subject["OFF"])
    assert found.condition == "OFF"
    assert found.cv_percent == 20.0
    assert found.effect.difference == pytest.approx(0.2 * 0.1368)
    assert found.effect.sd_x == pytest.approx(epoch_sd(off.iv.fixed_inertia[0], 0.1368, 20.0))
    assert found.effect.sd_y < found.effect.sd_x
    assert found.power >= 0.8
    assert found.powers[20] == ranksum_power(found.effect, 20, 20)
    assert found.planned == (40, 12)
    assert found.planned_power == ranksum_power(found.effect, 40, 12)
    same = detect(
        settings, perturbation(settings), WantedDifference("damping", 0.2 * 0.1368, False)
    )
    assert same.effect.difference == pytest.approx(found.effect.difference)
    assert same.needed == found.needed


def test_a_stricter_wish_needs_more() -> None:
    settings = parse_settings(VARIED)
    torque, wanted = perturbation(settings), WantedDifference.parse("damping=20%")
    base = detect(settings, torque, wanted).needed
    assert detect(settings, torque, wanted, power=0.95).needed > base
    assert detect(settings, torque, wanted, alpha=0.01).needed > base
    assert detect(settings, torque, WantedDifference.parse("damping=10%")).needed > 3 * base


def test_the_inertia_has_the_error_of_the_whole_fit() -> None:
    settings = parse_settings({"subject": {"OFF": {"voluntary_sd_nm": 0.1}, "DBS": {}}})
    found = detect(settings, perturbation(settings), WantedDifference.parse("inertia=10%"))
    whole = predicted_precision(perturbation(settings), settings, settings.subject["OFF"])
    assert found.effect.sd_x == pytest.approx(whole.iv.free[0])
    assert found.planned is None  # the default protocol runs OFF alone
    assert math.isnan(found.planned_power)


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        ("damping=100%", {}, "is not above 0, since subject.OFF.damping_nm_s_rad = 0.1368"),
        ("stiffness=2", {}, "is not above 0, since subject.OFF.stiffness_nm_rad = 1.751"),
        ("damping=5%", {"power": 1.0}, "--power 1 and --alpha 0.05 must both be between 0 and 1"),
        ("damping=5%", {"alpha": 0.0}, "--power 0.8 and --alpha 0 must both"),
    ],
)
def test_wishes_that_cannot_be_met_are_sentences(text: str, options: dict, words: str) -> None:
    settings = Settings()
    with pytest.raises(UserError, match=words):
        detect(settings, perturbation(settings), WantedDifference.parse(text), **options)


def test_planned_epochs_are_those_of_the_prbs() -> None:
    assert planned_epochs(Settings()) == {"OFF": 4, "DBS": 0}
    assert planned_epochs(parse_settings(VARIED)) == {"OFF": 40, "DBS": 12}
