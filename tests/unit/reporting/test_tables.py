"""Tables: every digit kept, every epoch and reason there."""

import csv
import dataclasses
import io
import math

import pytest

from rigidimeter.records import Delay, Outcome
from rigidimeter.reporting.page_table import Cell, Table, csv_text
from rigidimeter.reporting.report_tables import all_tables
from rigidimeter.study import StudyResult


def read_back(text: str, table: Table) -> list[list[Cell]]:
    """Return the rows of a CSV with each cell as the type it was written from."""
    header, *rows = csv.reader(io.StringIO(text))
    assert header == [column.name for column in table.columns]
    types = [[type(cell) for cell in row] for row in table.rows]
    read = {type(None): lambda _: None, bool: "True".__eq__, float: lambda c: float(c or "nan")}
    return [
        [read.get(kind, kind)(cell) for cell, kind in zip(row, kinds, strict=True)]
        for row, kinds in zip(rows, types, strict=True)
    ]


def same(a: Cell, b: Cell) -> bool:
    both_nan = isinstance(a, float) and isinstance(b, float) and math.isnan(a) and math.isnan(b)
    return both_nan or a == b


def assert_reads_back(text: str, table: Table) -> None:
    for row, expected in zip(read_back(text, table), table.rows, strict=True):
        assert all(same(a, b) for a, b in zip(row, expected, strict=True)), (row, expected)


def test_every_table_reads_back_equal(study: StudyResult) -> None:
    for table in all_tables(study).values():
        assert_reads_back(csv_text(table), table)


def test_tables_without_numbers_read_back_equal(make_study, make_analysis) -> None:
    failed = make_analysis({"OFF": 3}, Outcome("failed", 'a, "b"\nc; é'), scores=False)
    for table in all_tables(make_study([], analysis=failed)).values():
        assert_reads_back(csv_text(table), table)


def test_stored_names_carry_units(study: StudyResult) -> None:
    names = {column.name for table in all_tables(study).values() for column in table.columns}
    assert {
        "inertia_kg_m2",
        "inertia_kg_m2_se",
        "damping_nm_s_rad",
        "stiffness_nm_rad",
        "residual_sd_nm",
        "impulse_nm_s",
        "work_j",
        "duration_s",
    } <= names


def test_fits_hold_what_the_analysis_holds(study: StudyResult) -> None:
    tables = all_tables(study)
    for name in ("fits", "fixed_inertia"):
        columns = [column.name for column in tables[name].columns]
        for row, fit in zip(tables[name].rows, getattr(study.analysis, name), strict=True):
            cells = dict(zip(columns, row, strict=True))
            assert cells["epoch"] == fit.epoch
            assert cells["stiffness_nm_rad"] == fit.stiffness_nm_rad
            assert cells["stiffness_nm_rad_se"] == fit.stiffness_nm_rad_se
            assert cells["n_samples"] == fit.n_samples
            assert (cells["band_low_hz"], cells["band_high_hz"]) == fit.band_hz
            assert cells["outcome"] == fit.outcome.kind


def test_fits_hold_their_intervals_bounds_and_findings(study: StudyResult) -> None:
    table = all_tables(study)["fits"]
    columns = [column.name for column in table.columns]
    for row, fit in zip(table.rows, study.analysis.fits, strict=True):
        cells = dict(zip(columns, row, strict=True))
        for name in ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad"):
            for ending in ("_low", "_high", "_bound"):
                assert cells[name + ending] == getattr(fit, name + ending)
            assert cells[f"{name}_low"] < cells[name] < cells[f"{name}_high"]
        assert cells["findings"] == ", ".join(finding.name for finding in fit.findings)
        assert cells["n_findings"] == len(fit.findings)


def test_the_band_is_on_the_page_where_it_differs(make_study, make_analysis) -> None:
    analysis = make_analysis({"OFF": 3})
    one = dataclasses.replace(analysis.fits[0], band_hz=(0.15, 20.0))
    mixed = dataclasses.replace(analysis, fits=(one, *analysis.fits[1:]))
    for made, shown in ((analysis, False), (mixed, True)):
        table = all_tables(make_study([], analysis=made))["fits"]
        band = next(column for column in table.columns if column.name == "band_low_hz")
        assert band.on_page is shown
        assert ("band 0.150 to 10.0 Hz" in table.caption) is not shown


def test_pooled_estimates_are_by_condition_and_for_all(study: StudyResult) -> None:
    table = all_tables(study)["pooled"]
    columns = [column.name for column in table.columns]
    rows = [dict(zip(columns, row, strict=True)) for row in table.rows]
    assert [row["condition"] for row in rows] == ["OFF", "DBS", "(all)"]
    for row, fit in zip(rows, study.analysis.pooled, strict=True):
        assert row["damping_nm_s_rad"] == fit.damping_nm_s_rad
        assert row["damping_nm_s_rad_high"] == fit.damping_nm_s_rad_high


def test_delays_say_what_was_done(make_study, make_analysis) -> None:
    delays = (
        Delay("a.csv", 0.012, 0.0001, corrected=True),
        Delay("b.csv", -0.012, 0.0001, corrected=True),
        Delay("c.csv", 1e-5, 1e-4, remark="not corrected: not told from zero"),
    )
    analysis = dataclasses.replace(make_analysis({"OFF": 3}), delays=delays)
    rows = all_tables(make_study([], analysis=analysis))["delays"].rows
    assert [row[:4] for row in rows] == [
        ("a.csv", 0.012, 0.0001, "yes"),
        ("b.csv", -0.012, 0.0001, "yes"),
        ("c.csv", 1e-5, 1e-4, "no"),
    ]
    assert "moved earlier by it" in str(rows[0][4])
    assert "moved later by it" in str(rows[1][4])
    assert rows[2][4] == "not corrected: not told from zero"


def test_results_hold_what_the_comparisons_hold(study: StudyResult) -> None:
    table = all_tables(study)["comparisons"]
    columns = [column.name for column in table.columns]
    for row, comparison in zip(table.rows, study.comparisons, strict=True):
        cells = dict(zip(columns, row, strict=True))
        assert cells["measure"] == comparison.measure.name
        assert cells["median_other"] == comparison.summaries[comparison.other].median
        assert comparison.test is not None
        for field in ("shift", "shift_low", "z", "p", "r", "p_uncorrected", "u"):
            assert cells[field] == getattr(comparison.test, field)


def test_summaries_agree_with_the_comparisons(study: StudyResult) -> None:
    rows = {(row[0], row[3]): row[4:] for row in all_tables(study)["summaries"].rows}
    for comparison in study.comparisons:
        for condition, s in comparison.summaries.items():
            expected = (s.n, comparison.excluded[condition], s.median, s.q1, s.q3)
            assert rows[comparison.measure.name, condition] == expected


def test_exclusions_name_each_epoch_and_reason_once(make_study, make_analysis) -> None:
    analysis = make_analysis({"OFF": 2}, Outcome("excluded", "R² is −1, below zero"), scores=False)
    rows = all_tables(make_study([], analysis=analysis))["exclusions"].rows
    assert [row[1] for row in rows] == ["0", "1"]
    assert {row[-1] for row in rows} == {"R² is −1, below zero"}


def test_an_epoch_of_which_nothing_was_made_is_listed(study, make_study, make_analysis) -> None:
    lone = make_study([study.epochs[1]], analysis=make_analysis({}))
    ((_, label, _, stage, kind, reason),) = all_tables(lone)["exclusions"].rows
    assert (label, stage, kind) == ("p1", "none", "failed")
    assert reason


def test_controller_is_given_per_radian_and_per_degree(study: StudyResult) -> None:
    values = [(row[2], row[3]) for row in all_tables(study)["design"].rows]
    numbers = {unit: value for value, unit in values}
    assert numbers["kg·m²/deg"] == pytest.approx(0.0008, rel=1e-12)
    assert numbers["kg·m²/rad"] == pytest.approx(0.0458366, rel=1e-6)
    assert numbers["N·m·s/deg"] == pytest.approx(0.028, rel=1e-12)


def test_every_setting_has_its_key_and_unit(study: StudyResult) -> None:
    rows = {row[0]: row[1:] for row in all_tables(study)["settings"].rows}
    assert rows["prbs.clock_hz"] == ("20.0", "Hz")
    assert rows["rig.torque.noise_sd_nm"] == ("0.005", "N·m")
    assert rows["subject.DBS.stiffness_nm_rad"] == ("1.44", "N·m/rad")
    assert rows["protocol.blocks[1].task"] == ("sinusoid", "")
    assert rows["protocol.rests_s[0]"] == ("10.0", "s")


def test_counts_add_up(study: StudyResult) -> None:
    rows = all_tables(study)["counts"].rows
    assert sum(row[2] for row in rows) == len(study.epochs)
    assert {row[:3] for row in rows} == {
        ("torque perturbation", "OFF", 5),
        ("torque perturbation", "DBS", 5),
        ("imposed sinusoid", "OFF", 4),
        ("imposed sinusoid", "DBS", 4),
    }


def test_three_conditions_are_all_summarised(make_study, make_analysis) -> None:
    analysis = make_analysis({"OFF": 6, "DBS": 6, "levodopa": 4})
    made = make_study([], analysis=analysis)
    conditions = {row[3] for row in all_tables(made)["summaries"].rows}
    assert conditions == {"OFF", "DBS", "levodopa"}
