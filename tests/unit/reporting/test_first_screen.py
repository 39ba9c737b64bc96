"""The first screen says in words what the numbers are, in one direction everywhere."""

import csv
import math
import re
from dataclasses import replace
from pathlib import Path

import pytest
from tests.unit.reporting.cohorts import Design, made_study
from tests.unit.reporting.parsed_page import ParsedPage
from tests.unit.reporting.test_agreement import assert_shows

from rigidimeter.cli.comparison_text import comparison_lines
from rigidimeter.cli.estimate import estimate_lines
from rigidimeter.documents import read_json, write_json
from rigidimeter.reporting import page as page_module
from rigidimeter.reporting.first_screen import difference_words, gravest_words, light_words
from rigidimeter.reporting.interval_plot import interval_plot, reach
from rigidimeter.reporting.page import contents, parts, render_page, write_report
from rigidimeter.reporting.sections.study_overview import NUMBERS
from rigidimeter.study import (
    Difference,
    StudyResult,
    compare_analysis,
    comparison_document,
    precisions,
    traffic_light,
)

SMALL = Design(days=(4, 3), epochs=(4, 4), scores=(3, 3))


@pytest.fixture(scope="module")
def study() -> StudyResult:
    return made_study(SMALL)


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
    lines = comparison_lines(study)
    shown = page.table("DBS against OFF, means of days")[1:]
    for one, row, cells in zip(document["conclusion"], stored, shown, strict=True):
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
        place = lines.index(next(x for x in lines if x.startswith(f"{one['title']} (")))
        values = lines[place].rpartition(": OFF")[2]
        assert_shows(values, [one["value_reference"], one["value_other"]], 4)
        assert lines[place + 1].startswith(f"  DBS {'lower' if one['estimate'] > 0 else 'higher'}")
        assert_shows(lines[place + 2], [one["p"], one["p_holm"]], 2)
    light = document["quality"]
    assert "Data quality: good." in page.words()
    assert f"{light['sound']} of {light['epochs']} epochs are sound" in page.words()
    assert any(f"{light['sound']} of {light['epochs']} epochs are sound" in x for x in lines)


def test_the_light_is_words(study: StudyResult) -> None:
    light = traffic_light(study)
    assert light is not None
    assert light_words(light) == "46 of 49 epochs are sound (3 are excluded)."
    assert gravest_words(light) == "No check casts doubt on an epoch."
    worse = replace(light, doubt="voluntary_torque", doubt_epochs=7, doubted=7, sound=39)
    assert light_words(worse) == (
        "39 of 49 epochs are sound (checks cast doubt on 7, 3 are excluded)."
    )
    assert gravest_words(worse) == "Gravest doubt: voluntary torque, in 7 of them."


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
    lines = estimate_lines(analysis)
    begin = lines.index("All epochs together, with 95 % intervals")
    for one, line in zip(
        precisions(compare_analysis(analysis, resamples=0)), lines[begin + 1 :], strict=False
    ):
        assert line.startswith(f"  {one.measure.label}: ")
        needed = [one.epochs_needed or 0, one.n] if (one.epochs_needed or 0) > one.n else []
        numbers = [one.value, one.low, one.high, one.percent, *([5.0] if needed else []), *needed]
        assert_shows(line.partition("): ")[2], numbers, 2)
    (work,) = (line for line in estimate_lines(make_analysis({"DBS": 1})) if "Work" in line)
    assert work.endswith(", from one epoch, so without an interval")
