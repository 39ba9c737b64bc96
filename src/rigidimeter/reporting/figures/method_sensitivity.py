"""One conclusion by several roads: the shift of each measure by method, J held or not."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from rigidimeter.reporting.figures.style import GREY, drawable, styled, wrapped

__all__ = ["Road", "sensitivity"]

_CHOSEN = "#1C1C1C"
_OTHER = "#0072B2"
MOST_BESIDE = 3


class Road(NamedTuple):
    """A shift with its interval, and how it was come by."""

    method: str
    held: bool
    shift: float
    low: float
    high: float
    chosen: bool


def sensitivity(measures: Mapping[str, Sequence[Road]], label: str) -> Figure:
    """Draw a panel for each measure with one row for each method; zero is marked.

    Parameters
    ----------
    measures : mapping of str to sequence of Road
        By name with unit, each at least one road.
    label : str
        Of the horizontal axes, without a unit.
    """
    every = [road for found in measures.values() for road in found]
    methods = list(dict.fromkeys(road.method for road in every))
    roads = [
        (method, held)
        for method in methods
        for held in (True, False)
        if any((road.method, road.held) == (method, held) for road in every)
    ]
    across = min(len(measures), MOST_BESIDE)
    down = math.ceil(len(measures) / across)
    with styled():
        figure = Figure(figsize=(7.4, 0.5 + (1.0 + 0.26 * len(roads)) * down))
        grid = figure.subplots(down, across, squeeze=False)
        for place, axes in enumerate(grid.flat):
            if place >= len(measures):
                axes.set_visible(False)
        for place, ((name, found), axes) in enumerate(
            zip(measures.items(), grid.flat, strict=False)
        ):
            _panel(axes, found, roads)
            axes.set_title(wrapped(name, 30), fontsize=8.5)
            axes.set_xlabel(drawable(label))
            if place % across:
                axes.set_yticklabels([])
    return figure


def _panel(axes: Axes, found: Sequence[Road], roads: Sequence[tuple[str, bool]]) -> None:
    axes.axvline(0.0, color=GREY, linewidth=0.9, zorder=1)
    for road in found:
        place = roads.index((road.method, road.held))
        colour = _CHOSEN if road.chosen else _OTHER
        width = 2.2 if road.chosen else 1.2
        if np.isfinite(road.low) and np.isfinite(road.high):
            axes.hlines(place, road.low, road.high, color=colour, linewidth=width)
        axes.plot(
            road.shift,
            place,
            "s" if road.held else "o",
            color=colour,
            markerfacecolor=colour if road.held else "white",
            markersize=6.5 if road.chosen else 5.0,
            markeredgewidth=1.2,
        )
    axes.set_yticks(
        range(len(roads)),
        [f"{drawable(method)}, J {'fixed' if held else 'free'}" for method, held in roads],
    )
    axes.set_ylim(len(roads) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)
    axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.grid(visible=False, axis="y")
    low, high = axes.get_xlim()
    axes.set_xlim(min(low, 0.0), max(high, 0.0))
    axes.margins(x=0.08)
