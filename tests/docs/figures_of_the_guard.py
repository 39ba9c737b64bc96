"""The figures of what the guard finds, and when."""

from __future__ import annotations

import re
import textwrap

from matplotlib.figure import Figure
from tests.docs.dot_rows import BLUE, FIVE, GREEN, GREY, ORANGE, Marks, dot, legend, rows_of, symlog
from tests.docs.measured import numbers, tables

RIG_COLOURS = {"virtual": BLUE, "rdt_canopen": ORANGE, "rdt_ascii": GREEN}


def guard_times() -> Figure:
    """When each case of a fault was named, and when the arm was at rest."""
    (cases,) = (one for one in tables("guard-laws") if one.columns[:2] == ("#", "Case"))
    (faults,) = (one for one in tables("faults") if one.columns[:2] == ("#", "Fault"))
    named, rest = cases.columns.index("Named"), cases.columns.index("At rest")
    timed = {row[0] for row in cases.rows if row[rest]}
    labels = {
        row[0]: f"{row[0]} {textwrap.shorten(row[1], 44, placeholder=' …')}"
        for row in faults.rows
        if row[0] in timed
    }
    figure, axes, at = rows_of(list(labels.values()), 28, 1.5)
    places = dict(zip(labels, at, strict=True))
    symlog(axes, 1, (0, 1, 10, 100, 1000, 10000), "time after the fault, ms")
    axes.set_xlim(-0.3, 12000)
    marks = Marks(axes)
    for row in cases.rows:
        if row[0] not in places:
            continue
        y = places[row[0]] + 0.33 * (list(RIG_COLOURS).index(row[2]) - 1)
        colour = RIG_COLOURS[row[2]]
        for cell, open_ in ((row[named], False), (row[rest], True)):
            if cell:
                marks.put(max(numbers(cell.removeprefix("-"))[0], 0), y, dot(colour, open_=open_))
    marks.draw()
    legend(
        figure,
        [
            *(dot(colour, name.replace("_", ", ")) for name, colour in RIG_COLOURS.items()),
            dot(GREY, "named"),
            dot(GREY, "arm at rest", open_=True),
        ],
        5,
    )
    return figure


PASSES_S = 10.0
"""Where a fault stands that ended no epoch."""


def stopped(first_column: str) -> Figure:
    """Time until an epoch was ended by each fault of the readings, by rig."""
    (table,) = (one for one in tables("guard-laws") if one.columns[0] == first_column)
    shown = [row for row in table.rows if not row[0].startswith("*")]
    figure, axes, places = rows_of([row[0] for row in shown], 34, 1.6)
    symlog(axes, 0.1, (0, 0.1, 1, PASSES_S), "time after the fault, s")
    axes.set_xticklabels(["0", "0.1", "1", "passes"])
    axes.set_xlim(-0.01, 11)
    rigs = dict(zip(table.columns[1:], FIVE, strict=False))
    marks = Marks(axes)
    for y, row in zip(places, shown, strict=True):
        for step, cell, colour in zip(
            (-0.5, -0.17, 0.17, 0.5), row[1:], rigs.values(), strict=True
        ):
            passes = cell.startswith("passes")
            ended = re.search(r", ([\d.]+) s,", cell)
            time_s = PASSES_S if passes or not ended else float(ended[1])
            marks.put(time_s, y + step, dot(colour, open_=passes))
    marks.draw()
    legend(figure, (dot(colour, rig) for rig, colour in rigs.items()), 2)
    return figure
