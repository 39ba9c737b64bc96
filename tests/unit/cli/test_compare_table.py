"""`rigidimeter compare TABLE --value`: any table in two groups."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import ttest_rel

from rigidimeter.analysis.statistics import holm, ranksum


def table(path: Path, m: int = 20, n: int = 12) -> tuple[Path, dict[str, np.ndarray]]:
    g = np.random.default_rng(1)
    shared = g.standard_normal(m + n)
    shift = np.repeat([1.2, 0.0], [m, n])
    columns = {
        "a": shift + shared,
        "b": 0.3 * shift + shared + 0.2 * g.standard_normal(m + n),
        "c": -shift + g.standard_normal(m + n),
    }
    lines = ["condition,day,a,b,c"]
    for k in range(m + n):
        name = "OFF" if k < m else "DBS"
        cells = [repr(float(columns[key][k])) for key in "abc"]
        lines.append(",".join([name, f"{name}{k % 5}", *cells]))
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path, columns


@pytest.fixture
def compared(rigidimeter, tmp_path):
    def run(path: Path, *options: str):
        out = tmp_path / "out.json"
        ran = rigidimeter("compare", path, "--json", out, *options)
        return ran, json.loads(out.read_text("utf-8")) if out.exists() else None

    return run


def test_several_columns_are_adjusted_and_compared(compared, tmp_path) -> None:
    path, _ = table(tmp_path / "t.csv")
    ran, found = compared(path, "--value", "a", "--value", "b", "--value", "c")
    assert [row["measure"] for row in found["comparisons"]] == ["a", "b", "c"]
    assert all(row["p_holm"] >= row["p"] for row in found["comparisons"])
    one, two, _ = found["effect_differences"]
    assert (one["first"], one["second"], one["paired"]) == ("a", "b", True)
    assert one["low"] > 0  # a separates the groups better than b, from the same rows
    assert two["low"] < 0 < two["high"]  # c as well as a, the other way round
    assert "p, Holm" in ran.out
    again = compared(path, "--value", "a", "--value", "b", "--value", "c")[1]
    assert again == found


def test_measures_of_different_rows_are_independent_or_paired_by_session(
    compared, tmp_path
) -> None:
    path = tmp_path / "t.csv"
    g = np.random.default_rng(2)
    lines = ["condition,session,stiffness,work"]
    for k in range(80):
        name, level = ("OFF", 1.0) if k % 8 < 5 else ("DBS", 0.0)
        value = f"{level + g.standard_normal():.6f}"
        cells = f"{value}," if k % 2 else f",{value}"
        lines.append(f"{name},s{k // 8},{cells}")
    path.write_text("\n".join(lines) + "\n")
    options = ("--value", "stiffness", "--value", "work")
    _, apart = compared(path, *options)
    assert not apart["effect_differences"][0]["paired"]
    ran, together = compared(path, *options, "--session", "session")
    assert together["effect_differences"][0]["paired"], ran.out


def test_excluded_epochs_and_empty_cells_are_left_out_and_said(compared, tmp_path) -> None:
    path, _ = table(tmp_path / "t.csv")
    lines = path.read_text().splitlines()
    cells = lines[1].split(",")
    lines[1] = ",".join([*cells[:2], "", *cells[3:]])
    lines = [lines[0] + ",outcome", *(line + ",included" for line in lines[1:])]
    lines[2] = lines[2].replace("included", "excluded")
    path.write_text("\n".join(lines))
    _, found = compared(path, "--value", "a")
    assert found["comparisons"][0]["groups"]["OFF"]["n"] == 18
    assert any("no a in line 2; left out" in notice["text"] for notice in found["notices"])
    assert any("excluded or failed in line 3" in notice["text"] for notice in found["notices"])


def repeated(path: Path, head: str, label) -> np.ndarray:
    """Four scores a day and condition, alike in a day; return the means of days, shape (5, 2)."""
    g = np.random.default_rng(1)
    scores = g.normal([[2.5], [2.0]], 0.6, (5, 2, 1)) + 0.1 * g.standard_normal((5, 2, 4))
    lines = [f"condition,{head},score"]
    for (day, side, _), score in np.ndenumerate(scores):
        lines.append(f"{('OFF', 'DBS')[side]},{label(day)},{float(score)!r}")
    path.write_text("\n".join(lines) + "\n")
    return scores.mean(axis=2)


@pytest.mark.parametrize(
    ("head", "label", "units"),
    [
        ("day", lambda k: k, "days"),
        ("subject,day", lambda k: f"M1,{k}", "days"),
        ("subject", lambda k: f"M{k}", "subjects"),
    ],
)
def test_scores_of_a_day_or_a_subject_are_no_independent_values(
    compared, tmp_path, head, label, units
) -> None:
    means = repeated(tmp_path / "t.csv", head, label)
    ran, found = compared(tmp_path / "t.csv", "--value", "score")
    (row,) = found["comparisons"]
    assert row["days"]["p"] == pytest.approx(ttest_rel(*means.T).pvalue, rel=1e-9)
    assert row["p"] < 0.05 < row["days"]["p"]  # forty values as if they were independent
    assert f"Paired t-test of 5 {units}." in ran.out
    assert "hether OFF and DBS differ in score cannot be decided" in " ".join(ran.out.split())


@pytest.mark.parametrize(
    ("head", "label", "options", "units"),
    [
        ("day", lambda k: k, (), "days"),
        ("day", lambda k: k, ("--session", "day"), "days"),
        ("visit", lambda k: k, ("--session", "visit"), "days"),
        ("subject", lambda k: f"M{k}", (), "subjects"),
        ("subject,day", lambda k: f"M1,{k}", (), "days"),
        ("subject,day", lambda k: f"M{k},1", (), "subjects"),
    ],
)
def test_one_row_of_a_day_and_condition_is_paired(
    compared, tmp_path, head, label, options, units
) -> None:
    path = tmp_path / "t.csv"
    g = np.random.default_rng(3)
    off = g.normal(1.7, 0.4, 8)
    on = off - g.normal(0.2, 0.05, 8)
    rows = [f"OFF,{label(k)},{off[k]:.17g}\nDBS,{label(k)},{on[k]:.17g}" for k in range(8)]
    path.write_text("\n".join([f"condition,{head},k", *rows]) + "\n")
    ran, found = compared(path, "--value", "k", *options)
    (row,) = found["comparisons"]
    assert row["days"]["p"] == pytest.approx(ttest_rel(off, on).pvalue, rel=1e-9)
    assert row["days"]["p"] < 0.001 < 0.05 < row["p"]  # as if the values were independent
    assert f"Paired t-test of 8 {units}." in ran.out
    assert "k is lower in DBS than in OFF" in " ".join(ran.out.split())


def test_days_without_a_pair_stay_values(compared, tmp_path) -> None:
    path = tmp_path / "t.csv"
    rows = [f"{'OFF' if k < 8 else 'DBS'},{k},{k}.5" for k in range(16)]
    path.write_text("\n".join(["condition,day,k", *rows]) + "\n")
    ran, found = compared(path, "--value", "k")
    assert found["comparisons"][0]["days"] is None
    assert "Rank-sum test" in ran.out


def test_scores_of_one_day_decide_nothing(compared, tmp_path) -> None:
    repeated(tmp_path / "t.csv", "day", lambda k: 1)
    ran, _ = compared(tmp_path / "t.csv", "--value", "score")
    assert "Nothing could be tested." in ran.out


def test_two_values_give_medians_and_no_test(compared, tmp_path) -> None:
    path, _ = table(tmp_path / "t.csv", 5, 2)
    ran, found = compared(path, "--value", "a")
    assert ran.status == 0
    (row,) = found["comparisons"]
    assert row["p"] is None
    assert row["r"] is None
    assert row["groups"]["DBS"]["n"] == 2
    assert "a test needs 3 values in each condition; there are 5 in OFF and 2 in DBS" in " ".join(
        ran.out.split()
    )


def test_three_against_three_cannot_show_a_difference(compared, tmp_path) -> None:
    path, _ = table(tmp_path / "t.csv", 3, 3)
    _, found = compared(path, "--value", "a")
    assert found["reasons"][0]["name"] == "wide_interval"
    assert "0.1 by the exact test" in found["reasons"][0]["details"]


def test_each_further_group_is_compared_with_the_first_or_two_are_named(compared, tmp_path) -> None:
    path, columns = table(tmp_path / "t.csv")
    ran, found = compared(path, "--value", "a", "--by", "day")
    assert ran.status == 0
    tested = [c for c in found["comparisons"] if c["p"] is not None]
    assert {c["reference"] for c in tested} == {"OFF0"}
    assert [c["other"] for c in tested] == ["OFF1", "OFF2", "OFF3", "OFF4", "DBS0", "DBS1"]
    a, of = columns["a"], [f"{'OFF' if k < 20 else 'DBS'}{k % 5}" for k in range(32)]
    first = [a[k] for k in range(32) if of[k] == "OFF0"]
    for c in tested:
        expected = ranksum(first, [a[k] for k in range(32) if of[k] == c["other"]])
        assert c["p"] == pytest.approx(expected.p)
    assert [c["p_holm"] for c in tested] == pytest.approx(holm([c["p"] for c in tested]))
    ran, found = compared(
        path, "--value", "a", "--by", "day", "--reference", "OFF1", "--other", "OFF0"
    )
    assert (found["reference"], found["other"]) == ("OFF1", "OFF0")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--value", "x"), "there is no column x; its columns are condition, day, a, b, c"),
        (("--value", "a", "--by", "x"), "there is no column x"),
        (("--value", "day"), "line 2: day is 'OFF0', which is not a number"),
        (
            ("--value", "a", "--reference", "ON"),
            "there is no such condition; column condition of",
        ),
        (("--value", "a", "--reference", "OFF", "--other", "OFF"), "are both OFF"),
        (("--value", "a", "--session", "x"), "Name the right one with --session"),
    ],
)
def test_what_is_wrong_is_one_sentence(compared, tmp_path, options, sentence: str) -> None:
    path, _ = table(tmp_path / "t.csv")
    ran, found = compared(path, *options)
    assert ran.status == 1
    assert sentence in ran.err
    assert ran.err.count("\n") == 1
    assert found is None


def test_the_csv_has_a_row_for_each_column(rigidimeter, tmp_path) -> None:
    path, _ = table(tmp_path / "t.csv")
    out = tmp_path / "out.csv"
    assert rigidimeter("compare", path, "--value", "a", "--value", "b", "--csv", out).status == 0
    rows = list(csv.DictReader(out.read_text("utf-8").splitlines()))
    assert [row["measure"] for row in rows] == ["a", "b"]
    assert {row["n_reference"] for row in rows} == {"20"}


def test_one_group_and_two_tables_are_refused(rigidimeter, tmp_path) -> None:
    path, _ = table(tmp_path / "t.csv")
    ran = rigidimeter("compare", path, path, "--value", "a")
    assert "--value takes one table, but 2 inputs" in ran.err
    path.write_text("condition,a\nOFF,1\nOFF,2\n")
    assert "needs two conditions" in rigidimeter("compare", path, "--value", "a").err
    path.write_text("condition,a\nOFF,1\nDBS,\n")
    assert "a has no value in DBS" in rigidimeter("compare", path, "--value", "a").err


def test_a_value_whose_square_is_no_number_is_refused_with_its_line(rigidimeter, tmp_path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("condition,day,a\nOFF,1,1\nOFF,1,2e200\nOFF,2,3\nDBS,1,1\nDBS,2,2\n")
    ran = rigidimeter("compare", path, "--value", "a")
    assert ran.status == 1
    assert "t.csv, line 3: a is 2e+200; values up to 1e+100 can be compared" in ran.err


def two_rows_of_each(path: Path, head: str, label) -> None:
    """Eight subjects with two rows in each condition; `label` gives subject and day."""
    g = np.random.default_rng(3)
    rows = [
        f"{name},{label(name, k, twice)},{level + 0.1 * k + 0.01 * g.standard_normal():.6f}"
        for k in range(8)
        for name, level in (("OFF", 1.7), ("DBS", 1.5))
        for twice in range(2)
    ]
    path.write_text("\n".join([f"condition,{head},k", *rows]) + "\n")


@pytest.mark.parametrize(
    ("head", "label"),
    [
        ("subject,day", lambda name, k, twice: f"M{k},"),
        ("subject,day", lambda name, k, twice: f"M{k},NA"),
        ("Subject", lambda name, k, twice: f"M{k}"),
        ("Subject,Day", lambda name, k, twice: f"M{k},1"),
    ],
)
def test_a_subject_in_several_rows_is_one(compared, tmp_path, head, label) -> None:
    """A blank column of days is none, and a column is what its name says in capitals too."""
    two_rows_of_each(tmp_path / "t.csv", head, label)
    ran, found = compared(tmp_path / "t.csv", "--value", "k")
    assert "Paired t-test of 8 subjects." in ran.out
    assert found["comparisons"][0]["days"]["p"] < 0.001


@pytest.mark.parametrize(
    ("label", "sentence"),
    [
        (
            lambda name, k, twice: f"M{k},{'' if name == 'OFF' else k}",
            "lines 2, 3, 6, 7, 10 and 11 more: day is blank",
        ),
        (
            lambda name, k, twice: f"{'' if k == 3 else f'M{k}'},1",
            "lines 14, 15, 16, 17: subject is blank",
        ),
        (lambda name, k, twice: f"{'0' * twice}{k},1", "subject 0 is written in another way"),
        (lambda name, k, twice: f"{'mM'[twice]}{k},1", "subject m0 is written in another way"),
    ],
)
def test_whose_a_row_is_must_be_clear(compared, tmp_path, label, sentence) -> None:
    two_rows_of_each(tmp_path / "t.csv", "subject,day", label)
    ran, _ = compared(tmp_path / "t.csv", "--value", "k")
    assert ran.status == 1
    assert sentence in ran.err
    assert ran.err.count("\n") == 1
