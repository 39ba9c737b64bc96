"""The long table: what is in it, which rows count, and its files."""

import math

import numpy as np
import pandas as pd
import pytest
from tests.unit.analysis.study.made import made

from rigidimeter.analysis.study import (
    FIELDS,
    as_rows,
    blocks,
    counting,
    estimate_rows,
    read_rows,
    together,
    write_rows,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Analysis, Channel, Epoch, Fit, Outcome, Score

CAUTION = Finding("tremor", "caution", 2.0, 1.0)
NOTE = Finding("voluntary_torque", "note", 2.0, 1.0)


def fit(epoch: str, condition: str = "OFF", **changes) -> Fit:
    joint = np.array([0.005, 0.14, 1.75])
    values = {"value": joint, "se": 0.01 * joint, "low": 0.97 * joint, "high": 1.03 * joint}
    return Fit("a", epoch, condition, "iv", changes.pop("outcome", Outcome()), **values, **changes)


def analysis(*fits: Fit, **parts) -> Analysis:
    return Analysis("iv", fits, parts.pop("fixed", ()), 0.005, parts.pop("scores", ()), **parts)


@pytest.fixture(scope="module")
def study_rows() -> pd.DataFrame:
    return made(rated=False).rows


def test_columns_and_their_types(study_rows: pd.DataFrame) -> None:
    assert list(study_rows.columns) == list(FIELDS)
    kinds = {str: "category", float: "float64", bool: "bool"}
    found = {name: str(kind) for name, kind in study_rows.dtypes.items()}
    assert found == {name: kinds[field.kind] for name, field in FIELDS.items()}


def test_a_row_for_each_epoch_and_measure() -> None:
    scores = (Score("a", "s1", "OFF", Outcome(), 1.5, 0.7, 8, 1.0),)
    rows = estimate_rows({"iv": analysis(fit("p1"), scores=scores)})
    assert list(rows["measure"]) == [
        *("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad", "impulse_nm_s", "work_j"),
    ]
    assert list(rows["value"]) == [0.005, 0.14, 1.75, 1.5, 0.7]
    assert list(rows["se"][:3]) == pytest.approx([0.00005, 0.0014, 0.0175])
    assert list(rows["task"]) == ["prbs"] * 3 + ["sinusoid"] * 2
    assert set(rows["unit"]) == {"a/p1", "a/s1"}


def test_who_when_and_the_dose(study_rows: pd.DataFrame) -> None:
    row = study_rows[(study_rows["condition"] == "DBS")].iloc[0]
    assert (row["subject"], row["unit"]) == ("M1", f"M1/{row['day']}")
    assert (row["frequency_hz"], row["amplitude"], row["amplitude_unit"]) == (130.0, 0.32, "mA")
    assert math.isnan(study_rows[study_rows["condition"] == "OFF"].iloc[0]["frequency_hz"])


def test_what_counts_is_included_chosen_and_of_an_epoch() -> None:
    out = fit("p2", outcome=Outcome("excluded", "moved"))
    pooled = fit("pooled")
    rows = estimate_rows(
        {
            "iv": analysis(fit("p1"), out, fixed=(fit("p1"), out), pooled=(pooled,)),
            "bandlimited": analysis(fit("p1"), out, fixed=(fit("p1"), out)),
        }
    )
    assert len(rows) == 3 * (2 * 2 * 2 + 1)
    assert list(counting(rows, "stiffness_nm_rad")["epoch"]) == ["p1"]
    assert rows["chosen"].sum() == 3 * 3


def test_degrees_are_those_of_the_interval() -> None:
    joint = np.array([0.005, 0.14, 1.75])
    half = 0.01 * joint * [2.570581835636314, 1.959963984540054, 12.706204736432102]
    one = Fit("a", "p", "OFF", "iv", Outcome(), joint, 0.01 * joint, joint - half, joint + half)
    rows = estimate_rows({"iv": analysis(one)})
    assert list(rows["degrees"]) == pytest.approx([5.0, math.inf, 1.0])


def test_findings_that_touch_a_value() -> None:
    noted = fit("p1", findings=(NOTE, CAUTION))
    scores = (Score("a", "p1", "OFF", Outcome(), 1.0, 1.0, 8, 1.0),)
    rows = estimate_rows({"iv": analysis(noted, scores=scores)})
    by_measure = rows.set_index("measure")["findings"]
    assert by_measure["stiffness_nm_rad"] == "tremor"
    assert by_measure["work_j"] == "voluntary_torque tremor"  # whatever it does to a fit


def test_the_bias_that_findings_of_all_epochs_allow() -> None:
    bias = Finding("loop_bias", "caution", 200.0, 50.0)
    alike = Finding("between_samples", "caution", 2.0, 1.0)  # no difference between conditions
    known = fit("pooled", findings=(bias, alike))
    unknown = fit("pooled", "DBS", findings=(bias, CAUTION))
    fits = fit("p1"), fit("p2", "DBS")
    rows = estimate_rows({"iv": analysis(*fits, pooled=(known, unknown, fit("pooled", "")))})
    stiffness = rows[rows["measure"] == "stiffness_nm_rad"]
    assert list(stiffness["scope"]) == ["epoch", "epoch", "condition", "condition", "all"]
    assert list(stiffness["bias"][2:]) == pytest.approx([2 * 0.03 * 1.75, math.inf, 0.0])


def epoch(label: str, condition: str, begins_s: float, **more) -> Epoch:
    stamps = begins_s + np.arange(3.0)
    return Epoch("a", label, {"angle_rad": Channel("angle_rad", stamps, stamps)}, condition, **more)


def test_a_block_is_an_unbroken_stretch_of_one_condition() -> None:
    order = [("1", "OFF", 0.0), ("2", "OFF", 9.0), ("4", "OFF", 30.0), ("3", "DBS", 20.0)]
    assert blocks(epoch(*one) for one in order) == {
        ("a", "1"): "1",
        ("a", "2"): "1",
        ("a", "3"): "2",
        ("a", "4"): "3",
    }


@pytest.mark.parametrize("ending", [".parquet", ".csv"])
def test_a_file_gives_the_same_rows(study_rows: pd.DataFrame, tmp_path, ending: str) -> None:
    rows = study_rows.assign(bias=np.where(study_rows.index % 2, np.inf, np.nan))
    write_rows(tmp_path / f"rows{ending}", rows)
    pd.testing.assert_frame_equal(
        read_rows(tmp_path / f"rows{ending}"), rows, check_exact=True, check_categorical=False
    )


def test_tables_of_other_categories_stay_small(study_rows: pd.DataFrame) -> None:
    more = as_rows([{"subject": "R9", "measure": "rating", "value": 1.0}])
    joined = together([study_rows, more])
    assert len(joined) == len(study_rows) + 1
    assert str(joined["subject"].dtype) == "category"
    assert joined.iloc[-1]["subject"] == "R9"


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("rows.txt", "", r"rows are stored as \.parquet or \.csv, not as '\.txt'"),
        ("rows.csv", "condition,value\nOFF,1\n", "there is no column measure"),
        ("rows.csv", "condition,measure,value,vaf\nOFF,k,1,2\n", "column vaf is unknown"),
        ("rows.csv", "condition,measure,value\nOFF,k,x\n", "line 2: value is 'x'"),
        ("rows.csv", "condition,measure,value,chosen\nOFF,k,1,ja\n", "write True or False"),
        ("rows.parquet", "no", "is no Parquet file"),
    ],
)
def test_another_file_is_refused(tmp_path, name: str, text: str, message: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(UserError, match=message):
        read_rows(tmp_path / name)
