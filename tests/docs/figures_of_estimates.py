"""The figures of the measured errors and intervals of J, B and K."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from tests.docs.dot_rows import (
    FIVE,
    GREY,
    OFFSET,
    ORANGE,
    PARAMETERS,
    SMALL,
    WIDTH_IN,
    Marks,
    dot,
    legend,
    rows_of,
    symlog,
)
from tests.docs.measured import Table, numbers, tables


def scenarios(method: str) -> Figure:
    """Bias of a method in the scenarios that it is off in, flags or breaks the rule in."""
    (table,) = (one for one in tables("scenarios") if one.columns[0] == "method")
    bias, pooled = table.columns.index("bias (%)"), table.columns.index("pooled: bias (%)")
    flags = table.columns.index("flagged: epochs, recordings (%)")
    own = [row for row in table.rows if row[0] == method]
    shown = [
        row for row in own
        if np.nanmax(np.abs(numbers(row[bias]))) > 1 or "**" in row[-1] or _flagged(row[flags])
    ]  # fmt: skip
    rest = f"{len(own) - len(shown)} others: right"
    figure, axes, places = rows_of([*(row[1] for row in shown), rest], 34)
    symlog(axes, 1, (-100, -10, -1, 0, 1, 10, 100), f"bias of {method}, % of the truth")
    marks = Marks(axes)
    for label, y, row in zip(axes.get_yticklabels(), places, shown, strict=False):
        withheld = not np.isfinite(numbers(row[pooled])).any()
        reported = _flagged(row[flags])
        for (name, colour), x in zip(PARAMETERS.items(), numbers(row[bias]), strict=True):
            style = dot(colour, open_=reported, marker="s" if withheld else "o")
            marks.put(x, y + OFFSET[name], style)
        if "**" in row[-1]:
            label.set(color=ORANGE, weight="bold")
    marks.draw()
    legend(
        figure,
        [
            *(dot(colour, name) for name, colour in PARAMETERS.items()),
            dot(GREY, "silent"),
            dot(GREY, "reported", open_=True),
            dot(GREY, "pooled withheld", open_=True, marker="s"),
        ],
        6,
    )
    return figure


def _flagged(cell: str) -> bool:
    """Return whether at least nine of ten recordings were flagged."""
    return numbers(cell)[1] >= 90


def late_drive() -> Figure:
    """Bias and half interval by what was recorded, of two drives."""
    kept: list[tuple[str, tuple[str, ...]]] = []
    for table in tables("late-drive"):
        order = table.heading.removeprefix("Drive of ").split(",")[0]
        kept += [(f"{order}: {row[0]}\n{row[1]}", row) for row in table.rows]
    figure, axes, places = rows_of([label for label, _ in kept], 31)
    symlog(axes, 0.1, (-10, -1, 0, 1, 10), "error ± half interval, %")
    marks = Marks(axes)
    for y, (_, row) in zip(places, kept, strict=True):
        doubted = float(row[6]) >= 50
        for (name, colour), bias, half in zip(
            PARAMETERS.items(), numbers(row[2]), numbers(row[4]), strict=True
        ):
            axes.hlines(y + OFFSET[name], bias - half, bias + half, color=colour, lw=1)
            marks.put(bias, y + OFFSET[name], dot(colour, open_=doubted))
    marks.draw()
    legend(
        figure,
        [
            *(dot(colour, name) for name, colour in PARAMETERS.items()),
            dot(GREY, "flagged by between_samples", open_=True),
        ],
        4,
    )
    return figure


WANTED = {"J": 2.0, "B": 1.0, "K": 0.5}


def between_samples() -> Figure:
    """Errors of J, B and K by rate, of five drives and four filters."""
    figure = Figure(figsize=(WIDTH_IN, 5.6), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    found = tables("between-samples")
    rates = list(dict.fromkeys(found[0].column("samples/s")))
    for (name, wanted), axes in zip(WANTED.items(), panels, strict=True):
        marks = Marks(axes)
        for number, (table, colour) in enumerate(zip(found, FIVE, strict=True)):
            cells = (table.column(one) for one in ("samples/s", "filter", name, "flagged"))
            for rate, corner, error, flagged in zip(*cells, strict=True):
                if not error:
                    continue
                step = ["none", "30 Hz", "100 Hz", "320 Hz"].index(corner)
                place = rates.index(rate) + 0.15 * (number - 2) + 0.03 * (step - 1.5)
                style = dot(colour, open_=flagged != "0")
                marks.put(place, max(abs(float(error)), 0.01), style)
        marks.draw()
        axes.axhline(wanted, color=GREY, lw=0.8, ls="--")
        axes.text(5.55, wanted, f"{wanted:g} %", size=SMALL, color=GREY, ha="right", va="bottom")
        axes.set_yscale("log")
        axes.set_yticks([0.01, 0.1, 1, 10], ["≤ 0.01", "0.1", "1", "10"], size=SMALL)
        axes.set_ylim(0.008, 100 if name == "J" else 2.5)
        axes.minorticks_off()
        axes.set_ylabel(f"error of {name}, %", size=SMALL + 1)
        axes.spines[["top", "right"]].set_visible(False)
    panels[-1].set_xticks(range(len(rates)), rates, size=SMALL)
    panels[-1].set_xlabel("samples/s", size=SMALL + 1)
    names = [dot(c, table.heading) for c, table in zip(FIVE, found, strict=True)]
    legend(figure, [*names, dot(GREY, "flagged", open_=True)], 3)
    return figure


def other_drives() -> Figure:
    """Errors of J, B and K with drives of other bandwidths."""
    table = next(one for one in tables("other-drives") if "drive" in one.columns)
    cells = (table.column(name) for name in ("drive", "samples/s", "filter"))
    labels = [
        f"{drive}\n{rate}/s" + ("" if corner == "none" else f", filter {corner}")
        for drive, rate, corner in zip(*cells, strict=True)
    ]
    figure, axes, places = rows_of(labels, 34)
    symlog(axes, 0.1, (-100, -1, 0, 1, 100), "error, %")
    marks = Marks(axes)
    for name, colour in PARAMETERS.items():
        errors = zip(places, table.column(name), table.column("flagged of 4"), strict=True)
        for y, error, flagged in errors:
            marks.put(float(error), y + OFFSET[name], dot(colour, open_=flagged != "0"))
    marks.draw()
    names = [dot(colour, name) for name, colour in PARAMETERS.items()]
    legend(figure, [*names, dot(GREY, "flagged", open_=True)], 4)
    return figure


HELD = ("coverage (%)", "held by 95 % intervals")


def coverage() -> Figure:
    """Coverage of 95 % intervals of J, B and K in every table that has it."""
    kept: list[tuple[str, list[float]]] = []
    for table in tables("accuracy"):
        held = next((name for name in HELD if name in table.columns), None)
        if not held:
            continue
        for row, cell in zip(table.rows, table.column(held), strict=True):
            kept.append((_condition(table, row), numbers(cell)))
    figure, axes, places = rows_of([label for label, _ in kept], 36)
    marks = Marks(axes)
    for y, (_, shares) in zip(places, kept, strict=True):
        for (name, colour), share in zip(PARAMETERS.items(), shares, strict=True):
            marks.put(share, y + OFFSET[name], dot(colour))
    marks.draw()
    axes.axvline(95, color=GREY, lw=1)
    axes.set_xlim(0, 101)
    axes.set_xticks([0, 25, 50, 75, 95])
    axes.set_xlabel("coverage, %", size=SMALL + 1)
    legend(figure, [dot(colour, name) for name, colour in PARAMETERS.items()], 3)
    return figure


def _condition(table: Table, row: Sequence[str]) -> str:
    """Return what a row is of, in the words of its heading where the row leaves it out."""
    if table.columns[0] == "method":
        return f"{table.heading.rsplit(',', 1)[0]}: {row[0]}"
    if table.columns[1].startswith("controller"):
        return f"{row[0]}; controller {row[1]}"
    return row[0]


def intervals() -> Figure:
    """Coverage of single epochs by intervals without and with their three corrections."""
    (table,) = (one for one in tables("intervals") if "alone, with" in one.columns)
    figure, axes, places = rows_of(table.column(table.columns[0]), 36, 1.3)
    marks = Marks(axes)
    for name, open_ in (("alone, without", True), ("alone, with", False)):
        for y, cell in zip(places, table.column(name), strict=True):
            for (parameter, colour), share in zip(PARAMETERS.items(), numbers(cell), strict=True):
                marks.put(share, y + 1.3 * OFFSET[parameter], dot(colour, open_=open_))
    marks.draw()
    axes.axvline(95, color=GREY, lw=1)
    axes.set_xlabel("coverage of single epochs, %", size=SMALL + 1)
    names = [dot(colour, name) for name, colour in PARAMETERS.items()]
    legend(figure, [*names, dot(GREY, "without", open_=True), dot(GREY, "with")], 5)
    return figure
