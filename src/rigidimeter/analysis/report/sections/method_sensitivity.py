"""The shift of each measure by every method, with J fixed and with J free."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.ticker import MaxNLocator

from rigidimeter.analysis.report.contents import (
    Block,
    Figure,
    Section,
    bullets,
    from_study_folder,
    paragraph,
)
from rigidimeter.analysis.report.style import GREY, INK, drawable, styled, wrapped
from rigidimeter.analysis.study import (
    Measure,
    SensitivityRow,
    StudyResult,
    method_caveats,
    result_table,
)
from rigidimeter.core.words import (
    INTERVAL,
    Column,
    Table,
    axis_unit,
    condition_name,
    interval,
    number,
)

_OTHER = "#0072B2"
MOST_BESIDE = 3


def _blocks(result: StudyResult) -> Iterator[Block]:
    found = result.sensitivity
    if not found:
        return
    words = "; ".join(
        f"{row.measure.title}, {row.method}, J {row.inertia}: {number(row.shift, 3)} "
        f"{interval(row.shift_low, row.shift_high, 3)} {row.measure.unit}"
        for row in found
    )
    shift = f"Shift, {condition_name(result.reference)} − {condition_name(result.other)}"
    yield Figure(
        "sensitivity",
        "The Hodges–Lehmann shift with its interval by each method, in the unit above the "
        "panel. Filled squares: J held at its median; open circles: J estimated in each epoch. "
        "Black: the method of this report.",
        f"Shifts by method. {words}.",
        partial(sensitivity, found, shift),
        "tall",
    )
    titles = {row.measure.name: row.measure.title for row in found}
    caveats = [f"{titles[name]}: {text}." for name, text in method_caveats(found).items() if text]
    if caveats:
        yield bullets(caveats)
        yield paragraph(
            "A difference counts as shown if p of the test by days is below 0.05, not adjusted; "
            "where days could not be tested, if p over epochs is.",
            "remark",
        )
    yield Table(
        "sensitivity",
        "The shift by each method",
        (
            Column("title", "Measure", "text", below="unit"),
            Column("method", "Method", "check"),
            Column("inertia", "J", "label"),
            Column("n_reference", f"n {condition_name(result.reference)}", "count"),
            Column("n_other", f"n {condition_name(result.other)}", "count"),
            Column("shift", f"Shift {INTERVAL}", ends=("shift_low", "shift_high")),
            Column("r", "r"),
            Column("p", "p, epochs", "p"),
            Column("p_day", "p, days", "p"),
            Column("chosen", "Used here", "label"),
        ),
        result_table(result, "sensitivity"),
    )


def sensitivity(found: Sequence[SensitivityRow], label: str) -> Drawing:
    """Draw a panel for each measure with one row for each method; zero is marked.

    Parameters
    ----------
    found : sequence of SensitivityRow
        At least one.
    label : str
        Of the horizontal axes, without a unit.
    """
    measures: dict[Measure, list[SensitivityRow]] = {}
    for row in found:
        measures.setdefault(row.measure, []).append(row)
    methods = [
        (method, inertia)
        for method in dict.fromkeys(row.method for row in found)
        for inertia in ("fixed", "free")
        if any((row.method, row.inertia) == (method, inertia) for row in found)
    ]
    across = min(len(measures), MOST_BESIDE)
    down = math.ceil(len(measures) / across)
    with styled():
        figure = Drawing(figsize=(7.4, 0.5 + (1.0 + 0.26 * len(methods)) * down))
        grid = figure.subplots(down, across, squeeze=False)
        for axes in grid.flat[len(measures) :]:
            axes.set_visible(False)
        for place, ((measure, own), axes) in enumerate(
            zip(measures.items(), grid.flat, strict=False)
        ):
            sizes = [size for row in own for size in (row.shift, row.shift_low, row.shift_high)]
            factor, unit = axis_unit(sizes, measure.unit)
            _panel(axes, own, methods, factor)
            axes.set_title(wrapped(replace(measure, unit=unit).label, 30), fontsize=8.5)
            axes.set_xlabel(drawable(label))
            if place % across:
                axes.set_yticklabels([])
    return figure


def _panel(
    axes: Axes,
    own: Sequence[SensitivityRow],
    methods: Sequence[tuple[str, str]],
    factor: float,
) -> None:
    axes.axvline(0.0, color=GREY, linewidth=0.9, zorder=1)
    for row in own:
        shift, low, high = (factor * x for x in (row.shift, row.shift_low, row.shift_high))
        place = methods.index((row.method, row.inertia))
        colour = INK if row.chosen else _OTHER
        if np.isfinite(low) and np.isfinite(high):
            width = 2.2 if row.chosen else 1.2
            axes.hlines(place, low, high, color=colour, linewidth=width)
        axes.plot(
            shift,
            place,
            "s" if row.inertia == "fixed" else "o",
            color=colour,
            markerfacecolor=colour if row.inertia == "fixed" else "white",
            markersize=6.5 if row.chosen else 5.0,
            markeredgewidth=1.2,
        )
    axes.set_yticks(
        range(len(methods)), [f"{drawable(method)}, J {inertia}" for method, inertia in methods]
    )
    axes.set_ylim(len(methods) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)
    axes.xaxis.set_major_locator(MaxNLocator(3))
    axes.grid(visible=False, axis="y")
    low, high = axes.get_xlim()
    axes.set_xlim(min(low, 0.0), max(high, 0.0))
    axes.margins(x=0.08)


SECTION = Section("sensitivity", "Other methods", _blocks, from_study_folder)
