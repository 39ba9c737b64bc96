"""Values as points by condition: every epoch, day by day, examiners' ratings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from rigidimeter.analysis.report.style import (
    GREY,
    MARKERS,
    Look,
    condition_colours,
    condition_markers,
    legend_above,
    legend_outside,
    listed,
    named_places,
    note,
    spread,
    with_intervals,
    wrapped,
    write_at,
)
from rigidimeter.analysis.statistics import summarise
from rigidimeter.analysis.study import Comparison, RatingsFound, Relation
from rigidimeter.core.words import (
    axis_unit,
    condition_name,
    interval,
    number,
    p_and_r,
)

Array = NDArray[np.float64]

MOST_IN_A_ROW = 26
"""More days than this continue in another row of the same figure."""

_SPREAD, _ASIDE, _BESIDE, _POOLED = 0.24, -0.12, 0.28, 0.41
"""Of a strip of width 1: half of what its points take, where they, their median and the estimate
from all of them stand."""
_LANES, _STEP, _MEAN = 0.66, 0.9, 0.43
"""Width of the lanes of examiners, share of a lane for equal scores, and place of the mean."""


def _strip(
    axes: Axes, place: float, width: float, rows: Array, colour: str, markers: str, group: str
) -> None:
    """Draw values, shape (n, 3) with their ends; beside them their median and quartiles.

    `group` names the line of points, so that a page can say which epoch each of them is.
    """
    found = summarise(rows[:, 0])
    at = place + width * (_ASIDE + spread(len(rows), _SPREAD))
    size = 3.6 if len(rows) <= 60 else 2.6
    points: Look = {"width": 0.7, "faint": 0.4, "alpha": 0.6, "mew": 0, "ms": size, "gid": group}
    with_intervals(axes, at, rows, colour, markers[0], **points)
    quartiles = found.median, found.q1, found.q3
    median: Look = {"width": 2.0, "ms": 6, "mec": "white", "mew": 0.7}
    with_intervals(axes, place + width * _BESIDE, quartiles, colour, markers[1], **median)


def draw_distribution(
    panels: Sequence[Axes],
    label: str,
    values: Mapping[str, Sequence[float] | Sequence[tuple[float, float, float]]],
    colours: Mapping[str, str],
    remark: str = "",
    pooled: Mapping[str, ArrayLike] | None = None,
) -> None:
    """Draw a strip of points for each condition, with its median and quartiles beside it.

    Parameters
    ----------
    panels : sequence of Axes
        One.
    label : str
        Of the vertical axis, with the unit.
    values : mapping of str to array, shape (n,) or (n, 3)
        Finite values by condition, also with the ends of their intervals; a condition may have
        none.
    colours : mapping of str to str
        By condition.
    remark : str
        A few words above the axes, such as the test's p.
    pooled : mapping of str to array, shape (3,), optional
        An estimate from all of a condition and the ends of its interval, drawn as a square.
    """
    (axes,) = panels
    for place, (condition, sample) in enumerate(values.items()):
        rows = np.asarray(sample, dtype=np.float64)
        if rows.ndim == 1:
            rows = np.column_stack([rows, np.full((rows.size, 2), np.nan)])
        if len(rows):
            _strip(axes, place, 1.0, rows, colours[condition], "oD", f"epochs-{place}")
        together = np.asarray((pooled or {}).get(condition, (np.nan,) * 3))
        if np.isfinite(together[0]):
            at, colour = place + _POOLED, colours[condition]
            with_intervals(axes, at, together, colour, "s", mfc="white", ms=4.5)
    named_places(axes, [f"{wrapped(name, 13)}\nn = {len(v)}" for name, v in values.items()])
    axes.set_ylabel(label)
    axes.margins(y=0.08)
    note(axes, remark)


def distribution_size(conditions: int, *, pooled: bool = False) -> tuple[float, float]:
    """Return the size of a figure in inches."""
    return max(2.9, 0.9 + (0.95 + 0.2 * pooled) * conditions), 3.0


def draw_comparison(panels: Sequence[Axes], c: Comparison, colours: Mapping[str, str]) -> None:
    """Draw every value of a measure, with the colours of the conditions."""
    factor, unit = axis_unit((o.value for o in c.observations), c.measure.unit)
    draw_distribution(
        panels,
        replace(c.measure, unit=unit).label,
        {
            condition_name(key): [
                (factor * o.value, factor * o.low, factor * o.high) for o in c.of(key)
            ]
            for key in c.summaries
        },
        {condition_name(key): colours[key] for key in c.summaries},
        "" if c.test is None else f"by epochs: {p_and_r(c.test.p, -c.test.r)}",
        {
            condition_name(key): factor * np.array([o.value, o.low, o.high])
            for key, o in c.pooled.items()
        },
    )


def draw_comparisons(
    panels: Sequence[Axes], compared: Sequence[Comparison], colours: Mapping[str, str]
) -> None:
    """Draw each measure on a panel of its own."""
    for axes, c in zip(panels, compared, strict=True):
        draw_comparison([axes], c, colours)


def day_rows(c: Comparison) -> list[list[tuple[str, str]]]:
    """Return subjects and days as rows; a subject that does not fit begins a new one."""
    rows: list[list[tuple[str, str]]] = [[]]
    for subject in dict.fromkeys(m.subject for m in c.day_medians):
        own = dict.fromkeys(m.day for m in c.day_medians if m.subject == subject)
        if rows[-1] and len(rows[-1]) + len(own) > MOST_IN_A_ROW:
            rows.append([])
        for day in own:
            if len(rows[-1]) == MOST_IN_A_ROW:
                rows.append([])
            rows[-1].append((subject, day))
    return rows


def day_groups(c: Comparison) -> dict[str, list[tuple[str, str]]]:
    """Return source and label of the epochs of each day and condition, by their line of points."""
    return {
        f"epochs-{place}": [
            (o.source, o.epoch)
            for o in c.observations
            if (o.subject, o.day, o.condition) == (m.subject, m.day, m.condition)
        ]
        for place, m in enumerate(c.day_medians)
    }


def draw_days(panels: Sequence[Axes], c: Comparison, order: Sequence[str]) -> None:
    """Draw a measure day by day, in the order of recording, with a gap between subjects.

    Parameters
    ----------
    panels : sequence of Axes
        One for each of `day_rows`, or one for all days.
    c : Comparison
        With at least one day.
    order : sequence of str
        All conditions of the report as people read them, for their colours and markers.
    """
    rows = day_rows(c)
    if len(panels) == 1:
        rows = [[slot for row in rows for slot in row]]
    factor, unit = axis_unit((o.value for o in c.observations), c.measure.unit)
    colours, markers = condition_colours(order), condition_markers(order)
    several = len({m.subject for m in c.day_medians}) > 1
    for axes, row in zip(panels, rows, strict=True):
        places: list[float] = []
        for (subject, day), (before, _) in zip(row, [("", ""), *row], strict=False):
            place = places[-1] + (1.7 if subject != before else 1.0) if places else 0.0
            if places and subject != before:
                axes.axvline(place - 0.85, color=GREY, linewidth=0.6)
            if several and (not places or subject != before):
                look: Look = {"va": "top", "color": GREY, "fontweight": "bold"}
                write_at(axes, place - 0.45, 1.0, subject[:24], share="y", **look)
            _day(axes, place, c, (subject, day), factor, colours, markers)
            places.append(place)
        axes.set_xlim(-0.6, max(places[-1] + 0.6, 1.6))
        axes.set_xticks(places, [wrapped(day, 12, 1) for _, day in row])
        axes.tick_params(axis="x", length=0, rotation=45 * (longest_day(c) > 3))
        axes.grid(visible=False, axis="x")
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + 0.12 * (high - low) * several)
        axes.set_ylabel(f"{c.measure.title}\n({unit})")
    panels[-1].set_xlabel("Day, in the order of recording")
    shown = sorted({m.condition for m in c.day_medians}, key=lambda name: _side(c, name))
    for name in map(condition_name, shown):
        panels[0].plot([], [], markers[name], color=colours[name], ms=6, label=listed(name))
    legend_above(panels[0])


def longest_day(c: Comparison) -> int:
    """Return the length of the longest name of a day."""
    return max(len(m.day) for m in c.day_medians)


def _side(c: Comparison, condition: str) -> tuple[int, str]:
    """Return where a condition stands: the reference left of the other, whichever came first."""
    return (c.pair.index(condition) if condition in c.pair else len(c.pair), condition)


def _day(
    axes: Axes,
    place: float,
    c: Comparison,
    slot: tuple[str, str],
    factor: float,
    colours: Mapping[str, str],
    markers: Mapping[str, str],
) -> None:
    """Draw the conditions of one day side by side, the reference left, their medians joined."""
    own = [(k, m) for k, m in enumerate(c.day_medians) if (m.subject, m.day) == slot]
    own.sort(key=lambda each: _side(c, each[1].condition))
    width = 1.0 / len(own)
    centres = place + 0.9 * width * (np.arange(len(own)) - (len(own) - 1) / 2)
    for centre, (k, m) in zip(centres, own, strict=True):
        values = np.array([o.value for o in c.of(m.condition) if (o.subject, o.day) == slot])
        rows = factor * np.column_stack([values, np.full((values.size, 2), np.nan)])
        name = condition_name(m.condition)
        _strip(axes, centre, width, rows, colours[name], 2 * markers[name], f"epochs-{k}")
    if len(own) > 1:
        medians = [factor * m.median for _, m in own]
        axes.plot(centres + _BESIDE * width, medians, color=GREY, zorder=1.9)


def draw_ratings(panels: Sequence[Axes], found: RatingsFound, order: Sequence[str]) -> None:
    """Draw raw scores at the left; at the right corrected ones with the means of the model.

    Parameters
    ----------
    panels : sequence of Axes
        Two.
    found : RatingsFound
        At least one rating.
    order : sequence of str
        All conditions of the report, which gives them their colours.
    """
    colours = condition_colours(order)
    means = {condition_name(mean.condition): mean for mean in found.means}
    examiners = list(dict.fromkeys(row.examiner for row in found.rows))
    named = [(condition_name(row.condition), row.examiner) for row in found.rows]
    width = _LANES / len(examiners)
    raw, corrected = panels
    scores = np.array([row.score for row in found.rows])
    for axes, values in ((raw, scores), (corrected, np.asarray(found.fit.corrected))):
        each = product(enumerate(means), enumerate(examiners))
        for (place, condition), (lane, examiner) in each:
            own = values[[who == (condition, examiner) for who in named]]
            at = (
                place
                - 0.08
                + (lane - (len(examiners) - 1) / 2) * width
                + _side_by_side(own, _STEP * width)
            )
            marker = MARKERS[lane % len(MARKERS)]
            axes.plot(at, own, marker, color=colours[condition], ms=3.8, alpha=0.75, mew=0)
        counts = {name: sum(who == name for who, _ in named) for name in means}
        named_places(axes, [f"{wrapped(name, 16)}\nn = {n}" for name, n in counts.items()])
    for place, (condition, m) in enumerate(means.items()):
        colour = colours[condition]
        bar: Look = {"width": 2.0, "ms": 11, "mew": 2.2}
        with_intervals(corrected, place + _MEAN, (m.mean, m.low, m.high), colour, "_", **bar)
    for lane, examiner in enumerate(examiners):
        marker, label = MARKERS[lane % len(MARKERS)], listed(f"examiner {examiner}")
        raw.plot([], [], marker, color=GREY, ms=5, label=label)
    legend_outside(raw)
    raw.set_ylabel("Score")
    note(raw, "as given")
    note(corrected, "less the examiner's offset; bar: mean, 95 % interval")


def _side_by_side(values: Array, width: float) -> Array:
    """Return offsets that set equal values apart, within a width."""
    offsets = np.zeros(values.size)
    for level in np.unique(np.round(values, 9)):
        equal = np.abs(values - level) < 1e-8
        count = int(np.sum(equal))
        step = min(width / max(count - 1, 1), 0.035)
        offsets[equal] = step * (np.arange(count) - (count - 1) / 2)
    return offsets


def draw_relations(panels: Sequence[Axes], found: Sequence[Relation], order: Sequence[str]) -> None:
    """Draw the ratings of days against each of the measures, a panel for each.

    `order` has all conditions of the report, for their colours and markers.
    """
    colours, markers = condition_colours(order), condition_markers(order)
    for axes, one in zip(panels, found, strict=True):
        factor, unit = axis_unit(one.values, one.measure.unit)
        values, ratings = factor * np.array(one.values), np.array(one.ratings)
        conditions = np.array([condition_name(condition) for _, _, condition in one.visits])
        for name in dict.fromkeys(conditions.tolist()):
            own = conditions == name
            look: Look = {"color": colours[name], "ms": 5, "mew": 0, "alpha": 0.85}
            axes.plot(values[own], ratings[own], markers[name], label=listed(name), **look)
        axes.set_xlabel(replace(one.measure, unit=unit).label)
        note(axes, relation_words(one))
    panels[0].set_ylabel("Rating less offsets")
    legend_outside(panels[0])


def relation_words(one: Relation) -> str:
    """Return the rank correlation over all days with its interval."""
    rho, low, high = one.over_all
    return f"ρ = {number(rho, 2)} {interval(low, high, 2)}"
