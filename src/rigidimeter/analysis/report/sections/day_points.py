"""Each measure day by day: every epoch a point, each day's median and quartiles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from rigidimeter.analysis.report.contents import (
    Block,
    Figure,
    Section,
    from_study_folder,
    paragraph,
)
from rigidimeter.analysis.report.style import (
    GREY,
    condition_colours,
    condition_markers,
    drawable,
    legend_above,
    listed,
    spread,
    styled,
    wrapped,
)
from rigidimeter.analysis.study import Comparison, DayMedian, Observation, StudyResult, result_table
from rigidimeter.core.words import Table, axis_unit, condition_name, number, plural

MOST_IN_A_ROW = 26
"""More days than this continue in another row of the same figure."""

_HALF = 0.2
_BESIDE = 0.3
"""How far to the right of its points the median of a day is drawn."""


class Day(NamedTuple):
    """The epochs of one day in one condition: their median and quartiles, and their values.

    `group` names their line of points, so that a page can say which epoch each of them is.
    """

    median: DayMedian
    values: Sequence[float]
    group: str = ""

    def times(self, factor: float) -> Day:
        """Return the same in another unit."""
        m = self.median
        median = replace(m, median=factor * m.median, q1=factor * m.q1, q3=factor * m.q3)
        return self._replace(median=median, values=[factor * value for value in self.values])

    @property
    def condition(self) -> str:
        """The condition as people read it."""
        return condition_name(self.median.condition)


def _blocks(result: StudyResult) -> Iterator[Block]:
    yield Table("days", "Medians of the days", (), result_table(result, "days"))
    ordered = sorted(result.comparisons, key=lambda c: c.measure.place)
    by_measure = [(c, found) for c in ordered if (found := _days(c))]
    if not by_measure:
        return
    yield paragraph(
        "Each small point is an included epoch. Beside the points of a day are their median and, "
        "as a bar, their quartiles; a line joins the medians of a day that has both conditions."
    )
    order = [condition_name(name) for name in result.condition_names]
    for c, found in by_measure:
        words = "; ".join(
            f"{m.subject} day {m.day} {condition_name(m.condition)}: median {number(m.median)}, "
            f"n = {m.n}"
            for m, *_ in found
        )
        count = sum(len(one.values) for one in found)
        n_days = len({(one.median.subject, one.median.day) for one in found})
        yield Figure(
            f"days_{c.measure.name}",
            f"{c.measure.title}: {plural(count, 'included epoch')} of {plural(n_days, 'day')}.",
            f"{c.measure.title} by day. {words} ({c.measure.unit}).",
            partial(_in_unit, c, found, order),
            marks=_marks(c),
        )


def _days(c: Comparison) -> list[Day]:
    """Return the days of a measure in the order of recording."""
    own = _by_day(c)
    return [
        Day(m, [o.value for o in own[m.subject, m.day, m.condition]], f"epochs-{place}")
        for place, m in enumerate(c.day_medians)
    ]


def _by_day(c: Comparison) -> dict[tuple[str, str, str], list[Observation]]:
    own: dict[tuple[str, str, str], list[Observation]] = {}
    for o in c.observations:
        own.setdefault((o.subject, o.day, o.condition), []).append(o)
    return own


def _marks(c: Comparison) -> dict[str, list[tuple[str, str]]]:
    own = _by_day(c)
    return {
        f"epochs-{place}": [(o.source, o.epoch) for o in own[m.subject, m.day, m.condition]]
        for place, m in enumerate(c.day_medians)
    }


def _in_unit(c: Comparison, found: Sequence[Day], order: Sequence[str]) -> Drawing:
    return days(*_scaled(c, found), order)


def _scaled(c: Comparison, found: Sequence[Day]) -> tuple[str, list[Day]]:
    """Return the label of the axis, and the days in its unit."""
    factor, unit = axis_unit((value for one in found for value in one.values), c.measure.unit)
    return f"{c.measure.title}\n({unit})", [one.times(factor) for one in found]


class _Slot(NamedTuple):
    """A place on the horizontal axis: a day of a subject, and its conditions."""

    subject: str
    day: str
    found: tuple[Day, ...]


def days(label: str, found: Sequence[Day], order: Sequence[str]) -> Drawing:
    """Draw days from left to right in the order given, with a gap between subjects.

    Parameters
    ----------
    label : str
        Of the vertical axis, with the unit.
    found : sequence of Day
        At least one; those of one subject and day share a place.
    order : sequence of str
        All conditions of the report, which gives them their colours and markers.
    """
    rows = _rows(found)
    longest = _longest(found)
    with styled():
        figure = Drawing(figsize=(7.4, 0.35 + (2.1 + 0.5 * (longest > 3)) * len(rows)))
        panels = np.atleast_1d(figure.subplots(len(rows), 1, sharey=True))
        _draw(list(panels), rows, label, found, order)
        figure.legend(loc="outside upper left", ncols=6, handletextpad=0.2)
    return figure


def draw_days(axes: Axes, c: Comparison, order: Sequence[str]) -> None:
    """Draw the days of a measure on axes, in one row however many there are."""
    label, found = _scaled(c, _days(c))
    _draw([axes], [[slot for row in _rows(found) for slot in row]], label, found, order)
    legend_above(axes)


def _longest(found: Sequence[Day]) -> int:
    return max(len(one.median.day) for one in found)


def _draw(
    panels: Sequence[Axes],
    rows: Sequence[Sequence[_Slot]],
    label: str,
    found: Sequence[Day],
    order: Sequence[str],
) -> None:
    several = len({one.median.subject for one in found}) > 1
    colours, markers = condition_colours(order), condition_markers(order)
    for axes, row in zip(panels, rows, strict=True):
        _row(axes, row, order, several)
        axes.set_ylabel(label)
        if _longest(found) > 3:
            axes.tick_params(axis="x", rotation=45)
    panels[-1].set_xlabel("Day, in the order of recording")
    for name in dict.fromkeys(one.condition for one in found):
        panels[0].plot([], [], markers[name], color=colours[name], ms=6, label=listed(name))


def _rows(found: Sequence[Day]) -> list[list[_Slot]]:
    """Return the days as slots, in rows; a subject that does not fit begins a new one."""
    by_day: dict[str, dict[str, list[Day]]] = {}
    for one in found:
        by_day.setdefault(one.median.subject, {}).setdefault(one.median.day, []).append(one)
    rows: list[list[_Slot]] = [[]]
    for subject, own in by_day.items():
        slots = [_Slot(subject, day, tuple(here)) for day, here in own.items()]
        if rows[-1] and len(rows[-1]) + len(slots) > MOST_IN_A_ROW:
            rows.append([])
        while slots:
            space = MOST_IN_A_ROW - len(rows[-1])
            rows[-1] += slots[:space]
            slots = slots[space:]
            if slots:
                rows.append([])
    return rows


def _row(axes: Axes, slots: Sequence[_Slot], order: Sequence[str], several: bool) -> None:
    places: list[float] = []
    place = -1.0
    previous = ""
    for slot in slots:
        first = not places or slot.subject != previous
        place += 1.7 if places and first else 1.0
        if first and places:
            axes.axvline(place - 0.85, color=GREY, linewidth=0.6)
        if first and several:
            axes.annotate(
                drawable(slot.subject[:24]),
                (place - 0.45, 1.0),
                xycoords=axes.get_xaxis_transform(),
                va="top",
                fontsize=8,
                fontweight="bold",
                color=GREY,
            )
        share = len(slot.found)
        # Two conditions of one day are drawn side by side, their medians joined.
        centres = [place + (k - (share - 1) / 2) * 0.9 / share for k in range(share)]
        medians = [one.median.median for one in slot.found]
        joined = [centre + _BESIDE / share for centre in centres]
        axes.plot(joined[: share * (share > 1)], medians[: share * (share > 1)], color=GREY)
        for centre, one in zip(centres, slot.found, strict=True):
            _strip(axes, centre, 1.0 / share, one, order)
        places.append(place)
        previous = slot.subject
    axes.set_xlim(-0.6, max(place + 0.6, 4.0))
    axes.set_xticks(places, [wrapped(slot.day, 12, 1) for slot in slots])
    axes.tick_params(axis="x", length=0)
    axes.grid(visible=False, axis="x")
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.12 * (high - low) * several)


def _strip(axes: Axes, centre: float, width: float, one: Day, order: Sequence[str]) -> None:
    colour = condition_colours(order)[one.condition]
    marker = condition_markers(order)[one.condition]
    values = np.asarray(one.values, dtype=np.float64)
    across = centre - 0.12 * width + spread(values.size, _HALF) * width
    (points,) = axes.plot(across, values, marker, color=colour, alpha=0.5, ms=2.8, mew=0)
    points.set_gid(one.group or None)
    beside = centre + _BESIDE * width
    axes.vlines(beside, one.median.q1, one.median.q3, color=colour, linewidth=1.8)
    axes.plot(beside, one.median.median, marker, color=colour, markersize=6, mec="white", mew=0.7)


SECTION = Section("days", "Day by day", _blocks, from_study_folder)
