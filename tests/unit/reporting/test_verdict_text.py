"""Sentences of a study folder say what its numbers say, and no more."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest
from tests.unit.reporting.cohorts import Design, altered, made_study, sensitivity_row, untested

from rigidimeter.records import Finding, Outcome
from rigidimeter.reporting.verdict_text import dependence_sentences, verdict
from rigidimeter.statistics import two_groups
from rigidimeter.study import Comparison, Measure, SensitivityRow, StudyResult

SMALL = Design(days=(5, 4), epochs=(5, 5), scores=(4, 4))


def all_sentences(result: StudyResult) -> str:
    found = verdict(result)
    return " ".join([found.lead, *found.rest])


@pytest.fixture(scope="module")
def study() -> StudyResult:
    return made_study(SMALL)


DAMPING = Measure("b", "Damping", "N", "fixed_inertia")


def groups(effect: float, scatter: float = 0.1):
    rng = np.random.default_rng(4)
    x = 1.0 + scatter * rng.standard_normal(30)
    y = 1.0 - effect + scatter * rng.standard_normal(30)
    return two_groups(
        x, y, [f"M/{i // 5}" for i in range(30)], [f"M/{6 + i // 5}" for i in range(30)]
    )


def rows(*methods: tuple[str, str, float, float]) -> tuple[SensitivityRow, ...]:
    return tuple(
        dataclasses.replace(
            sensitivity_row(DAMPING, method, ways, groups(effect, scatter), 1.0),
            chosen=method == "iv" and ways == "fixed",
        )
        for method, ways, effect, scatter in methods
    )


def said(study: StudyResult, *methods: tuple[str, str, float, float]) -> str:
    (sentence,) = dependence_sentences(dataclasses.replace(study, sensitivity=rows(*methods)))
    return sentence


def test_a_clear_effect_is_shown_and_none_is_not(study: StudyResult) -> None:
    text = all_sentences(study)
    plain = text.replace("\N{NO-BREAK SPACE}", " ")
    assert plain.startswith(
        "DBS is lower than OFF in stiffness K by 0.31 N·m/rad, 18 % (p = 0.0212)"
    )
    assert "Tested by days; p adjusted by Holm’s method for 6 measures." in text
    none = all_sentences(made_study(dataclasses.replace(SMALL, effect=0.0)))
    assert "is lower" not in none
    assert none.startswith("No difference between OFF and DBS is shown in stiffness K, viscous")


def test_the_sign_is_that_of_the_estimate(study: StudyResult) -> None:
    def turned(c: Comparison) -> Comparison:
        d = c.days
        assert d is not None
        return dataclasses.replace(
            c, days=dataclasses.replace(d, estimate=-d.estimate, low=-d.high, high=-d.low)
        )

    text = all_sentences(altered(study, turned))
    assert "DBS is higher than OFF in" in text
    assert "lower" not in text


def test_a_p_that_only_one_measure_alone_would_bear_is_not_claimed(study: StudyResult) -> None:
    def weaker(c: Comparison) -> Comparison:
        assert c.days is not None
        p = 0.03 if c.measure.name == "work_j" else 0.6
        return dataclasses.replace(c, days=dataclasses.replace(c.days, p=p))

    text = all_sentences(altered(study, weaker))
    assert "is lower" not in text
    assert "(p\N{NO-BREAK SPACE}≥\N{NO-BREAK SPACE}0.18)" in text


def test_the_lead_is_claimed_only_where_it_is_beyond_chance(study: StudyResult) -> None:
    sizes = {c.measure.name: abs(c.effects.rank_biserial) for c in study.comparisons if c.effects}
    first = max(sizes, key=lambda name: sizes[name])

    def with_p(p_of: Callable[[tuple[str, str]], float]) -> StudyResult:
        pairs = [
            dataclasses.replace(d, p_holm=p_of((d.first, d.second))) for d in study.differences
        ]
        return dataclasses.replace(study, differences=tuple(pairs))

    text = all_sentences(with_p(lambda pair: 1e-5 if "inertia_kg_m2" in pair else 1.0))
    assert "it is significantly larger than that of inertia J" in text
    assert "it is not significantly larger than that of" in text
    text = all_sentences(with_p(lambda pair: 1.0))
    assert "it is not significantly larger than that of any other" in text
    text = all_sentences(with_p(lambda pair: math.nan if first in pair else 1.0))
    assert "significantly" not in text
    assert "could not be tested" in text


def test_prefixes_and_missing_tests(study: StudyResult) -> None:
    other = dataclasses.replace(study, virtual=True, blinded=True)
    assert all_sentences(other).startswith(
        "Virtual data. Blinded: the names of the conditions are codes. DBS is lower than OFF"
    )
    lacking = untested(study, "work_j", "one day in each condition")
    assert (
        "It cannot be decided whether the conditions differ in work: one day in each condition."
    ) in all_sentences(lacking)
    alone = dataclasses.replace(study, comparisons=())
    assert "No epoch could be included" in all_sentences(alone)


def test_agreeing_methods(study: StudyResult) -> None:
    assert (
        said(study, ("published", "fixed", 0.3, 0.1), ("iv", "fixed", 0.3, 0.1))
        == "Damping: every method shows the difference."
    )
    assert (
        said(study, ("published", "fixed", 0.0, 0.1), ("iv", "fixed", 0.0, 0.1))
        == "Damping: no method shows a difference."
    )
    text = said(study, ("published", "fixed", 0.6, 0.1), ("iv", "fixed", 0.3, 0.1))
    assert "The size depends on the method" in text


def test_voluntary_torque_is_named_where_the_intervals_say_so(study: StudyResult) -> None:
    text = said(study, ("published", "fixed", 0.3, 0.1), ("iv", "fixed", 0.0, 0.1))
    assert text.startswith("Damping: “published” shows a difference, “iv” does not.")
    assert "Voluntary torque would explain this" in text


def test_voluntary_torque_is_not_blamed_where_other_least_squares_are_not_moved(
    study: StudyResult,
) -> None:
    text = said(
        study,
        ("published", "fixed", 0.3, 0.1),
        ("bandlimited", "fixed", 0.0, 0.1),
        ("iv", "fixed", 0.0, 0.1),
    )
    assert "“published” shows a difference, “bandlimited” and “iv” do not." in text
    assert "would bias “bandlimited” too, so it is not the likely reason" in text
    assert "would explain this" not in text


def test_shifts_that_differ_in_p_alone_are_called_so(study: StudyResult) -> None:
    text = said(study, ("iv", "fixed", 0.3, 0.1), ("iv", "free", 0.33, 0.7))
    assert "“iv” (J fixed) shows a difference, “iv” (J free) does not." in text
    assert "they differ more in p than in size" in text


def test_lack_of_precision_is_not_taken_for_voluntary_torque(study: StudyResult) -> None:
    text = said(study, ("published", "fixed", 0.3, 0.1), ("iv", "fixed", 0.25, 1.2))
    assert "Voluntary torque" not in text
    assert "lack of precision could be the reason" in text


def test_least_squares_may_hide_a_difference(study: StudyResult) -> None:
    text = said(study, ("published", "fixed", 0.0, 0.1), ("iv", "fixed", 0.3, 0.1))
    assert text.startswith("Damping: “iv” shows a difference, “published” does not.")
    assert "it can hide a difference as well as make one" in text


def test_opposite_signs_and_held_inertia(study: StudyResult) -> None:
    text = said(study, ("published", "fixed", 0.3, 0.1), ("iv", "fixed", -0.3, 0.1))
    assert (
        "the sign depends on the method. “published” shows DBS lower than OFF, “iv” higher" in text
    )
    text = said(study, ("iv", "fixed", 0.3, 0.1), ("iv", "free", 0.0, 0.1))
    assert "“iv” (J fixed) shows a difference, “iv” (J free) does not." in text


def test_reasons_that_measures_share_are_said_once(make_study, make_analysis, epochs) -> None:
    """One recording in each condition: what a difference comes from cannot be known."""
    text = all_sentences(make_study(epochs))
    assert text.startswith(
        "It cannot be decided whether the conditions differ in stiffness K, viscous damping B, "
        "inertia J, angular impulse and work: there is one recording in each condition, so "
        "recording and condition cannot be separated."
    )
    text = all_sentences(make_study([], analysis=make_analysis({"OFF": 40, "DBS": 40})))
    assert "there is only one recording" in text


def test_that_few_days_show_only_large_differences_is_said_once() -> None:
    text = all_sentences(made_study(dataclasses.replace(SMALL, days=(2, 2), both_on_a_day=True)))
    assert text.count("with 1 degree of freedom only a difference above 12.7 standard errors") == 1
    assert text.index("No difference between OFF and DBS is shown in") < text.index(
        "with 1 degree of freedom"
    )


def test_what_was_found_and_is_not_supported(study: StudyResult) -> None:
    finding = Finding("tremor", "doubt", 2.0, 1.0, "a tremor", "repeat it at rest")
    fits = tuple(
        dataclasses.replace(fit, findings=(finding,)) if fit.condition == "DBS" else fit
        for fit in study.analysis.fits
    )
    shaken = dataclasses.replace(
        study, sensitivity=(), analysis=dataclasses.replace(study.analysis, fits=fits)
    )
    text = all_sentences(shaken)
    assert text.startswith("DBS is lower than OFF in angular impulse")
    lead = text.partition(". A difference was found")[0]
    assert lead.endswith("a difference in stiffness K and viscous damping B is not supported")
    assert "A difference was found, but is not supported, in stiffness K (p" in text
    assert ": tremor casts doubt on 0 of 23 epochs in OFF and 19 of 19 epochs in DBS" in text


def test_verdict_without_comparison_gives_the_values(make_study, make_analysis) -> None:
    text = all_sentences(make_study([], analysis=make_analysis({"": 3})))
    assert text.startswith("Stiffness K ")
    assert "±" in text
    assert text.endswith("(95 % intervals); no two conditions are compared.")


def test_verdict_of_nothing(make_study, make_analysis) -> None:
    failed = make_analysis({"OFF": 2}, Outcome("failed", "no torque"), scores=False)
    for analysis in (failed, make_analysis({})):
        assert "No epoch could be included" in all_sentences(make_study([], analysis=analysis))
