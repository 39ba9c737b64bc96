"""One measure day by day: every epoch a point, each day's median and quartiles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rigidimeter.reporting.figures.style import GREY, drawable, listed, note, styled, wrapped

__all__ = ["DayStrip", "days"]

MOST_IN_A_ROW = 26
"""More days than this go on in another row of the same figure."""

_GOLDEN = 0.6180339887498949
_HALF = 0.2
_BESIDE = 0.3
"""How far to the right of its points the median of a day stands."""


class DayStrip(NamedTuple):
    """The epochs of one day in one condition, with their median and quartiles."""

    subject: str
    day: str
    condition: str
    values: Sequence[float]
    median: float
    q1: float
    q3: float


class _Slot(NamedTuple):
    """A place on the horizontal axis: a day of a subject, and what was done on it."""

    subject: str
    day: str
    strips: tuple[DayStrip, ...]


def days(
    label: str,
    strips: Sequence[DayStrip],
    colours: Mapping[str, str],
    markers: Mapping[str, str],
    remark: str = "",
) -> Figure:
    """Draw days from left to right in the order given, subjects apart.

    Parameters
    ----------
    label : str
        Of the vertical axis, with the unit.
    strips : sequence of DayStrip
        At least one; those of one subject and day share a place.
    colours, markers : mapping of str to str
        By condition.
    remark : str
        A few words above the axes.
    """
    rows = _rows(strips)
    several = len({strip.subject for strip in strips}) > 1
    longest = max(len(slot.day) for row in rows for slot in row)
    with styled():
        figure = Figure(figsize=(7.4, 0.35 + (2.1 + 0.5 * (longest > 3)) * len(rows)))
        panels = np.atleast_1d(figure.subplots(len(rows), 1, sharey=True))
        for axes, row in zip(panels, rows, strict=True):
            _row(axes, row, colours, markers, several)
            axes.set_ylabel(label)
            if longest > 3:
                axes.tick_params(axis="x", rotation=45)
        panels[-1].set_xlabel("Day, in the order of recording")
        shown = dict.fromkeys(strip.condition for strip in strips)
        for name in shown:
            panels[0].plot(
                [], [], markers[name], color=colours[name], markersize=6, label=listed(name)
            )
        figure.legend(loc="outside upper left", ncols=6, handletextpad=0.2)
        note(panels[0], remark)
    return figure


def _rows(strips: Sequence[DayStrip]) -> list[list[_Slot]]:
    """Return the days as slots, in rows; a subject that does not fit begins a new one."""
    by_day: dict[str, dict[str, list[DayStrip]]] = {}
    for strip in strips:
        by_day.setdefault(strip.subject, {}).setdefault(strip.day, []).append(strip)
    rows: list[list[_Slot]] = [[]]
    for subject, own in by_day.items():
        slots = [_Slot(subject, day, tuple(found)) for day, found in own.items()]
        if rows[-1] and len(rows[-1]) + len(slots) > MOST_IN_A_ROW:
            rows.append([])
        while slots:
            space = MOST_IN_A_ROW - len(rows[-1])
            rows[-1] += slots[:space]
            slots = slots[space:]
            if slots:
                rows.append([])
    return rows


def _row(
    axes: Axes,
    slots: Sequence[_Slot],
    colours: Mapping[str, str],
    markers: Mapping[str, str],
    several: bool,
) -> None:
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
        for k, strip in enumerate(slot.strips):
            # Two conditions on one day stand beside each other.
            share = len(slot.strips)
            centre = place + (k - (share - 1) / 2) * 0.9 / share
            _strip(axes, centre, 1.0 / share, strip, colours, markers)
        places.append(place)
        previous = slot.subject
    axes.set_xlim(-0.6, max(place + 0.6, 4.0))
    axes.set_xticks(places, [wrapped(slot.day, 12, 1) for slot in slots])
    axes.tick_params(axis="x", length=0)
    axes.grid(visible=False, axis="x")
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.12 * (high - low) * several)


def _strip(
    axes: Axes,
    centre: float,
    width: float,
    strip: DayStrip,
    colours: Mapping[str, str],
    markers: Mapping[str, str],
) -> None:
    colour, marker = colours[strip.condition], markers[strip.condition]
    values = np.asarray(strip.values, dtype=np.float64)
    across = centre - 0.12 * width + _jitter(values.size) * width
    axes.plot(across, values, marker, color=colour, alpha=0.5, markersize=2.8, markeredgewidth=0)
    beside = centre + _BESIDE * width
    axes.vlines(beside, strip.q1, strip.q3, color=colour, linewidth=1.8)
    axes.plot(beside, strip.median, marker, color=colour, markersize=6, mec="white", mew=0.7)


def _jitter(count: int) -> NDArray[np.float64]:
    share = np.mod(0.5 + _GOLDEN * np.arange(count), 1.0)
    return np.asarray(_HALF * (2 * share - 1), dtype=np.float64)
