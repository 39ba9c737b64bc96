"""The first screen says in words what the numbers are, in one direction everywhere."""

import csv
import math
import re
from dataclasses import replace
from pathlib import Path

import pytest
from tests.unit.analysis.report.cohorts import Design, made_study
from tests.unit.analysis.report.parsed_page import ParsedPage
from tests.unit.analysis.report.test_agreement import assert_shows, cells_below

from rigidimeter.analysis.report import first_screen
from rigidimeter.analysis.report import page as page_module
from rigidimeter.analysis.report.first_screen import (
    difference_words,
    light_words,
    main_finding,
    strip,
)
from rigidimeter.analysis.report.interval_plot import interval_plot, reach
from rigidimeter.analysis.report.page import contents, parts, render_page, write_report
from rigidimeter.analysis.report.sections.study_overview import NUMBERS
from rigidimeter.analysis.report.verdict_text import verdict
from rigidimeter.analysis.statistics import summarise
from rigidimeter.analysis.study import (
    Difference,
    StudyResult,
    compare_analysis,
    comparison_document,
    precisions,
    traffic_light,
)
from rigidimeter.cli.comparison_text import comparison_blocks
from rigidimeter.cli.estimate import estimate_blocks
from rigidimeter.cli.terminal_tables import Table, text_lines
from rigidimeter.core.files import read_json, write_json

SMALL = Design(days=(4, 3), epochs=(4, 4), scores=(3, 3))


@pytest.fixture(scope="module")
def study() -> StudyResult:
    return made_study(SMALL)


def test_it_is_said_which_p_the_conclusion_follows(study: StudyResult) -> None:
    """An interval can exclude zero where p adjusted for all measures shows no difference."""
    says = "the conclusion follows Holm's p"
    assert says in first_screen.tested_words(study)
    alone = replace(study, comparisons=study.comparisons[:1])
    assert says not in first_screen.tested_words(alone)


@pytest.mark.parametrize(
    ("d", "words"),
    [
        (
            Difference("mean", 1.8, 1.53, 0.27, 0.1, 0.44, 0.01),
            "lower by 0.270 N·m/rad, 15 %, 95 % interval 0.100 to 0.440 lower",
        ),
        (
            Difference("mean", 1.8, 2.07, -0.27, -0.44, -0.1, 0.01),
            "higher by 0.270 N·m/rad, 15 %, 95 % interval 0.100 to 0.440 higher",
        ),
        (
            Difference("mean", 1.8, 1.53, 0.27, -0.1, 0.64, 0.1),
            "lower by 0.270 N·m/rad, 15 %, 95 % interval 0.100 higher to 0.640 lower",
        ),
        (Difference("mean", 1.8, 1.53, 0.27), "lower by 0.270 N·m/rad, 15 %"),
        (
            Difference("mean", 0.0045, 0.0054, -0.0009, ratio=False),
            "higher by 0.900 10⁻³ N·m/rad",
        ),
    ],
)
def test_differences_are_words_for_the_other_condition(d: Difference, words: str) -> None:
    assert difference_words(d, "N·m/rad") == words


def test_page_table_document_and_terminal_agree(
    study: StudyResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page_module, "SECTIONS", [NUMBERS])
    page = ParsedPage(write_report(study, tmp_path).read_text(encoding="utf-8"))
    write_json(tmp_path / "c.json", comparison_document(study))
    document = read_json(tmp_path / "c.json")
    with (tmp_path / "tables" / "conclusion.csv").open(encoding="utf-8", newline="") as file:
        stored = list(csv.DictReader(file))
    blocks = list(comparison_blocks(study))
    terminal = cells_below(blocks, "In short")
    verdicts = [row for block in blocks if isinstance(block, Table) for row in block.rows]
    shown = page.table("DBS against OFF, means of days")[1:]
    for one, row, cells, line in zip(document["conclusion"], stored, shown, terminal, strict=True):
        for name, value in one.items():
            if isinstance(value, float):
                assert float(row[name]) == value
            else:
                assert row[name] == ("" if value is None else value)
        factor = 1e3 if "10⁻³" in cells[0] else 1.0
        numbers = {name: one[name] for name in ("estimate", "low", "high")}
        sizes = [abs(factor * size) for size in sorted(numbers.values())]
        assert_shows(cells[1], [factor * one["value_reference"]], 3)
        assert_shows(cells[2], [factor * one["value_other"]], 3)
        assert_shows(cells[3].partition("[")[0], [abs(factor * one["estimate"])], 3)
        ends = [abs(factor * one["low"]), abs(factor * one["high"])]
        ends = ends if one["low"] < 0 < one["high"] else sorted(ends)
        assert_shows(cells[3].partition("[")[2], ends, 3)
        assert len(sizes) == 3
        if one["percent"] is not None:
            assert_shows(cells[4].partition("[")[0], [abs(one["percent"])], 2)
        assert_shows(cells[6], [one["p"], one["p_holm"]], 2)
        assert cells[7] == one["verdict"]
        assert any(str(x).endswith(f": {one['verdict']}") for x in verdicts)
        values = [factor * one["value_reference"], factor * one["value_other"]]
        assert_shows(" ".join(line[:2]), values, 3)
        assert line[2].endswith("lower" if one["estimate"] > 0 else "higher")
        assert_shows(line[2], [abs(factor * one["estimate"])], 3)
        assert_shows(line[4], ends, 3)
        assert_shows(" ".join(line[5:]), [one["p"], one["p_holm"]], 2)
    light = document["quality"]
    assert "Data quality: good." in page.words()
    assert f"{light['sound']} of {light['epochs']} epochs are sound" in page.words()
    sound = f"{light['sound']} of {light['epochs']} epochs are sound"
    assert sound in " ".join(text_lines(blocks))
    assert text_lines(blocks, 1000)[0] == verdict(study).lead


def test_the_light_is_words(study: StudyResult) -> None:
    light = traffic_light(study)
    assert light is not None
    assert light_words(light) == "46 of 49 epochs are sound (3 are excluded)."
    assert main_finding(light) == "No check casts doubt on an epoch."
    worse = replace(light, doubt="voluntary_torque", doubt_epochs=7, doubted=7, sound=39)
    assert light_words(worse) == (
        "39 of 49 epochs are sound (checks cast doubt on 7, 3 are excluded)."
    )
    assert main_finding(worse) == "Main finding: voluntary torque, in 7 of them."
    assert main_finding(replace(light, text="all days came later")) == "All days came later."


def test_a_difference_that_is_unknown_has_no_picture(study: StudyResult) -> None:
    assert all("<svg" in row.plot for row in strip(study))
    one_sided = tuple(
        replace(
            c,
            test=None,
            days=None,
            observations=c.of("OFF"),
            summaries={"OFF": c.summaries["OFF"], "DBS": summarise([])},
        )
        for c in study.comparisons
    )
    assert [row.plot for row in strip(replace(study, comparisons=one_sided))] == [""] * 6


def test_the_plot_has_its_text_as_text_and_arrows_beyond_its_axis() -> None:
    svg = interval_plot(-15.0, (-40.0, 10.0), ("50 % lower", "0", "50 % higher"), 50.0)
    assert re.findall(r">([^<>]+)</text>", svg) == ["50 % lower", "0", "50 % higher"]
    assert "arrow" not in svg
    beyond = interval_plot(-15.0, (-400.0, 10.0), ("a", "0", "b"), 100.0)
    assert beyond.count("arrow") == 1
    unknown = interval_plot(math.nan, (math.nan, math.nan), ("a", "0", "b"), 100.0)
    assert "range" not in unknown
    assert "nan" not in unknown
    assert "<script>" not in interval_plot(0.0, (0.0, 0.0), ("<script>",) * 3, 1.0)


def test_the_axis_holds_what_is_drawn() -> None:
    for size in (0.011, 0.3, 1.0, 2.1, 49.0, 51.0, 99.0):
        assert size <= reach([size]) <= 5 * size


def test_one_condition_has_its_own_first_screen(make_study, make_analysis) -> None:
    made = make_study([], analysis=make_analysis({"": 3}))
    page = ParsedPage(render_page(made, contents(made), {}))
    rows = page.table("All epochs together")[1:]
    assert [row[0].split()[0] for row in rows] == [
        "Stiffness",
        "Viscous",
        "Inertia",
        "Angular",
        "Work",
    ]
    assert "What would make them better" in page.words()
    assert "Repeat epochs like these" in page.words()


def test_what_has_nothing_to_show_is_neither_on_the_page_nor_in_its_contents(study) -> None:
    bare = replace(study, ratings=None, sensitivity=(), exclusions=())
    titles = [part.title for part in parts(contents(bare))]
    assert titles[:2] == ["Summary", "Measures"]
    assert not {"Ratings", "What rests on the method"} & set(titles)
    assert titles.index("Settings and provenance") > titles.index("Methods")
    assert titles == list(dict.fromkeys(titles))


def test_the_terminal_has_the_precision_of_one_condition(make_analysis) -> None:
    analysis = make_analysis({"DBS": 3})
    result = compare_analysis(analysis, resamples=0)
    shown = cells_below(estimate_blocks(result), "All epochs together")
    for one, line in zip(precisions(result), shown, strict=True):
        assert line[0].startswith(f"{one.measure.title}, ")
        factor = 1e3 if "10⁻³" in line[0] else 1.0
        values = [factor * one.value, factor * one.low, factor * one.high, one.percent]
        assert_shows(" ".join(line[1:4]), values, 2)
        assert_shows(line[4], [one.sd_percent], 2)
        assert line[5:] == (f"{one.n}", f"{one.epochs_needed}")
    one_epoch = compare_analysis(make_analysis({"DBS": 1}), resamples=0)
    rows = cells_below(estimate_blocks(one_epoch), "All epochs together")
    (work,) = (row for row in rows if "Work" in row[0])
    assert work[2:] == ("not known from one epoch", "", "–", "1", "")
