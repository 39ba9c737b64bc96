"""The numbers of the first screen: differences, their directions, the traffic light, precision."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import t as t_distribution
from scipy.stats import ttest_ind
from tests.study_anew.old_cohorts import Design, altered, made_study

from rigidimeter.analysis.report.page import contents, render_page
from rigidimeter.analysis.statistics import summarise
from rigidimeter.analysis.study import (
    Comparison,
    Difference,
    LeftOut,
    Measure,
    Observation,
    StudyResult,
    compare,
    compare_analysis,
    conclude,
    condition_precisions,
    precisions,
    precisions_untested,
    result_table,
    traffic_light,
)
from rigidimeter.analysis.study.comparison import day_test, no_days
from rigidimeter.analysis.study.deciding import needed
from rigidimeter.analysis.study.differences import by_units
from rigidimeter.analysis.study.tested import tested as of_basis
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Epoch, Outcome
from rigidimeter.planning import pairs_needed

SMALL = Design(days=(5, 4), epochs=(5, 5), scores=(4, 4))


@pytest.fixture(scope="module")
def study() -> StudyResult:
    return made_study(SMALL)


def of(result: StudyResult, measure: str) -> Difference:
    concluded = conclude(result)
    assert concluded is not None
    (found,) = (one for one in concluded.each if one.comparison.measure.name == measure)
    return found.difference


class TestDifference:
    def test_per_cent_are_of_the_reference(self):
        found = Difference("mean", 2.0, 1.5, -0.5, -0.9, -0.1, 0.01, 0.05)
        assert found.percent == pytest.approx((-25.0, -45.0, -5.0))
        assert found.measured == pytest.approx((-0.5, -0.55, -0.45))
        assert found.measured_percent == pytest.approx((-25.0, -27.5, -22.5))

    @pytest.mark.parametrize("odd", [{"reference": -2.0}, {"reference": 0.0}, {"ratio": False}])
    def test_there_is_none_where_it_has_no_meaning(self, odd):
        found = replace(Difference("mean", 2.0, 1.5, -0.5, -0.9, -0.1, 0.01, 0.05), **odd)
        assert np.isnan(found.percent).all()
        assert np.isnan(found.measured_percent).all()

    def test_the_row_has_every_number_under_the_keys_of_the_document(self):
        row = Difference("mean", 2.0, 1.5, -0.5, -0.9, -0.1, 0.01, 0.05).row()
        assert row == {
            "centre": "mean",
            "value_reference": 2.0,
            "value_other": 1.5,
            "difference": -0.5,
            "difference_low": -0.9,
            "difference_high": -0.1,
            "difference_percent": -25.0,
            "difference_percent_low": -45.0,
            "difference_percent_high": -5.0,
            "measured_low": pytest.approx(-0.55),
            "measured_high": pytest.approx(-0.45),
            "measured_percent_low": pytest.approx(-27.5),
            "measured_percent_high": pytest.approx(-22.5),
            "p": 0.01,
        }

    def test_means_difference_and_interval_are_those_of_the_test_by_days(self, study):
        """No day has both: Welch's test of the means of the days. It is other − reference."""
        c = study.comparison("stiffness_nm_rad")
        days = [
            [
                np.mean([o.value for o in c.of(name) if o.day == day])
                for day in dict.fromkeys(o.day for o in c.of(name))
            ]
            for name in c.pair
        ]
        expected = ttest_ind(*days, equal_var=False)
        found = of(study, "stiffness_nm_rad")
        assert (found.reference, found.other) == pytest.approx([np.mean(own) for own in days])
        assert found.estimate == pytest.approx(found.other - found.reference, rel=1e-12)
        assert (found.estimate, found.low, found.high, found.p) == (
            -c.days.estimate,
            -c.days.high,
            -c.days.low,
            c.days.p,
        )
        assert found.low < found.estimate < found.high < 0
        assert found.p == pytest.approx(expected.pvalue, rel=0.1)

    def test_the_interval_excludes_zero_where_p_is_below_the_level(self, study):
        for one in conclude(study).each:
            d = one.difference
            assert (d.p < 0.05) == (d.low > 0 or d.high < 0)
            if not math.isnan(d.percent[0]):
                assert (d.p < 0.05) == (d.percent[1] > 0 or d.percent[2] < 0)

    def test_means_of_days_with_both_and_with_one_keep_their_weights(self):
        study = made_study(replace(SMALL, both_on_a_day=True))
        for one in conclude(study).each:
            d = one.difference
            assert d.estimate == pytest.approx(d.other - d.reference, rel=1e-9)

    def test_one_recording_of_each_has_values_and_no_interval_of_a_test(self, study):
        first = {fit.condition: fit.source for fit in reversed(study.analysis.fits)}
        fits = tuple(f for f in study.analysis.fits if f.source == first[f.condition])
        alone = replace(study.analysis, fits=fits, fixed_inertia=fits, scores=())
        result = compare_analysis(alone, "OFF", "DBS", resamples=0)
        found = of(result, "stiffness_nm_rad")
        c = result.comparison("stiffness_nm_rad")
        assert found.reference == pytest.approx(np.mean(c.values["OFF"]))
        assert found.estimate == pytest.approx(found.other - found.reference)
        assert np.isnan([found.low, found.high, found.p]).all()
        half = math.sqrt(
            sum(
                sum(((o.high - o.low) / 2) ** 2 for o in c.of(name)) / len(c.of(name)) ** 2
                for name in c.pair
            )
        )
        assert found.measured_half == pytest.approx(half, rel=1e-12)

    def test_values_of_a_table_have_medians_and_the_shift(self):
        values = [*range(1, 11), *range(21, 31)]
        table = pd.DataFrame({"condition": ["a"] * 10 + ["b"] * 10, "k": values})
        found = of(compare(table, value="k", resamples=0), "k")
        assert (found.centre, found.reference, found.other) == ("median", 5.5, 25.5)
        assert found.estimate == 20.0
        assert 0 < found.low < 20.0 < found.high
        assert math.isnan(found.measured_half)


def compared(*days: tuple[str, str, list[float], list[float]]) -> Difference:
    """Return the difference in K of (condition, day, values, halves of their intervals)."""
    observations = tuple(
        Observation(value, condition, "M1", day, f"{day}-{condition}.csv", f"{k}",
                    low=value - half, high=value + half)
        for condition, day, values, halves in days
        for k, (value, half) in enumerate(zip(values, halves, strict=True))
    )  # fmt: skip
    own = {name: [o.value for o in observations if o.condition == name] for name in ("OFF", "DBS")}
    c = Comparison(
        Measure("stiffness_nm_rad", "Stiffness K", "N·m/rad", "fits"),
        "OFF",
        "DBS",
        observations,
        {name: summarise(values) for name, values in own.items()},
        {"OFF": 0, "DBS": 0},
    )
    return by_units(c, day_test(c))


class TestMeasured:
    """half = √(Σ w²h²) over the epochs of both conditions, with the weights of the test."""

    def test_days_of_unequal_numbers_of_epochs_and_a_day_with_one_condition(self):
        """Days 1 to 3 have both, day 4 OFF alone, so OFF weighs them as least squares does.

        At a correlation of ½ of 3 pairs and 1 of OFF alone (1 + 4)α' − 2β' = 1 and −2α' + 4β' = −1
        give α' = 1/8 for the day of OFF alone, so (1 − 1/8)/3 = 7/24 for each of the pairs; those
        of DBS have 1/3. An epoch has the weight of its day over the number of its epochs.
        """
        found = compared(
            ("OFF", "1", [2.0, 2.2], [0.1, 0.2]),
            ("OFF", "2", [1.9], [0.3]),
            ("OFF", "3", [2.1, 2.2, 2.3], [0.1, 0.1, 0.1]),
            ("OFF", "4", [1.6, 1.8], [0.2, 0.2]),
            ("DBS", "1", [1.5], [0.1]),
            ("DBS", "2", [1.4, 1.6], [0.2, 0.1]),
            ("DBS", "3", [1.3], [0.3]),
        )
        pair, alone, dbs = 7 / 24, 1 / 8, 1 / 3
        assert found.reference == pytest.approx(pair * (2.1 + 1.9 + 2.2) + alone * 1.7, rel=1e-12)
        assert found.other == pytest.approx((1.5 + 1.5 + 1.3) / 3, rel=1e-12)
        squares = [
            (pair / 2) ** 2 * (0.1**2 + 0.2**2),
            pair**2 * 0.3**2,
            (pair / 3) ** 2 * 3 * 0.1**2,
            (alone / 2) ** 2 * 2 * 0.2**2,
            dbs**2 * 0.1**2,
            (dbs / 2) ** 2 * (0.2**2 + 0.1**2),
            dbs**2 * 0.3**2,
        ]
        assert found.measured_half == pytest.approx(math.sqrt(sum(squares)), rel=1e-12)
        assert found.measured_half == pytest.approx(0.147702, abs=1e-6)

    def test_it_is_not_that_of_the_test(self, study):
        """Between days there is more than the measurement of either."""
        found = of(study, "stiffness_nm_rad")
        assert 0 < 2 * found.measured_half < 0.3 * (found.high - found.low)
        assert found.measured[0] == found.tested[0]

    def test_without_a_test_days_count_alike(self):
        found = compared(("OFF", "1", [2.0, 2.2, 2.4], [0.1, 0.2, 0.3]), ("DBS", "1", [1.5], [0.1]))
        assert math.isnan(found.p)
        assert (found.reference, found.other) == pytest.approx((2.2, 1.5))
        half = math.sqrt((0.01 + 0.04 + 0.09) / 9 + 0.01)
        assert found.measured_half == pytest.approx(half, rel=1e-12)

    def test_it_is_never_narrower_than_what_the_instrument_is_accurate_to(self):
        """0.1 % of the mean of both values: 0.001 · (2.0 + 1.5)/2."""
        found = compared(("OFF", "1", [2.0, 2.0], [1e-6] * 2), ("DBS", "1", [1.5], [1e-6]))
        assert found.measured_half == pytest.approx(0.00175, rel=1e-12)
        assert found.measured_percent == pytest.approx((-25.0, -25.0875, -24.9125), rel=1e-9)
        wider = compared(("OFF", "1", [2.0, 2.0], [1e-3] * 2), ("DBS", "1", [1.5], [2e-3]))
        assert wider.measured_half == pytest.approx(math.sqrt(1e-6 / 2 + 4e-6), rel=1e-12)

    def test_an_epoch_without_an_interval_leaves_it_unknown(self):
        found = compared(("OFF", "1", [2.0, 2.0], [0.1, math.nan]), ("DBS", "1", [1.5], [0.1]))
        assert found.estimate == pytest.approx(-0.5)
        assert math.isnan(found.measured_half)

    def test_scores_and_ratings_have_none(self, study):
        for measure in ("impulse_nm_s", "work_j", "rating"):
            assert math.isnan(of(study, measure).measured_half)


TREMOR = {"frequency_hz": 5.0, "amplitude_nm": 0.2, "stands_out": 9.0}


def doubted(study: StudyResult, epochs: int, condition: str = "DBS") -> StudyResult:
    finding = Finding("tremor", "caution", 2.0, 1.0, facts=TREMOR)
    left = iter([True] * epochs)
    fits = tuple(
        replace(fit, findings=(finding,))
        if fit.condition == condition and fit.outcome.included and next(left, False)
        else fit
        for fit in study.analysis.fits
    )
    return replace(study, analysis=replace(study.analysis, fits=fits))


class TestTrafficLight:
    def test_sound_epochs_are_counted(self, study):
        light = traffic_light(study)
        assert (light.level, light.doubt) == ("good", "")
        assert light.epochs == len(study.analysis.fits) + len(study.analysis.scores) == 81
        assert (light.sound, light.excluded, light.doubted) == (78, 3, 0)

    def test_the_gravest_doubt_is_named(self, study):
        light = traffic_light(doubted(study, 19))
        assert (light.level, light.sound, light.doubted) == ("caution", 59, 19)
        assert (light.doubt, light.doubt_epochs) == ("tremor", 19)
        assert light.text == "Torque oscillates at 5 Hz with 0.2 N·m"
        assert light.remedy.startswith("Use --method iv with the recorded perturbation")

    def test_a_recording_that_could_not_be_used_is_no_good_quality(self, study):
        refused = LeftOut("b.csv", "M1", "1", "DBS", "its angle is in degrees")
        light = traffic_light(replace(study, left_out=(refused,)))
        assert light.level == "caution"
        assert light.text == "1 of the study's recordings could not be used"

    def test_fewer_than_half_sound_is_poor(self, study):
        fits = doubted(doubted(study, 99), 99, "OFF").analysis
        assert traffic_light(replace(study, analysis=replace(fits, scores=()))).level == "poor"

    def test_nothing_that_counts_is_poor(self, study):
        lost = Epoch("a.csv", "1", {}, closed=Outcome("failed", "the file ends"))
        nothing = replace(study.analysis, fits=(), fixed_inertia=(), scores=())
        light = traffic_light(replace(study, analysis=nothing, epochs=(lost,), comparisons=()))
        assert (light.level, light.epochs, light.sound) == ("poor", 1, 0)

    def test_an_impossible_inertia_is_poor(self, study):
        first, *rest = (fit for fit in study.analysis.fits if fit.outcome.included)
        turned = replace(first, value=-first.value)
        light = traffic_light(
            replace(study, analysis=replace(study.analysis, fits=(turned, *rest)))
        )
        assert light.level == "poor"
        assert "J is not greater than zero" in light.text

    def test_a_table_of_numbers_has_none(self):
        table = pd.DataFrame({"condition": ["a"] * 4 + ["b"] * 4, "k": range(8)})
        assert traffic_light(compare(table, value="k", resamples=0)) is None

    def test_scatter_between_epochs_is_no_caution_where_conditions_are_compared(self, study):
        finding = Finding("varying_between_epochs", "caution", 2.0, 1.0)
        pooled = replace(
            study.analysis.fits[-1], epoch="pooled", condition="OFF", findings=(finding,)
        )
        made = replace(study, analysis=replace(study.analysis, pooled=(pooled,)))
        light = traffic_light(made)
        assert (light.level, light.doubt, light.text) == ("good", "", "")
        alone = replace(made, other="", comparisons=())
        assert traffic_light(alone).level == "caution"


class TestPrecision:
    def alone(self, study: StudyResult, fits: int) -> StudyResult:
        own = [fit for fit in study.analysis.fits if fit.condition == "OFF"]
        chosen = [fit for fit in own if fit.outcome.included][:fits]
        analysis = replace(study.analysis, fits=tuple(chosen), fixed_inertia=tuple(chosen))
        return compare_analysis(analysis, "OFF", "", resamples=0)

    def test_epochs_for_five_per_cent(self, study):
        """A standard error of 10 % from one epoch: (1.96 · 10 / 5)² = 15.4 epochs."""
        result = self.alone(study, 1)
        (fit,) = result.analysis.fits
        wide = replace(fit, se=0.1 * fit.value, low=0.8 * fit.value, high=1.2 * fit.value)
        result = replace(result, analysis=replace(result.analysis, fits=(wide,)))
        found = precisions(result)
        assert [one.measure.name for one in found[:3]] == [
            "stiffness_nm_rad",
            "damping_nm_s_rad",
            "inertia_kg_m2",
        ]
        for one in found[:3]:
            assert one.n == 1
            assert one.percent == pytest.approx(20.0)
            assert one.epochs_needed == 16

    def test_scores_are_means_with_the_interval_of_their_scatter(self, study):
        own = [s.work_j for s in study.analysis.scores]
        (work,) = (one for one in precisions(self.alone(study, 1)) if one.measure.name == "work_j")
        half = t_distribution.ppf(0.975, len(own) - 1) * np.std(own, ddof=1) / math.sqrt(len(own))
        assert (work.n, work.value) == (len(own), pytest.approx(np.mean(own)))
        assert (work.low, work.high) == pytest.approx((work.value - half, work.value + half))

    def test_two_conditions_have_none(self, study):
        assert precisions(study) == ()

    def test_a_condition_without_an_epoch_has_not_those_of_the_other(self, study):
        """The only fit to epochs together is then that of the other condition."""
        lost = Outcome("excluded", "the arm touched the position limit")
        fits = tuple(
            replace(fit, outcome=lost) if fit.condition == "DBS" else fit
            for fit in study.analysis.fits
        )
        first = next(fit for fit in fits if fit.outcome.included)
        pooled = (replace(first, epoch="pooled", condition="OFF"),)
        made = replace(study, analysis=replace(study.analysis, fits=fits, pooled=pooled))
        found = condition_precisions(made)
        assert found["OFF"][0].value == first.stiffness_nm_rad
        assert [one.measure.name for one in found["DBS"]] == ["impulse_nm_s", "work_j"]

    def test_a_single_day_has_those_of_each_condition(self, study):
        """No test by days exists; what the epochs of the day give is shown, for each condition."""
        assert precisions_untested(study) == {}
        analysis = replace(study.analysis, pooled=())
        no_test = altered(study, lambda c: replace(c, days=c.days and no_days(1, 1, "one day")))
        one_day = replace(no_test, analysis=analysis)
        found = precisions_untested(one_day)
        for name in ("OFF", "DBS"):
            own = [
                fit.stiffness_nm_rad
                for fit in analysis.fits
                if fit.condition == name and fit.outcome.included
            ]
            stiffness = found[name][0]
            assert (stiffness.n, stiffness.value) == (len(own), pytest.approx(np.mean(own)))
            assert stiffness.low < stiffness.value < stiffness.high
        rows = result_table(one_day, "precision")
        assert [(row["condition"], row["value"]) for row in rows] == [
            (name, one.value) for name, each in found.items() for one in each
        ]
        page = render_page(one_day, contents(one_day), {})
        assert 'href="tables/precision.csv">the intervals' in page


def test_the_days_that_would_decide_are_those_of_the_paired_t_test():
    """One day of two epochs each: SD 12 % between days as assumed, of which half cancels.

    v = Σ (0.12²·½ + 0.16²/2) x² over both conditions, for scatter is assumed below three epochs.
    """
    c = observed_on_one_day([2.0, 2.0], [1.6, 1.6])
    v = (0.12**2 / 2 + 0.16**2 / 2) * (2.0**2 + 1.6**2)
    assert needed(of_basis(c, "days"), 0.4, 0.025) == (
        pairs_needed(0.4, v**0.5, alpha=0.025),
        "day",
    )
    # Of three epochs the scatter is their own: none here, so that the days' alone counts.
    c = observed_on_one_day([2.0] * 3, [1.6] * 3)
    sd = math.sqrt(0.12**2 / 2 * (2.0**2 + 1.6**2))
    assert needed(of_basis(c, "days"), 0.4, 0.05) == (pairs_needed(0.4, sd), "day")
    scores = replace(c, measure=replace(c.measure, origin="scores"))
    assert needed(of_basis(scores, "days"), 0.4, 0.05) is None


def observed_on_one_day(off: list[float], dbs: list[float]) -> Comparison:
    observations = tuple(
        Observation(value, name, "M1", "1", f"{name}.csv", f"{k}")
        for name, values in (("OFF", off), ("DBS", dbs))
        for k, value in enumerate(values)
    )
    return Comparison(
        Measure("stiffness_nm_rad", "Stiffness K", "N·m/rad", "fits"),
        "OFF",
        "DBS",
        observations,
        {"OFF": summarise(off), "DBS": summarise(dbs)},
        {"OFF": 0, "DBS": 0},
    )
