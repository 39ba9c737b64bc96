"""What is written of a table agrees with p and the intervals beside it."""

from dataclasses import replace

import numpy as np
import pandas as pd
from tests.study_anew.old_cohorts import Design, made_study

from rigidimeter.analysis.study import Primary, StudyResult, compare, conclude, lead, statements
from rigidimeter.analysis.study.differences import signed
from rigidimeter.core.study_files import PrimaryTable


def table(reference: list[float], other: list[float]) -> pd.DataFrame:
    """Return values of days 1, 2, … in both conditions, two of each day."""
    rows = [
        {"subject": "S1", "day": day, "condition": condition, "k": value + end}
        for condition, own in (("OFF", reference), ("DBS", other))
        for day, value in enumerate(own, start=1)
        for end in (-1e-3, 1e-3)
    ]
    return pd.DataFrame(rows)


def concluded(result: StudyResult) -> str:
    found = statements(result)
    assert found is not None
    return " ".join(found.concluded)


def test_an_interval_that_excludes_zero_is_not_excluded_after_the_adjustment() -> None:
    fallen = [0.93, 0.97, 0.91, 0.99, 0.95]
    three = table([1.0] * 5, fallen).assign(a=lambda t: 1 + 0.01 * np.sin(7 * t.index))
    found = compare(three, value=["k", "a"], resamples=100)
    assert "k is lower" in concluded(found)
    many = three.assign(**{name: three["a"] + 0.003 * k for k, name in enumerate("bcdefg")})
    weak = many.assign(k=many["k"] - 0.11 * (many["k"] - 1.0) ** 2 + 0.02 * (many["day"] == 2))
    weak.loc[(weak["day"] == 4) & (weak["condition"] == "DBS"), "k"] += 0.01
    found = compare(weak, value=["k", *"abcdefg"], resamples=100)
    (k, *_) = conclude(found).each  # type: ignore[union-attr]
    assert k.difference.p < 0.05 < k.p
    assert k.difference.high < 0
    text = concluded(found)
    assert "higher at all" not in text
    assert f"k has p = {k.difference.p:.2g} alone, p = {k.p:.2g} adjusted" in text


def test_values_of_both_signs_have_no_per_cent() -> None:
    around_zero = table([-0.2, 0.1, 0.15, -0.05, 0.01], [0.1, -0.1, 0.2, -0.3, 0.05])
    found = compare(around_zero, value="k", resamples=100)
    (k,) = conclude(found).each  # type: ignore[union-attr]
    assert k.verdict == "cannot be decided"
    text = f"{lead(found)} {concluded(found)}"
    assert "cannot be decided: 20 % of values of which some are negative has no meaning" in text
    assert "DBS − OFF: k −0.0" in text


def test_three_values_against_three_have_no_interval_of_95_percent() -> None:
    few = pd.DataFrame({"condition": ["OFF"] * 3 + ["DBS"] * 3, "k": [1.0, 2, 3, 4, 5, 6]})
    found = compare(few, value="k", resamples=100)
    assert "excluded" not in concluded(found)
    assert np.isnan(conclude(found).each[0].difference.low)  # type: ignore[union-attr]


def test_the_name_of_a_column_begins_a_sentence_as_it_is() -> None:
    apart = pd.DataFrame(
        {"condition": ["OFF"] * 10 + ["DBS"] * 10, "k": [*np.arange(10.0), *np.arange(20.0, 30)]}
    )
    found = compare(apart, value="k", resamples=100)
    assert concluded(found) == "k is higher in DBS than in OFF."
    assert lead(found).startswith("k was higher")


def test_the_end_of_an_interval_is_not_rounded_to_zero() -> None:
    assert signed((-15.6, -31.06, -0.13), (-0.2, -0.3, -0.1)).ends == "−31.1 to −0.1 %"
    assert signed((-8.0, -16.0, 0.0), (-0.2, -0.3, -0.1)).ends == "−16 to 0 %"


def test_a_sequence_is_named_in_the_order_in_which_it_was_declared() -> None:
    declared = PrimaryTable(measures=["damping_nm_s_rad", "stiffness_nm_rad"], rule="sequence")
    study = made_study(Design(days=(5, 4), epochs=(5, 5), scores=(4, 4)))
    found = replace(study, primary=Primary(declared, "study.toml"))
    assert "adjusted in the declared sequence of B and K" in statements(found).tested  # type: ignore[union-attr]


def test_a_caution_of_the_inertia_has_the_number_of_its_row() -> None:
    study = made_study(Design(days=(5, 4)))
    (inertia,) = [
        one
        for one in conclude(study).each  # type: ignore[union-attr]
        if one.comparison.measure.name == "inertia_kg_m2"
    ]
    assert f"inertia differs by {inertia.difference.percent[0]:.2g} %" in concluded(study)


def test_each_condition_is_stated_beside_the_reference() -> None:
    levels = {"OFF": 1.75, "1 mA": 1.75, "2 mA": 1.4, "3 mA": 1.2}
    rng = np.random.default_rng(4)
    rows = [
        {"day": day, "condition": name, "k": value + 0.1 * rng.standard_normal()}
        for day in range(8)
        for name, value in levels.items()
    ]
    found = compare(pd.DataFrame(rows), value="k", resamples=100)
    said = found.statements
    assert said is not None
    for name in ("1 mA", "2 mA", "3 mA"):
        assert f"{name} − OFF: k " in said.measured
        assert sum(sentence.startswith(f"{name} − OFF: ") for sentence in said.concluded) == 1
    assert said.tested.count("Paired t-test of 8 days") == 1
    assert "3 mA − OFF: k is lower in 3 mA than in OFF." in said.concluded
    assert repr(found) == "OFF, 1 mA, 2 mA and 3 mA; medians: k 1.685, 1.741, 1.383 and 1.218"
    pair = compare(pd.DataFrame(rows), "2 mA", reference="OFF", value="k", resamples=100)
    assert repr(pair).startswith("OFF and 2 mA; medians: ")
    assert pair.statements is not None
    assert pair.statements.concluded == ("k is lower in 2 mA than in OFF.",)
