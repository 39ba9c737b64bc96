"""The tables of the sections: every number, epoch and reason; and a section from outside."""

import csv
import dataclasses
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from matplotlib.figure import Figure as Drawing

from rigidimeter.analysis.report import (
    SECTIONS,
    Block,
    Figure,
    Section,
    Shown,
    paragraph,
    report,
    sections_of,
)
from rigidimeter.core.records import Delay, Outcome, Ticks
from rigidimeter.core.words import Column, Table


def tables_of(result: Shown, name: str) -> list[Table]:
    blocks = (block for _, blocks in sections_of(result) for block in blocks)
    return [block for block in blocks if isinstance(block, Table) and block.name == name]


def rows_of(result: Shown, name: str) -> list[dict[str, Any]]:
    return [dict(row) for row in tables_of(result, name)[0].rows]


def test_a_section_from_outside_is_in_the_page_and_its_files(
    make_study, make_analysis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def draw() -> Drawing:
        figure = Drawing()
        figure.add_subplot().plot([0.0, 1.0], [2.0, 3.0])
        return figure

    def blocks(result: Shown) -> Iterator[Block]:
        yield paragraph(f"Of {len(result.analysis.fits)} <fits>.")
        columns = (Column("toy_nm", "Toy (N·m)"), Column("condition", "Condition", "condition"))
        rows = [{"toy_nm": 1 / 3, "condition": "OFF", "only_in_file_s": 0.1}]
        yield Table("toys", "Toy numbers", columns, rows, note="A note.")
        yield Figure("toy_figure", "A caption.", "A line that rises.", draw)

    monkeypatch.setattr("rigidimeter.analysis.report.sections.SECTIONS", SECTIONS)
    monkeypatch.setattr("rigidimeter.analysis.report.page.SECTIONS", SECTIONS)
    SECTIONS.append(Section("toy", "From outside", blocks))
    try:
        page = report(make_study([], analysis=make_analysis({"OFF": 3})), tmp_path)
    finally:
        SECTIONS.pop()
    text = page.read_text(encoding="utf-8")
    assert "<h2>From outside</h2>" in text
    section = text[text.index("<h2>From outside") :]
    for shown in ("From outside", "Of 3 &lt;fits&gt;.", "Toy (N·m)", "0.3333", "A note.",
                  "A caption.", 'aria-label="A line that rises."'):  # fmt: skip
        assert shown in section
    assert "only_in_file_s" not in section
    with (tmp_path / "tables" / "toys.csv").open(encoding="utf-8", newline="") as file:
        (row,) = csv.DictReader(file)
    assert float(row["toy_nm"]) == 1 / 3
    assert row["only_in_file_s"] == "0.1"
    ET.parse(tmp_path / "figures" / "toy_figure.svg")


def test_a_section_that_is_not_shown_is_absent(study: Shown) -> None:
    names = [section.name for section, _ in sections_of(study)]
    assert {"about", "results", "exclusions", "provenance"} <= set(names)
    assert not {"study", "comparison", "days", "ratings", "methods"} & set(names)
    assert len(names) == len(set(names))


def test_the_band_is_a_column_where_it_differs(make_study, make_analysis) -> None:
    analysis = make_analysis({"OFF": 3})
    one = dataclasses.replace(analysis.fits[0], band_hz=(0.15, 20.0))
    mixed = dataclasses.replace(analysis, fits=(one, *analysis.fits[1:]))
    for made, shown in ((analysis, False), (mixed, True)):
        table = tables_of(make_study([], analysis=made), "estimates")[0]
        assert any(column.name == "band_low_hz" for column in table.columns) is shown
        assert ("band 0.150 to 10.0 Hz" in table.title) is not shown


def test_delays_say_what_was_done(make_study, make_analysis) -> None:
    delays = (
        Delay("a.csv", 0.012, 0.0001, corrected=True),
        Delay("b.csv", -0.012, 0.0001, corrected=True),
        Delay("c.csv", 1e-5, 1e-4, remark="too small"),
    )
    analysis = dataclasses.replace(make_analysis({"OFF": 3}), delays=delays)
    rows = rows_of(make_study([], analysis=analysis), "delays")
    keys = ("source", "delay_s", "delay_s_se", "corrected")
    assert [tuple(row[key] for key in keys) for row in rows] == [
        ("a.csv", 0.012, 0.0001, True),
        ("b.csv", -0.012, 0.0001, True),
        ("c.csv", 1e-5, 1e-4, False),
    ]
    assert "moved earlier by this delay" in rows[0]["done"]
    assert "moved later by this delay" in rows[1]["done"]
    assert rows[2]["done"] == "too small"


def test_exclusions_name_each_epoch_and_reason_once(make_study, make_analysis) -> None:
    analysis = make_analysis({"OFF": 2}, Outcome("excluded", "R² is −1, below zero"), scores=False)
    rows = rows_of(make_study([], analysis=analysis), "exclusions")
    assert [row["epoch"] for row in rows] == ["0", "1"]
    assert {row["reason"] for row in rows} == {"R² is −1, below zero"}


def test_an_epoch_of_which_nothing_was_made_is_listed(study, make_study, make_analysis) -> None:
    lone = make_study([study.epochs[1]], analysis=make_analysis({}))
    (row,) = rows_of(lone, "exclusions")
    assert (row["epoch"], row["stage"], row["outcome"]) == ("p1", "none", "failed")
    assert row["reason"]


def test_controller_is_given_per_radian_and_per_degree(study: Shown) -> None:
    own = dataclasses.replace(study, own_rig=True)
    numbers = {row["unit"]: row["value"] for row in rows_of(own, "design")}
    assert numbers["kg·m²/deg"] == pytest.approx(0.0008, rel=1e-12)
    assert numbers["kg·m²/rad"] == pytest.approx(0.0458366, rel=1e-6)
    assert numbers["N·m·s/deg"] == pytest.approx(0.028, rel=1e-12)


def test_every_setting_has_its_key_and_unit(study: Shown) -> None:
    rows = {row["key"]: (row["value"], row["unit"]) for row in rows_of(study, "settings")}
    assert rows["prbs.clock_hz"] == ("20.0", "Hz")
    assert rows["rig.torque.noise_sd_nm"] == ("0.005", "N·m")
    assert rows["subject.DBS.stiffness_nm_rad"] == ("1.44", "N·m/rad")
    assert rows["protocol.blocks[1].task"] == ("sinusoid", "")
    assert rows["protocol.rests_s[0]"] == ("10.0", "s")


def test_counts_add_up(study: Shown) -> None:
    rows = rows_of(study, "counts")
    assert sum(row["epochs"] for row in rows) == len(study.epochs)
    assert {(row["task"], row["condition"], row["epochs"]) for row in rows} == {
        ("torque perturbation", "OFF", 5),
        ("torque perturbation", "DBS", 5),
        ("imposed sinusoid", "OFF", 4),
        ("imposed sinusoid", "DBS", 4),
    }


def test_late_and_missed_ticks_are_counted_epoch_by_epoch(study: Shown) -> None:
    late = dataclasses.replace(study.epochs[0], ticks=Ticks(19_000, 200, 1000, 50))
    unknown = [dataclasses.replace(epoch, ticks=None) for epoch in study.epochs[1:]]
    rows = rows_of(dataclasses.replace(study, epochs=(late, *unknown)), "ticks")
    counts = {"ran": 19_000, "late": 200, "missed": 1000, "limited": 50, "missed_percent": 5.0}
    assert rows == [{"source": late.source, "epoch": late.label, **counts}]


def test_three_conditions_are_all_summarised(make_study, make_analysis) -> None:
    made = make_study([], analysis=make_analysis({"OFF": 6, "DBS": 6, "levodopa": 4}))
    (table,) = tables_of(made, "summaries")
    assert {row["condition"] for row in table.rows} == {"OFF", "DBS", "levodopa"}
    assert table.columns
    assert not any(math.isnan(row["median"]) for row in table.rows)
