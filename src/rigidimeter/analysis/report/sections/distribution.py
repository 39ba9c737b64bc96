"""Each measure in each condition, every included epoch a point with its interval."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from numpy.typing import NDArray

from rigidimeter.analysis.report.contents import Block, Figure, Section, paragraph
from rigidimeter.analysis.report.style import condition_colours, note, spread, styled, wrapped
from rigidimeter.analysis.statistics import summarise
from rigidimeter.analysis.study import Comparison, StudyResult
from rigidimeter.core.words import (
    axis_unit,
    condition_name,
    interval,
    number,
    p_and_r,
)

_STRIP = 0.26
"""Half the width of a strip, in units of the distance between conditions."""
_ASIDE = 0.15
"""How far to the right of median and quartiles the pooled estimate is drawn."""

Array = NDArray[np.float64]


def _blocks(result: StudyResult) -> Iterator[Block]:
    shown = [c for c in result.comparisons if c.measure.origin != "ratings" and c.observations]
    if not shown:
        return
    yield paragraph(
        "Each point is an included epoch; the thin line through it is its 95 % interval. The bar "
        "goes from the lower to the upper quartile, and the diamond is the median. An open square "
        "is the estimate from all epochs of the condition together, with its 95 % interval. "
        "Damping and stiffness of the points were estimated with the inertia fixed; the squares "
        "are from fits of J, B and K together."
    )
    colours = condition_colours(result.condition_names)
    for c in shown:
        yield Figure(
            f"distribution_{c.measure.name}",
            f"{c.measure.title}.",
            f"{c.measure.title}, every included epoch a point. {_in_words(c)}",
            partial(_drawing, c, colours),
            "small",
            marks={
                f"epochs-{place}": [(o.source, o.epoch) for o in c.of(key)]
                for place, key in enumerate(c.summaries)
            },
        )


def _in_words(c: Comparison) -> str:
    parts = []
    for condition, s in c.summaries.items():
        text = f"{condition_name(condition)}: n = {s.n}"
        if s.n:
            text += f", median {number(s.median)}, quartiles {number(s.q1)} to {number(s.q3)}"
        if condition in c.pooled:
            pooled = c.pooled[condition]
            text += f", all epochs {number(pooled.value)} {interval(pooled.low, pooled.high)}"
        parts.append(text)
    return f"{'; '.join(parts)} ({c.measure.unit})."


def _drawing(c: Comparison, colours: Mapping[str, str]) -> Drawing:
    with styled():
        figure = Drawing(figsize=distribution_size(len(c.summaries), pooled=bool(c.pooled)))
        draw_comparison(figure.add_subplot(), c, colours)
    return figure


def draw_comparison(axes: Axes, c: Comparison, colours: Mapping[str, str]) -> None:
    """Draw every value of a measure on axes, with the colours of the conditions."""
    factor, unit = axis_unit((o.value for o in c.observations), c.measure.unit)
    draw_distribution(
        axes,
        replace(c.measure, unit=unit).label,
        {condition_name(key): [factor * v for v in c.values[key]] for key in c.summaries},
        {condition_name(key): colours[key] for key in c.summaries},
        "" if c.test is None else p_and_r(c.test.p, c.test.r),
        ends={
            condition_name(key): [(factor * o.low, factor * o.high) for o in c.of(key)]
            for key in c.summaries
        },
        pooled={
            condition_name(key): (factor * o.value, factor * o.low, factor * o.high)
            for key, o in c.pooled.items()
        },
    )


def distribution_size(conditions: int, *, pooled: bool) -> tuple[float, float]:
    """Return the size of a figure in inches."""
    return max(2.9, 0.9 + (0.95 + 0.2 * pooled) * conditions), 3.0


def distribution(
    label: str,
    values: Mapping[str, Sequence[float]],
    colours: Mapping[str, str],
    remark: str = "",
    *,
    ends: Mapping[str, Sequence[tuple[float, float]]] | None = None,
    pooled: Mapping[str, tuple[float, float, float]] | None = None,
) -> Drawing:
    """Draw `draw_distribution` on a figure of its own."""
    with styled():
        figure = Drawing(figsize=distribution_size(len(values), pooled=bool(pooled)))
        draw_distribution(
            figure.add_subplot(), label, values, colours, remark, ends=ends, pooled=pooled
        )
    return figure


def draw_distribution(
    axes: Axes,
    label: str,
    values: Mapping[str, Sequence[float]],
    colours: Mapping[str, str],
    remark: str = "",
    *,
    ends: Mapping[str, Sequence[tuple[float, float]]] | None = None,
    pooled: Mapping[str, tuple[float, float, float]] | None = None,
) -> None:
    """Draw a strip of points for each condition, with its median and quartiles beside it.

    Parameters
    ----------
    axes : Axes
    label : str
        Of the vertical axis, with the unit.
    values : mapping of str to sequence of float
        Finite values by condition; a condition may have none.
    colours : mapping of str to str
        By condition.
    remark : str
        A few words above the axes, such as the test's p.
    ends : mapping of str to sequence of (float, float), optional
        The ends of each value's interval; an interval with an end that is not finite is not drawn.
    pooled : mapping of str to (float, float, float), optional
        An estimate from all of a condition and the ends of its interval, drawn as a square.
    """
    ends, pooled = ends or {}, pooled or {}
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


def _strip(axes: Axes, position: int, sample: Array, intervals: Array, colour: str) -> None:
    summary = summarise(sample)
    across = position - 0.12 + spread(sample.size, _STRIP)
    if intervals.size:
        drawn = np.all(np.isfinite(intervals), axis=1)
        axes.vlines(
            across[drawn], *intervals[drawn].T, color=colour, alpha=0.4, linewidth=0.7, zorder=1.5
        )
    (points,) = axes.plot(
        across,
        sample,
        "o",
        color=colour,
        alpha=0.65,
        markersize=3.6 if sample.size <= 60 else 2.6,
        markeredgewidth=0,
    )
    points.set_gid(f"epochs-{position}")
    beside = position + _STRIP
    axes.plot([beside, beside], [summary.q1, summary.q3], color=colour, linewidth=2.0)
    axes.plot(beside, summary.median, "D", color=colour, markersize=6, mec="white", mew=0.7)


def _pooled(axes: Axes, place: float, estimate: Sequence[float], colour: str) -> None:
    value, low, high = estimate
    if np.isfinite(value):
        if np.isfinite(low) and np.isfinite(high):
            axes.vlines(place, low, high, color=colour, linewidth=1.2)
        axes.plot(place, value, "s", color="white", mec=colour, mew=1.2, markersize=4.5)


SECTION = Section("distributions", "Every epoch", _blocks)
