"""The figures of a study folder: every point is drawn, and grey print tells conditions apart."""

import dataclasses
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from tests.unit.reporting.cohorts import Design, made_study

from rigidimeter.reporting.figures import condition_colours, condition_markers, svg_text
from rigidimeter.reporting.figures.day_points import DayStrip, days
from rigidimeter.reporting.figures.forest import Effect, forest
from rigidimeter.reporting.figures.method_sensitivity import Road, sensitivity
from rigidimeter.reporting.figures.rating_points import Mark, Mean, ratings
from rigidimeter.reporting.pictures import (
    day_pictures,
    effect_pictures,
    rating_pictures,
    sensitivity_pictures,
)
from rigidimeter.study import StudyResult

NAMES = ("OFF", "DBS")
COLOURS, MARKERS = condition_colours(NAMES), condition_markers(NAMES)
SMALL = Design(days=(3, 2), epochs=(4, 4), scores=(3, 3))


@pytest.fixture(scope="module")
def study() -> StudyResult:
    return made_study(SMALL)


def points(axes, marker: str) -> list[float]:
    return [
        float(y) for line in axes.lines if line.get_marker() == marker for y in line.get_ydata()
    ]


def test_conditions_differ_in_colour_and_in_shape() -> None:
    assert len(set(COLOURS.values())) == len(set(MARKERS.values())) == 2


def strip(day: str, condition: str, *values: float, subject: str = "M") -> DayStrip:
    q1, median, q3 = np.quantile(values, [0.25, 0.5, 0.75])
    return DayStrip(subject, day, condition, values, median, q1, q3)


def test_every_epoch_and_every_median_of_a_day_is_drawn() -> None:
    figure = days(
        "B (N·m·s/rad)",
        [strip("1", "OFF", 1.0, 2.0, 4.0), strip("2", "DBS", 3.0), strip("3", "OFF", 5.0, 6.0)],
        COLOURS,
        MARKERS,
    )
    (axes,) = figure.axes
    assert sorted(points(axes, MARKERS["OFF"])) == [1.0, 2.0, 2.0, 4.0, 5.0, 5.5, 6.0]
    assert sorted(points(axes, MARKERS["DBS"])) == [3.0, 3.0]
    assert [text.get_text() for text in axes.get_xticklabels()] == ["1", "2", "3"]
    low, high = axes.get_ylim()
    assert low < 1.0
    assert high > 6.0


def test_the_same_days_give_the_same_text() -> None:
    one, two = (
        svg_text(days("B", [strip("1", "OFF", 1.0, 2.0)], COLOURS, MARKERS)) for _ in range(2)
    )
    assert one == two


def test_both_conditions_of_one_day_share_its_place_side_by_side() -> None:
    figure = days("B", [strip("1", "OFF", 1.0), strip("1", "DBS", 2.0)], COLOURS, MARKERS)
    (axes,) = figure.axes
    assert [text.get_text() for text in axes.get_xticklabels()] == ["1"]
    off, dbs = (
        [x for line in axes.lines if line.get_marker() == MARKERS[n] for x in line.get_xdata()]
        for n in NAMES
    )
    assert max(off) < min(dbs)


def test_subjects_stand_apart_and_many_days_go_on_in_another_row() -> None:
    strips = [strip(str(k), "OFF", float(k), subject=s) for s in ("M", "N") for k in range(20)]
    figure = days("B", strips, COLOURS, MARKERS)
    assert len(figure.axes) == 2
    assert [axes.texts[0].get_text() for axes in figure.axes] == ["M", "N"]
    long = days("B", [strip(str(k), "OFF", 1.0) for k in range(60)], COLOURS, MARKERS)
    assert sum(len(axes.get_xticks()) for axes in long.axes) == 60


def test_a_forest_has_a_row_for_each_effect_in_their_order() -> None:
    effects = [
        Effect("Damping", "n = 4", 0.35, 0.1, 0.6, 0.75, "0.35"),
        Effect("Stiffness", "n = 4", -0.9, -0.95, float("nan"), 0.8, "−0.9"),
    ]
    (axes,) = forest(effects, "r").axes
    assert points(axes, "s") == [0, 1]
    labels = [text.get_text() for text in axes.get_yticklabels()]
    assert labels == ["Damping\nn = 4", "Stiffness\nn = 4"]
    assert axes.get_ylim()[0] > axes.get_ylim()[1]  # the first at the top
    assert axes.get_xlim()[0] < -0.95


def test_equal_ratings_stand_side_by_side() -> None:
    marks = [Mark("OFF", "A", 2.0, 1.5)] * 3 + [Mark("DBS", "B", 1.0, 1.2)]
    means = {"OFF": Mean(1.5, 1.0, 2.0), "DBS": Mean(1.2, 0.5, 1.9)}
    raw, corrected = ratings(marks, means, COLOURS, "95 % interval").axes
    across = [x for line in raw.lines if len(line.get_xdata()) == 3 for x in line.get_xdata()]
    assert len(set(across)) == 3
    assert points(corrected, "_") == [1.5, 1.2]


def test_sensitivity_keeps_methods_together_and_marks_the_chosen_one() -> None:
    roads = [
        Road("published", False, 0.2, 0.1, 0.3, False),
        Road("iv", True, 0.0, -0.1, 0.1, True),
        Road("published", True, 0.25, 0.1, 0.4, False),
    ]
    (axes,) = sensitivity({"B (N)": roads}, "Shift").axes
    labels = [text.get_text() for text in axes.get_yticklabels()]
    assert labels == ["published, J fixed", "published, J free", "iv, J fixed"]
    assert points(axes, "s") == [2, 0]
    assert points(axes, "o") == [1]
    low, high = axes.get_xlim()
    assert low < -0.1
    assert high > 0.4


def test_pictures_of_a_study(study: StudyResult) -> None:
    shown = [
        *effect_pictures(study),
        *day_pictures(study),
        *rating_pictures(study),
        *sensitivity_pictures(study),
    ]
    assert [picture.name for picture in shown] == [
        "effects",
        "days_inertia_kg_m2",
        "days_damping_nm_s_rad",
        "days_stiffness_nm_rad",
        "days_impulse_nm_s",
        "days_work_j",
        "ratings",
        "sensitivity",
    ]
    for picture in shown:
        ET.fromstring(picture.svg)
        assert picture.alt
        assert picture.caption
    assert "17 included epochs of 5 days" in shown[1].caption


def test_virtual_data_say_so_in_every_figure(study: StudyResult) -> None:
    virtual = dataclasses.replace(study, virtual=True)
    for draw in (effect_pictures, rating_pictures, sensitivity_pictures):
        (plain,), (marked,) = draw(study), draw(virtual)
        assert "virtual data" not in plain.svg
        assert "<!-- virtual data -->" in marked.svg


def test_nothing_is_drawn_of_what_is_not_there(study: StudyResult) -> None:
    for without in (
        dataclasses.replace(study, sessions=(), ratings=None, sensitivity=()),
        empty(study),
    ):
        for draw in (effect_pictures, day_pictures, rating_pictures, sensitivity_pictures):
            assert draw(without) == []


def empty(study: StudyResult) -> StudyResult:
    return dataclasses.replace(study, comparisons=(), ratings=None, sensitivity=())
