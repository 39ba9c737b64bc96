"""What was measured, tested and concluded says what the numbers say, and no more."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from tests.unit.analysis.study_anew.made import (
    JOINT,
    Design,
    alike,
    doubted,
    in_dbs,
    made,
)

from rigidimeter.analysis.study_anew import (
    Columns,
    Compared,
    LeftOut,
    Primary,
    Study,
    conclude,
    day_tests,
    estimate_rows,
    lead,
    statement,
    table_study,
)
from rigidimeter.core.records import Analysis, Fit, Outcome
from rigidimeter.core.study_files import PrimaryTable

ALONE = "In brackets: 95 % interval from measurement error only, without day-to-day variation."
OTHER_DAYS = "other days of this subject, not for other subjects"
FAMILIES = (
    "p Holm-adjusted over K and B, and apart over impulse, work and rating; each 95 % "
    "interval is unadjusted"
)


class Said:
    """Everything that is said of a study; each test may be changed before it is concluded."""

    def __init__(self, study: Study, change=lambda one: one) -> None:
        self.each = conclude(study, [*filter(None, map(change, day_tests(study)))])
        self.lead = lead(study, self.each)
        found = statement(study, self.each)
        assert found is not None
        self.measured, self.tested, self.concluded = found


@pytest.fixture(scope="module")
def study() -> Study:
    return made()


@pytest.fixture(scope="module")
def said(study: Study) -> Said:
    return Said(study)


def recorded_once(stiffness: float, percent: float = 0.2) -> Study:
    """Return one recording of each condition, six epochs long, and no day.

    K of DBS is given; `percent` is half the interval of each epoch.
    """

    def change(fit: Fit) -> Fit | None:
        if fit.source not in ("sessions/M1-day-01", "sessions/M1-day-02"):
            return None
        k = int(fit.epoch[1:]) - 1
        value = np.array([*JOINT[:2], stiffness if in_dbs(fit) else 1.751]) * (1 + 1e-4 * (k - 2.5))
        half = percent / 100 * value
        ends = {"se": half / 2, "low": value - half, "high": value + half}
        return replace(fit, outcome=Outcome(), value=value, **ends)

    return made(Design(epochs=6, scores=0), fit=change, score=lambda _: None, days_known=False)


class TestMeasured:
    """It is there whatever the design, and speaks of the recordings alone."""

    def test_one_recording_of_each_has_a_difference_and_no_conclusion(self) -> None:
        """1.751 to 1.300 N·m/rad: −0.451/1.751 = −25.76 %.

        Half the interval: 0.2 % of each of 6 epochs, √(1.751² + 1.3²)/1.751 · 0.2 %/√6 = 0.102 %.
        """
        found = Said(recorded_once(1.3))
        assert found.measured == (
            "Between these recordings, DBS − OFF: K −25.8 % (−25.9 to −25.7), B 0.0 % (−0.1 to "
            f"+0.1) and J 0.0 % (−0.1 to +0.1). {ALONE}"
        )
        half = 0.002 / math.sqrt(6) * math.hypot(1.751, 1.3)
        assert found.each[0].measured_half == pytest.approx(half, rel=1e-6)
        assert found.tested == "Nothing could be tested."
        assert found.concluded == (
            "Whether OFF and DBS differ in K and B cannot be decided: there is one recording in "
            "each condition, so recording and condition cannot be separated; with 6 days in both "
            "conditions a difference of 20 % in K would be shown with a chance of 80 %.",
        )
        assert found.lead == f"{found.measured} {found.concluded[0]}"

    @pytest.mark.parametrize(
        ("stiffness", "percent", "words"),
        [
            # Of epochs known to 0.01 % half the interval is 0.1 % of the mean: (1 + 1.2576)/2.
            (1.751 * 1.2576, 0.01, "K +25.8 % (+25.6 to +25.9)"),
            (1.3, 3.0, "K −26 % (−27 to −24)"),
        ],
    )
    def test_it_has_a_sign_and_the_digits_of_its_interval(self, stiffness, percent, words) -> None:
        assert words in Said(recorded_once(stiffness, percent)).measured

    def test_measures_without_an_interval_are_in_the_table_or_stand_alone(self, study, said):
        assert said.measured == (
            "Between these recordings, DBS − OFF: K −18 % (−19 to −16), B −16 % (−17 to −15) and "
            f"J −2 % (−3 to −1). {ALONE}"
        )
        alone = Said(study, lambda one: None if one.measure.origin == "fits" else one)
        assert alone.measured == (
            "Between these recordings, DBS − OFF: impulse −19 %, work −19 % and rating −0.45 "
            "points."
        )

    def test_values_in_one_condition_alone_are_no_difference(self) -> None:
        kept = {name: lambda one: None if in_dbs(one) else one for name in ("fit", "score")}
        found = Said(made(rated=False, **kept))
        assert found.measured == "No measure has values in both conditions."


def untested(name: str, remark: str):
    """Return the change that takes the test of a measure away."""
    missing = dict.fromkeys(("p", "low", "high", "se", "df"), math.nan)
    change = {**missing, "remark": remark, "test": "", "statistic": None}
    return lambda one: replace(one, **change) if one.measure.name == name else one


def turned(*names: str):
    """Return the change that gives differences the other sign."""

    def change(one: Compared) -> Compared:
        if one.measure.name not in names:
            return one
        sizes = {"difference": -one.difference, "low": -one.high, "high": -one.low}
        return replace(one, sign=-one.sign, **sizes)

    return change


class TestTested:
    def test_tests_are_named_with_their_measures_and_how_p_is_adjusted(self, said) -> None:
        assert said.tested == (
            "Welch's t-test of 5 days of OFF and 4 days of DBS (K, B, J, impulse, work); mixed "
            f"model of examiners and days (rating); {FAMILIES}."
        )

    def test_p_is_adjusted_for_what_was_tested_alone(self, study) -> None:
        lacking = Said(study, untested("work_j", "one day in each condition"))
        assert "(K, B, J, impulse)" in lacking.tested
        apart = "; p Holm-adjusted over K and B, and apart over impulse and rating; "
        assert apart in lacking.tested
        assert (
            "Whether OFF and DBS differ in work cannot be decided: one day in each condition."
        ) in lacking.concluded
        assert "work" not in lacking.lead

    def test_one_test_of_one_measure_is_not_adjusted(self, study) -> None:
        alone = Said(study, lambda one: one if one.measure.short == "J" else None)
        assert alone.tested == "Welch's t-test of 5 days of OFF and 4 days of DBS."


def test_a_clear_effect_is_shown_and_none_is_not(said: Said) -> None:
    assert said.lead == (
        "In this subject, stiffness K was lower in DBS than in OFF: −18 % (95 % interval −29 to "
        "−7 %, Welch's t-test of 5 days of OFF and 4 days of DBS, p = 0.0077) and viscous damping "
        "B −16 % (95 % interval −24 to −8 %, p = 0.0077); p Holm-adjusted over K and B; each "
        f"95 % interval is unadjusted. The intervals hold for {OTHER_DAYS}."
    )
    assert said.concluded == (
        f"In this subject, K and B are lower in DBS than in OFF. This holds for {OTHER_DAYS}.",
        "Secondary: in this subject, impulse, work and rating are lower in DBS than in OFF.",
    )
    none = Said(made(Design(effect=0.0)))
    absent, *_ = none.concluded
    assert absent.startswith(
        "In this subject, no difference of 20 % between OFF and DBS is shown in K, B, impulse and "
        "work; excluded (95 %): K more than "
    )
    assert none.lead == f"{none.measured} {absent}"


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
    design = Design(subjects=tuple(names), scores=0, day_scatter=0.01)
    found = Said(made(design, rated=False))
    assert found.lead.startswith(f"{where}stiffness K was lower in DBS than in OFF: −")
    assert f" The intervals hold for {reach}" in found.lead
    assert found.concluded[0].startswith(f"{where}K")
    assert f" This holds for {reach}" in found.concluded[0]


def test_the_signs_are_those_of_the_estimates(study: Study) -> None:
    every = Said(study, turned(*(one.measure.name for one in day_tests(study))))
    assert every.lead.startswith(
        "In this subject, stiffness K was higher in DBS than in OFF: +18 % (95 % interval +7 to "
        "+29 %, "
    )
    assert "K and B are higher in DBS than in OFF." in every.concluded[0]
    assert "K +18 % (+16 to +19), B +16 %" in every.measured
    assert "lower" not in " ".join([every.lead, *every.concluded])
    one = Said(study, turned("damping_nm_s_rad"))
    assert " and viscous damping B was higher: +16 %" in one.lead
    assert one.concluded[:2] == (
        "In this subject, K is lower in DBS than in OFF.",
        f"In this subject, B is higher in DBS than in OFF. This holds for {OTHER_DAYS}.",
    )


def test_a_p_that_only_one_measure_alone_would_bear_is_not_claimed(study: Study) -> None:
    found = Said(study, lambda o: replace(o, p=0.03 if o.measure.name == "work_j" else 0.6))
    (work,) = [one for one in found.each if one.measure.name == "work_j"]
    assert work.p_adjusted == pytest.approx(0.09)
    assert not [one for one in found.each if one.verdict in ("lower", "higher")]
    assert "lower in" not in found.lead


def test_what_stands_before_and_after_the_sentence_to_quote(study: Study, said: Said) -> None:
    coded = replace(study, virtual=True, blinded=True)
    before = "Virtual data. Blinded: the names of the conditions are codes. "
    assert lead(coded, said.each) == before + said.lead
    refused = tuple(LeftOut(f"{k}.csv", "M1", "9", "DBS", "in degrees") for k in (1, 2))
    for n, words in ((1, "1 of 10 sessions is left out."), (2, "2 of 11 sessions are left out.")):
        assert lead(replace(study, left_out=refused[:n]), said.each) == f"{said.lead} {words}"


def test_reasons_that_measures_share_are_said_once() -> None:
    """One recording in each condition: what a difference comes from cannot be known."""
    kept = ("sessions/M1-day-01", "sessions/M1-day-02")

    def first(one):
        return one if one.source in kept else None

    assert Said(made(fit=first, score=first, days_known=False)).concluded == (
        "Whether OFF and DBS differ in K, B, impulse and work cannot be decided: there is one "
        "recording in each condition, so recording and condition cannot be separated; with 7 days "
        "in both conditions a difference of 20 % in K would be shown with a chance of 80 %.",
    )
    one_file = made(
        fit=lambda one: first(one) and replace(one, source="x.csv"),
        score=lambda _: None,
        days_known=False,
    )
    (text,) = Said(one_file).concluded
    assert text.count("there is only one recording") == 1


def test_what_few_days_cannot_decide_is_said_with_what_would() -> None:
    assert Said(made(Design(days=(2, 2), both_on_a_day=True))).concluded == (
        "In this subject, whether OFF and DBS differ in K, B, impulse, work and rating cannot be "
        "decided: the chance to show a difference of 20 % was below one half; excluded (95 %): K "
        "more than 68 % lower or 36 % higher, B more than 73 % lower or 31 % higher; with 7 days "
        "in both conditions a difference of 20 % in K would be shown with a chance of 80 %.",
    )


def test_what_was_withheld_is_not_in_the_sentence_to_quote() -> None:
    """Of the recordings it is said, of the conditions it is not."""
    shaken = Said(made(fit=doubted("tremor")))
    assert "K −18 % (−19 to −16), B −16 % (−17 to −15)" in shaken.measured
    first, *_, last = shaken.concluded
    assert first.startswith("In this subject, a difference in K and B is not supported: tremor in ")
    assert "0 of 23 epochs in OFF, 19 of 19 in DBS" in first
    assert last == (
        "Secondary: in this subject, impulse, work and rating are lower in DBS than in OFF."
    )
    assert shaken.lead == f"{shaken.measured} {first}"


def test_what_is_declared_is_named_in_its_order_and_claimed_alone() -> None:
    table = PrimaryTable(measures=["damping_nm_s_rad", "stiffness_nm_rad"], rule="sequence")
    found = Said(made(primary=Primary(table, "study.toml")))
    assert "adjusted in the declared sequence of B and K" in found.tested
    one = Said(made(primary=Primary(PrimaryTable(measures=["stiffness_nm_rad"]), "study.toml")))
    assert one.concluded[0].startswith("In this subject, K is lower in DBS than in OFF.")
    assert one.concluded[-1].startswith("Secondary: in this subject, B, impulse")


def test_a_caution_of_the_inertia_has_the_number_of_its_row() -> None:
    found = Said(made(fit=alike([1.04, 0.8, 0.8])))
    (inertia,) = [one for one in found.each if one.measure.short == "J"]
    size = inertia.percent(inertia.of_test)[0]
    assert f"inertia differs by {size:.2g} %" in " ".join(found.concluded)


def alone(fits: Sequence[Fit], name: str) -> Study:
    analysis = Analysis("iv", tuple(fits), tuple(fits), 0.0045, ())
    return Study(estimate_rows({"iv": analysis}), name, analysis=analysis)


@pytest.mark.parametrize(("name", "start"), [("DBS", "DBS: stiffness K "), ("", "Stiffness K ")])
def test_one_condition_has_its_values_and_no_statements(study, name: str, start: str) -> None:
    own = [replace(fit, condition=name) for fit in study.analysis.fits if in_dbs(fit)]
    found = alone(own, name)
    assert statement(found, ()) is None
    said = lead(found, ())
    assert said.startswith(start)
    assert "±" in said
    assert said.endswith("(95 % intervals).")


@pytest.mark.parametrize(
    "fits", [[], [Fit("a.csv", "1", "OFF", "iv", Outcome("failed", "no torque"))]]
)
def test_nothing_included_is_said(fits: list[Fit]) -> None:
    assert "No epoch could be included" in lead(alone(fits, "OFF"), ())


def table(reference: list[float], other: list[float]) -> pd.DataFrame:
    """Return values of days 1, 2, … in both conditions, two of each day."""
    rows = [
        {"subject": "S1", "day": day, "condition": condition, "k": value + end}
        for condition, own in (("OFF", reference), ("DBS", other))
        for day, value in enumerate(own, start=1)
        for end in (-1e-3, 1e-3)
    ]
    return pd.DataFrame(rows)


def of_table(rows: pd.DataFrame, *values: str) -> Said:
    return Said(table_study(rows, Columns(values or ("k",))))


class TestTables:
    """What is written of a table agrees with p and the intervals beside it."""

    def test_an_interval_that_excludes_zero_is_not_excluded_after_the_adjustment(self) -> None:
        fallen = [0.93, 0.97, 0.91, 0.99, 0.95]
        three = table([1.0] * 5, fallen).assign(a=lambda t: 1 + 0.01 * np.sin(7 * t.index))
        assert "k is lower" in " ".join(of_table(three, "k", "a").concluded)
        many = three.assign(**{name: three["a"] + 0.003 * k for k, name in enumerate("bcdefg")})
        weak = many.assign(k=many["k"] - 0.11 * (many["k"] - 1.0) ** 2 + 0.02 * (many["day"] == 2))
        weak.loc[(weak["day"] == 4) & (weak["condition"] == "DBS"), "k"] += 0.01
        found = of_table(weak, "k", *"abcdefg")
        k = found.each[0]
        assert k.p < 0.05 < k.p_adjusted
        assert k.high < 0
        text = " ".join(found.concluded)
        assert "higher at all" not in text
        assert f"k has p = {k.p:.2g} alone, p = {k.p_adjusted:.2g} adjusted" in text

    def test_values_of_both_signs_have_no_per_cent(self) -> None:
        found = of_table(table([-0.2, 0.1, 0.15, -0.05, 0.01], [0.1, -0.1, 0.2, -0.3, 0.05]))
        assert found.each[0].verdict == "cannot be decided"
        text = f"{found.lead} {' '.join(found.concluded)}"
        why = "cannot be decided: 20 % of values of which some are negative has no meaning"
        assert why in text
        assert "DBS − OFF: k −0.0" in text

    def test_three_values_against_three_have_no_interval_of_95_percent(self) -> None:
        few = pd.DataFrame({"condition": ["OFF"] * 3 + ["DBS"] * 3, "k": [1.0, 2, 3, 4, 5, 6]})
        found = of_table(few)
        assert "excluded" not in " ".join(found.concluded)
        assert math.isnan(found.each[0].low)

    def test_the_name_of_a_column_begins_a_sentence_as_it_is(self) -> None:
        values = [*np.arange(10.0), *np.arange(20.0, 30)]
        found = of_table(pd.DataFrame({"condition": ["OFF"] * 10 + ["DBS"] * 10, "k": values}))
        assert found.concluded == ("k is higher in DBS than in OFF.",)
        assert found.lead.startswith("k was higher")

    def test_each_condition_is_stated_beside_the_reference(self) -> None:
        levels = {"OFF": 1.75, "1 mA": 1.75, "2 mA": 1.4, "3 mA": 1.2}
        rng = np.random.default_rng(4)
        rows = [
            {"day": day, "condition": name, "k": value + 0.1 * rng.standard_normal()}
            for day in range(8)
            for name, value in levels.items()
        ]
        found = of_table(pd.DataFrame(rows))
        for name in ("1 mA", "2 mA", "3 mA"):
            assert f"{name} − OFF: k " in found.measured
            own = [sentence for sentence in found.concluded if sentence.startswith(f"{name} − OFF")]
            assert len(own) == 1
        assert found.tested.count("Paired t-test of 8 days") == 1
        assert "3 mA − OFF: k is lower in 3 mA than in OFF." in found.concluded
        pair = Said(table_study(pd.DataFrame(rows), Columns(["k"]), ("OFF", "2 mA")))
        assert pair.concluded == ("k is lower in 2 mA than in OFF.",)
