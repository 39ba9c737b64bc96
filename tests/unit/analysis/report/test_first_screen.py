"""The first screen says in words what the numbers are, in one direction everywhere."""

import math
import re
from dataclasses import replace

import pytest
from tests.unit.analysis.report.cohorts import Design, bare, made_study, of_result
from tests.unit.analysis.report.parsed_page import ParsedPage

from rigidimeter.analysis.report import Shown
from rigidimeter.analysis.report.first_screen import (
    interval_plot,
    light_words,
    main_finding,
    strips,
)
from rigidimeter.analysis.report.methods_prose import methods_prose
from rigidimeter.analysis.report.page import contents, parts, render_page
from rigidimeter.analysis.study_anew import Primary, traffic_light
from rigidimeter.core.study_files import PrimaryTable

SMALL = Design(days=(4, 3), epochs=(4, 4), scores=(3, 3))


@pytest.fixture(scope="module")
def study() -> Shown:
    return made_study(SMALL)


def test_it_is_said_which_p_the_conclusion_follows(study: Shown) -> None:
    """An interval can exclude zero where p adjusted for all measures shows no difference."""
    assert heading_of_p(study) == "p, Holm"
    alone = tuple(one for one in study.result.comparisons if one.role == "check")
    assert heading_of_p(of_result(study, comparisons=alone)) == "p"
    order = PrimaryTable(measures=["stiffness_nm_rad", "damping_nm_s_rad"], rule="sequence")
    declared = made_study(SMALL, primary=Primary(order, "study.toml"))
    assert heading_of_p(declared) == "p, adjusted"
    methods = " ".join(str(methods_prose(declared)).split())
    assert "adjusted: K and B were primary, each tested only if those before it" in methods
    assert "adjusted apart by Holm’s method" in methods


def heading_of_p(shown: Shown) -> str:
    return ParsedPage(render_page(shown, (), {})).table("DBS against OFF")[0][6]


def test_the_light_is_words(study: Shown) -> None:
    light = traffic_light(study.study, study.result.comparisons)
    assert light is not None
    assert light_words(light) == "46 of 49 epochs without a caution (3 excluded)."
    assert main_finding(light) == ""
    worse = light | {"doubt": "voluntary_torque", "doubt_epochs": 7, "doubted": 7, "sound": 39}
    assert light_words(worse) == (
        "39 of 49 epochs without a caution (7 with a caution, 3 excluded)."
    )
    assert main_finding(worse) == "Main finding: voluntary torque, in 7 of them."
    assert main_finding(light | {"text": "all days came later"}) == "All days came later."


def drawn(study: Shown) -> list[str]:
    ((*_, rows),) = strips(study.result)
    return [str(plot) for _, plot in rows]


def test_a_difference_that_is_unknown_has_no_picture(study: Shown) -> None:
    assert [plot.count("<svg") for plot in drawn(study)] == [1] * 6
    unknown = replace(study.result.comparisons[0], difference=math.nan)
    assert drawn(of_result(study, comparisons=(unknown,))) == [""]


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
    titles = [part.title for part in parts(contents(bare(study)))]
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
