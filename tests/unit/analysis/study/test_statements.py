"""What was measured, tested and concluded says what the numbers say, and no more."""

import dataclasses
import math

import numpy as np
import pytest
from tests.unit.analysis.report.cohorts import (
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
            "Between these recordings, from OFF to DBS, K fell by 25.8 % (25.7 to 25.9), B changed "
            "by 0.0 % (−0.1 to 0.1) and J by 0.0 % (−0.1 to 0.1). "
            "In brackets: 95 % of the measurement alone."
        )
        (stiffness,) = (one for one in conclude(result).each if one.comparison.measure.short == "K")
        assert stiffness.verdict == "cannot be decided"
        assert stiffness.difference.measured_half == pytest.approx(
            0.002 / math.sqrt(6) * math.hypot(K, 1.3), rel=1e-6
        )
        assert by_what(result) == "Nothing could be tested."
        assert concluded(result) == (
            "Whether OFF and DBS differ in K, B and J cannot be decided: there is one recording in "
            "each condition, so recording and condition cannot be separated; 5 days with both "
            "conditions would show a difference of 20 % in K.",
        )
        assert lead(result) == f"{measured(result)} {concluded(result)[0]}"

    def test_its_sign_is_that_of_the_change(self):
        """Of epochs known to 0.01 % half the interval is 0.1 % of the mean: (1 + 1.2576)/2."""
        assert "K rose by 25.8 % (25.6 to 25.9)" in measured(recorded_once(K * 1.2576, 0.01))

    def test_it_has_the_digits_of_its_interval(self):
        assert "K fell by 26 % (24 to 27)" in measured(recorded_once(1.3, 3.0))

    def test_a_measure_without_an_interval_has_none(self, study):
        assert measured(study) == (
            "Between these recordings, from OFF to DBS, K fell by 18 % (16 to 19), B by 16 % "
            "(15 to 17), J by 2 % (1 to 3), impulse by 19 %, work by 19 % and rating by 0.45 "
            "points. In brackets: 95 % of the measurement alone."
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
            "model with an offset for each examiner and each day, after Kenward and Roger (rating);"
            " p adjusted by Holm’s method for 6 measures, intervals not."
        )

    def test_p_is_adjusted_for_what_was_tested_alone(self, study):
        lacking = untested(study, "work_j", "one day in each condition")
        assert "(K, B, J, impulse)" in by_what(lacking)
        assert by_what(lacking).endswith(
            "p adjusted by Holm’s method for 5 measures, intervals not."
        )

    def test_one_test_of_one_measure_is_not_adjusted(self, study):
        alone = dataclasses.replace(study, comparisons=study.comparisons[:1])
        assert by_what(alone) == "Welch's t-test of 5 days of OFF and 4 days of DBS."


def test_a_clear_effect_is_shown_and_none_is_not(study: StudyResult) -> None:
    assert lead(study) == (
        "Stiffness K was 18 % lower in DBS than in OFF (95 % interval 7 to 29 %, Welch's t-test of "
        "5 days of OFF and 4 days of DBS, p = 0.021), viscous damping B 16 % lower (95 % interval "
        "8 to 24 %, p = 0.015), angular impulse 19 % lower (95 % interval 13 to 25 %, p = 0.0014) "
        "and work 19 % lower (95 % interval 13 to 25 %, p = 0.0014); p adjusted by Holm’s method "
        "for 6 measures, intervals not."
    )
    assert concluded(study) == (
        "K, B, impulse and work are lower in DBS than in OFF.",
        "No difference between OFF and DBS is shown in J and rating.",
    )
    none = made_study(dataclasses.replace(SMALL, effect=0.0))
    shown = "No difference between OFF and DBS is shown in K, B, J, impulse, work and rating."
    assert concluded(none) == (shown,)
    assert lead(none) == f"{measured(none)} {shown}"


def test_the_sentence_to_quote_has_the_numbers_of_the_test(study: StudyResult) -> None:
    one = conclude(study).of("lower")[0]
    estimate, low, high = (-size for size in one.difference.percent)
    assert f"K was {estimate:.0f} % lower" in lead(study)
    assert f"(95 % interval {high:.0f} to {low:.0f} %, " in lead(study)
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
        "Stiffness K was 18 % higher in DBS than in OFF (95 % interval 7 to 29 %, "
    )
    assert concluded(found)[0] == "K, B, impulse and work are higher in DBS than in OFF."
    assert "K rose by 18 % (16 to 19), B by 16 %" in measured(found)
    assert "lower" not in " ".join([lead(found), *concluded(found)])
    assert "fell" not in measured(found)


def test_a_p_that_only_one_measure_alone_would_bear_is_not_claimed(study: StudyResult) -> None:
    def weaker(c: Comparison) -> Comparison:
        assert c.days is not None
        p = 0.03 if c.measure.name == "work_j" else 0.6
        return dataclasses.replace(c, days=dataclasses.replace(c.days, p=p))

    found = altered(study, weaker)
    assert conclude(found).each[-2].p == pytest.approx(0.18)
    assert concluded(found) == (
        "No difference between OFF and DBS is shown in K, B, J, impulse, work and rating.",
    )
    assert "lower" not in lead(found)


def test_prefixes_and_missing_tests(study: StudyResult) -> None:
    other = dataclasses.replace(study, virtual=True, blinded=True)
    assert lead(other) == (
        "Virtual data. Blinded: the names of the conditions are codes. " + lead(study)
    )
    lacking = untested(study, "work_j", "one day in each condition")
    assert concluded(lacking)[-1] == (
        "Whether OFF and DBS differ in work cannot be decided: one day in each condition."
    )
    assert "work" not in lead(lacking)
    assert "work by 19 %" in measured(lacking)


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
        "Whether OFF and DBS differ in K, B, J, impulse and work cannot be decided: there is one "
        "recording in each condition, so recording and condition cannot be separated; 6 days with "
        "both conditions would show a difference of 20 % in K.",
    )
    one_file = tuple(dataclasses.replace(fit, source="x.csv") for fit in fits)
    analysis = dataclasses.replace(analysis, fits=one_file, scores=())
    (said,) = concluded(compare_analysis(analysis, "OFF", "DBS", resamples=0))
    assert said.count("there is only one recording") == 1


def test_that_few_days_show_only_large_differences_is_said_once() -> None:
    """By Holm's method p of six is below 0.05/6 at first: tan(π/2 (1 − 0.05/6)) = 76.4."""
    few = made_study(dataclasses.replace(SMALL, days=(2, 2), both_on_a_day=True))
    (said,) = (each for each in concluded(few) if "no difference" in each.lower())
    assert said == (
        "No difference between OFF and DBS is shown in K, B, J, impulse and work: differences "
        "below 76.4 standard errors may not show; more days show smaller ones."
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
    assert lead(shaken).startswith("Angular impulse was 19 % lower in DBS than in OFF (")
    for word in ("stiffness", "damping", " K ", " B ", "not supported"):
        assert word not in lead(shaken)
    assert "K fell by 18 % (16 to 19), B by 16 % (15 to 17)" in measured(shaken)
    first, second, *_ = concluded(shaken)
    assert first == "Impulse and work are lower in DBS than in OFF."
    assert second.startswith("A difference in K and B is not supported: tremor in ")
    assert "0 of 23 epochs in OFF, 19 of 19 in DBS" in second


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
