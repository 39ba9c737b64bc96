"""The figures of how often tests and verdicts are right, and of speed."""

from __future__ import annotations

from matplotlib.figure import Figure
from tests.docs.dot_rows import (
    BLUE,
    GREY,
    OFFSET,
    ORANGE,
    PARAMETERS,
    SMALL,
    Marks,
    dot,
    legend,
    rows_of,
)
from tests.docs.measured import numbers, tables


def calibration() -> Figure:
    """Shares of p < 0.05 of two tests, without a difference and with one."""
    found = [one for one in tables("calibration") if one.columns[0] == "Measure"]
    labels = [one.heading.removesuffix(", with the effect") for one in found]
    with_effect = [one.heading.endswith("with the effect") for one in found]
    titles = [
        f"{'K, B lower' if effect else 'no difference'}: {label[0].lower()}{label[1:]}"
        for label, effect in zip(labels, with_effect, strict=True)
    ]
    figure, axes, places = rows_of(titles, 30, 1.6)
    tests = dict(zip(found[0].columns[1:], (ORANGE, BLUE), strict=True))
    marks = Marks(axes)
    for y, table, effect in zip(places, found, with_effect, strict=True):
        for step, (test, colour) in zip((-0.25, 0.25), tests.items(), strict=True):
            for measure, share in zip(table.column("Measure"), table.column(test), strict=True):
                differs = effect and measure != "J"
                marks.put(float(share), y + step, dot(colour, open_=differs))
    marks.draw()
    axes.axvline(5, color=GREY, lw=1)
    axes.set_xlim(0, 100)
    axes.set_xticks([0, 5, 20, 40, 60, 80, 100])
    axes.set_xlabel("p < .05, % of studies", size=SMALL + 1)
    entries = [dot(colour, test) for test, colour in tests.items()]
    legend(figure, [*entries, dot(GREY, "a true difference", open_=True)], 2)
    return figure


def verdicts() -> Figure:
    """How often a difference is found where there is one and where there is none, by design."""
    (table,) = (
        one
        for one in tables("benchmarks")
        if one.columns[0] == "studies" and "planned" in one.columns
    )
    designs = list(dict.fromkeys(table.column("studies")))
    figure, axes, places = rows_of(designs, 30, 1.3)
    found = next(k for k, name in enumerate(table.columns) if name.startswith("lower by 18 %"))
    planned, wrong = table.columns.index("planned"), table.columns.index("either found, none there")
    marks = Marks(axes)
    for row in table.rows:
        y, name = places[designs.index(row[0])] + OFFSET[row[1]], row[1]
        marks.put(numbers(row[planned])[0], y, dot(PARAMETERS[name], open_=True))
        marks.put(numbers(row[found])[0], y, dot(PARAMETERS[name]))
        marks.put(float(row[wrong]), places[designs.index(row[0])], dot(GREY, marker="s"))
    marks.draw()
    axes.axvline(5, color=GREY, lw=1)
    axes.set_xlim(0, 100)
    axes.set_xticks([0, 5, 20, 40, 60, 80, 100])
    axes.set_xlabel("a difference is found, % of studies", size=SMALL + 1)
    legend(
        figure,
        [
            dot(PARAMETERS["K"], "K 18 % lower"),
            dot(PARAMETERS["B"], "B 13 % lower"),
            dot(GREY, "planned", open_=True),
            dot(GREY, "none is there", marker="s"),
        ],
        4,
    )
    return figure


def speed() -> Figure:
    """Ratios of our times and memory to those of a reference."""
    table = tables("benchmarks")[0]
    figure, axes, places = rows_of(table.column(table.columns[0]), 40)
    axes.set_xscale("log")
    marks = Marks(axes)
    for y, ratio in zip(places, table.column("ratio"), strict=True):
        marks.put(float(ratio), y, dot(BLUE))
    marks.draw()
    axes.axvline(1, color=GREY, lw=1)
    axes.set_xticks([0.01, 0.1, 1, 10, 100], ["0.01", "0.1", "1", "10", "100"])
    axes.minorticks_off()
    axes.set_xlabel("ours / reference", size=SMALL + 1)
    return figure
