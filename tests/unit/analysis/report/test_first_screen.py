"""The first screen says in words what the numbers are, in one direction everywhere."""

import csv
import math
import re
from dataclasses import replace
from pathlib import Path

import pytest
from tests.unit.analysis.report.cohorts import Design, made_study
from tests.unit.analysis.report.parsed_page import ParsedPage

from rigidimeter.analysis.report import SECTIONS
from rigidimeter.analysis.report import page as page_module
from rigidimeter.analysis.report.first_screen import (
    interval_plot,
    light_words,
    main_finding,
    reach,
    strips,
)
from rigidimeter.analysis.report.methods_prose import methods_prose
from rigidimeter.analysis.report.page import contents, parts, render_page, write_report
from rigidimeter.analysis.statistics import summarise
from rigidimeter.analysis.study import (
    Difference,
    Primary,
    StudyResult,
    comparison_document,
    conclude,
    difference_rows,
    lead,
    traffic_light,
)
from rigidimeter.cli.comparison_text import difference_blocks
from rigidimeter.core.files import read_json, write_json
from rigidimeter.core.study_files import PrimaryTable

SMALL = Design(days=(4, 3), epochs=(4, 4), scores=(3, 3))


@pytest.fixture(scope="module")
def study() -> StudyResult:
    return made_study(SMALL)


def test_it_is_said_which_p_the_conclusion_follows(study: StudyResult) -> None:
    """An interval can exclude zero where p adjusted for all measures shows no difference."""
    (terminal,) = difference_blocks(study)
    assert terminal.headings[6] == "p, Holm"
    assert "p, Holm" in ParsedPage(render_page(study, (), {})).table("DBS against OFF")[0]
    (alone,) = difference_blocks(replace(study, comparisons=study.comparisons[:1]))
    assert alone.headings[6] == "p"
    order = PrimaryTable(measures=["stiffness_nm_rad", "damping_nm_s_rad"], rule="sequence")
    declared = replace(study, primary=Primary(order, "study.toml"))
    (terminal,) = difference_blocks(declared)
    assert terminal.headings[6] == "p, adjusted"
    page = render_page(declared, (), {})
    assert "p, adjusted" in ParsedPage(page).table("DBS against OFF")[0]
    methods = " ".join(str(methods_prose(declared)).split())
    assert "adjusted: K and B were primary, each tested only if those before it" in methods
    assert "adjusted apart by Holm’s method" in methods


@pytest.mark.parametrize(
    ("d", "difference", "interval"),
    [
        (Difference("mean", 1.8, 1.53, -0.27, -0.44, -0.1, 0.01), "−15 %", "−24 to −6 %"),
        (Difference("mean", 1.8, 2.07, 0.27, 0.1, 0.44, 0.01), "+15 %", "+6 to +24 %"),
        (Difference("mean", 1.8, 1.53, -0.27, -0.64, 0.1, 0.1), "−15 %", "−36 to +6 %"),
        (
            Difference("mean", 1.8, 1.53, -0.27, -0.28, -0.26, 0.01),
            "−15.0 %",
            "−15.6 to −14.4 %",
        ),
        (Difference("mean", 1.8, 1.53, -0.27), "−15 %", ""),
        (Difference("mean", 1.8, 1.8, 0.0, -0.1, 0.1, 0.9), "0 %", "−6 to +6 %"),
        (Difference("mean", 2.0, 1.5, -0.5, -0.8, -0.2, ratio=False), "−0.50", "−0.80 to −0.20"),
        (Difference("mean", 0.0045, 0.0054, 0.0009, ratio=False), "+0.90", ""),
        (Difference("mean", math.nan, 1.8, math.nan), "–", ""),
    ],
)
def test_differences_are_signed_with_the_digits_of_their_interval(
    study: StudyResult, d: Difference, difference: str, interval: str
) -> None:
    """Other − reference, in % where that has a meaning, else in the unit of both values."""
    concluded = conclude(study)
    assert concluded is not None
    one = replace(concluded.each[0], difference=d)
    (row,) = difference_rows(replace(concluded, each=(one,)))
    assert (row.difference, row.interval) == (difference, interval)
    assert row.unit == ("10⁻³ N·m/rad" if d.reference < 0.01 else "N·m/rad")


def test_table_and_document_are_one(
    study: StudyResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page_module, "SECTIONS", [s for s in SECTIONS if s.name == "numbers"])
    page = ParsedPage(write_report(study, tmp_path).read_text(encoding="utf-8"))
    write_json(tmp_path / "c.json", comparison_document(study))
    document = read_json(tmp_path / "c.json")
    with (tmp_path / "tables" / "conclusion.csv").open(encoding="utf-8", newline="") as file:
        stored = list(csv.DictReader(file))
    for one, row in zip(document["conclusion"], stored, strict=True):
        for name, value in one.items():
            if isinstance(value, int | float):
                assert float(row[name]) == value
            else:
                assert row[name] == ("" if value is None else value)
    assert lead(study) in page.words()
    light = document["quality"]
    assert "Data quality: good." in page.words()
    assert f"{light['sound']} of {light['epochs']} epochs without a caution" in page.words()


def test_the_light_is_words(study: StudyResult) -> None:
    light = traffic_light(study)
    assert light is not None
    assert light_words(light) == "46 of 49 epochs without a caution (3 excluded)."
    assert main_finding(light) == ""
    worse = replace(light, doubt="voluntary_torque", doubt_epochs=7, doubted=7, sound=39)
    assert light_words(worse) == (
        "39 of 49 epochs without a caution (7 with a caution, 3 excluded)."
    )
    assert main_finding(worse) == "Main finding: voluntary torque, in 7 of them."
    assert main_finding(replace(light, text="all days came later")) == "All days came later."


def drawn(study: StudyResult) -> list[str]:
    ((_, _, _, rows),) = strips(study)
    return [str(plot) for _, plot in rows]


def test_a_difference_that_is_unknown_has_no_picture(study: StudyResult) -> None:
    assert [plot.count("<svg") for plot in drawn(study)] == [1] * 6
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
    assert drawn(replace(study, comparisons=one_sided)) == [""] * 6


def test_the_plot_has_its_text_as_text_and_arrows_beyond_its_axis() -> None:
    svg = interval_plot((-15.0, -40.0, 10.0), 50.0, " %", middle="none")
    assert re.findall(r">([^<>]+)</text>", svg) == ["−50 %", "none", "+50 %"]
    assert "arrow" not in svg
    beyond = interval_plot((-15.0, -400.0, 10.0), 100.0, " %")
    assert beyond.count("arrow") == 1
    unknown = interval_plot((math.nan,) * 3, 100.0, " %")
    assert "range" not in unknown
    assert "nan" not in unknown
    assert "<script>" not in interval_plot((0.0, 0.0, 0.0), 1.0, "<script>", words="<script>")


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
    assert titles == [
        "Summary",
        "What was done",
        "Rig checks",
        "Epoch quality",
        "Model fit",
        "All tests",
        "Provenance",
        "Tables",
    ]
    assert "Sensitivity" in [p.title for p in parts(contents(study))]
    assert titles == list(dict.fromkeys(titles))
