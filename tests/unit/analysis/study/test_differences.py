"""The numbers of the first screen: differences, their directions, the traffic light, precision."""

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import t as t_distribution
from scipy.stats import ttest_ind
from tests.unit.analysis.report.cohorts import Design, altered, made_study

from rigidimeter.analysis.report.page import contents, render_page
from rigidimeter.analysis.study import (
    Difference,
    LeftOut,
    StudyResult,
    compare,
    compare_analysis,
    conclude,
    precisions,
    precisions_untested,
    result_table,
    traffic_light,
)
from rigidimeter.analysis.study.comparison import no_days
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Epoch, Outcome

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
        found = Difference("mean", 2.0, 1.5, 0.5, 0.1, 0.9, 0.01)
        assert found.percent == pytest.approx((25.0, 5.0, 45.0))
        assert found.side == "lower"
        assert replace(found, estimate=-0.5).side == "higher"

    @pytest.mark.parametrize("odd", [{"reference": -2.0}, {"reference": 0.0}, {"ratio": False}])
    def test_there_is_none_where_it_has_no_meaning(self, odd):
        found = Difference("mean", 2.0, 1.5, 0.5, 0.1, 0.9, 0.01)
        assert np.isnan(replace(found, **odd).percent).all()

    def test_means_difference_and_interval_are_those_of_the_test_by_days(self, study):
        """No day has both: Welch's test of the means of the days."""
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
        assert found.estimate == pytest.approx(found.reference - found.other, rel=1e-12)
        assert (found.estimate, found.low, found.high, found.p) == (
            c.days.estimate,
            c.days.low,
            c.days.high,
            c.days.p,
        )
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
            assert d.estimate == pytest.approx(d.reference - d.other, rel=1e-9)

    def test_one_recording_of_each_has_values_and_no_interval(self, study):
        first = {fit.condition: fit.source for fit in reversed(study.analysis.fits)}
        fits = tuple(f for f in study.analysis.fits if f.source == first[f.condition])
        alone = replace(study.analysis, fits=fits, fixed_inertia=fits, scores=())
        result = compare_analysis(alone, "OFF", "DBS", resamples=0)
        found = of(result, "stiffness_nm_rad")
        c = result.comparison("stiffness_nm_rad")
        assert found.reference == pytest.approx(np.mean(c.values["OFF"]))
        assert found.estimate == pytest.approx(found.reference - found.other)
        assert np.isnan([found.low, found.high, found.p]).all()

    def test_values_of_a_table_have_medians_and_the_shift(self):
        values = [*range(1, 11), *range(21, 31)]
        table = pd.DataFrame({"condition": ["a"] * 10 + ["b"] * 10, "k": values})
        found = of(compare(table, value="k", resamples=0), "k")
        assert (found.centre, found.reference, found.other) == ("median", 5.5, 25.5)
        assert (found.estimate, found.side) == (-20.0, "higher")


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
        assert light.remedy.startswith("Record the perturbation")

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
        pooled = replace(study.analysis.fits[-1], condition="OFF", findings=(finding,))
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
