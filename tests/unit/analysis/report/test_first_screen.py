"""The first screen says in words what the numbers are, in one direction everywhere."""

import math
import re
from dataclasses import replace

import pytest
from tests.unit.analysis.report.cohorts import Design, bare, made_study, of_result
from tests.unit.analysis.report.parsed_page import ParsedPage

from rigidimeter.analysis.report import Shown, methods_prose, page_text
from rigidimeter.analysis.study import Primary, traffic_light
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
    return ParsedPage(page_text(shown)).table("DBS against OFF")[0][6]


def test_the_light_is_words(study: Shown, monkeypatch: pytest.MonkeyPatch) -> None:
    light = traffic_light(study.study, study.result.comparisons)
    assert light is not None
    doubted = light | {"doubt": "voluntary_torque", "doubt_epochs": 7, "doubted": 7, "sound": 39}
    for shown, words in (
        (light, "46 of 49 epochs without a caution (3 excluded)."),
        (
            doubted,
            "39 of 49 epochs without a caution (7 with a caution, 3 excluded). "
            "Main finding: voluntary torque, in 7 of them.",
        ),
        (light | {"text": "all days came later"}, "All days came later."),
    ):
        patched = "rigidimeter.analysis.report.page.traffic_light"
        monkeypatch.setattr(patched, lambda *_, shown=shown: shown)
        assert words in ParsedPage(page_text(study)).words()


def plots(shown: Shown) -> list[str]:
    return re.findall(r'<svg class="interval.*?</svg>', page_text(shown), re.DOTALL)


def test_a_difference_that_is_unknown_has_no_picture(study: Shown) -> None:
    assert len(plots(study)) == 6
    unknown = replace(study.result.comparisons[0], difference=math.nan)
    assert plots(of_result(study, comparisons=(unknown,))) == []


def test_the_plot_has_its_text_as_text_and_arrows_beyond_its_axis(study: Shown) -> None:
    one = next(c for c in study.result.comparisons if c.measure.name == "stiffness_nm_rad")
    inside = replace(one, value_reference=1.0, difference=-0.15, low=-0.4, high=0.1)
    (svg,) = plots(of_result(study, comparisons=(inside,)))
    assert re.findall(r">([^<>]+)</text>", svg) == ["−50 %", "0", "+50 %"]
    assert "arrow" not in svg
    (beyond,) = plots(of_result(study, comparisons=(replace(inside, low=-4.0),)))
    assert beyond.count("arrow") == 1
    untested = replace(inside, low=math.nan, high=math.nan)
    (unknown,) = plots(of_result(study, comparisons=(untested,)))
    assert "range" not in unknown
    assert "nan" not in unknown


def test_one_condition_has_its_own_first_screen(make_study, make_analysis) -> None:
    made = make_study([], analysis=make_analysis({"": 3}))
    page = ParsedPage(page_text(made))
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


def titles_of(shown: Shown) -> list[str]:
    """Return the parts that the bar of the page names."""
    (bar,) = re.findall(r"<nav.*?</nav>", page_text(shown), re.DOTALL)
    return re.findall(r'<a href="#[^>]*>([^<]+)</a>', bar)


def test_what_has_nothing_to_show_is_neither_on_the_page_nor_in_its_contents(study) -> None:
    titles = titles_of(bare(study))
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
    assert "Sensitivity" in titles_of(study)
    assert titles == list(dict.fromkeys(titles))
