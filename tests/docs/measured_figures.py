"""The figures of the maintainers' measured tables, drawn from these as they stand in the pages.

Nothing is measured for them, so a figure says what its table says.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from tests.docs.measured import DEVELOPMENT, Table, numbers, tables

FOLDER = DEVELOPMENT / "figures"
WIDTH_IN, ROW_IN, SMALL = 3.7, 0.17, 7
BLUE, ORANGE, GREEN, GREY = "#1f5fa8", "#c2570c", "#2c7a4b", "#555555"
PARAMETERS = {"J": BLUE, "B": ORANGE, "K": GREEN}
OFFSET = {"J": -0.22, "B": 0.0, "K": 0.22}


def rows_of(
    labels: Sequence[str], characters: int, least: float = 0.9
) -> tuple[Figure, Axes, list[float]]:
    """Return axes with a row for each label, the first on top, and the rows' places.

    A row is as high as its label, at least so many lines of 0.17 inches.
    """
    wrapped = [
        "\n".join(textwrap.fill(line, characters) for line in label.splitlines())
        for label in labels
    ]
    heights = np.array([max(least, 0.75 * label.count("\n") + 0.9) for label in wrapped])
    places = np.cumsum(heights) - heights / 2
    figure = Figure(figsize=(WIDTH_IN, ROW_IN * heights.sum() + 0.85), layout="constrained")
    axes = figure.subplots()
    axes.set_yticks(places, wrapped, size=SMALL)
    axes.set_ylim(heights.sum(), 0)
    axes.tick_params(axis="y", length=0)
    axes.tick_params(axis="x", labelsize=SMALL)
    axes.grid(axis="y", color="#e4e4e4", lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right", "left"]].set_visible(False)
    return figure, axes, places.tolist()


def dot(colour: str, label: str = "", *, open_: bool = False, marker: str = "o") -> Line2D:
    """Return how a series looks, to draw or for a legend."""
    face = "white" if open_ else colour
    return Line2D([], [], color=colour, marker=marker, ms=4, mfc=face, ls="", label=label)


def put(axes: Axes, x: float, y: float, style: Line2D) -> None:
    """Draw one mark."""
    if np.isfinite(x):
        axes.plot(x, y, style.get_marker(), color=style.get_color(), ms=style.get_markersize(),
                  mfc=style.get_markerfacecolor(), mew=0.9, clip_on=False)  # fmt: skip


def legend(figure: Figure, entries: Iterable[Line2D], columns: int) -> None:
    """Put the legend above the axes."""
    figure.legend(
        handles=list(entries), loc="outside upper center", ncols=columns, frameon=False,
        fontsize=SMALL, handletextpad=0.1, columnspacing=0.9,
    )  # fmt: skip


def symlog(axes: Axes, least: float, ticks: Sequence[float], label: str) -> None:
    """Give x a scale that is linear up to the least number and logarithmic beyond it."""
    axes.set_xscale("symlog", linthresh=least, linscale=0.5)
    axes.set_xticks(ticks, [f"{tick:g}".replace("-", "−") for tick in ticks])
    axes.minorticks_off()
    axes.set_xlabel(label, size=SMALL + 1)
    for tick in ticks:
        axes.axvline(tick, color=GREY if tick == 0 else "#e4e4e4", lw=0.8, zorder=0)


# --- Scenarios ---------------------------------------------------------------------------------


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
    rest = f"{len(own) - len(shown)} others: within 1 %, silent"
    figure, axes, places = rows_of([*(row[1] for row in shown), rest], 34)
    symlog(axes, 1, (-100, -10, -1, 0, 1, 10, 100), f"bias of {method}, % of the truth")
    for label, y, row in zip(axes.get_yticklabels(), places, shown, strict=False):
        withheld = not np.isfinite(numbers(row[pooled])).any()
        reported = _flagged(row[flags])
        for (name, colour), x in zip(PARAMETERS.items(), numbers(row[bias]), strict=True):
            style = dot(colour, open_=reported, marker="s" if withheld else "o")
            put(axes, x, y + OFFSET[name], style)
        if "**" in row[-1]:
            label.set(color=ORANGE, weight="bold")
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


# --- Drives ------------------------------------------------------------------------------------


def late_drive() -> Figure:
    """Bias and half interval by what was recorded, of two drives."""
    kept: list[tuple[str, tuple[str, ...]]] = []
    for table in tables("late-drive"):
        order = table.heading.removeprefix("Drive of ").split(",")[0]
        kept += [(f"{order}: {row[0]}\n{row[1]}", row) for row in table.rows]
    figure, axes, places = rows_of([label for label, _ in kept], 31)
    symlog(axes, 0.1, (-10, -1, 0, 1, 10), "error ± half interval, %")
    for y, (_, row) in zip(places, kept, strict=True):
        doubted = float(row[6]) >= 50
        for (name, colour), bias, half in zip(
            PARAMETERS.items(), numbers(row[2]), numbers(row[4]), strict=True
        ):
            axes.hlines(y + OFFSET[name], bias - half, bias + half, color=colour, lw=1)
            put(axes, bias, y + OFFSET[name], dot(colour, open_=doubted))
    legend(
        figure,
        [
            *(dot(colour, name) for name, colour in PARAMETERS.items()),
            dot(GREY, "flagged by between_samples", open_=True),
        ],
        4,
    )
    return figure


STRUCTURE_COLOURS = (BLUE, ORANGE, GREEN, "#7b3f98", "#222222")
WANTED = {"J": 2.0, "B": 1.0, "K": 0.5}


def between_samples() -> Figure:
    """Errors of J, B and K by rate, of five drives and four filters."""
    figure = Figure(figsize=(WIDTH_IN, 5.6), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    found = tables("between-samples")
    rates = list(dict.fromkeys(found[0].column("samples/s")))
    for (name, wanted), axes in zip(WANTED.items(), panels, strict=True):
        for number, (table, colour) in enumerate(zip(found, STRUCTURE_COLOURS, strict=True)):
            cells = (table.column(one) for one in ("samples/s", "filter", name, "flagged"))
            for rate, corner, error, flagged in zip(*cells, strict=True):
                if not error:
                    continue
                step = ["none", "30 Hz", "100 Hz", "320 Hz"].index(corner)
                place = rates.index(rate) + 0.15 * (number - 2) + 0.03 * (step - 1.5)
                style = dot(colour, open_=flagged != "0")
                put(axes, place, max(abs(float(error)), 0.01), style)
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
    names = [dot(c, table.heading) for c, table in zip(STRUCTURE_COLOURS, found, strict=True)]
    legend(figure, [*names, dot(GREY, "flagged", open_=True)], 3)
    return figure


# --- Guard -------------------------------------------------------------------------------------

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
    for row in cases.rows:
        if row[0] not in places:
            continue
        y = places[row[0]] + 0.33 * (list(RIG_COLOURS).index(row[2]) - 1)
        colour = RIG_COLOURS[row[2]]
        for cell, open_ in ((row[named], False), (row[rest], True)):
            if cell:
                put(axes, max(numbers(cell.removeprefix("-"))[0], 0), y, dot(colour, open_=open_))
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


# --- Statistics --------------------------------------------------------------------------------


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
    for y, table, effect in zip(places, found, with_effect, strict=True):
        for step, (test, colour) in zip((-0.25, 0.25), tests.items(), strict=True):
            for measure, share in zip(table.column("Measure"), table.column(test), strict=True):
                differs = effect and measure != "J"
                put(axes, float(share), y + step, dot(colour, open_=differs))
    axes.axvline(5, color=GREY, lw=1)
    axes.set_xlim(0, 100)
    axes.set_xticks([0, 5, 20, 40, 60, 80, 100])
    axes.set_xlabel("p < .05, % of studies", size=SMALL + 1)
    entries = [dot(colour, test) for test, colour in tests.items()]
    legend(figure, [*entries, dot(GREY, "a true difference", open_=True)], 2)
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
    for y, (_, shares) in zip(places, kept, strict=True):
        for (name, colour), share in zip(PARAMETERS.items(), shares, strict=True):
            put(axes, share, y + OFFSET[name], dot(colour))
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


def speed() -> Figure:
    """Ratios of our times and memory to those of a reference."""
    table = tables("benchmarks")[0]
    figure, axes, places = rows_of(table.column(table.columns[0]), 40)
    axes.set_xscale("log")
    for y, ratio in zip(places, table.column("ratio"), strict=True):
        put(axes, float(ratio), y, dot(BLUE))
    axes.axvline(1, color=GREY, lw=1)
    axes.set_xticks([0.01, 0.1, 1, 10, 100], ["0.01", "0.1", "1", "10", "100"])
    axes.minorticks_off()
    axes.set_xlabel("ours / reference", size=SMALL + 1)
    return figure


METHODS = ("iv", "bandlimited", "blind")
FIGURES: Mapping[str, Callable[[], Figure]] = {
    **{f"scenarios-{method}": partial(scenarios, method) for method in METHODS},
    "late-drive": late_drive,
    "between-samples": between_samples,
    "guard-times": guard_times,
    "calibration": calibration,
    "coverage": coverage,
    "speed": speed,
}
