"""`compare` takes a study folder, estimates or a table, and refuses everything else."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from rigidimeter.analysis.study import (
    StudyResult,
    analyse,
    compare,
    comparison_document,
    conclude_study,
    conclusion_rows,
    conditions,
    load_study,
    result_table,
    shown_cells,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Analysis, Fit, Outcome, Score

K = "stiffness_nm_rad"


def analysis(*fits: Fit, scores: tuple[Score, ...] = ()) -> Analysis:
    return Analysis("bandlimited", fits, fits, 0.004, scores)


def fit(condition: str, stiffness: float = 1.0, outcome: Outcome | None = None) -> Fit:
    value = np.array([0.004, 0.1, stiffness])
    return Fit("s", "1", condition, "bandlimited", outcome or Outcome(), value=value)


def document(result: StudyResult, place: Path) -> dict:
    return comparison_document(result, str(place))


def test_a_folder_is_compared_as_its_parts_are_and_keeps_nothing(study: Path) -> None:
    found = compare(study, resamples=100)
    parts = conclude_study(analyse(load_study(study)), resamples=100)
    assert document(found, study) == document(parts, study)
    assert not (study / "analysis").exists()
    turned = compare(study, "OFF", reference="DBS", resamples=0)
    assert (
        turned.value_test("work_j").statistic.shift == -found.value_test("work_j").statistic.shift
    )
    assert turned.effects == {}


def test_a_result_in_a_notebook(study: Path) -> None:
    found = compare(study, resamples=0)
    table, rows = found.table(), conclusion_rows(found.comparisons)
    for name in ("verdict", "difference"):
        assert list(table[name]) == [row[name] for row in rows]
    assert len(table.columns) == 12
    full = found.table(full=True)
    assert list(full["days_p_holm"].dropna()) == [
        row["days_p_holm"] for row in result_table(found, "comparisons") if row["days_p_holm"]
    ]
    assert len(full.columns) > 50
    for piece in ("Small study", "DBS − OFF", shown_cells(found.comparisons[0])["verdict"]):
        assert piece in found._repr_html_()
    work = found.summaries("work_j")
    assert repr(found).startswith("Small study; OFF and DBS; medians: ")
    assert f"Work {work['OFF'].median:.4g} and {work['DBS'].median:.4g} J" in repr(found)
    assert "\n" not in repr(found)


def test_a_table_and_its_file_give_the_same(study: Path) -> None:
    path = study / "ratings.csv"
    one, two = (compare(x, value="score", resamples=100) for x in (path, pd.read_csv(path)))
    assert one.values == two.values
    assert str(conclusion_rows(one.comparisons)) == str(conclusion_rows(two.comparisons))


TABLE = pd.DataFrame({"a": [1.0, 2.0], "condition": ["X", "Y"]})


@pytest.mark.parametrize(
    ("x", "options", "message"),
    [
        *((x, {"value": "a"}, "takes a study folder, est") for x in (None, ["a"], {"a": [1]})),
        (analysis(), {"value": "a"}, "compare takes a study folder, estimates"),
        (Path(), {}, "neither a study folder nor a JSON file of estimates"),
        (Path("elbow.csv"), {}, "neither a study folder nor a JSON file of estimates"),
        *((TABLE, {"value": value}, "a table needs value=") for value in (None, [], 0)),
        (pd.concat([TABLE, TABLE], axis=1), {"value": "a"}, "two columns with the name a"),
        (TABLE, {"value": "b"}, "there is no column b"),
        (TABLE, {"value": "a", "group": "p"}, "no column group"),
        (TABLE, {"value": "a", "reference": "Z"}, "--reference Z: there is no such condition"),
        (TABLE.assign(condition="X"), {"value": "a"}, "a comparison needs two conditions"),
        (TABLE.assign(a="x"), {"value": "a"}, "a is 'x'"),
        (TABLE.assign(a=1e101), {"value": "a"}, "values up to 1e\\+100 can be compared"),
        (analysis(fit("X"), fit("Y")), {"group": "p"}, "estimates name no group"),
    ],
)  # fmt: skip
def test_what_cannot_be_compared_is_refused(x, options: dict, message: str) -> None:
    with pytest.raises(UserError, match=message):
        compare(x, **options)


def test_estimates_without_a_folder() -> None:
    """OFF is the reference wherever it comes; what is excluded is counted and left out."""
    fits = [fit("DBS", k) for k in (1.0, 1.1, 1.2)] + [fit("OFF", k) for k in (2.0, 2.1, 2.2)]
    out = fit("OFF", 99.0, Outcome("excluded", "limit"))
    assert conditions(analysis(*fits, fit(""))) == ("OFF", "DBS")
    found = compare(analysis(*fits, out), resamples=0)
    assert {name: one.median for name, one in found.summaries(K).items()} == {
        "OFF": 2.1,
        "DBS": 1.1,
    }
    row = next(one for one in result_table(found, "comparisons") if one["measure"] == K)
    assert (row["n_reference"], row["excluded_reference"], row["excluded_other"]) == (3, 1, 0)
    assert found.value_test(K).statistic.shift == pytest.approx(1.0)
    assert found.value_test(K).statistic.z > 0
    few = compare(analysis(fit("OFF"), fit("DBS")), resamples=0)
    assert "needs 3 epochs" in few.value_test(K).remark
    assert few.summaries(K)["OFF"].n == 1
