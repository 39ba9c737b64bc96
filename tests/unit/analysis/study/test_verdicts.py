"""What is concluded of a measure, and what keeps a difference that was found from being claimed."""

from dataclasses import replace

import pandas as pd
import pytest
import scipy
from tests.unit.analysis.study.made import (
    JOINT,
    NAMES,
    alike,
    concluded,
    doubted,
    first,
    in_dbs,
    made,
    score_rows,
)

from rigidimeter.analysis.statistics import holm
from rigidimeter.analysis.study import (
    Compared,
    Primary,
    Study,
    as_rows,
    conclude,
    conclusion_rows,
    corrected,
    day_tests,
    ratings_of,
    reasons,
    sensitivity,
    statement,
)
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Fit, Outcome
from rigidimeter.core.study_files import PrimaryTable
from rigidimeter.planning import pairs_needed

J, B, K = "inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad"
IMPULSE, WORK, RATING = "impulse_nm_s", "work_j", "rating"
LOWER, NONE, WITHHELD, OPEN = (
    *("lower", "no difference shown", "not supported", "cannot be decided"),
)


def pooled(name: str, condition: str = "OFF", half: float = 0.1, size: float = 2.0) -> Fit:
    """Return a fit to all epochs of a condition, with a finding."""
    finding = Finding(name, "caution", size, 0.5 * size)
    ends = {"se": 0.01 * JOINT, "low": JOINT - half, "high": JOINT + half}
    return Fit("", "pooled", condition, "iv", Outcome(), JOINT, findings=(finding,), **ends)


def one_in_dbs(fit: Fit) -> bool:
    return in_dbs(fit) and fit.epoch == "p02"


def every(_: Fit) -> bool:
    return True


def times(factor: float):
    return lambda fit: replace(fit, value=factor * fit.value) if in_dbs(fit) else fit


def later(label):
    """Return sessions with all days of DBS after those of OFF."""
    return lambda one: one._replace(day=label(int(one.day) + 10 * (one.condition == "DBS")))


def paired_epochs(score):
    """Return a score of the same epoch as a fit."""
    return replace(score, epoch=score.epoch.replace("s", "p"))


TORQUE = "torque of the subject's own (voluntary_torque) in 0 of 23 epochs in OFF, 19 of 19 in DBS"
TOGETHER = "in all epochs of a condition together"
AFTER = "all days in DBS came after all days in OFF"

NOTED = {"fit": doubted("voluntary_torque", level="note"), "score": paired_epochs}
OF_ALL = {J: WITHHELD, B: WITHHELD, K: WITHHELD}
CASES = [
    ({}, {K: LOWER, B: LOWER, J: NONE, IMPULSE: LOWER, WORK: LOWER, RATING: LOWER}, ""),
    ({"fit": doubted("voluntary_torque")}, {K: WITHHELD, B: WITHHELD}, TORQUE),
    ({"fit": doubted("lack_of_fit", one_in_dbs)}, {K: LOWER}, ""),  # it stands without them
    ({"fit": doubted("lack_of_fit")}, {J: OPEN}, "lack_of_fit can hide differences: 0 of 23 ep"),
    # A note is no doubt of an estimate, but of a score of the same epoch.
    (NOTED, {K: LOWER}, ""),
    (NOTED, {WORK: WITHHELD}, TORQUE.replace("of 23", "of 20").replace("19 of 19", "16 of 16")),
    ({"score": paired_epochs}, {WORK: LOWER}, ""),
    # What is alike in both conditions makes no difference.
    ({"fit": doubted("between_samples", every)}, {K: LOWER}, ""),
    ({"fit": doubted("varying_between_epochs", every)}, {K: LOWER}, ""),
    ({"pooled": [pooled("missing_term")]}, {K: WITHHELD}, f"missing_term {TOGETHER}"),
    ({"pooled": [pooled("missing_term")]}, {IMPULSE: LOWER}, ""),
    # A bias counts as far as it could make the difference: 60 % of half the interval.
    ({"pooled": [pooled("loop_bias", "DBS", 0.02, 60.0)]}, {K: LOWER}, ""),
    ({"pooled": [pooled("loop_bias", "DBS", 0.5, 60.0)]}, {K: WITHHELD}, f"loop_bias {TOGETHER}"),
    # No treatment changes the inertia.
    ({"fit": times(57.3)}, OF_ALL, "inertia differs by a factor of about 57, as where degrees are"),
    ({"fit": alike([1.2, 1.1, 1.1])}, OF_ALL, "inertia differs by 20 %, and no treatment changes"),
    ({"fit": alike([0.995] * 3, 1e-4)}, {J: NONE}, "0.5 % is within the 1 % that motion between"),
    # Where days tell their order; 10 is after 9.
    ({"entry": later(str)}, {K: WITHHELD}, AFTER),
    ({"entry": later("day {}".format)}, {K: WITHHELD}, AFTER),
    ({"entry": later("2026-01-{:02d}".format)}, {K: WITHHELD}, AFTER),
    ({"entry": later("{}. January".format)}, {K: LOWER}, ""),
    # A recording stands for a day that is not known; one of each decides nothing.
    ({"days_known": False}, {K: WITHHELD}, "which recordings are of one day is not known"),
    ({"days_known": False}, {J: NONE}, ""),
    ({"days_known": False, "fit": first}, {K: OPEN}, "there is one recording in each condition"),
]  # fmt: skip


@pytest.mark.parametrize(("given", "verdicts", "reason"), CASES)
def test_a_verdict_and_its_reason(given: dict, verdicts: dict[str, str], reason: str) -> None:
    found = concluded(made(**given))
    assert {name: found[name].verdict for name in verdicts} == verdicts
    for name in verdicts:
        assert found[name].reason.startswith(reason)
        assert found[name].verdict != LOWER or (found[name].reason == "" and found[name].found)


@pytest.mark.parametrize(
    ("name", "sign", "verdict"),
    [("tremor", 1, LOWER), ("tremor", -1, WITHHELD), ("lack_of_fit", 1, WITHHELD)],
)
def test_a_method_that_the_subject_does_not_bias_clears_its_torque_alone(
    name: str, sign: int, verdict: str
) -> None:
    study = made(fit=doubted(name))
    one = next(
        one
        for one in sensitivity(study.rows, study.pair)[0]
        if (one.by_values.measure.name, one.method, one.inertia) == (K, "iv", "fixed")
    )
    found = one.by_values
    turned = replace(found, difference=sign * found.difference, sign=sign * found.sign)
    assert concluded(study, [one._replace(by_values=turned)])[K].verdict == verdict


def test_the_paper_s_second_stage_concludes_nothing() -> None:
    """An inertia held at the wrong value goes into K of the fits at fixed inertia alone."""
    heavier = alike([1.2, 1.0, 1.0])
    study = made(fit=heavier)
    held = (study.rows["inertia"] == "fixed") & (study.rows["condition"] == "DBS")
    lower = study.rows["value"].where(~held, 0.8 * study.rows["value"])
    found = concluded(replace(study, rows=study.rows.assign(value=lower)))
    assert (found[K].verdict, found[J].verdict) == (NONE, WITHHELD)
    assert abs(found[K].percent(found[K].of_test)[0]) < 0.5


def test_what_is_within_the_accuracy_is_asked_of_what_was_tested() -> None:
    """Each day falls by a tenth, and most epochs of OFF and of DBS are of days that are alike."""
    many = {"OFF": 1, "DBS": 2}
    rows = as_rows(
        {"subject": "M1", "day": f"{day}", "session": f"{day}-{name}", "unit": f"{day}",
         "condition": name, "method": "iv", "measure": K, "value": level * factor * (1 + 1e-4 * k)}
        for name, factor in (("OFF", 1.0), ("DBS", 0.9))
        for day, level in enumerate((2.5, 2.7, 3.0, 3.1, 3.2))
        for k in range(15 if day == many[name] else 2)
    )  # fmt: skip
    medians = rows.groupby("condition", observed=True)["value"].median()
    assert medians["OFF"] == pytest.approx(medians["DBS"], rel=1e-3)
    found = concluded(Study(rows, *NAMES))[K]
    assert found.p_adjusted < 1e-3
    assert found.verdict == LOWER


def test_an_inertia_that_differs_by_less_is_a_caution_beside_the_verdicts_of_k_and_b() -> None:
    """A cuff that sits otherwise may change all three; here J by 4 %, K and B by 20 %."""
    study = made(fit=alike([1.04, 0.8, 0.8]))
    found = concluded(study)
    for name in (K, B):
        assert (found[name].verdict, found[name].finding) == (LOWER, None)
        assert found[name].caution == found[J].finding
    assert found[IMPULSE].caution is None
    said = statement(study, [*found.values()]).concluded
    assert said[1].startswith("Caution for K and B: inertia differs by ")
    assert conclusion_rows(found.values())[0]["caution"]
    (group,) = [g for g in reasons([*found.values()]) if g.finding.name == "inertia_of_conditions"]
    assert group.where == "K, B and J"


def declared(*measures: str, **more) -> dict[str, Primary]:
    given = {"measures": list(measures)} if measures else {}
    return {"primary": Primary(PrimaryTable(**given, **more), "study.toml")}


class TestFamilies:
    """K and B are claimed by Holm's method, scores and ratings apart, J is in no family."""

    @pytest.mark.parametrize(
        ("primary", "families", "roles"),
        [
            ({}, [(K, B), (IMPULSE, WORK, RATING), (J,)], {K: "primary", J: "check"}),
            (
                declared(K),
                [(K,), (B, IMPULSE, WORK, RATING), (J,)],
                {K: "primary", B: "secondary", RATING: "secondary"},
            ),
            (
                {"primary": Primary(source="earlier comparison")},
                [(K, B, J, IMPULSE, WORK, RATING)],
                {J: "primary"},
            ),
        ],
    )
    def test_each_is_adjusted_by_itself(self, primary, families, roles) -> None:
        found = concluded(made(**primary))
        for names in families:
            assert [found[n].p_adjusted for n in names] == [*holm([found[n].p for n in names])]
            assert {found[n].family.tests for n in names} == {len(names)}
        assert {name: found[name].role for name in roles} == roles

    @pytest.mark.parametrize(("first", "claimed"), [(0.01, True), (0.2, False)])
    def test_in_a_sequence_the_second_is_claimed_only_if_the_first_is_shown(
        self, first: float, claimed: bool
    ) -> None:
        p = {K: 0.03, B: first}
        study = made(**declared(B, K, rule="sequence"))
        tests = [replace(one, p=p.get(one.measure.name, one.p)) for one in day_tests(study)]
        found = conclude(study, tests)
        second = found[0]
        assert second.p_adjusted == max(first, 0.03)
        assert (second.verdict == LOWER) is claimed
        if not claimed:
            assert second.verdict == OPEN
            assert second.reason == "in the declared sequence it comes after B, which is not shown"
        assert "p adjusted in the declared sequence of B and K" in statement(study, found).tested

    @pytest.mark.parametrize(
        ("p", "finding"),
        [(0.02, "earlier_in_sequence"), (0.03, "wide_interval"), (0.2, "wide_interval")],
    )
    def test_in_a_sequence_the_level_is_divided_by_the_conditions(self, p, finding) -> None:
        """Two conditions beside the reference: alone it would be found below 0.025."""
        study = made(further=("LOW",), **declared(B, K, rule="sequence"))
        damping, stiffness = (o for o in day_tests(study) if o.other == "DBS"
                              and o.measure.name in (B, K))  # fmt: skip
        wide = {"low": -9.0, "high": 9.0, "se": 3.0}
        tests = [replace(stiffness, p=p, **wide), replace(damping, p=0.5, **wide),
                 replace(stiffness, p=0.5, other="LOW", **wide)]  # fmt: skip
        one = conclude(study, tests)[0]
        assert (one.measure.name, one.other) == (K, "DBS")
        assert (one.finding.name, one.family.level) == (finding, 0.025)

    @pytest.mark.parametrize(("rule", "verdict"), [("sequence", OPEN), ("holm", LOWER)])
    def test_nothing_is_claimed_behind_what_is_within_the_accuracy(self, rule, verdict) -> None:
        found = concluded(made(fit=alike([1.0, 0.995, 0.82], 1e-4), **declared(B, K, rule=rule)))
        assert found[B].finding.name == "within_accuracy"
        assert found[K].verdict == verdict


class TestTheOneRule:
    """No difference is shown where the test could have shown it, and it is excluded."""

    def at(self, half_percent: float, estimate_percent: float) -> Compared:
        """Return what is concluded of K with half its interval at p = 0.05/2, and an estimate."""
        study = made()
        tests = list(day_tests(study))
        place = [one.measure.name for one in tests].index(K)
        one = tests[place]
        unit = one.value_reference / 100
        se = half_percent * unit / scipy.stats.t.isf(0.0125, one.df)
        size, half = -estimate_percent * unit, scipy.stats.t.isf(0.025, one.df) * se
        p = 2 * scipy.stats.t.sf(abs(size) / se, one.df)
        changed = {"difference": size, "se": se, "low": size - half, "high": size + half, "p": p}
        tests[place] = replace(one, sign=size, **changed)
        return conclude(study, tests)[0]

    @pytest.mark.parametrize(
        ("half", "estimate", "verdict"),
        [
            (19.9, 1.0, NONE),
            (20.1, 1.0, OPEN),
            (19.9, 9.0, OPEN),  # 20 % is within its interval
            (19.9, 25.0, LOWER),
            (80.0, 45.0, OPEN),
        ],
    )
    def test_it_is_by_half_the_interval_and_by_what_that_excludes(self, half, estimate, verdict):
        one = self.at(half, estimate)
        assert one.verdict == verdict
        assert one.half_width / one.value_reference == pytest.approx(half / 100)

    def test_the_size_is_what_the_study_declares(self) -> None:
        assert concluded(made(**declared(difference_percent=60.0)))[J].wanted_percent == 60.0

    def test_days_that_would_decide_are_planned_for_the_first_test_of_the_family(self) -> None:
        one = self.at(30.0, 1.0)
        sd = one.se * (2 / (1 / 5 + 1 / 4)) ** 0.5
        expected = pairs_needed(0.2 * one.value_reference, sd, alpha=0.025)
        assert one.needed == (expected, "day")

    @pytest.mark.parametrize(
        ("epochs", "level", "within"), [(2, 0.025, 0.16**2 / 2), (3, 0.05, 0.0)]
    )
    def test_of_one_day_they_are_those_of_the_paired_t_test(self, epochs, level, within) -> None:
        """SD 12 % between days as assumed, of which half cancels; 16 % between epochs below three.

        Three are alike here, so that the days' scatter alone counts.
        """
        rows = as_rows(
            {"subject": "M1", "day": "1", "session": name, "condition": name, "method": "iv",
             "measure": K, "epoch": f"{k}", "value": value}
            for name, value in zip(NAMES, (2.0, 1.6), strict=True)
            for k in range(epochs)
        )  # fmt: skip
        both = pd.concat([rows, rows.assign(measure=B)]) if level < 0.05 else rows
        study = Study(both.reset_index(drop=True), *NAMES)
        one = concluded(replace(study, **declared(*(K, B) if level < 0.05 else (K,))))[K]
        sd = ((0.12**2 / 2 + within) * (2.0**2 + 1.6**2)) ** 0.5
        assert one.needed == (pairs_needed(0.4, sd, alpha=level), "day")


def test_an_examiner_for_each_condition_makes_no_difference() -> None:
    """A rated OFF and B, who rates lower, DBS: nobody saw both."""
    scores = {"1": 2.0, "2": 2.5, "3": 2.0, "4": 2.5, "5": 1.0, "6": 1.5, "7": 1.0, "8": 1.5}
    records = [
        ("OFF" if day < "5" else "DBS", "A" if day < "5" else "B", "M1", day, score + again)
        for day, score in scores.items()
        for again in (0.0, 0.5)
    ]
    found = ratings_of("ratings.csv", score_rows(records), ["examiner"])
    result = concluded(Study(corrected(found), *NAMES, ratings=found))[RATING]
    assert result.p_adjusted < 0.05
    assert result.verdict == WITHHELD
    assert "examiners A, B rated one of the conditions alone" in result.reason
