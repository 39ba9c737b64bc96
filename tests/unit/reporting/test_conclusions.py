"""Sentences of a study folder say what its numbers say, and no more."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest
from tests.unit.reporting.cohorts import Design, altered, made_study, sensitivity_row, untested

from rigidimeter.estimation import METHODS, Method
from rigidimeter.reporting.conclusions import method_dependence, study_verdict
from rigidimeter.reporting.prose import methods_prose
from rigidimeter.statistics import two_groups
from rigidimeter.study import Comparison, Measure, SensitivityRow, StudyResult

SMALL = Design(days=(5, 4), epochs=(5, 5), scores=(4, 4))


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
    (sentence,) = method_dependence(dataclasses.replace(study, sensitivity=rows(*methods)))
    return sentence


def test_a_clear_effect_is_shown_and_none_is_not(study: StudyResult) -> None:
    text = study_verdict(study)
    assert text.startswith("When days count (p by Holm for 6 measures), DBS is lower than OFF in")
    assert "stiffness K (p" in text
    none = study_verdict(made_study(dataclasses.replace(SMALL, effect=0.0)))
    assert "is lower" not in none
    assert "no difference is shown in inertia J" in none


def test_the_sign_is_that_of_the_estimate(study: StudyResult) -> None:
    def turned(c: Comparison) -> Comparison:
        d = c.days
        assert d is not None
        return dataclasses.replace(
            c, days=dataclasses.replace(d, estimate=-d.estimate, low=-d.high, high=-d.low)
        )

    text = study_verdict(altered(study, turned))
    assert "DBS is higher than OFF in" in text
    assert "lower" not in text


def test_a_p_that_only_one_measure_alone_would_bear_is_not_claimed(study: StudyResult) -> None:
    def weaker(c: Comparison) -> Comparison:
        assert c.days is not None
        p = 0.03 if c.measure.name == "work_j" else 0.6
        return dataclasses.replace(c, days=dataclasses.replace(c.days, p=p))

    text = study_verdict(altered(study, weaker))
    assert "is lower" not in text
    assert "work (p\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}0.18)" in text


def test_the_lead_is_claimed_only_where_it_is_beyond_chance(study: StudyResult) -> None:
    sizes = {c.measure.name: abs(c.effects.rank_biserial) for c in study.comparisons if c.effects}
    first = max(sizes, key=lambda name: sizes[name])

    def with_p(p_of: Callable[[tuple[str, str]], float]) -> StudyResult:
        pairs = [
            dataclasses.replace(d, p_holm=p_of((d.first, d.second))) for d in study.differences
        ]
        return dataclasses.replace(study, differences=tuple(pairs))

    text = study_verdict(with_p(lambda pair: 1e-5 if "inertia_kg_m2" in pair else 1.0))
    assert "its lead is beyond chance over inertia J, not over" in text
    text = study_verdict(with_p(lambda pair: 1.0))
    assert "its lead over any other is not beyond chance" in text
    text = study_verdict(with_p(lambda pair: math.nan if first in pair else 1.0))
    assert "beyond chance" not in text
    assert "is not known" in text


def test_prefixes_and_missing_tests(study: StudyResult) -> None:
    other = dataclasses.replace(study, virtual=True, blinded=True)
    assert study_verdict(other).startswith("Virtual data. Blinded: conditions are codes. When")
    lacking = untested(study, "work_j", "one day in each condition")
    assert "Not tested by days: work." in study_verdict(lacking)
    alone = dataclasses.replace(study, comparisons=())
    assert study_verdict(alone) == ""


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
    assert "Its size depends on it" in text


def test_voluntary_torque_is_named_where_the_intervals_say_so(study: StudyResult) -> None:
    text = said(study, ("published", "fixed", 0.3, 0.1), ("iv", "fixed", 0.0, 0.1))
    assert text.startswith("Damping: the difference that “published” shows is not shown by “iv”.")
    assert "Voluntary torque would do this" in text


def test_voluntary_torque_is_not_blamed_where_other_least_squares_are_not_moved(
    study: StudyResult,
) -> None:
    text = said(
        study,
        ("published", "fixed", 0.3, 0.1),
        ("bandlimited", "fixed", 0.0, 0.1),
        ("iv", "fixed", 0.0, 0.1),
    )
    assert "that “published” shows is not shown by “bandlimited” and “iv”" in text
    assert "would bias “bandlimited” too, so it is not the likely reason" in text
    assert "would do this" not in text


def test_shifts_that_differ_in_p_alone_are_called_so(study: StudyResult) -> None:
    text = said(study, ("iv", "fixed", 0.3, 0.1), ("iv", "free", 0.33, 0.7))
    assert "shows is not shown by “iv” (J free)" in text
    assert "they differ in p more than in size" in text


def test_lack_of_precision_is_not_taken_for_voluntary_torque(study: StudyResult) -> None:
    text = said(study, ("published", "fixed", 0.3, 0.1), ("iv", "fixed", 0.25, 1.2))
    assert "Voluntary torque" not in text
    assert "a lack of precision could be the reason" in text


def test_least_squares_may_hide_a_difference(study: StudyResult) -> None:
    text = said(study, ("published", "fixed", 0.0, 0.1), ("iv", "fixed", 0.3, 0.1))
    assert text.startswith("Damping: the difference that “iv” shows is not shown by “published”.")
    assert "can hide a difference as well as make one" in text


def test_opposite_signs_and_held_inertia(study: StudyResult) -> None:
    text = said(study, ("published", "fixed", 0.3, 0.1), ("iv", "fixed", -0.3, 0.1))
    assert (
        "the sign depends on the method: “published” shows DBS lower than OFF, “iv” higher" in text
    )
    text = said(study, ("iv", "fixed", 0.3, 0.1), ("iv", "free", 0.0, 0.1))
    assert "that “iv” (J fixed) shows is not shown by “iv” (J free)" in text


def test_methods_hold_the_facts_of_the_study(study: StudyResult) -> None:
    prose = methods_prose(study)
    text = prose.text
    assert text.startswith(
        "One subject was measured on 9 days (5 days in OFF, 4 days in DBS), in 9"
    )
    assert "45 epochs with a torque perturbation and 36 epochs with an imposed sinusoid" in text
    assert "DBS, stimulation on, 130 Hz, 0.32 mA, pulse width 60 µs" in text
    assert "±40 deg" in text
    assert "torque, angle and velocity at 100 samples/s" in text
    assert (
        "Of 81 epochs 3 do not count: 2 not ended with success, 1 excluded by the operator." in text
    )
    assert "3 examiners gave 27 ratings" in text
    for name in ("Werning", "Young", "Gilson", "Kenward", "Hodges", "Efron", "Holm"):
        assert sum(name in reference for reference in prose.references) >= 1
    assert "Newcombe" not in text


def test_methods_take_the_text_of_an_estimator_from_outside(study: StudyResult) -> None:
    toy = Method("toy", "a guess", (), "by a guess of ours", METHODS[0].fit, references=("bca",))
    by_toy = dataclasses.replace(study, analysis=dataclasses.replace(study.analysis, method="toy"))
    METHODS.append(toy)
    try:
        text = methods_prose(by_toy).text
    finally:
        METHODS.remove(toy)
    assert "were estimated epoch by epoch by a guess of ours (Efron 1987) in the band" in text
    assert "by the method “toy”" in methods_prose(by_toy).text


def test_methods_leave_out_what_was_not(study: StudyResult) -> None:
    foreign = tuple(
        dataclasses.replace(epoch, excitation_hz=None, motion=None) for epoch in study.epochs
    )
    analysis = dataclasses.replace(study.analysis, method="bandlimited")
    other = dataclasses.replace(
        study,
        epochs=foreign,
        analysis=analysis,
        comparisons=(),
        differences=(),
        ratings=None,
        sensitivity=(),
    )
    text = " ".join(methods_prose(other).paragraphs)
    for absent in ("guard", "admittance", "examiner", "Kenward", "Efron", "Young", "Holm", "rank"):
        assert absent not in text
    assert "least squares of signals that passed one zero-phase filter" in text
    blind = methods_prose(dataclasses.replace(study, blinded=True)).text
    assert "130 Hz" not in blind
    assert "blinded: conditions are codes" in blind
