"""Effect sizes of all measures with their intervals, and whether they differ from each other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from rigidimeter.analysis.report.contents import (
    Block,
    Figure,
    Section,
    from_study_folder,
    paragraph,
)
from rigidimeter.analysis.report.style import GREY, INK, styled, wrapped
from rigidimeter.analysis.statistics import Effects, largest_r
from rigidimeter.analysis.study import Comparison, StudyResult, result_table
from rigidimeter.core.words import INTERVAL, Column, Table, condition_name, interval, number

COHEN = (0.1, 0.3, 0.5)
"""What is called a small, a medium and a large r."""


def _blocks(result: StudyResult) -> Iterator[Block]:
    found = [(c, c.effects) for c in result.comparisons if c.effects is not None]
    if not found:
        return
    percent = f"{100 * found[0][1].confidence:g} %"
    yield Figure(
        "effects",
        f"Effect sizes r with {percent} intervals from resampling {result.resampled}. Dotted "
        "lines: small (0.1), medium (0.3) and large (0.5) effects. Grey ticks: the largest r that "
        "these group sizes allow, which differs between measures.",
        f"Effect sizes r with {percent} intervals. "
        f"{'; '.join(f'{c.measure.title} {_in_words(effects)}' for c, effects in found)}.",
        partial(forest, found, forest_label(result)),
    )
    without_overlap = [c.measure.title for c, effects in found if effects.method == "Newcombe"]
    if without_overlap:
        yield paragraph(
            f"{', '.join(without_overlap)}: the two conditions do not overlap, so resampling would "
            "give an interval of no width. The interval is Newcombe’s, which treats all values as "
            "independent.",
            "remark",
        )
    if result.differences:
        yield paragraph(
            "Does one measure separate the conditions better than another? r cannot answer that, "
            "because the group sizes limit it. The rank-biserial correlation can: it is the share "
            "of pairs of values that differ in one direction less the share that differ in the "
            "other. Its size is compared here."
        )
    yield Table(
        "effect_differences",
        "Differences between effect sizes (sizes of the rank-biserial correlations)",
        (
            Column("first_title", "Effect size of", "text"),
            Column("second_title", "less that of", "text"),
            Column("estimate", f"Difference {INTERVAL}", ends=("low", "high")),
            Column("p", "p", "p"),
            Column("p_holm", "p, Holm", "p"),
            Column("paired", "Same days", "label"),
        ),
        result_table(result, "effect_differences"),
        folding=True,
    )


def _in_words(found: Effects) -> str:
    return f"{number(found.r, 2)} {interval(found.r_low, found.r_high, 2)}"


def forest(found: Sequence[tuple[Comparison, Effects]], label: str) -> Drawing:
    """Draw one row for each measure, the first one at the top.

    Parameters
    ----------
    found : sequence of (Comparison, Effects)
        At least one. A thin grey tick on either side is the largest r that the group sizes allow.
    label : str
        Of the horizontal axis.
    """
    with styled():
        figure = Drawing(figsize=forest_size(len(found)))
        draw_forest(figure.add_subplot(), found, label)
    return figure


def forest_label(result: StudyResult) -> str:
    """Return what the horizontal axis shows."""
    reference, other = condition_name(result.reference), condition_name(result.other)
    return f"Effect size r; above zero: {reference} larger than {other}"


def forest_size(rows: int) -> tuple[float, float]:
    """Return the size of the figure in inches."""
    return 7.4, 0.9 + 0.42 * rows


def draw_forest(axes: Axes, found: Sequence[tuple[Comparison, Effects]], label: str) -> None:
    """Draw `forest` on axes; the numbers are to the right of them."""
    most = [largest_r(effects.test.n_x, effects.test.n_y) for _, effects in found]
    for size in COHEN:
        for x in (-size, size):
            axes.axvline(x, color=GREY, linewidth=0.6, dashes=(1, 3), zorder=0)
    axes.axvline(0.0, color=GREY, linewidth=0.9, zorder=1)
    for place, (_, effects) in enumerate(found):
        low, high = effects.r_low, effects.r_high
        if np.isfinite(low) and np.isfinite(high):
            axes.hlines(place, low, high, color=INK, linewidth=1.6)
            axes.plot([low, high], [place] * 2, "|", color=INK, markersize=7)
        axes.plot(effects.r, place, "s", color=INK, markersize=6)
        for x in (-most[place], most[place]):
            axes.plot(x, place, "|", color=GREY, markersize=13, markeredgewidth=0.7, alpha=0.7)
        axes.text(
            1.02,
            place,
            _in_words(effects),
            transform=axes.get_yaxis_transform(),
            va="center",
            fontsize=8,
        )
    values = [x for _, effects in found for x in (effects.r_low, effects.r_high, effects.r)]
    drawn = [x for x in values if np.isfinite(x)]
    reach = 1.05 * max(0.5, *most, *map(abs, drawn))
    low = -reach if min(drawn) < -0.15 else min(1.1 * min(drawn), -0.15)
    high = reach if max(drawn) > 0.15 else max(1.1 * max(drawn), 0.15)
    axes.set_xlim(low, high)
    axes.set_yticks(
        range(len(found)),
        [
            f"{wrapped(c.measure.title, 28, 2)}\nn = {effects.test.n_x} and {effects.test.n_y}"
            for c, effects in found
        ],
    )
    axes.set_ylim(len(found) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False)
    axes.set_xlabel(label)


SECTION = Section("effects", "Effect sizes", _blocks, from_study_folder)
