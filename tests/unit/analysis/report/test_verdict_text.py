"""Sentences of a study folder say what its numbers say, and no more."""

import dataclasses

import numpy as np
import pytest
from tests.unit.analysis.report.cohorts import (
    Design,
    altered,
    made_study,
    sensitivity_row,
    untested,
)

from rigidimeter.analysis.report.verdict_text import verdict
from rigidimeter.analysis.statistics import two_groups
from rigidimeter.analysis.study import (
    Comparison,
    Measure,
    SensitivityRow,
    StudyResult,
    method_caveats,
)
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Outcome

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


@pytest.mark.parametrize(
    ("methods", "caveat"),
    [
        ((("published", "fixed", 0.3), ("iv", "fixed", 0.3)), ""),
        ((("published", "fixed", 0.0), ("iv", "fixed", 0.0)), ""),
        ((("published", "fixed", 0.3), ("iv", "fixed", 0.0)), "not every method shows a"),
        ((("iv", "fixed", 0.3), ("iv", "free", 0.0)), "not every method shows a difference"),
        ((("published", "fixed", 0.3), ("iv", "fixed", -0.3)), "the sign of the difference"),
    ],
)
def test_how_a_conclusion_depends_on_the_method(methods, caveat: str) -> None:
    found = method_caveats(rows(*((*method, 0.1) for method in methods)))
    assert found[DAMPING.name].startswith(caveat)
    assert bool(found[DAMPING.name]) == bool(caveat)


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
    finding = Finding("tremor", "caution", 2.0, 1.0)
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
