"""What is concluded of a measure, and what keeps a difference that was found from being claimed."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import scipy
from tests.study_anew.old_cohorts import Design, made_study, ratings_found

from rigidimeter.analysis.statistics import holm, summarise
from rigidimeter.analysis.study import (
    Observation,
    Primary,
    StudyResult,
    compare,
    compare_analysis,
    conclude,
    conclusion_rows,
)
from rigidimeter.analysis.study.comparison import day_tests, gathered
from rigidimeter.analysis.study.conclusions import Conclusion
from rigidimeter.analysis.study.ratings_model import ratings_comparison, ratings_days
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Fit
from rigidimeter.core.study_files import PrimaryTable
from rigidimeter.planning import pairs_needed

SMALL = Design(days=(5, 4), epochs=(5, 5), scores=(4, 4))


@pytest.fixture(scope="module")
def study() -> StudyResult:
    return made_study(SMALL)


def of(result: StudyResult, measure: str) -> Conclusion:
    concluded = conclude(result)
    assert concluded is not None
    (found,) = (one for one in concluded.each if one.comparison.measure.name == measure)
    return found


def doubted(study: StudyResult, name: str, where, level: str = "caution") -> StudyResult:
    """Return the study with a finding on those fits for which `where` is true."""
    finding = Finding(name, level, 2.0, 1.0)  # type: ignore[arg-type]
    fits = tuple(
        replace(fit, findings=(finding,)) if where(fit) else fit for fit in study.analysis.fits
    )
    return replace(study, analysis=replace(study.analysis, fits=fits))


def unsupported(study: StudyResult, name: str, where) -> StudyResult:
    """Return the study with such findings, and no other method that could clear them."""
    return replace(doubted(study, name, where), sensitivity=())


def in_dbs(fit: Fit) -> bool:
    return fit.condition == "DBS"


def one_in_dbs(fit: Fit) -> bool:
    return fit.condition == "DBS" and fit.epoch == "p02"


def test_a_difference_without_any_doubt_is_shown(study):
    for measure in ("stiffness_nm_rad", "damping_nm_s_rad", "impulse_nm_s"):
        found = of(study, measure)
        assert (found.verdict, found.reason) == ("lower", "")
        assert found.p < 0.05
    assert of(study, "inertia_kg_m2").verdict == "no difference shown"


def test_a_difference_made_by_doubted_epochs_is_not_supported(study):
    found = of(unsupported(study, "voluntary_torque", in_dbs), "stiffness_nm_rad")
    assert found.verdict == "not supported"
    assert found.reason == (
        "torque of the subject's own (voluntary_torque) in 0 of 23 epochs in OFF, 19 of 19 in DBS"
    )
    assert found.finding is not None
    assert "without these epochs a test needs 3 epochs in each" in found.finding.details


def test_a_difference_that_stands_without_them_is_shown(study):
    assert of(doubted(study, "lack_of_fit", one_in_dbs), "stiffness_nm_rad").verdict == "lower"


def test_a_doubt_that_can_hide_a_difference_is_said(study):
    found = of(doubted(study, "lack_of_fit", in_dbs), "inertia_kg_m2")
    assert found.verdict == "cannot be decided"
    assert (
        found.reason == "lack_of_fit can hide differences: 0 of 23 epochs in OFF, 19 of 19 in DBS"
    )


def test_a_note_is_no_doubt_of_an_estimate_but_of_a_score_of_the_same_epoch(study):
    noted = doubted(study, "voluntary_torque", in_dbs, "note")
    assert of(noted, "stiffness_nm_rad").verdict == "lower"
    scores = tuple(
        replace(score, epoch=score.epoch.replace("s", "p")) for score in study.analysis.scores
    )
    moved = replace(noted, analysis=replace(noted.analysis, scores=scores))
    work = next(c for c in moved.comparisons if c.measure.name == "work_j")
    same = replace(
        work,
        observations=tuple(replace(o, epoch=o.epoch.replace("s", "p")) for o in work.observations),
    )
    moved = replace(moved, comparisons=(same,))
    assert of(moved, "work_j").verdict == "not supported"
    assert of(replace(study, comparisons=(same,)), "work_j").verdict == "lower"


@pytest.mark.parametrize("name", ["between_samples", "varying_between_epochs"])
def test_what_is_alike_in_both_conditions_makes_no_difference(study, name):
    assert of(doubted(study, name, lambda _: True), "stiffness_nm_rad").verdict == "lower"


def test_a_method_that_the_subject_does_not_bias_clears_its_torque_alone(study):
    row = next(
        row
        for row in study.sensitivity
        if row.measure.name == "stiffness_nm_rad" and row.method == "iv" and row.inertia == "fixed"
    )
    with_iv = replace(study, sensitivity=(row,))
    assert of(doubted(with_iv, "tremor", in_dbs), "stiffness_nm_rad").verdict == "lower"
    assert of(doubted(with_iv, "lack_of_fit", in_dbs), "stiffness_nm_rad").verdict != "lower"
    other_sign = replace(study, sensitivity=(replace(row, shift=-row.shift),))
    found = of(doubted(other_sign, "tremor", in_dbs), "stiffness_nm_rad")
    assert found.verdict == "not supported"


def test_a_doubt_on_all_epochs_of_a_condition_together(study):
    finding = Finding("missing_term", "caution", 2.0, 1.0)
    pooled = replace(study.analysis.fits[0], epoch="pooled", condition="OFF", findings=(finding,))
    together = replace(study, analysis=replace(study.analysis, pooled=(pooled,)))
    found = of(together, "stiffness_nm_rad")
    assert found.verdict == "not supported"
    assert found.reason == "missing_term in all epochs of a condition together"
    assert of(together, "impulse_nm_s").verdict == "lower"


def test_no_treatment_changes_the_inertia(study):
    """Degrees in one condition's files, for example, make all three of J, B and K larger."""
    fits = tuple(
        replace(fit, value=57.3 * fit.value) if in_dbs(fit) else fit for fit in study.analysis.fits
    )
    turned = replace(study.analysis, fits=fits, fixed_inertia=fits)
    by_source = {session.source: session for session in study.sessions}
    comparisons = day_tests(gathered(turned, ("OFF", "DBS"), by_source))
    found = replace(study, analysis=turned, comparisons=comparisons)
    for measure in ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad"):
        assert of(found, measure).verdict == "not supported"
        assert of(found, measure).reason.startswith(
            "inertia differs by a factor of about 57, as where degrees are read as"
        )


def with_values(study: StudyResult, change) -> StudyResult:
    """Return the study with other estimates, tested anew."""
    fits = tuple(replace(fit, value=change(fit)) for fit in study.analysis.fits)
    analysis = replace(study.analysis, fits=fits)
    by_source = {session.source: session for session in study.sessions}
    comparisons = day_tests(gathered(analysis, ("OFF", "DBS"), by_source))
    return replace(study, analysis=analysis, comparisons=comparisons)


def test_what_is_within_the_accuracy_is_asked_of_what_was_tested(study):
    """Each day falls by a tenth, and most epochs of OFF and of DBS are of days that are alike."""
    (c,) = (one for one in study.comparisons if one.measure.name == "stiffness_nm_rad")
    levels, many = (2.5, 2.7, 3.0, 3.1, 3.2), {"OFF": 1, "DBS": 2}
    observations = tuple(
        Observation(level * factor * (1 + 1e-4 * k), name, "M1", f"{day}", f"{day}-{name}", f"{k}")
        for name, factor in (("OFF", 1.0), ("DBS", 0.9))
        for day, level in enumerate(levels)
        for k in range(15 if day == many[name] else 2)
    )
    values = {name: [o.value for o in observations if o.condition == name] for name in many}
    summaries = {name: summarise(own) for name, own in values.items()}
    assert summaries["OFF"].median == pytest.approx(summaries["DBS"].median, rel=1e-3)
    again = replace(c, observations=observations, summaries=summaries, days=None)
    uneven = day_tests((again,))
    found = of(replace(study, comparisons=uneven), "stiffness_nm_rad")
    assert found.p < 1e-3
    assert found.verdict == "lower"


def test_in_a_sequence_nothing_is_claimed_behind_what_is_within_the_accuracy(study):
    def slight(fit: Fit) -> np.ndarray:
        spread = 1.0 + 1e-4 * (int(fit.epoch[1:]) % 3)
        of_dbs = np.array([1.0, 0.995, 0.82]) if in_dbs(fit) else 1.0
        return np.array([0.0045, 0.137, 1.75]) * of_dbs * spread

    made = with_values(study, slight)
    order = ("damping_nm_s_rad", "stiffness_nm_rad")
    found = declared(made, *order, rule="sequence")
    assert of(found, order[0]).finding.name == "within_accuracy"
    assert of(found, order[1]).verdict == "cannot be decided"
    assert of(declared(made, *order, rule="holm"), order[1]).verdict == "lower"


def test_the_paper_s_second_stage_concludes_nothing(study):
    """An inertia held at the wrong value goes into K of the fits at fixed inertia alone."""

    def heavier(fit: Fit) -> np.ndarray:
        spread = 1.0 + 0.01 * (int(fit.epoch[1:]) % 3)
        return np.array([0.0045 * (1.2 if in_dbs(fit) else 1.0), 0.137, 1.75]) * spread

    made = with_values(study, heavier)
    held = tuple(
        replace(fit, value=fit.value * np.array([1.0, 1.0, 0.8])) if in_dbs(fit) else fit
        for fit in made.analysis.fits
    )
    made = replace(made, analysis=replace(made.analysis, fixed_inertia=held))
    found = of(made, "stiffness_nm_rad")
    assert found.verdict == "no difference shown"
    assert abs(found.difference.percent[0]) < 0.5
    inertia = of(made, "inertia_kg_m2")
    assert inertia.p < 0.05
    assert inertia.verdict == "not supported"
    assert inertia.reason.startswith("inertia differs by 20 %, and no treatment changes it")


def test_an_inertia_that_differs_explains_a_smaller_difference_of_stiffness(study):
    """Torque of the subject or a unit changes all three in proportion."""

    def larger(fit: Fit) -> np.ndarray:
        spread = 1.0 + 0.01 * (int(fit.epoch[1:]) % 3)
        by = np.array([1.2, 1.1, 1.1]) if in_dbs(fit) else np.ones(3)
        return np.array([0.0045, 0.137, 1.75]) * by * spread

    found = of(with_values(study, larger), "stiffness_nm_rad")
    assert found.p < 0.05
    assert found.verdict == "not supported"
    assert found.reason.startswith("inertia differs by 20 %, and no treatment changes it")


def test_a_difference_smaller_than_the_error_between_samples_is_none(study):
    def same(fit: Fit) -> np.ndarray:
        lower = 0.995 if in_dbs(fit) else 1.0
        return np.array([0.0045, 0.137, 1.75]) * lower * (1 + 1e-4 * int(fit.epoch[1:]))

    found = of(with_values(study, same), "inertia_kg_m2")
    assert found.p < 0.05
    assert found.verdict == "no difference shown"
    assert found.reason == "0.5 % is within the 1 % that motion between samples may cause"


@pytest.mark.parametrize(("half_width", "verdict"), [(0.02, "lower"), (0.5, "not supported")])
def test_a_bias_counts_as_far_as_it_could_make_the_difference(study, half_width, verdict):
    """60 % of half the interval of all epochs together."""
    finding = Finding("loop_bias", "caution", 60.0, 50.0)
    value = study.analysis.fits[0].value
    pooled = replace(
        study.analysis.fits[0],
        condition="DBS",
        findings=(finding,),
        low=value - half_width,
        high=value + half_width,
    )
    together = replace(study.analysis, pooled=(pooled,))
    found = of(replace(study, analysis=together, sensitivity=()), "stiffness_nm_rad")
    assert found.verdict == verdict
    if verdict != "lower":
        assert found.reason == "loop_bias in all epochs of a condition together"


@pytest.mark.parametrize(
    ("label", "verdict"),
    [
        (lambda n: str(n), "not supported"),
        (lambda n: f"day {n}", "not supported"),
        (lambda n: f"2026-01-{n:02d}", "not supported"),
        (lambda n: f"{n}. January", "lower"),
    ],
    ids=["numbers", "numbered", "dates", "of no known order"],
)
def test_days_of_one_condition_after_all_of_the_other(study, label, verdict):
    """Where days tell their order; 10 is after 9."""

    def later(observation: Observation) -> Observation:
        day = int(observation.day) + (10 if observation.condition == "DBS" else 0)
        return replace(observation, day=label(day))

    comparisons = tuple(
        replace(c, observations=tuple(later(o) for o in c.observations))
        for c in study.comparisons
        if c.measure.origin != "ratings"
    )
    found = of(replace(study, comparisons=comparisons), "stiffness_nm_rad")
    assert found.verdict == verdict
    if verdict != "lower":
        assert found.reason.startswith("all days in DBS came after all days in OFF")


def declared(study: StudyResult, *measures: str, **more) -> StudyResult:
    """Return the study with these primary measures; B and K by default."""
    given = {"measures": list(measures)} if measures else {}
    return replace(study, primary=Primary(PrimaryTable(**given, **more), "study.toml"))


class TestFamilies:
    """K and B are claimed by Holm's method, scores and ratings apart, J is in no family."""

    def test_primary_secondary_and_the_check_are_adjusted_apart(self, study):
        found = {one.comparison.measure.name: one for one in conclude(study).each}
        alone = {name: one.comparison.days.p for name, one in found.items()}
        for names in (
            ("stiffness_nm_rad", "damping_nm_s_rad"),
            ("impulse_nm_s", "work_j", "rating"),
        ):
            assert [found[n].p for n in names] == list(holm([alone[n] for n in names]))
            assert {found[n].family.tests for n in names} == {len(names)}
        assert found["inertia_kg_m2"].p == alone["inertia_kg_m2"]
        assert found["inertia_kg_m2"].role == "check"

    def test_one_declared_measure_is_not_adjusted_and_the_other_is_secondary(self, study):
        found = declared(study, "stiffness_nm_rad")
        one = of(found, "stiffness_nm_rad")
        assert (one.p, one.role) == (one.comparison.days.p, "primary")
        assert (of(found, "damping_nm_s_rad").role, of(found, "rating").role) == ("secondary",) * 2
        assert "subject, K is lower in DBS than in OFF." in found.statements.concluded[0]
        assert "B, impulse" in found.statements.concluded[-1]

    @pytest.mark.parametrize(("first", "claimed"), [(0.01, True), (0.2, False)])
    def test_in_a_sequence_the_second_is_claimed_only_if_the_first_is_shown(
        self, study, first, claimed
    ):
        p = {"stiffness_nm_rad": 0.03, "damping_nm_s_rad": first}
        given = tuple(
            replace(c, days=replace(c.days, p=p.get(c.measure.name, c.days.p)))
            for c in study.comparisons
        )
        order = ("damping_nm_s_rad", "stiffness_nm_rad")
        found = declared(replace(study, comparisons=given), *order, rule="sequence")
        second = of(found, "stiffness_nm_rad")
        assert second.p == max(first, 0.03)
        assert (second.verdict == "lower") is claimed
        if not claimed:
            assert second.verdict == "cannot be decided"
            assert second.reason == "in the declared sequence it comes after B, which is not shown"
        assert "p adjusted in the declared sequence of B and K" in found.statements.tested

    def test_what_was_compared_before_keeps_all_measures_in_one_family(self, study):
        found = conclude(replace(study, primary=Primary(source="earlier comparison")))
        assert {one.family.tests for one in found.each} == {6}
        assert [one.p for one in found.each] == list(
            holm([one.comparison.days.p for one in found.each])
        )


class TestTheOneRule:
    """No difference is shown where the test could have shown it, and it is excluded."""

    def at(self, study: StudyResult, half_percent: float, estimate_percent: float) -> Conclusion:
        """Return what is concluded of K with half its interval at p = 0.05/2, and an estimate."""

        def changed(c):
            t = scipy.stats.t.isf(0.0125, c.days.df)
            estimate, se = (c.days.mean_x * x / 100 for x in (estimate_percent, half_percent / t))
            half = scipy.stats.t.isf(0.025, c.days.df) * se
            p = 2 * scipy.stats.t.sf(abs(estimate) / se, c.days.df)
            return replace(
                c,
                days=replace(c.days, estimate=estimate, se=se, low=estimate - half,
                             high=estimate + half, p=p),
            )  # fmt: skip

        given = tuple(
            changed(c) if c.measure.name == "stiffness_nm_rad" else c for c in study.comparisons
        )
        return of(replace(study, comparisons=given), "stiffness_nm_rad")

    @pytest.mark.parametrize(
        ("half", "estimate", "verdict"),
        [
            (19.9, 1.0, "no difference shown"),
            (20.1, 1.0, "cannot be decided"),
            (19.9, 9.0, "cannot be decided"),  # 20 % is within its interval
            (19.9, 25.0, "lower"),
            (80.0, 45.0, "cannot be decided"),
        ],
    )
    def test_it_is_by_half_the_interval_and_by_what_that_excludes(
        self, study, half, estimate, verdict
    ):
        one = self.at(study, half, estimate)
        assert one.verdict == verdict
        assert one.half_width / one.difference.reference == pytest.approx(half / 100)

    def test_the_size_is_what_the_study_declares(self, study):
        one = of(declared(study, difference_percent=60.0), "inertia_kg_m2")
        assert one.wanted_percent == 60.0

    def test_days_that_would_decide_are_planned_for_the_first_test_of_the_family(self, study):
        one = self.at(study, 30.0, 1.0)
        days = one.comparison.days
        sd = days.se * (2 / (1 / 5 + 1 / 4)) ** 0.5
        assert one.needed == (pairs_needed(0.2 * days.mean_x, sd, alpha=0.025), "day")

    def test_two_days_conclude_no_absence(self):
        """Epochs that scatter by 2 %, and nothing between days: still one degree of freedom."""
        rng = np.random.default_rng(3)
        rows = [
            {"subject": "S1", "day": day, "condition": name, "k": level * (1 + 0.02 * x)}
            for day in (1, 2)
            for name, level in (("OFF", 1.75), ("DBS", 1.435))
            for x in rng.standard_normal(8)
        ]
        found = compare(pd.DataFrame(rows), value="k", resamples=0)
        assert of(found, "k").verdict in ("lower", "cannot be decided")
        flat = pd.DataFrame([{**row, "b": 1 + 0.1 * rng.standard_normal()} for row in rows])
        one = of(compare(flat, value=["k", "b"], resamples=0), "b")
        assert one.verdict == "cannot be decided"
        assert one.reason == "the chance to show a difference of 20 % was below one half"
        assert one.needed is not None

    def test_many_values_that_do_not_differ_show_it(self):
        rng = np.random.default_rng(1)
        rows = [{"condition": c, "k": 5 + rng.standard_normal()} for c in "ab" for _ in range(80)]
        found = compare(pd.DataFrame(rows), value="k", resamples=0)
        assert of(found, "k").verdict == "no difference shown"
        (sentence,) = found.statements.concluded
        assert sentence.startswith("No difference of 20 % between a and b is shown in k; excluded")
        few = compare(pd.DataFrame(rows[:6] + rows[-6:]), value="k", resamples=0)
        assert of(few, "k").verdict == "cannot be decided"
        assert of(few, "k").needed.unit == "value"


def test_an_inertia_that_differs_by_less_is_a_caution_beside_the_verdicts_of_k_and_b(study):
    """A cuff that sits otherwise may change all three; here J by 4 %, K and B by 20 %."""

    def cuff(fit: Fit) -> np.ndarray:
        spread = 1.0 + 0.01 * (int(fit.epoch[1:]) % 3)
        by = np.array([1.04, 0.8, 0.8]) if in_dbs(fit) else np.ones(3)
        return np.array([0.0045, 0.137, 1.75]) * by * spread

    found = with_values(study, cuff)
    for measure in ("stiffness_nm_rad", "damping_nm_s_rad"):
        one = of(found, measure)
        assert (one.verdict, one.finding) == ("lower", None)
        assert one.caution == of(found, "inertia_kg_m2").finding
    assert of(found, "rating" if found.ratings is None else "impulse_nm_s").caution is None
    assert found.statements.concluded[1].startswith("Caution for K and B: inertia differs by ")
    assert "caution" in conclusion_rows(found)[0]
    (group,) = [g for g in found.findings if g.finding.name == "inertia_of_conditions"]
    assert group.where == "K, B and J"


class TestRecordings:
    """Where days are not known, a recording stands for a day."""

    def test_a_difference_between_them_may_be_that_of_one_day_from_another(self, study):
        found = compare_analysis(study.analysis, "OFF", "DBS", resamples=0)
        assert conclude(found).basis == "recordings"
        stiffness = of(found, "stiffness_nm_rad")
        assert stiffness.p < 0.05
        assert stiffness.verdict == "not supported"
        assert stiffness.reason.startswith("which recordings are of one day is not known")
        assert of(found, "inertia_kg_m2").verdict == "no difference shown"

    def test_one_of_each_decides_nothing(self, study):
        """Another day may have shifted all stiffness: there is nothing to tell the two apart."""
        first = {fit.condition: fit.source for fit in reversed(study.analysis.fits)}
        fits = tuple(f for f in study.analysis.fits if f.source == first[f.condition])
        alone = replace(study.analysis, fits=fits, fixed_inertia=fits, scores=())
        result = compare_analysis(alone, "OFF", "DBS", resamples=0)
        assert result.comparison("stiffness_nm_rad").test.p < 0.05
        found = of(result, "stiffness_nm_rad")
        assert found.verdict == "cannot be decided"
        assert "one recording in each condition" in found.reason


class TestTables:
    def test_three_against_three_cannot_decide(self):
        table = pd.DataFrame({"condition": ["a"] * 3 + ["b"] * 3, "k": [1, 2, 3, 7, 8, 9]})
        found = of(compare(table, value="k", resamples=0), "k")
        assert found.verdict == "cannot be decided"
        assert found.reason == "3 values against 3 cannot reach p < 0.05"

    def test_ten_against_ten_can(self):
        values = [*range(10), *range(20, 30)]
        table = pd.DataFrame({"condition": ["a"] * 10 + ["b"] * 10, "k": values})
        assert of(compare(table, value="k", resamples=0), "k").verdict == "higher"
        assert of(
            compare(table, other="a", reference="b", value="k", resamples=0), "k"
        ).verdict == ("lower")


def test_an_examiner_for_each_condition_makes_no_difference():
    """A rated OFF and B, who rates lower, DBS: nobody saw both."""
    scores = {"1": 2.0, "2": 2.5, "3": 2.0, "4": 2.5, "5": 1.0, "6": 1.5, "7": 1.0, "8": 1.5}
    rows = [
        ("OFF" if day < "5" else "DBS", "A" if day < "5" else "B", "M1", day, score + again)
        for day, score in scores.items()
        for again in (0.0, 0.5)
    ]
    found = ratings_found(tuple(rows), ("OFF", "DBS"))
    rated = replace(ratings_comparison(found), days=ratings_days(found))
    result = of(replace(made_study(SMALL), ratings=found, comparisons=(rated,)), "rating")
    assert result.p < 0.05
    assert result.verdict == "not supported"
    assert "examiners A, B rated one of the conditions alone" in result.reason


def test_rows_of_the_document(study):
    rows = conclusion_rows(unsupported(study, "voluntary_torque", in_dbs))
    assert [row["measure"] for row in rows][:3] == [
        "stiffness_nm_rad",
        "damping_nm_s_rad",
        "inertia_kg_m2",
    ]
    assert {row["tested_by"] for row in rows} == {"days"}
    assert rows[0]["verdict"] == "not supported"
    alone = replace(
        study, other="", comparisons=tuple(replace(c, other="") for c in study.comparisons)
    )
    assert conclusion_rows(alone) == []
