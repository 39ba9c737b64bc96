"""Figures of rows: a label, and dots beside it. A width of 3.7 inches fills a telephone."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

WIDTH_IN, ROW_IN, SMALL = 3.7, 0.17, 7
BLUE, ORANGE, GREEN, GREY = "#1f5fa8", "#c2570c", "#2c7a4b", "#555555"
FIVE = (BLUE, ORANGE, GREEN, "#7b3f98", "#222222")
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


@dataclass
class Marks:
    """Marks of axes, drawn together by their look, which keeps the file small."""

    axes: Axes
    places: dict[tuple[object, ...], list[tuple[float, float]]] = field(default_factory=dict)

    def put(self, x: float, y: float, style: Line2D) -> None:
        """Add one mark, if there is a number."""
        look = (style.get_marker(), style.get_color(), style.get_markerfacecolor())
        if np.isfinite(x):
            self.places.setdefault(look, []).append((x, y))

    def draw(self) -> None:
        """Draw them all."""
        for (marker, colour, face), places in self.places.items():
            self.axes.plot(*zip(*places, strict=True), ls="", marker=marker, color=colour, mfc=face,
                           ms=4, mew=0.9, clip_on=False)  # fmt: skip


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
