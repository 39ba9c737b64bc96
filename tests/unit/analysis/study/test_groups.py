"""Groups of subjects are not pooled without a word, and other columns that split are named."""

import pandas as pd
import pytest

import rigidimeter as rm
from rigidimeter.analysis.study import StudyResult, conclude, lead, statements
from rigidimeter.core.errors import UserError

SUBJECTS = 6


def table(patients: float, controls: float, **more: str) -> pd.DataFrame:
    """Return a value of each epoch, two a day and two days a subject; effects as shares of OFF."""
    rows = []
    for group, effect in (("patients", patients), ("controls", controls)):
        for k in range(SUBJECTS):
            for day in range(2):
                for condition in ("OFF", "ON"):
                    for epoch in range(2):
                        own = 1.7 * (1 + 0.02 * ((3 * k + 5 * day) % 7 - 3))
                        change = 1 + (effect + 0.01 * (k % 3 - 1)) * (condition == "ON")
                        value = own * change * (1 + 0.004 * (epoch - 0.5))
                        rows.append((f"{group}{k}", f"{day}", condition, group, value))
    found = pd.DataFrame(rows, columns=["subject", "day", "condition", "group", "k"])
    return found.assign(**more)


def compared(found: pd.DataFrame, **options: object) -> StudyResult:
    return rm.compare(found, value="k", resamples=0, **options)


def reason(result: StudyResult) -> tuple[str, str]:
    (one,) = conclude(result).each
    return one.verdict, one.reason


def test_a_difference_of_one_group_alone_is_claimed_of_no_group() -> None:
    """18 % in patients, none in controls: 9 % of a mixture that nobody asked about."""
    found = compared(table(-0.18, 0.0))
    verdict, why = reason(found)
    assert verdict == "not supported"
    assert "patients −18.0 % (p < 10⁻⁶)" in why
    assert "controls 0.0 % (p = 0.97)" in why
    for claim in ("is lower", "was lower", "are lower"):
        assert claim not in " ".join([lead(found), *statements(found).concluded])
    assert "of patients and controls together, ON − OFF: k −9.0 %" in statements(found).measured


def test_opposite_differences_are_not_none() -> None:
    verdict, why = reason(compared(table(-0.18, 0.18)))
    assert verdict == "cannot be decided"
    assert "patients −18.0 % (p < 10⁻⁶)" in why
    assert "controls +18.0 % (p < 10⁻⁶)" in why


def test_a_difference_of_each_group_is_claimed_of_each() -> None:
    found = compared(table(-0.18, -0.12))
    assert conclude(found).each[0].verdict == "lower"
    for said in (lead(found), statements(found).concluded[0]):
        assert "lower in ON than in OFF in each of the groups patients and controls" in said


def test_one_group_is_compared_by_itself() -> None:
    found = compared(table(-0.18, 0.0), group="patients")
    assert lead(found).startswith("In these 6 subjects, k was lower in ON than in OFF: −18.0 % (")
    assert reason(compared(table(-0.18, 0.0), group="controls"))[0] == "no difference shown"
    with pytest.raises(UserError, match="there is no group elderly; there are: patients, controls"):
        compared(table(-0.18, 0.0), group="elderly")
    with pytest.raises(UserError, match="no column group"):
        compared(table(-0.18, 0.0).drop(columns="group"), group="patients")


def test_groups_of_one_condition_each_cannot_be_told_from_it() -> None:
    whole = table(-0.18, -0.18)
    apart = whole[(whole["group"] == "patients") == (whole["condition"] == "ON")]
    assert reason(compared(apart))[0] == "not supported"
    # The conditions under another heading are no groups.
    assert reason(compared(apart.assign(group=apart["condition"])))[0] == "lower"


def test_other_columns_that_split_the_rows_are_named() -> None:
    rows = len(table(0, 0))
    sides = ["left", "right"] * (rows // 2)
    found = compared(table(-0.18, -0.18).assign(side=sides, visit=[1, 1, 2, 2] * (rows // 4)))
    (said,) = (notice.text for notice in found.notices if "side" in notice.text)
    assert "columns side and visit split the rows and are not used" in said
    quiet = compared(table(-0.18, -0.18).assign(note="", mass_kg=range(rows)))
    assert not [notice for notice in quiet.notices if "split" in notice.text]


def test_the_command_line_takes_a_group(tmp_path, rigidimeter) -> None:
    path = tmp_path / "k.csv"
    table(-0.18, 0.0).to_csv(path, index=False)
    ran = rigidimeter("compare", path, "--value", "k", "--resamples", "100")
    said = " ".join(ran.out.split())
    assert "a difference in k is not supported: each group alone: patients −18.0 %" in said
    ran = rigidimeter("compare", path, "--value", "k", "--resamples", "100", "--group", "patients")
    assert ran.out.startswith("OFF and ON · group patients\n")
    assert "k is lower in ON than in OFF" in " ".join(ran.out.split())
    ran = rigidimeter("report", path, "--group", "patients", "--out", tmp_path / "report")
    assert ran.status
    assert "--group patients: recordings name no group; give a study folder" in ran.err
