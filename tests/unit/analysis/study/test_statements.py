"""What was measured, tested and concluded says what the numbers say, and no more."""

import dataclasses
import math

import numpy as np
import pytest
from tests.study_anew.old_cohorts import (
    Design,
    altered,
    made_study,
    sensitivity_row,
    untested,
)

from rigidimeter.analysis.statistics import two_groups
from rigidimeter.analysis.study import (
    Comparison,
    LeftOut,
    Measure,
    SensitivityRow,
    StudyResult,
    compare_analysis,
    conclude,
    lead,
    method_caveats,
    statements,
)
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Analysis, Fit, Outcome

SMALL = Design(days=(5, 4), epochs=(5, 5), scores=(4, 4))
K = 1.751
"""N·m/rad, of a relaxed forearm."""
ALONE = "In brackets: 95 % interval from measurement error only, without day-to-day variation."
OTHER_DAYS = "other days of this subject, not for other subjects"


FAMILIES = (
    "p Holm-adjusted over K and B, and apart over impulse, work and rating; each 95 % "
    "interval is unadjusted"
)


def measured(result: StudyResult) -> str:
    said = statements(result)
    assert said is not None
    return said.measured


def by_what(result: StudyResult) -> str:
    said = statements(result)
    assert said is not None
    return said.tested


def concluded(result: StudyResult) -> tuple[str, ...]:
    said = statements(result)
    assert said is not None
    return said.concluded


@pytest.fixture(scope="module")
def study() -> StudyResult:
    return made_study(SMALL)


def recorded_once(stiffness: float, percent: float = 0.2) -> StudyResult:
    """Return one recording of each condition, six epochs long.

    K of OFF is `K`, that of DBS is given; `percent` is half the interval of each epoch.
    """
    fits = []
    for condition, own in (("OFF", K), ("DBS", stiffness)):
        for k in range(6):
            value = np.array([0.0045, 0.137, own]) * (1 + 1e-4 * (k - 2.5))
            half = percent / 100 * value
            fits.append(
                Fit(
                    source=f"{condition}.csv",
                    epoch=f"{k + 1}",
                    condition=condition,
                    method="iv",
                    outcome=Outcome(),
                    value=value,
                    se=half / 2,
                    low=value - half,
                    high=value + half,
                    bound=half / 2,
                    vaf_percent=99.0,
                    n_samples=4501,
                    band_hz=(0.15, 30.0),
                )
            )
    analysis = Analysis("iv", tuple(fits), tuple(fits), 0.0045, ())
    return compare_analysis(analysis, "OFF", "DBS", resamples=0)


DAMPING = Measure("b", "Damping", "N", "fits")


def groups(effect: float, scatter: float = 0.1):
    rng = np.random.default_rng(4)
    x = 1.0 + scatter * rng.standard_normal(30)
    y = 1.0 - effect + scatter * rng.standard_normal(30)
    return two_groups(
        x, y, [f"M/{i // 5}" for i in range(30)], [f"M/{6 + i // 5}" for i in range(30)]
    )


def rows(*methods: tuple[str, str, float, float]) -> tuple[SensitivityRow, ...]:
    return tuple(
        sensitivity_row(DAMPING, method, ways, groups(effect, scatter), 1.0)
        for method, ways, effect, scatter in methods
    )


class TestMeasured:
    """It is there whatever the design, and speaks of the recordings alone."""

    def test_one_recording_of_each_has_a_difference_and_no_conclusion(self):
        """1.751 to 1.300 N·m/rad: −0.451/1.751 = −25.76 %.

        Half the interval: 0.2 % of each of 6 epochs, √(1.751² + 1.3²)/1.751 · 0.2 %/√6 = 0.102 %.
        """
        result = recorded_once(1.3)
        assert measured(result) == (
            "Between these recordings, DBS − OFF: K −25.8 % (−25.9 to −25.7), B 0.0 % (−0.1 to "
            f"+0.1) and J 0.0 % (−0.1 to +0.1). {ALONE}"
        )
        (stiffness,) = (one for one in conclude(result).each if one.comparison.measure.short == "K")
        assert stiffness.verdict == "cannot be decided"
        assert stiffness.difference.measured_half == pytest.approx(
            0.002 / math.sqrt(6) * math.hypot(K, 1.3), rel=1e-6
        )
        assert by_what(result) == "Nothing could be tested."
        assert concluded(result) == (
            "Whether OFF and DBS differ in K and B cannot be decided: there is one recording in "
            "each condition, so recording and condition cannot be separated; with 6 days in both "
            "conditions a difference of 20 % in K would be shown with a chance of 80 %.",
        )
        assert lead(result) == f"{measured(result)} {concluded(result)[0]}"

    def test_its_sign_is_that_of_the_change(self):
        """Of epochs known to 0.01 % half the interval is 0.1 % of the mean: (1 + 1.2576)/2."""
        assert "K +25.8 % (+25.6 to +25.9)" in measured(recorded_once(K * 1.2576, 0.01))

    def test_it_has_the_digits_of_its_interval(self):
        assert "K −26 % (−27 to −24)" in measured(recorded_once(1.3, 3.0))

    def test_measures_without_an_interval_are_in_the_table_or_stand_alone(self, study):
        assert measured(study) == (
            "Between these recordings, DBS − OFF: K −18 % (−19 to −16), B −16 % (−17 to −15) and "
            f"J −2 % (−3 to −1). {ALONE}"
        )
        scores = tuple(c for c in study.comparisons if c.measure.origin != "fits")
        assert measured(dataclasses.replace(study, comparisons=scores)) == (
            "Between these recordings, DBS − OFF: impulse −19 %, work −19 % and rating −0.45 "
            "points."
        )

    def test_values_in_one_condition_alone_are_no_difference(self, study):
        of_off = tuple(
            dataclasses.replace(
                c,
                days=None,
                test=None,
                observations=c.of("OFF"),
                summaries={**c.summaries, "DBS": dataclasses.replace(
                    c.summaries["DBS"], n=0, median=math.nan)},
            )
            for c in study.comparisons
            if c.measure.origin != "ratings"
        )  # fmt: skip
        alone = dataclasses.replace(study, comparisons=of_off)
        assert measured(alone) == "No measure has values in both conditions."


class TestTested:
    def test_tests_are_named_with_their_measures_and_how_p_is_adjusted(self, study):
        assert by_what(study) == (
            "Welch's t-test of 5 days of OFF and 4 days of DBS (K, B, J, impulse, work); mixed "
            f"model of examiners and days (rating); {FAMILIES}."
        )

    def test_p_is_adjusted_for_what_was_tested_alone(self, study):
        lacking = untested(study, "work_j", "one day in each condition")
        assert "(K, B, J, impulse)" in by_what(lacking)
        assert "; p Holm-adjusted over K and B, and apart over impulse and rating; " in by_what(
            lacking
        )

    def test_one_test_of_one_measure_is_not_adjusted(self, study):
        alone = dataclasses.replace(study, comparisons=study.comparisons[:1])
        assert by_what(alone) == "Welch's t-test of 5 days of OFF and 4 days of DBS."


def test_a_clear_effect_is_shown_and_none_is_not(study: StudyResult) -> None:
    assert lead(study) == (
        "In this subject, stiffness K was lower in DBS than in OFF: −18 % (95 % interval −29 to "
        "−7 %, Welch's t-test of 5 days of OFF and 4 days of DBS, p = 0.0077) and viscous damping "
        "B −16 % (95 % interval −24 to −8 %, p = 0.0077); p Holm-adjusted over K and B; each "
        f"95 % interval is unadjusted. The intervals hold for {OTHER_DAYS}."
    )
    assert concluded(study) == (
        f"In this subject, K and B are lower in DBS than in OFF. This holds for {OTHER_DAYS}.",
        "Secondary: in this subject, impulse, work and rating are lower in DBS than in OFF.",
    )
    none = made_study(dataclasses.replace(SMALL, effect=0.0))
    absent, *_ = concluded(none)
    assert absent.startswith(
        "In this subject, no difference of 20 % between OFF and DBS is shown in K, B, impulse and "
        "work; excluded (95 %): K more than "
    )
    assert lead(none) == f"{measured(none)} {absent}"


@pytest.mark.parametrize(
    ("names", "where", "reach"),
    [
        ("A", "In this subject, ", "other days of this subject, not for other subjects."),
        ("AB", "In these two subjects, ", "other days of these two subjects, not for other"),
        ("ABC", "In these 3 subjects, ", "subjects like these."),
    ],
)
def test_one_subject_or_two_stand_for_no_others(names: str, where: str, reach: str) -> None:
    """Where days were sampled, other days are all that the interval holds for."""
    design = dataclasses.replace(SMALL, subjects=tuple(names), scores=(0, 0), day_scatter=0.01)
    fits = made_study(design)
    found = dataclasses.replace(
        fits, comparisons=tuple(c for c in fits.comparisons if c.measure.origin == "fits")
    )
    assert lead(found).startswith(f"{where}stiffness K was lower in DBS than in OFF: −")
    assert f" The intervals hold for {reach}" in lead(found)
    assert concluded(found)[0].startswith(f"{where}K")
    assert f" This holds for {reach}" in concluded(found)[0]


def test_the_sentence_to_quote_has_the_numbers_of_the_test(study: StudyResult) -> None:
    one = conclude(study).of("lower")[0]
    estimate, low, high = (f"−{-size:.0f}" for size in one.difference.percent)
    assert f": {estimate} % (95 % interval {low} to {high} %, " in lead(study)
    assert f"p = {one.p:.2g})" in lead(study)


def test_the_sign_is_that_of_the_estimate(study: StudyResult) -> None:
    def turned(c: Comparison) -> Comparison:
        d = c.days
        assert d is not None
        return dataclasses.replace(
            c, days=dataclasses.replace(d, estimate=-d.estimate, low=-d.high, high=-d.low)
        )

    found = altered(study, turned)
    assert lead(found).startswith(
        "In this subject, stiffness K was higher in DBS than in OFF: +18 % (95 % interval +7 to "
        "+29 %, "
    )
    assert "K and B are higher in DBS than in OFF." in concluded(found)[0]
    assert "K +18 % (+16 to +19), B +16 %" in measured(found)
    assert "lower" not in " ".join([lead(found), *concluded(found)])


def test_measures_of_both_signs_have_each_its_verdict(study: StudyResult) -> None:
    def turned(c: Comparison) -> Comparison:
        d = c.days
        if d is None or c.measure.name != "damping_nm_s_rad":
            return c
        return dataclasses.replace(
            c, days=dataclasses.replace(d, estimate=-d.estimate, low=-d.high, high=-d.low)
        )

    found = altered(study, turned)
    assert " and viscous damping B was higher: +16 %" in lead(found)
    first, second, *_ = concluded(found)
    assert first == "In this subject, K is lower in DBS than in OFF."
    assert second == (
        f"In this subject, B is higher in DBS than in OFF. This holds for {OTHER_DAYS}."
    )


def test_a_p_that_only_one_measure_alone_would_bear_is_not_claimed(study: StudyResult) -> None:
    def weaker(c: Comparison) -> Comparison:
        assert c.days is not None
        p = 0.03 if c.measure.name == "work_j" else 0.6
        return dataclasses.replace(c, days=dataclasses.replace(c.days, p=p))

    found = altered(study, weaker)
    assert conclude(found).each[-2].p == pytest.approx(0.09)
    assert not conclude(found).of("lower", "higher")
    assert "lower in" not in lead(found)


def test_prefixes_and_missing_tests(study: StudyResult) -> None:
    other = dataclasses.replace(study, virtual=True, blinded=True)
    assert lead(other) == (
        "Virtual data. Blinded: the names of the conditions are codes. " + lead(study)
    )
    lacking = untested(study, "work_j", "one day in each condition")
    assert (
        "Whether OFF and DBS differ in work cannot be decided: one day in each condition."
    ) in concluded(lacking)
    assert "work" not in lead(lacking)


def test_what_was_left_out_is_in_the_sentence_to_quote(study: StudyResult) -> None:
    refused = tuple(LeftOut(f"{k}.csv", "M1", "9", "DBS", "in degrees") for k in (1, 2))
    one, two = (dataclasses.replace(study, left_out=refused[:n]) for n in (1, 2))
    assert lead(one) == f"{lead(study)} 1 of 10 sessions is left out."
    assert lead(two) == f"{lead(study)} 2 of 11 sessions are left out."


@pytest.mark.parametrize(
    ("methods", "caveat"),
    [
        ((("published", "fixed", 0.3), ("iv", "fixed", 0.3)), ""),
        ((("published", "fixed", 0.0), ("iv", "fixed", 0.0)), ""),
        ((("published", "fixed", 0.3), ("iv", "fixed", 0.0)), "not every method shows a"),
        ((("iv", "fixed", 0.3), ("iv", "free", 0.0)), "not every method shows a difference"),
        ((("iv", "fixed", 0.3), ("iv", "fixed", -0.3)), "the sign of the difference"),
    ],
)
def test_how_a_conclusion_depends_on_the_method(methods, caveat: str) -> None:
    found = method_caveats(rows(*((*method, 0.1) for method in methods)))
    assert found[DAMPING.name].startswith(caveat)
    assert bool(found[DAMPING.name]) == bool(caveat)


def test_reasons_that_measures_share_are_said_once(study: StudyResult) -> None:
    """One recording in each condition: what a difference comes from cannot be known."""
    first = {fit.condition: fit.source for fit in reversed(study.analysis.fits)}
    fits, scores = (
        tuple(one for one in results if one.source == first[one.condition])
        for results in (study.analysis.fits, study.analysis.scores)
    )
    analysis = dataclasses.replace(study.analysis, fits=fits, fixed_inertia=fits, scores=scores)
    assert concluded(compare_analysis(analysis, "OFF", "DBS", resamples=0)) == (
        "Whether OFF and DBS differ in K, B, impulse and work cannot be decided: there is one "
        "recording in each condition, so recording and condition cannot be separated; with 7 days "
        "in both conditions a difference of 20 % in K would be shown with a chance of 80 %.",
    )
    one_file = tuple(dataclasses.replace(fit, source="x.csv") for fit in fits)
    analysis = dataclasses.replace(analysis, fits=one_file, scores=())
    (said,) = concluded(compare_analysis(analysis, "OFF", "DBS", resamples=0))
    assert said.count("there is only one recording") == 1


def test_what_few_days_cannot_decide_is_said_with_what_would() -> None:
    few = made_study(dataclasses.replace(SMALL, days=(2, 2), both_on_a_day=True))
    assert concluded(few) == (
        "In this subject, whether OFF and DBS differ in K, B, impulse and work cannot be decided: "
        "the chance to show a difference of 20 % was below one half; excluded (95 %): K more than "
        "68 % lower or 36 % higher, B more than 73 % lower or 31 % higher; with 7 days in both "
        "conditions a difference of 20 % in K would be shown with a chance of 80 %.",
        "Secondary: in this subject, rating is lower in DBS than in OFF.",
    )


def test_what_was_withheld_is_not_in_the_sentence_to_quote(study: StudyResult) -> None:
    """Of the recordings it is said, of the conditions it is not."""
    finding = Finding("tremor", "caution", 2.0, 1.0)
    fits = tuple(
        dataclasses.replace(fit, findings=(finding,)) if fit.condition == "DBS" else fit
        for fit in study.analysis.fits
    )
    shaken = dataclasses.replace(
        study, sensitivity=(), analysis=dataclasses.replace(study.analysis, fits=fits)
    )
    assert {one.comparison.measure.short for one in conclude(shaken).of("not supported")} == {
        "K",
        "B",
    }
    assert "K −18 % (−19 to −16), B −16 % (−17 to −15)" in measured(shaken)
    first, *_, last = concluded(shaken)
    assert first.startswith("In this subject, a difference in K and B is not supported: tremor in ")
    assert "0 of 23 epochs in OFF, 19 of 19 in DBS" in first
    assert last == (
        "Secondary: in this subject, impulse, work and rating are lower in DBS than in OFF."
    )
    assert lead(shaken) == f"{measured(shaken)} {first}"


def test_one_condition_has_its_values_and_no_statements(study: StudyResult) -> None:
    fits = tuple(fit for fit in study.analysis.fits if fit.condition == "DBS")
    for name, start in (("DBS", "DBS: stiffness K "), ("", "Stiffness K ")):
        own = tuple(dataclasses.replace(fit, condition=name) for fit in fits)
        analysis = Analysis("iv", own, own, 0.0045, ())
        alone = compare_analysis(analysis, resamples=0)
        assert statements(alone) is None
        assert lead(alone).startswith(start)
        assert "±" in lead(alone)
        assert lead(alone).endswith("(95 % intervals).")


def test_nothing_included_is_said(study: StudyResult) -> None:
    lost = Fit("a.csv", "1", "OFF", "iv", Outcome("failed", "no torque"))
    for fits in ((lost,), ()):
        analysis = Analysis("iv", fits, fits, math.nan, ())
        assert "No epoch could be included" in lead(compare_analysis(analysis, resamples=0))
    assert "No epoch could be included" in lead(dataclasses.replace(study, comparisons=()))
