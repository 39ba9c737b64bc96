"""One measure in each condition, every epoch a point with its interval."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rigidimeter.reporting.figures.style import note, styled, wrapped
from rigidimeter.statistics import summarise

__all__ = ["distribution"]

_GOLDEN = 0.6180339887498949
_STRIP = 0.26
"""Half the width of a strip, in units of the distance between conditions."""
_ASIDE = 0.15
"""How far to the right of median and quartiles the pooled estimate stands."""

Array = NDArray[np.float64]


def distribution(
    label: str,
    values: Mapping[str, Sequence[float]],
    colours: Mapping[str, str],
    remark: str = "",
    *,
    ends: Mapping[str, Sequence[tuple[float, float]]] | None = None,
    pooled: Mapping[str, tuple[float, float, float]] | None = None,
) -> Figure:
    """Draw a strip of points for each condition, with its median and quartiles beside it.

    Parameters
    ----------
    label : str
        Of the vertical axis, with the unit.
    values : mapping of str to sequence of float
        Finite values by condition; a condition may have none.
    colours : mapping of str to str
        By condition.
    remark : str
        A few words above the axes, such as the test's p.
    ends : mapping of str to sequence of (float, float), optional
        The ends of each value's interval; an end that is not finite is not drawn.
    pooled : mapping of str to (float, float, float), optional
        An estimate from all of a condition and the ends of its interval, drawn as a square.
    """
    ends, pooled = ends or {}, pooled or {}
    with styled():
        width = 0.95 + 0.2 * bool(pooled)
        figure = Figure(figsize=(max(2.9, 0.9 + width * len(values)), 3.0))
        axes = figure.add_subplot()
        for position, (condition, sample) in enumerate(values.items()):
            colour = colours[condition]
            if len(sample):
                intervals = np.reshape(ends.get(condition, []), (-1, 2))
                _strip(axes, position, np.asarray(sample, dtype=np.float64), intervals, colour)
            if condition in pooled:
                _pooled(axes, position + _STRIP + _ASIDE, pooled[condition], colour)
        axes.set_xlim(-0.55, len(values) - 0.45)
        axes.set_xticks(
            range(len(values)),
            [f"{wrapped(name, 13)}\nn = {len(sample)}" for name, sample in values.items()],
        )
        axes.set_ylabel(label)
        axes.tick_params(axis="x", length=0)
        axes.grid(visible=False, axis="x")
        axes.margins(y=0.08)
        note(axes, remark)
    return figure


def _strip(axes: Axes, position: int, sample: Array, intervals: Array, colour: str) -> None:
    summary = summarise(sample)
    across = position - 0.12 + _jitter(sample.size)
    if intervals.size:
        drawn = np.all(np.isfinite(intervals), axis=1)
        axes.vlines(
            across[drawn], *intervals[drawn].T, color=colour, alpha=0.4, linewidth=0.7, zorder=1.5
        )
    axes.plot(
        across,
        sample,
        "o",
        color=colour,
        alpha=0.65,
        markersize=3.6 if sample.size <= 60 else 2.6,
        markeredgewidth=0,
    )
    beside = position + _STRIP
    axes.plot([beside, beside], [summary.q1, summary.q3], color=colour, linewidth=2.0)
    axes.plot(beside, summary.median, "D", color=colour, markersize=6, mec="white", mew=0.7)


def _pooled(axes: Axes, place: float, estimate: Sequence[float], colour: str) -> None:
    value, low, high = estimate
    if np.isfinite(value):
        if np.isfinite(low) and np.isfinite(high):
            axes.vlines(place, low, high, color=colour, linewidth=1.2)
        axes.plot(place, value, "s", color="white", mec=colour, mew=1.2, markersize=4.5)


def _jitter(count: int) -> Array:
    """Return offsets that fill the strip evenly; multiples of the golden ratio never cluster."""
    share = np.mod(0.5 + _GOLDEN * np.arange(count), 1.0)
    return np.asarray(_STRIP * (2 * share - 1), dtype=np.float64)
