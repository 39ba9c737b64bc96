"""A test of a measure is one row: what it holds, and what a refusal is."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from rigidimeter.analysis.statistics import day_difference
from rigidimeter.analysis.study_anew import (
    MEASURES,
    Measure,
    Primary,
    Study,
    as_rows,
    by_units,
    by_values,
    compare_values,
    conclude,
    conclusion_rows,
    counting,
    day_tests,
    read_rows,
    write_rows,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.study_files import PrimaryTable

PAIR = ("OFF", "DBS")
STIFFNESS = MEASURES[2]


def rows_of(values: dict[tuple[str, str, str], list[float]], measure: Measure = STIFFNESS):
    """Return rows of a measure by day, block and condition, each value with ends 10 % away."""
    records = [
        {
            "subject": "M1",
            "day": day,
            "session": f"s{day}",
            "block": block,
            "unit": f"M1/{day}",
            "condition": condition,
            "method": "iv",
            "measure": measure.name,
            "value": value,
            "low": 0.9 * value,
            "high": 1.1 * value,
        }
        for (day, block, condition), own in values.items()
        for value in own
    ]
    return as_rows(records)


@pytest.fixture(scope="module")
def rows() -> pd.DataFrame:
    """Two days of four blocks, the second condition 1 lower; three epochs a block."""
    rng = np.random.default_rng(1)
    return rows_of(
        {
            (day, str(block), PAIR[block % 2]): list(3.0 - block % 2 + 0.1 * rng.random(3) + size)
            for day, size in (("1", 0.0), ("2", 0.5))
            for block in range(1, 5)
        }
    )


def test_by_days_the_difference_is_other_less_reference(rows: pd.DataFrame) -> None:
    counted = counting(rows, STIFFNESS.name)
    one = by_units(counted, STIFFNESS, PAIR)
    x, y = (counted[counted["condition"] == name] for name in PAIR)
    found = day_difference(x["value"], y["value"], list(x["day"]), list(y["day"]), names=PAIR)
    assert (one.difference, one.low, one.high) == (-found.estimate, -found.high, -found.low)
    assert (one.p, one.df, one.se, one.test) == (found.p, found.df, found.se, found.test)
    assert one.units == (2, 2)
    assert one.percent(one.of_test)[0] == pytest.approx(100 * one.difference / found.mean_x)


def test_blocks_and_recordings_in_the_place_of_days(rows: pd.DataFrame) -> None:
    counted = counting(rows, STIFFNESS.name)
    by_block = by_units(counted, STIFFNESS, PAIR, "blocks")
    assert by_block.test == "Welch's t-test of 4 blocks of OFF and 4 blocks of DBS"
    assert by_block.df > by_units(counted, STIFFNESS, PAIR).df
    by_recording = by_units(counted, STIFFNESS, PAIR, "recordings")
    assert by_recording.test == "paired t-test of 2 recordings, with the standard error of the " \
        "epochs alone, which is larger"  # fmt: skip


def test_a_refusal_is_a_row_with_its_reason(rows: pd.DataFrame) -> None:
    few = counting(rows, STIFFNESS.name).iloc[:5]
    for one in (by_units(few, STIFFNESS, PAIR), by_values(few, STIFFNESS, PAIR)):
        assert one.remark == (
            "a test needs 3 epochs in each condition; there are 2 in OFF and 3 in DBS"
        )
        assert math.isnan(one.p)
        assert one.value_reference > one.value_other
        assert not one.tested


def test_too_many_values_are_refused_alone_and_a_remark_beside_days() -> None:
    values = {(day, "1", name): list(np.linspace(1.0, 2.0, 3600)) for day in "12" for name in PAIR}
    many = rows_of(values)
    (one,) = compare_values(Study(many, *PAIR))
    assert "make 5.2e+07 pairs" in one.remark
    with pytest.raises(UserError, match=r"make 5\.2e\+07 pairs"):
        day_tests(Study(many.assign(day="", method=""), *PAIR))


def test_one_condition_alone_is_summarised_and_not_concluded(rows: pd.DataFrame) -> None:
    study = Study(rows, "OFF")
    (one,) = day_tests(study)
    assert one.remark == "only one condition was recorded"
    assert conclude(study, [one]) == ()


@pytest.mark.parametrize(
    ("p", "finding"),
    [(0.02, "earlier_in_sequence"), (0.03, "wide_interval"), (0.2, "wide_interval")],
)
def test_in_a_sequence_the_level_is_divided_by_the_conditions(
    rows: pd.DataFrame, p: float, finding: str
) -> None:
    """Two conditions beside the reference: alone it would be found below 0.025."""
    table = PrimaryTable(measures=["damping_nm_s_rad", "stiffness_nm_rad"], rule="sequence")
    more = rows.assign(measure="damping_nm_s_rad")
    both = pd.concat([rows.astype({"measure": str}), more]).reset_index(drop=True)
    study = Study(both, "OFF", "DBS", ("LOW",), primary=Primary(table))
    tests = [
        by_units(counting(rows, STIFFNESS.name), STIFFNESS, PAIR),
        by_units(counting(more, "damping_nm_s_rad"), MEASURES[1], PAIR),
    ]
    changed = [
        replace(tests[0], p=p),
        replace(tests[1], p=0.5),
        replace(tests[0], p=0.5, other="LOW"),
    ]
    found = {
        (row["measure"], row["other"]): row for row in conclusion_rows(conclude(study, changed))
    }
    assert found["stiffness_nm_rad", "DBS"]["finding"] == finding
    assert found["stiffness_nm_rad", "DBS"]["level"] == 0.025


@pytest.mark.parametrize("ending", [".parquet", ".csv"])
def test_rows_of_a_file_are_concluded_alike(
    rows: pd.DataFrame, tmp_path: Path, ending: str
) -> None:
    flagged = rows.assign(findings=np.where(rows["condition"] == "DBS", "tremor", ""))
    write_rows(tmp_path / f"rows{ending}", flagged)
    before, after = (Study(one, *PAIR) for one in (flagged, read_rows(tmp_path / f"rows{ending}")))
    found = conclusion_rows(conclude(after, day_tests(after)))
    assert found == conclusion_rows(conclude(before, day_tests(before)))
    assert found[0]["finding"] == "flagged_epochs"
