"""Figures and results that need the recordings of the animal, drawn from the virtual study.

The recordings were never published, so the verdict of these rows is that they cannot be computed.
They show the same figure, with the same axes, of data whose origin stands in the figure itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from rigidimeter.estimation import scoring_cycles
from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import AGREES, Picture, Row, within_percent
from rigidimeter.paper.context import Workshop
from rigidimeter.paper.printed_effects import rating_model
from rigidimeter.reporting.numbers import number, p_value
from rigidimeter.reporting.sections.distribution import distribution
from rigidimeter.reporting.sections.torque_angle_loop import loop, loop_limits
from rigidimeter.reporting.style import condition_colours, svg_text
from rigidimeter.statistics import difference, summarise
from rigidimeter.study import Comparison

__all__ = ["ROWS"]

_COLOURS = condition_colours(("OFF", "DBS"))
_MISSING = "The recordings of the animal were not published; a virtual study of the same design "


class _Comparison(NamedTuple):
    """A figure of one measure in OFF and DBS."""

    row: str
    figure: str
    measure: str
    label: str
    factor: float
    paper: str


_DISTRIBUTIONS = (
    _Comparison("fig-5b", "Fig. 5(b)", "impulse_nm_s", "Angular impulse (N·m·s)", 1.0,
                "angular impulse lower in DBS, p = 4.3e-4"),
    _Comparison("fig-5c", "Fig. 5(c)", "work_j", "Work (J)", 1.0,
                "work lower in DBS, p = 5.6e-4 (text)"),
    _Comparison("fig-8a", "Fig. 8(a)", "inertia_kg_m2", "Inertia J (10⁻³ kg·m²)", 1e3,
                "no significant difference of the inertia, p = 0.165"),
    _Comparison("fig-8b", "Fig. 8(b)", "damping_nm_s_rad", "Viscous damping B (N·m·s/rad)", 1.0,
                "viscosity lower in DBS, p = 5.0e-4"),
    _Comparison("fig-8c", "Fig. 8(c)", "stiffness_nm_rad", "Stiffness K (N·m/rad)", 1.0,
                "stiffness lower in DBS, p = 1.8e-4 (the caption calls it viscosity)"),
)  # fmt: skip


def _p_and_r(compared: Comparison) -> tuple[float, str]:
    """Return p and the effect size in words; NaN and a dash where there are too few epochs."""
    if compared.test is None:
        return float("nan"), "–"
    return compared.test.p, f"{compared.test.r:.2f}".replace("-", "−")


def _p_of_days(measure: str, workshop: Workshop) -> float:
    """Return p of the test in which days count; NaN where there are too few."""
    try:
        return workshop.day_test(measure).p
    except ValueError:
        return float("nan")


def _distribution_row(item: _Comparison, workshop: Workshop) -> Row:
    compared = workshop.comparison(item.measure)
    p, r = _p_and_r(compared)
    summaries = compared.summaries
    values = {
        name: [item.factor * value for value in compared.values[name]] for name in ("OFF", "DBS")
    }
    medians = " and ".join(
        f"{number(summaries[name].median)} ({name}, n = {summaries[name].n})" for name in values
    )
    by_day = p_value(_p_of_days(item.measure, workshop))
    remark = f"virtual data; p = {p_value(p)} (epochs), {by_day} (days)"
    figure = distribution(item.label, values, _COLOURS, remark)
    figure.set_size_inches(3.6, 3.2)
    return Row(
        id=item.row,
        source=item.figure,
        paper=f"median and interquartile range; {item.paper}",
        ours=f"virtual study: medians {medians} {compared.measure.unit}; p = {p_value(p)}, "
        f"r = {r}; when days count, not epochs, p = {by_day}",
        reading="Two-sided rank-sum test with tie and continuity correction; every epoch a point. "
        "Beside it a mixed model with an offset for every day.",
        checks=(),
        unpublished=_MISSING + "stands in for them, with a subject that we chose.",
        pictures=(
            Picture(
                item.row,
                svg_text(figure),
                f"{item.label} of every virtual epoch in OFF and DBS, with median and quartiles.",
                f"{item.figure} from virtual data: epochs, median and quartiles.",
            ),
        ),
        virtual=True,
    )


def figure_5a(workshop: Workshop) -> Row:
    """Make the row: the ratings, corrected for the examiners."""
    ratings = workshop.study.ratings
    fit = rating_model(ratings)
    contrast = difference(fit, "OFF", "DBS")
    by_day = difference(rating_model(ratings, days=True), "OFF", "DBS")
    values = {
        name: [
            float(score)
            for score, rating in zip(fit.corrected, ratings, strict=True)
            if rating.condition == name
        ]
        for name in ("OFF", "DBS")
    }
    medians = " and ".join(
        f"{number(summarise(v).median, 3)} ({name}, n = {len(v)})" for name, v in values.items()
    )
    offsets = ", ".join(f"{name} {b:+.2f}" for name, b in fit.offsets["examiner"].items())
    figure = distribution(
        "Corrected mUPDRS score",
        values,
        _COLOURS,
        f"virtual data; p = {p_value(contrast.p_residual)} (paper's model), "
        f"{p_value(by_day.p_kenward_roger)} (days)",
    )
    figure.set_size_inches(3.6, 3.2)
    return Row(
        id="fig-5a",
        source="Fig. 5(a), Sec. 3.1",
        paper="median and interquartile range of corrected scores; lower in DBS, p = 0.020",
        ours=f"virtual ratings: medians {medians}; offsets of the examiners "
        f"{offsets.replace('-', '−')}; contrast OFF − DBS {number(contrast.estimate, 3)}, "
        f"p = {p_value(contrast.p_residual)}; with an offset for every day "
        f"p = {p_value(by_day.p_kenward_roger)}",
        reading="Score less the examiner's predicted offset; F-test of the contrast. The scores of "
        "one day share its state, so the model with days is the one that holds.",
        checks=(),
        unpublished="The ratings were not published; virtual ones of the same number stand in.",
        pictures=(
            Picture(
                "fig-5a",
                svg_text(figure),
                "Corrected virtual ratings in OFF and DBS, with median and quartiles.",
                "Fig. 5(a) from virtual ratings: each rating, median and quartiles.",
            ),
        ),
        virtual=True,
    )  # fmt: skip


def figure_7(workshop: Workshop) -> Row:
    """Make the row: torque against angle in the epoch of median work of each condition."""
    settings, scores = workshop.study.settings, workshop.analysis.scores
    chosen = {}
    for name in ("OFF", "DBS"):
        ranked = sorted((s for s in scores if s.condition == name), key=lambda s: s.work_j)
        chosen[name] = ranked[(len(ranked) - 1) // 2]
    by_name = {(epoch.source, epoch.label): epoch for epoch in workshop.study.epochs}
    cycles = {
        name: scoring_cycles(by_name[score.source, score.epoch], settings.scores)
        for name, score in chosen.items()
    }
    limits = loop_limits(cycles.values())
    pictures = tuple(
        Picture(
            f"fig-7-{name.lower()}",
            svg_text(loop(cycles[name], _COLOURS[name], limits, f"{name}, virtual data")),
            f"Torque against angle in {name}: eight loops of a virtual epoch.",
            f"Fig. 7 from virtual data, {name}: the epoch of median work, eight cycles, "
            f"{number(chosen[name].work_j, 3)} J a cycle.",
        )
        for name in chosen
    )
    works = " and ".join(f"{number(s.work_j, 3)} J ({name})" for name, s in chosen.items())
    return Row(
        id="fig-7",
        source="Fig. 7, Sec. 3.3",
        paper="sample traces of torque against angle; asymmetric at full flexion and extension",
        ours=f"virtual epochs of median work: {works}; symmetric, since the virtual arm is linear",
        reading="Torque and angle pass the same zero-phase band.",
        checks=(),
        unpublished=_MISSING + "has no asymmetry: Eq. 3 is linear.",
        pictures=pictures,
        virtual=True,
    )


def equation_7(workshop: Workshop) -> Row:
    """Make the row: two stages: J at the median of all epochs, then B and K alone."""
    analysis = workshop.analysis
    counted = [fit for fit in analysis.fixed_inertia if fit.outcome.included]
    held = (
        float(np.median([fit.damping_nm_s_rad for fit in counted])),
        float(np.median([fit.stiffness_nm_rad for fit in counted])),
    )
    return Row(
        id="eq-7",
        source="Eq. 7, Sec. 2.4.4, Fig. 8",
        paper="J fixed at the median of all epochs of all conditions, 0.0045 kg·m²",
        ours=f"median J of {len(analysis.fits)} virtual epochs {number(analysis.inertia_kg_m2)} "
        f"kg·m²; with it held, all epochs together give B {number(held[0])} N·m·s/rad and "
        f"K {number(held[1])} N·m/rad (medians)",
        reading="The virtual arm has 0.0045 kg·m² as its median; epochs that do not count in the "
        "first stage do not in the second.",
        checks=(
            within_percent("Median J", "kg·m²", printed.FIG_8_INERTIA, analysis.inertia_kg_m2, 5.0),
        ),
        because={AGREES: "The two stages return the inertia that was put in."},
        virtual=True,
    )


def table_2(workshop: Workshop) -> Row:
    """Make the row: the tests of Table 2 on the virtual study."""
    contrast = difference(rating_model(workshop.study.ratings), "OFF", "DBS")
    parts = [f"mUPDRS p = {p_value(contrast.p_residual)} (contrast)"]
    for item in _DISTRIBUTIONS:
        p, r = _p_and_r(workshop.comparison(item.measure))
        by_day = p_value(_p_of_days(item.measure, workshop))
        parts.append(f"{item.label.partition(' (')[0]} p = {p_value(p)}, r = {r} ({by_day})")
    return Row(
        id="table-2",
        source="Table 2",
        paper="mUPDRS .04, .18; impulse 4.3e-4, .30; work 2.8e-4, .31; viscosity 4.0e-4, .35; "
        "stiffness 1.8e-3, .37 (p, r)",
        ours="virtual study, in parentheses p when days count: " + "; ".join(parts),
        reading="Whether the printed p, r and N belong together is in the rows table-2-….",
        checks=(),
        unpublished=_MISSING + "shows that the chain from epochs to tests runs, not what DBS does.",
        virtual=True,
    )


def _bound(item: _Comparison) -> Callable[[Workshop], Row]:
    return lambda workshop: _distribution_row(item, workshop)


ROWS: Mapping[str, Callable[[Workshop], Row]] = {
    "eq-7": equation_7,
    "fig-5a": figure_5a,
    "fig-7": figure_7,
    **{item.row: _bound(item) for item in _DISTRIBUTIONS},
    "table-2": table_2,
}
