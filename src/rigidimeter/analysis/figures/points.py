"""Values as points by condition: every epoch, day by day, examiners' ratings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from rigidimeter.analysis.figures.style import (
    GREY,
    MARKERS,
    Look,
    condition_colours,
    condition_markers,
    labelled,
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
from rigidimeter.analysis.statistics import RankSum, summarise
from rigidimeter.analysis.study import (
    Measure,
    Ratings,
    Relation,
    StudyResult,
    counting,
    measures_of,
    pooled,
)
from rigidimeter.core.words import axis_unit, condition_name, interval, number, p_and_r

Array = NDArray[np.float64]

_ENDS = ["value", "low", "high"]

MOST_IN_A_ROW = 26
"""More days than this continue in another row of the same figure."""

_SPREAD, _ASIDE, _BESIDE, _POOLED = 0.24, -0.12, 0.28, 0.41
"""Of a strip of width 1: half of what its points take, where they, their median and the estimate
from all of them stand."""
_LANES, _STEP, _MEAN = 0.66, 0.9, 0.43
"""Width of the lanes of examiners, share of a lane for equal scores, and place of the mean."""


@dataclass(frozen=True)
class Values:
    """The values of a measure that count, as figures show them.

    Attributes
    ----------
    measure : Measure
    pair : (str, str)
        The conditions that are compared; the second is empty where there is one.
    rows : pandas.DataFrame
        As `counting` returns them.
    names : tuple of str
        The conditions in which the measure was recorded, the compared ones first.
    pooled : mapping of str to array, shape (3,)
        By condition: the estimate from all its epochs together, with the ends of its interval.
    remark : str
        p and r of the rank-sum test; empty without one.
    """

    measure: Measure
    pair: tuple[str, str]
    rows: pd.DataFrame
    names: tuple[str, ...] = ()
    pooled: Mapping[str, Array] = field(default_factory=dict)
    remark: str = ""

    def of(self, condition: str) -> pd.DataFrame:
        """Return the rows of one condition."""
        return self.rows[self.rows["condition"] == condition]

    @cached_property
    def days(self) -> dict[tuple[str, str, str], pd.DataFrame]:
        """The rows of each subject, day and condition, in the order of recording."""
        of_days = self.rows.groupby(["subject", "day", "condition"], sort=False)
        return {(s, d, c): own for (s, d, c), own in of_days}


def values_of(result: StudyResult, measure: Measure) -> Values:
    """Return the values of a measure of a result, all its conditions together."""
    rows = result.study.rows
    tested = result.value_test(measure.name)
    test = None if tested is None else tested.statistic
    return Values(
        measure,
        result.study.pair,
        counting(rows, measure.name),
        tuple(result.summaries(measure.name)),
        {
            one.condition: np.array([one.value, one.low, one.high])
            for one in pooled(rows, measure.name).itertuples()
        },
        f"by epochs: {p_and_r(test.p, -test.r)}" if isinstance(test, RankSum) else "",
    )


def drawn_values(result: StudyResult) -> list[Values]:
    """Return the values of each measure that has some, but for the ratings."""
    measures = [one for one in measures_of(result.study.rows) if one.origin != "ratings"]
    found = [values_of(result, one) for one in measures]
    return [one for one in found if len(one.rows)]


def epoch_keys(rows: pd.DataFrame) -> list[tuple[str, str]]:
    """Return source and label of the epoch of each row."""
    return list(zip(rows["session"], rows["epoch"], strict=True))


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


def draw_values(panels: Sequence[Axes], v: Values, colours: Mapping[str, str]) -> None:
    """Draw every value of a measure, with the colours of the conditions."""
    factor, unit = axis_unit(v.rows["value"], v.measure.unit)
    draw_distribution(
        panels,
        labelled(v.measure.title, unit),
        {condition_name(key): factor * v.of(key)[_ENDS].to_numpy() for key in v.names},
        {condition_name(key): colours[key] for key in v.names},
        v.remark,
        {condition_name(key): factor * ends for key, ends in v.pooled.items()},
    )


def draw_measures(
    panels: Sequence[Axes], shown: Sequence[Values], colours: Mapping[str, str]
) -> None:
    """Draw each measure on a panel of its own."""
    for axes, v in zip(panels, shown, strict=True):
        draw_values([axes], v, colours)


def day_rows(v: Values) -> list[list[tuple[str, str]]]:
    """Return subjects and days as rows; a subject that does not fit begins a new one."""
    rows: list[list[tuple[str, str]]] = [[]]
    for subject in dict.fromkeys(who for who, _, _ in v.days):
        own = dict.fromkeys(day for who, day, _ in v.days if who == subject)
        if rows[-1] and len(rows[-1]) + len(own) > MOST_IN_A_ROW:
            rows.append([])
        for day in own:
            if len(rows[-1]) == MOST_IN_A_ROW:
                rows.append([])
            rows[-1].append((subject, day))
    return rows


def day_groups(v: Values) -> dict[str, list[tuple[str, str]]]:
    """Return source and label of the epochs of each day and condition, by their line of points."""
    return {f"epochs-{place}": epoch_keys(own) for place, own in enumerate(v.days.values())}


def draw_days(panels: Sequence[Axes], v: Values, order: Sequence[str]) -> None:
    """Draw a measure day by day, in the order of recording, with a gap between subjects.

    Parameters
    ----------
    panels : sequence of Axes
        One for each of `day_rows`, or one for all days.
    v : Values
        At least one.
    order : sequence of str
        All conditions of the report as people read them, for their colours and markers.
    """
    rows = day_rows(v)
    if len(panels) == 1:
        rows = [[slot for row in rows for slot in row]]
    factor, unit = axis_unit(v.rows["value"], v.measure.unit)
    colours, markers = condition_colours(order), condition_markers(order)
    several = len({subject for subject, _, _ in v.days}) > 1
    for axes, row in zip(panels, rows, strict=True):
        places: list[float] = []
        for (subject, day), (before, _) in zip(row, [("", ""), *row], strict=False):
            place = places[-1] + (1.7 if subject != before else 1.0) if places else 0.0
            if places and subject != before:
                axes.axvline(place - 0.85, color=GREY, linewidth=0.6)
            if several and (not places or subject != before):
                look: Look = {"va": "top", "color": GREY, "fontweight": "bold"}
                write_at(axes, place - 0.45, 1.0, subject[:24], share="y", **look)
            _day(axes, place, v, (subject, day), factor, colours, markers)
            places.append(place)
        axes.set_xlim(-0.6, max(places[-1] + 0.6, 1.6))
        axes.set_xticks(places, [wrapped(day, 12, 1) for _, day in row])
        axes.tick_params(axis="x", length=0, rotation=45 * (longest_day(v) > 3))
        axes.grid(visible=False, axis="x")
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + 0.12 * (high - low) * several)
        axes.set_ylabel(f"{v.measure.title}\n({unit})")
    panels[-1].set_xlabel("Day, in the order of recording")
    shown = sorted({condition for _, _, condition in v.days}, key=lambda name: _side(v, name))
    for name in map(condition_name, shown):
        panels[0].plot([], [], markers[name], color=colours[name], ms=6, label=listed(name))
    legend_above(panels[0])


def longest_day(v: Values) -> int:
    """Return the length of the longest name of a day."""
    return max(len(day) for _, day, _ in v.days)


def _side(v: Values, condition: str) -> tuple[int, str]:
    """Return where a condition stands: the reference left of the other, whichever came first."""
    return (v.pair.index(condition) if condition in v.pair else 2, condition)


def _day(
    axes: Axes,
    place: float,
    v: Values,
    slot: tuple[str, str],
    factor: float,
    colours: Mapping[str, str],
    markers: Mapping[str, str],
) -> None:
    """Draw the conditions of one day side by side, the reference left, their medians joined."""
    own = [
        (k, condition, rows)
        for k, ((*who, condition), rows) in enumerate(v.days.items())
        if (*who,) == slot
    ]
    own.sort(key=lambda each: _side(v, each[1]))
    width = 1.0 / len(own)
    centres = place + 0.9 * width * (np.arange(len(own)) - (len(own) - 1) / 2)
    for centre, (k, condition, rows) in zip(centres, own, strict=True):
        name = condition_name(condition)
        points = factor * rows[_ENDS].assign(low=np.nan, high=np.nan).to_numpy()
        _strip(axes, centre, width, points, colours[name], 2 * markers[name], f"epochs-{k}")
    if len(own) > 1:
        medians = [factor * summarise(rows["value"]).median for _, _, rows in own]
        axes.plot(centres + _BESIDE * width, medians, color=GREY, zorder=1.9)


def draw_ratings(
    panels: Sequence[Axes],
    found: Ratings,
    means: Mapping[str, tuple[float, float, float]],
    order: Sequence[str],
) -> None:
    """Draw raw scores at the left; at the right corrected ones with the means of the model.

    Parameters
    ----------
    panels : sequence of Axes
        Two.
    found : Ratings
        At least one.
    means : mapping of str to (float, float, float)
        By condition as people read it: the mean and the ends of its interval.
    order : sequence of str
        All conditions of the report, which gives them their colours.
    """
    colours = condition_colours(order)
    raters = [*found.rows["rater"]]
    examiners = list(dict.fromkeys(raters))
    named = list(zip(map(condition_name, found.rows["condition"]), raters, strict=True))
    width = _LANES / len(examiners)
    raw, corrected = panels
    scores = found.rows["value"].to_numpy()
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
    for place, (condition, mean) in enumerate(means.items()):
        bar: Look = {"width": 2.0, "ms": 11, "mew": 2.2}
        with_intervals(corrected, place + _MEAN, mean, colours[condition], "_", **bar)
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
        axes.set_xlabel(labelled(one.measure.title, unit))
        note(axes, relation_words(one))
    panels[0].set_ylabel("Rating less offsets")
    legend_outside(panels[0])


def relation_words(one: Relation) -> str:
    """Return the rank correlation over all days with its interval."""
    rho, low, high = one.over_all
    return f"ρ = {number(rho, 2)} {interval(low, high, 2)}"
