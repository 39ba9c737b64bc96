"""Torque against angle under an imposed sinusoid (Fig. 7)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from rigidimeter.analysis.estimation import Cycles, scoring_cycles
from rigidimeter.analysis.report.contents import Block, Figure, Section, paragraph
from rigidimeter.analysis.report.representative import place
from rigidimeter.analysis.report.style import condition_colours, listed, note, styled
from rigidimeter.analysis.study import StudyResult
from rigidimeter.analysis.study.examples import analysed_epoch, representative_scores
from rigidimeter.core.words import condition_name, number

_POINTS = 2000
"""Enough for any number of cycles at the size of the figure."""


def _blocks(result: StudyResult) -> Iterator[Block]:
    colours = condition_colours(result.condition_names)
    found = [
        (score, scoring_cycles(epoch, result.settings.scores))
        for score in representative_scores(result)
        if (epoch := analysed_epoch(result, score)) is not None
    ]
    if not found:
        return
    yield paragraph(
        "Torque against angle during the imposed sinusoid, both band-pass filtered in the same "
        "way. The area of a loop is the work of one cycle."
    )
    epochs, works = [], []
    for score, cycles in found:
        name = condition_name(score.condition)
        works.append(f"{name}: {number(score.work_j)} J per cycle")
        epochs.append(
            f"{name}: {place(result, score)}, {cycles.n_cycles} cycles at "
            f"{number(cycles.frequency_hz, 3)} Hz"
        )
    yield Figure(
        "loops",
        f"The included epochs with the median work. {'; '.join(epochs)}.",
        f"Torque against angle. {'; '.join(works)}. {'; '.join(epochs)}.",
        partial(
            loops,
            [
                (words, cycles, colours[score.condition])
                for words, (score, cycles) in zip(works, found, strict=True)
            ],
        ),
    )


def loop_limits(epochs: Iterable[Cycles]) -> tuple[float, float]:
    """Return how far the axes must reach to hold these loops: angle in deg, torque in N·m."""
    sizes = [
        (float(np.max(np.abs(np.degrees(c.angle_rad)))), float(np.max(np.abs(c.torque_nm))))
        for c in epochs
    ]
    return 1.08 * max(angle for angle, _ in sizes), 1.08 * max(torque for _, torque in sizes)


def loops(shown: Sequence[tuple[str, Cycles, str]]) -> Drawing:
    """Draw the loops of an epoch of each condition in one panel.

    Parameters
    ----------
    shown : sequence of (str, Cycles, str)
        What the legend says of an epoch, the cycles that were scored, and the colour.
    """
    limits = loop_limits(cycles for _, cycles, _ in shown)
    with styled():
        figure = Drawing(figsize=(5.2, 3.6))
        axes = figure.add_subplot()
        for label, cycles, colour in shown:
            _draw(axes, cycles, colour, limits, listed(label))
        figure.legend(loc="outside upper left", ncols=min(len(shown), 2))
    return figure


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
    with styled():
        figure = Drawing(figsize=(3.4, 3.0))
        axes = figure.add_subplot()
        _draw(axes, cycles, colour, limits)
        note(axes, remark)
    return figure


def _draw(
    axes: Axes, cycles: Cycles, colour: str, limits: tuple[float, float], label: str = ""
) -> None:
    every = slice(None, None, max(1, cycles.time_s.size // _POINTS))
    angle_deg, torque_nm = np.degrees(cycles.angle_rad[every]), cycles.torque_nm[every]
    axes.plot(angle_deg, torque_nm, color=colour, linewidth=0.8, label=label or None)
    axes.set_xlim(-limits[0], limits[0])
    axes.set_ylim(-limits[1], limits[1])
    axes.set_xlabel("Angle (deg)")
    axes.set_ylabel("Torque (N·m)")


SECTION = Section("loops", "Torque–angle loops", _blocks)
