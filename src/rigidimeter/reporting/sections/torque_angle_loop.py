"""Torque against angle under an imposed sinusoid (Fig. 7)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial

import numpy as np
from matplotlib.figure import Figure as Drawing

from rigidimeter.estimation import Cycles, scoring_cycles
from rigidimeter.reporting.contents import Block, Figure, Section, paragraph
from rigidimeter.reporting.numbers import condition_name, number
from rigidimeter.reporting.representative import analysed_epoch, place, representatives, slug
from rigidimeter.reporting.style import condition_colours, note, styled
from rigidimeter.study import StudyResult

_POINTS = 2000
"""Enough for any number of cycles at the size of the figure."""


def _blocks(result: StudyResult) -> Iterator[Block]:
    colours = condition_colours(result.condition_names)
    found = [
        (score, scoring_cycles(epoch, result.settings.scores))
        for score in representatives(result, result.analysis.scores, lambda score: score.work_j)
        if (epoch := analysed_epoch(result, score)) is not None
    ]
    if not found:
        return
    yield paragraph(
        "Torque against angle during the imposed sinusoid, both band-pass filtered in the same "
        "way. The area of a loop is the work of one cycle. All panels have the same axes."
    )
    limits = loop_limits(cycles for _, cycles in found)
    for position, (score, cycles) in enumerate(found, start=1):
        name = condition_name(score.condition)
        work = f"{number(score.work_j)} J"
        yield Figure(
            f"loop_{position}_{slug(score.condition)}",
            f"{name}: {place(result, score)}, the included epoch with the median work; "
            f"{cycles.n_cycles} cycles.",
            f"{name}: torque against angle of epoch {score.epoch}, {cycles.n_cycles} cycles "
            f"at {number(cycles.frequency_hz, 3)} Hz, work {work} per cycle.",
            partial(loop, cycles, colours[score.condition], limits, f"{work} per cycle"),
            "small",
        )


def loop_limits(epochs: Iterable[Cycles]) -> tuple[float, float]:
    """Return how far the axes must reach to hold these loops: angle in deg, torque in N·m."""
    sizes = [
        (float(np.max(np.abs(np.degrees(c.angle_rad)))), float(np.max(np.abs(c.torque_nm))))
        for c in epochs
    ]
    return 1.08 * max(angle for angle, _ in sizes), 1.08 * max(torque for _, torque in sizes)


def loop(cycles: Cycles, colour: str, limits: tuple[float, float], remark: str = "") -> Drawing:
    """Draw the loops of an epoch; their mean area is the work per cycle.

    Parameters
    ----------
    cycles : Cycles
        The cycles that were scored.
    colour : str
        Of the condition.
    limits : (float, float)
        How far the axes reach either way, in deg and N·m; the same for all conditions.
    remark : str
        A few words above the axes.
    """
    every = slice(None, None, max(1, cycles.time_s.size // _POINTS))
    with styled():
        figure = Drawing(figsize=(3.4, 3.0))
        axes = figure.add_subplot()
        axes.plot(
            np.degrees(cycles.angle_rad[every]),
            cycles.torque_nm[every],
            color=colour,
            linewidth=0.8,
        )
        axes.set_xlim(-limits[0], limits[0])
        axes.set_ylim(-limits[1], limits[1])
        axes.set_xlabel("Angle (deg)")
        axes.set_ylabel("Torque (N·m)")
        note(axes, remark)
    return figure


SECTION = Section("loops", "Torque–angle loops", _blocks)
