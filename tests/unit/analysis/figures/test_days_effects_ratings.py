"""The figures of a study folder: every point is drawn, and grey print separates conditions."""

from typing import Any
from xml.etree import ElementTree as ET

import pytest
from matplotlib.figure import Figure
from tests.unit.analysis.report.cohorts import Design, bare, made_ratings, made_study

from rigidimeter.analysis.figures import (
    Values,
    condition_colours,
    condition_markers,
    day_rows,
    draw_days,
    draw_effects,
    draw_methods,
    draw_ratings,
    drawn,
    effect_rows,
    svg_text,
)
from rigidimeter.analysis.report import SECTIONS, Shown
from rigidimeter.analysis.report import Figure as PageFigure
from rigidimeter.analysis.study import Measure, as_rows, counting

NAMES = ("OFF", "DBS")
COLOURS, MARKERS = condition_colours(NAMES), condition_markers(NAMES)
MEASURE = Measure("b", "B", "N·m·s/rad", "fits")
SMALL = Design(days=(3, 2), epochs=(4, 4), scores=(3, 3))


SHOWN = ("effects", "days", "ratings", "sensitivity")


def figures(shown: Shown) -> list[PageFigure]:
    return [
        block
        for section in SECTIONS
        if section.name in SHOWN
        for block in section.blocks(shown)
        if isinstance(block, PageFigure)
    ]


@pytest.fixture(scope="module")
def study() -> Shown:
    return made_study(SMALL)


def points(axes, marker: str) -> list[float]:
    return [
        float(y) for line in axes.lines if line.get_marker() == marker for y in line.get_ydata()
    ]


def test_conditions_differ_in_colour_and_in_shape() -> None:
    assert len(set(COLOURS.values())) == len(set(MARKERS.values())) == 2


def strip(day: str, condition: str, *values: float, subject: str = "M") -> list[dict[str, Any]]:
    about = {"condition": condition, "subject": subject, "day": day, "measure": MEASURE.name}
    return [about | {"method": "iv", "value": value} for value in values]


def days(*strips: list[dict[str, Any]]) -> Figure:
    """Draw what was measured on these days."""
    rows = as_rows(row for own in strips for row in own)
    v = Values(MEASURE, NAMES, counting(rows, MEASURE.name))
    return drawn((7.4, 2.5), draw_days, v, NAMES, rows=len(day_rows(v)))


def test_every_epoch_and_every_median_of_a_day_is_drawn() -> None:
    (axes,) = days(
        strip("1", "OFF", 1.0, 2.0, 4.0), strip("2", "DBS", 3.0), strip("3", "OFF", 5.0, 6.0)
    ).axes
    assert sorted(points(axes, MARKERS["OFF"])) == [1.0, 2.0, 2.0, 4.0, 5.0, 5.5, 6.0]
    assert sorted(points(axes, MARKERS["DBS"])) == [3.0, 3.0]
    assert [text.get_text() for text in axes.get_xticklabels()] == ["1", "2", "3"]
    assert axes.get_ylabel() == "B\n(N·m·s/rad)"
    low, high = axes.get_ylim()
    assert low < 1.0
    assert high > 6.0


def test_both_conditions_of_one_day_share_its_place_side_by_side() -> None:
    (axes,) = days(strip("1", "OFF", 1.0), strip("1", "DBS", 2.0)).axes
    assert [text.get_text() for text in axes.get_xticklabels()] == ["1"]
    off, dbs = (
        [x for line in axes.lines if line.get_marker() == MARKERS[n] for x in line.get_xdata()]
        for n in NAMES
    )
    assert max(off) < min(dbs)
    (joined,) = [line for line in axes.lines if line.get_marker() == "None"]
    assert list(joined.get_ydata()) == [1.0, 2.0]


def test_the_reference_is_at_the_left_on_a_day_that_began_with_the_other() -> None:
    (axes,) = days(
        strip("1", "DBS", 2.0), strip("1", "OFF", 1.0), strip("2", "OFF", 1.0), strip("2", "DBS", 2)
    ).axes
    off, dbs = (
        [x for line in axes.lines if line.get_marker() == MARKERS[n] for x in line.get_xdata()]
        for n in NAMES
    )
    assert max(x for x in off if x < 0.5) < min(x for x in dbs)
    assert max(off) < max(dbs)
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["OFF", "DBS"]


def test_subjects_stand_apart_and_many_days_go_on_in_another_row() -> None:
    strips = [strip(str(k), "OFF", float(k), subject=s) for s in ("M", "N") for k in range(20)]
    figure = days(*strips)
    assert len(figure.axes) == 2
    assert [axes.texts[0].get_text() for axes in figure.axes] == ["M", "N"]
    long = days(*(strip(str(k), "OFF", 1.0) for k in range(60)))
    assert sum(len(axes.get_xticks()) for axes in long.axes) == 60


def test_a_forest_has_a_row_for_each_effect_in_their_order(study: Shown) -> None:
    one, two = effect_rows(study.result)[:2]
    shown = [one, {**two, "r": 0.9, "r_low": float("nan"), "r_high": 0.95}]
    (axes,) = drawn((7.4, 2.0), draw_effects, shown, "r").axes
    assert points(axes, "s") == [0, 1]
    labels = [text.get_text() for text in axes.get_yticklabels()]
    assert labels[0] == f"Inertia J\nn = {one['n_reference']} and {one['n_other']}"
    assert axes.get_ylim()[0] > axes.get_ylim()[1]  # the first at the top
    assert axes.get_xlim()[0] < -0.95
    # The interval with one end unknown is not drawn.
    assert sum(len(lines.get_segments()) for lines in axes.collections) == 1


def test_equal_ratings_are_drawn_side_by_side_and_the_means_beside_them() -> None:
    rows = tuple(
        (condition, examiner, "M", day, score)
        for condition, examiner, day, score in (
            *[("OFF", "A", str(k), 2.0) for k in range(3)],
            ("OFF", "B", "0", 1.5),
            ("OFF", "B", "1", 2.0),
            ("DBS", "A", "4", 1.5),
            ("DBS", "A", "5", 0.5),
            ("DBS", "B", "4", 1.0),
        )
    )
    means = {"OFF": (1.9, 1.5, 2.3), "DBS": (1.0, 0.6, 1.4)}
    shown = made_ratings(rows), means, NAMES
    raw, corrected = drawn((7.4, 3.3), draw_ratings, *shown, columns=2).axes
    equal = [
        x
        for line in raw.lines
        for x, y in line.get_xydata()
        if y == 2.0 and len(line.get_xdata()) == 3
    ]
    assert len(set(equal)) == 3
    assert points(corrected, "_") == [1.9, 1.0]


def test_what_is_concluded_from_is_above_other_methods_and_those_with_j_held() -> None:
    names = ("method", "inertia", "shift", "shift_low", "shift_high", "chosen")
    rows = [
        {"measure": "b", "title": "B", "unit": "N"} | dict(zip(names, row, strict=True))
        for row in (
            ("published", "free", 0.2, 0.1, 0.3, False),
            ("iv", "fixed", 0.0, -0.1, 0.1, True),
            ("published", "fixed", 0.25, 0.1, 0.4, False),
        )
    ]
    (axes,) = drawn((7.4, 2.0), draw_methods, rows, "Shift").axes
    assert axes.get_title(loc="left") == "B (N)"
    labels = [text.get_text() for text in axes.get_yticklabels()]
    assert labels == ["iv, J fixed", "published, J free", "published, J fixed"]
    assert points(axes, "s") == [0, 2]
    assert points(axes, "o") == [1]
    low, high = axes.get_xlim()
    assert low < -0.4  # other − reference: the shifts are turned
    assert high > 0.1


def test_figures_of_a_study(study: Shown) -> None:
    shown = figures(study)
    assert [figure.name for figure in shown] == [
        "days_stiffness_nm_rad",
        "days_damping_nm_s_rad",
        "days_inertia_kg_m2",
        "days_impulse_nm_s",
        "days_work_j",
        "sensitivity",
        "effects",
        "ratings",
    ]
    for figure in shown:
        ET.fromstring(svg_text(figure.draw()))
        assert figure.alt
        assert figure.caption
    assert "17 included epochs of 5 days" in shown[0].caption


def test_nothing_is_drawn_of_what_is_not_there(study: Shown) -> None:
    assert not {"sensitivity", "effects", "ratings"} & {one.name for one in figures(bare(study))}
