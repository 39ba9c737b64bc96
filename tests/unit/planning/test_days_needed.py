"""Days and subjects needed: sample size of the paired t-test, the model of days, differences."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import t as student

from rigidimeter.analysis.statistics import day_difference
from rigidimeter.analysis.statistics import test_by_levels as by_levels
from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.core.study_files import PrimaryTable, primary_named
from rigidimeter.planning import (
    ASSUMED,
    Scatter,
    WantedDifference,
    day_difference_sd,
    detections,
    paired_power,
    pairs_needed,
    planned_epochs,
    prbs_nm,
    predicted_precision,
)

STUDIES = 2000
SAMPLE_SIZES = [
    (1.0, 0.8, 0.05, 9.937864),
    (0.5, 0.8, 0.05, 33.36720),
    (1.0, 0.9, 0.05, 12.58546),
    (2.0, 0.8, 0.05, 4.220719),
    (1.0, 0.8, 0.01, 15.08070),
]


@pytest.mark.parametrize(("difference", "power", "alpha", "pairs"), SAMPLE_SIZES)
def test_it_is_the_sample_size_of_the_paired_t_test(difference, power, alpha, pairs):
    """As R's power.t.test(delta=, sd=1, power=, sig.level=, type="paired") gives it."""
    found = brentq(lambda n: paired_power(difference, 1.0, n, alpha=alpha) - power, 2.0, 100.0)
    assert found == pytest.approx(pairs, abs=2e-5)
    assert pairs_needed(difference, 1.0, power, alpha=alpha) == math.ceil(pairs)


def test_without_any_scatter_three_days_show_it():
    """Two days with both conditions are not tested by their differences alone."""
    assert pairs_needed(1.0, 0.0) == 3
    assert paired_power(1.0, 0.0, 3) == 1.0


def test_the_unit_and_the_sign_do_not_matter():
    power = paired_power(0.5, 1.3, 8)
    assert paired_power(-0.5, 1.3, 8) == power
    assert paired_power(50.0, 130.0, 8) == pytest.approx(power)


def test_a_difference_too_small_for_a_thousand_days_has_no_number():
    assert pairs_needed(0.01, 1.0) is None
    assert pairs_needed(0.1, 1.0) == 787


@pytest.mark.parametrize(("sd", "pairs", "alpha"), [(-1.0, 5, 0.05), (1.0, 1, 0.05), (1.0, 5, 1.0)])
def test_numbers_out_of_range_are_refused(sd, pairs, alpha):
    with pytest.raises(ValueError, match="more than 1 pair"):
        paired_power(1.0, sd, pairs, alpha=alpha)


def _draw(rng, scatter, epoch_se, n, days, difference):
    """Draw epochs of two conditions as the model says, the first of 1; return them by day."""
    share, of_days, of_one = (
        percent / 100.0
        for percent in (
            scatter.between_epochs_percent,
            scatter.between_days_percent,
            scatter.condition_in_day_percent,
        )
    )
    alike = math.sqrt(of_days**2 - of_one**2) * rng.standard_normal((days, 1))
    x, y = (
        level
        + alike
        + of_one * level * rng.standard_normal((days, 1))
        + math.hypot(share * level, se) * rng.standard_normal((days, n))
        for level, se in zip((1.0, 1.0 - difference), epoch_se, strict=True)
    )
    return x, y


def test_the_day_that_both_conditions_share_cancels():
    """The variance of a day's difference, from 20,000 days."""
    scatter = Scatter(8.0, 30.0, 5.0, "")
    x, y = _draw(np.random.default_rng(3), scatter, (0.02, 0.04), 4, 20_000, 0.2)
    found = np.std(x.mean(axis=1) - y.mean(axis=1), ddof=1)
    assert found == pytest.approx(
        day_difference_sd(scatter, (1.0, 0.8), (0.02, 0.04), (4, 4)), rel=0.02
    )


def test_many_epochs_a_day_leave_what_a_day_does_to_one_condition():
    scatter = Scatter(20.0, 12.0, 8.0, "")
    sds = [day_difference_sd(scatter, (2.0, 1.0), (0.1, 0.1), (n, n)) for n in (1, 10, 10**9)]
    assert sds[0] > sds[1] > sds[2]
    assert sds[2] == pytest.approx(0.08 * math.sqrt(2.0**2 + 1.0**2))


VARIED = {
    "subject": {"OFF": {"voluntary_sd_nm": 0.1}, "DBS": {}},
    "protocol": {"blocks": [{"epochs": 5}, {"epochs": 3, "condition": "DBS"}]},
}


def perturbation(settings: Settings) -> np.ndarray:
    return prbs_nm(settings.prbs, settings.rig.tick_rate_hz)


def found_for(text: str, tables: dict = VARIED, **options):
    settings = parse_settings(tables)
    wanted = [WantedDifference.parse(text)]
    return detections(settings, perturbation(settings), wanted, **options)[0]


@pytest.mark.parametrize(
    ("text", "epochs", "primary"),
    [
        ("damping=15%", 1, "damping"),
        ("stiffness=12%", 3, "stiffness"),
        ("stiffness=15%", 5, "stiffness,damping"),
    ],
)
def test_studies_of_that_many_days_find_it_by_the_test_of_compare(text, epochs, primary):
    """2,000 virtual studies of as many days and epochs; days are whole, so that 0.8 is exceeded."""
    found = found_for(text, primary=primary_named(primary))
    one = next(each for each in found.needed if each.epochs[0] == epochs)
    days, alpha = one.days, found.level
    assert alpha == 0.05 / len(primary.split(","))
    predicted = paired_power(found.difference, one.day_sd, days, alpha=alpha)
    assert predicted >= 0.8
    assert paired_power(found.difference, one.day_sd, days - 1, alpha=alpha) < 0.8
    rng = np.random.default_rng(7)
    errors = tuple(se / found.value for se in found.epoch_se)
    share = found.difference / found.value
    shown = 0
    for _ in range(STUDIES):
        x, y = _draw(rng, found.scatter, errors, epochs, days, share)
        of_days = {f"{day}": (list(x[day]), list(y[day])) for day in range(days)}
        shown += _p(by_levels({"": of_days}, ("OFF", "DBS"), "day")) < alpha
    power = shown / STUDIES
    print(f"{text}: {days} days of {epochs} epochs: power {power:.3f}, said {predicted:.3f}")
    assert power == pytest.approx(predicted, abs=0.03)
    assert power == pytest.approx(0.8, abs=0.05)
    labels = [day for day in of_days for _ in range(epochs)]
    compared = day_difference(x.ravel(), y.ravel(), labels, labels)
    assert compared.p == pytest.approx(_p(by_levels({"": of_days}, ("OFF", "DBS"), "day")))


def _p(tested):
    """Of the test by days or subjects, 1 where the difference has the wrong sign."""
    return 2 * student.sf(tested.estimate / tested.se, tested.df) if tested.estimate > 0 else 1.0


def test_subjects_of_one_day_find_it_by_the_test_of_compare():
    found = found_for("damping=30%", primary=primary_named("damping"))
    one = next(each for each in found.needed if each.epochs[0] == 5)
    effect_sd = found.scatter.between_subjects * found.difference
    sd = math.hypot(effect_sd, one.day_sd)
    predicted = paired_power(found.difference, sd, one.subjects)
    rng = np.random.default_rng(8)
    errors = tuple(se / found.value for se in found.epoch_se)
    shown = 0
    for _ in range(STUDIES):
        x, y = _draw(rng, found.scatter, errors, 5, one.subjects, found.difference / found.value)
        y = y + rng.normal(0.0, effect_sd, (one.subjects, 1)) / found.value
        subjects = {f"{k}": {"1": (list(x[k]), list(y[k]))} for k in range(one.subjects)}
        tested = by_levels(subjects, ("OFF", "DBS"), "day")
        assert tested.unit == "subject"
        shown += _p(tested) < 0.05
    assert shown / STUDIES == pytest.approx(predicted, abs=0.03)


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
        ("damping", "the difference is missing; write .* such as damping=20%"),
        ("stifness=18%", '--detect stifness=18%: unknown parameter "stifness"; did you mean stiff'),
        ("mass=2", 'unknown parameter "mass"; known: inertia, damping, stiffness'),
        ("damping=", "nothing is not a number other than 0"),
        ("damping=much", "much is not a number other than 0"),
        ("damping=0%", "0% is not a number other than 0"),
        ("damping=nan", "nan is not a number"),
    ],
)
def test_what_is_no_difference_is_a_sentence(text: str, words: str) -> None:
    with pytest.raises(UserError, match=words):
        WantedDifference.parse(text)


def test_days_follow_from_error_and_scatter() -> None:
    settings = parse_settings(VARIED)
    found = found_for("damping=20%")
    off = predicted_precision(perturbation(settings), settings, settings.subject["OFF"])
    assert found.condition == "OFF"
    assert found.scatter == ASSUMED["damping"]
    assert found.difference == pytest.approx(0.2 * 0.1368)
    assert found.epoch_se[0] == off.iv.free[1]
    for each in (*found.needed, found.planned):
        sd = day_difference_sd(found.scatter, (0.1368, 0.8 * 0.1368), found.epoch_se, each.epochs)
        assert each.day_sd == pytest.approx(sd)
        assert each.days_alone == pairs_needed(found.difference, sd)
        assert each.days == pairs_needed(found.difference, sd, alpha=0.05 / 2)
        of_subjects = math.hypot(found.difference / 2, sd)
        assert each.subjects == pairs_needed(found.difference, of_subjects, alpha=0.05 / 2)
    assert found.planned.epochs == (5, 3)
    same = found_for(f"damping={0.2 * 0.1368}")
    assert same.difference == pytest.approx(found.difference)
    assert same.needed[2].days == found.needed[2].days


def test_settings_that_give_the_scatter_of_epochs_are_used() -> None:
    tables = VARIED | {"subject": {"OFF": {"damping_cv_percent": 25.0}, "DBS": {}}}
    found = found_for("damping=20%", tables)
    assert found.scatter.between_epochs_percent == 25.0
    assert found.scatter.condition_in_day_percent == ASSUMED["damping"].condition_in_day_percent
    assert (
        f"{found.scatter}"
        == "25 % between epochs (subject.OFF), 6.4 % of condition by day (chosen)"
    )
    unvaried = {"subject": {"OFF": {"damping_cv_percent": 0.0}, "DBS": {}}}
    assert found_for("damping=20%", VARIED | unvaried).scatter == ASSUMED["damping"]
    given = {"damping": Scatter(1.0, 2.0, 3.0, "a study")}
    assert found_for("damping=20%", tables, scatter=given).scatter == given["damping"]


def test_in_a_sequence_those_before_it_must_be_shown_too() -> None:
    """Its chance is the product, also where the difference of the first is not named."""
    sequence = primary_named("stiffness,damping", "sequence")
    first = found_for("stiffness=20%", primary=sequence)
    (second,) = (found_for("damping=20%", primary=sequence),)
    assert first.level == second.level == 0.05
    assert first.before == ()
    assert [one.wanted for one in second.before] == [first.wanted]
    one, other = second.needed[2], first.needed[2]

    def chance(days: int) -> float:
        return paired_power(second.difference, one.day_sd, days) * paired_power(
            first.difference, other.day_sd, days
        )

    assert chance(one.days) >= 0.8 > chance(one.days - 1)
    assert other.days == other.days_alone
    assert one.days > max(one.days_alone, other.days - 1)


def test_inertia_is_tested_by_itself_and_what_is_no_primary_measure_is_refused() -> None:
    assert found_for("inertia=5%").level == 0.05
    assert found_for("damping=20%").primary == PrimaryTable()
    with pytest.raises(UserError, match=r"damping is not a primary measure \(stiffness\); add"):
        found_for("damping=20%", primary=primary_named("stiffness"))
    scores = primary_named("work,damping", "sequence")
    with pytest.raises(UserError, match="work comes first in the sequence"):
        found_for("damping=20%", primary=scores)


def test_a_stricter_wish_needs_more() -> None:
    def days(text: str, **options: float) -> int:
        return found_for(text, **options).needed[3].days

    base = days("damping=20%")
    assert days("damping=20%", power=0.95) > base
    assert days("damping=20%", alpha=0.01) > base
    assert days("damping=10%") > 2 * base


def test_one_condition_has_no_planned_epochs() -> None:
    assert found_for("inertia=10%", {"subject": VARIED["subject"]}).planned is None


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        ("damping=100%", {}, "nothing of B would be left .subject.OFF.damping_nm_s_rad = 0.1368"),
        (
            "stiffness=18",
            {},
            r"--detect stiffness=18: 18 N·m/rad is more than K itself \(subject.OFF"
            r".stiffness_nm_rad = 1.751\); did you mean 18 %",
        ),
        ("stiffness=-18", {}, r"stiffness=-18: 18 N·m/rad is more than K .*did you mean -18 %"),
        ("damping=5%", {"power": 1.0}, "--power 1 and --alpha 0.05 must both be between 0 and 1"),
        ("damping=5%", {"alpha": 0.0}, "--power 0.8 and --alpha 0 must both"),
    ],
)
def test_wishes_that_cannot_be_met_are_sentences(text: str, options: dict, words: str) -> None:
    with pytest.raises(UserError, match=words):
        found_for(text, {}, **options)


def test_planned_epochs_are_those_of_the_prbs() -> None:
    assert planned_epochs(Settings()) == {"OFF": 4, "DBS": 0}
    assert planned_epochs(parse_settings(VARIED)) == {"OFF": 5, "DBS": 3}
