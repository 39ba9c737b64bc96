"""Effect sizes of several measures under each other, with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from rigidimeter.reporting.figures.style import GREY, note, styled, wrapped

__all__ = ["Effect", "forest"]

_INK = "#1C1C1C"
COHEN = (0.1, 0.3, 0.5)
"""What is called a small, a medium and a large r."""


class Effect(NamedTuple):
    """An effect size, the ends of its interval, the most it could be, and it all in words."""

    name: str
    counts: str
    value: float
    low: float
    high: float
    most: float
    words: str


def forest(effects: Sequence[Effect], label: str, remark: str = "") -> Figure:
    """Draw one row for each measure, the first one at the top.

    Parameters
    ----------
    effects : sequence of Effect
        At least one. `most` is drawn as a thin grey tick at ±most: two groups that do not overlap
        at all would stand there.
    label : str
        Of the horizontal axis.
    remark : str
        A few words above the axes.
    """
    places = range(len(effects))
    with styled():
        figure = Figure(figsize=(7.4, 0.9 + 0.42 * len(effects)))
        axes = figure.add_subplot()
        for size in COHEN:
            for x in (-size, size):
                axes.axvline(x, color=GREY, linewidth=0.6, dashes=(1, 3), zorder=0)
        axes.axvline(0.0, color=GREY, linewidth=0.9, zorder=1)
        for place, effect in zip(places, effects, strict=True):
            if np.isfinite(effect.low) and np.isfinite(effect.high):
                axes.hlines(place, effect.low, effect.high, color=_INK, linewidth=1.6)
                axes.plot([effect.low, effect.high], [place] * 2, "|", color=_INK, markersize=7)
            axes.plot(effect.value, place, "s", color=_INK, markersize=6)
            for x in (-effect.most, effect.most):
                axes.plot(x, place, "|", color=GREY, markersize=13, markeredgewidth=0.7, alpha=0.7)
            axes.text(
                1.02,
                place,
                effect.words,
                transform=axes.get_yaxis_transform(),
                va="center",
                fontsize=8,
            )
        drawn = [x for e in effects for x in (e.low, e.high, e.value) if np.isfinite(x)]
        reach = 1.05 * max(0.5, *(e.most for e in effects), *map(abs, drawn))
        low = -reach if min(drawn) < -0.15 else min(1.1 * min(drawn), -0.15)
        high = reach if max(drawn) > 0.15 else max(1.1 * max(drawn), 0.15)
        axes.set_xlim(low, high)
        axes.set_yticks(
            places, [f"{wrapped(effect.name, 28, 2)}\n{effect.counts}" for effect in effects]
        )
        axes.set_ylim(len(effects) - 0.5, -0.5)
        axes.tick_params(axis="y", length=0)
        axes.grid(visible=False)
        axes.set_xlabel(label)
        note(axes, remark)
    return figure
