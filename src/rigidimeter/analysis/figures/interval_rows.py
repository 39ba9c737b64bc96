"""Estimates with their intervals below each other: effect sizes, other methods, other bands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from scipy.stats import norm

from rigidimeter.analysis.figures.style import (
    GREY,
    INK,
    Look,
    condition_colours,
    condition_markers,
    drawable,
    labelled,
    legend_outside,
    listed,
    with_intervals,
    wrapped,
    write_at,
)
from rigidimeter.analysis.statistics import largest_r
from rigidimeter.analysis.study import StudyResult, result_table
from rigidimeter.core.records import PARAMETERS, BandEstimate
from rigidimeter.core.words import axis_unit, condition_name, interval, number

Row = Mapping[str, Any]

COHEN = (0.1, 0.3, 0.5)
"""What is called a small, a medium and a large r."""

WIDE = float(norm.ppf(0.975))
_OTHER = "#0072B2"
_BESIDE = 0.5
"""The rows of all conditions of one band fill this share of its height."""


def _rows(axes: Axes, labels: Sequence[str]) -> None:
    """Name the rows, the first one at the top, and mark zero."""
    axes.axvline(0.0, color=GREY, linewidth=0.9, zorder=1)
    axes.set_yticks(range(len(labels)), labels)
    axes.set_ylim(len(labels) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")


def effect_rows(result: StudyResult) -> list[Row]:
    """Return the rows of the table of comparisons that have an effect size with its interval."""
    return [row for row in result_table(result, "comparisons") if row["interval_method"]]


def effect_words(row: Row) -> str:
    """Return r of other − reference with its interval."""
    r, low, high = _turned(row)
    return f"{number(r, 2)} {interval(low, high, 2)}"


def _turned(row: Row, name: str = "r") -> tuple[float, float, float]:
    """Return a number and its interval of other − reference; tables have reference − other."""
    return -row[name], -row[f"{name}_high"], -row[f"{name}_low"]


def effects_label(result: StudyResult) -> str:
    """Return what the horizontal axis of effect sizes shows."""
    reference, other = map(condition_name, result.study.pair)
    return f"Effect size r; above zero: {other} larger than {reference}"


def effects_size(rows: int) -> tuple[float, float]:
    """Return the size of the figure of effect sizes in inches."""
    return 7.4, 0.9 + 0.42 * rows


def draw_effects(panels: Sequence[Axes], found: Sequence[Row], label: str) -> None:
    """Draw the effect size of each measure with its interval; the numbers are at the right.

    Parameters
    ----------
    panels : sequence of Axes
        One.
    found : sequence of mappings
        At least one, as `effect_rows` gives them. A thin grey tick on either side is the largest r
        that the group sizes allow.
    label : str
        Of the horizontal axis.
    """
    (axes,) = panels
    sizes = [(row["n_x"], row["n_y"]) for row in found]
    names = [wrapped(row["title"], 28, 2) for row in found]
    _rows(axes, [f"{n}\nn = {x} and {y}" for n, (x, y) in zip(names, sizes, strict=True)])
    for size in COHEN:
        for x in (-size, size):
            axes.axvline(x, color=GREY, linewidth=0.6, dashes=(1, 3), zorder=0)
    most = [largest_r(*both) for both in sizes]
    for place, row in enumerate(found):
        r, *ends = _turned(row)
        with_intervals(axes, place, (r, *ends), INK, "s", across=True, width=1.6, ms=6)
        if np.all(np.isfinite(ends)):
            axes.plot(ends, [place] * 2, "|", color=INK, ms=7)
        bounds = (-most[place], most[place])
        axes.plot(bounds, [place] * 2, "|", color=GREY, ms=13, mew=0.7, alpha=0.7)
        write_at(axes, 1.02, place, effect_words(row), share="x", va="center")
    values = [*map(_turned, found)]
    least, largest = np.nanmin(values), np.nanmax(values)
    reach = 1.05 * max(0.5, *most, abs(least), abs(largest))
    axes.set_xlim(
        -reach if least < -0.15 else min(1.1 * least, -0.15),
        reach if largest > 0.15 else max(1.1 * largest, 0.15),
    )
    axes.grid(visible=False)
    axes.set_xlabel(label)


def by_measure(found: Sequence[Row]) -> dict[str, list[Row]]:
    """Return the rows of each measure: a panel of the figure."""
    names = dict.fromkeys(row["measure"] for row in found)
    return {name: [row for row in found if row["measure"] == name] for name in names}


def methods_in(found: Sequence[Row]) -> list[tuple[str, str]]:
    """Return methods with how J was treated, a row of each panel: what is concluded from first."""
    every = sorted(found, key=lambda row: (not row["chosen"], row["inertia"] == "fixed"))
    return list(dict.fromkeys((row["method"], row["inertia"]) for row in every))


def shift(row: Row) -> tuple[float, float, float]:
    """Return the shift of a method with its interval, other − reference."""
    return _turned(row, "shift")


def draw_methods(panels: Sequence[Axes], found: Sequence[Row], label: str) -> None:
    """Draw a panel for each measure with one row for each method.

    Parameters
    ----------
    panels : sequence of Axes
        At least one for each of `by_measure`; the others are hidden.
    found : sequence of mappings
        The rows of the table of methods, at least one.
    label : str
        Of the horizontal axes, without a unit.
    """
    methods = methods_in(found)
    for axes in panels[len(by_measure(found)) :]:
        axes.set_visible(False)
    for axes, own in zip(panels, by_measure(found).values(), strict=False):
        shifts = np.array([*map(shift, own)])
        factor, unit = axis_unit(shifts.ravel(), own[0]["unit"])
        _rows(axes, [f"{drawable(method)}, J {inertia}" for method, inertia in methods])
        for row, ends in zip(own, factor * shifts, strict=True):
            place = methods.index((row["method"], row["inertia"]))
            colour = INK if row["chosen"] else _OTHER
            marker, face = ("s", colour) if row["inertia"] == "fixed" else ("o", "white")
            width, size = (2.2, 6.5) if row["chosen"] else (1.2, 5.0)
            look: Look = {"width": width, "ms": size, "mfc": face, "mew": 1.2}
            with_intervals(axes, place, ends, colour, marker, across=True, **look)
        axes.set_title(wrapped(labelled(own[0]["title"], unit), 30), fontsize=8.5)
        axes.set_xlabel(drawable(label))
        axes.xaxis.set_major_locator(MaxNLocator(3))
        axes.margins(x=0.08)


def band_label(one: BandEstimate) -> str:
    """Return the band of an estimate, or which part of the epochs it is from."""
    if one.part != "all":
        return f"{one.part} of each epoch"
    return f"{one.low_hz:.2g} to {one.high_hz:.3g} Hz"


def band_percent(one: BandEstimate) -> NDArray[np.float64]:
    """Return change and the ends of its interval, in % of the estimate in the band of the fit.

    The shape is (3, 3): of each parameter a row.
    """
    change, half = np.array(one.change), WIDE * np.array(one.change_se)
    scale = 100 / np.abs(np.array(one.value) - change)
    return np.column_stack([scale * change, scale * (change - half), scale * (change + half)])


def draw_bands(
    panels: Sequence[Axes], found: Sequence[BandEstimate], half: dict[str, NDArray[np.float64]]
) -> None:
    """Draw a panel for each parameter, with a row for each band.

    Parameters
    ----------
    panels : sequence of Axes
        Three.
    found : sequence of BandEstimate
        At least one.
    half : dict of str to array, shape (3,)
        By condition, half the interval of the estimate in %; none is drawn where it is missing.
    """
    others = [one for one in found if not one.of_fit]
    labels = list(dict.fromkeys(map(band_label, others)))
    conditions = list(dict.fromkeys(one.condition for one in found))
    colours = condition_colours(map(condition_name, conditions))
    markers = condition_markers(map(condition_name, conditions))
    for i, (axes, parameter) in enumerate(zip(panels, PARAMETERS, strict=True)):
        _rows(axes, labels)
        for k, condition in enumerate(conditions):
            name = condition_name(condition)
            wide = half.get(condition, np.full(3, np.nan))[i]
            if np.isfinite(wide):
                axes.axvspan(-wide, wide, color=colours[name], alpha=0.12, linewidth=0)
            own = [one for one in others if one.condition == condition]
            rows = [band_percent(one)[i] for one in own]
            beside = _BESIDE * ((k + 0.5) / len(conditions) - 0.5)
            places = [labels.index(band_label(one)) + beside for one in own]
            look: Look = {"across": True, "ms": 4, "label": listed(name)}
            with_intervals(axes, places, rows, colours[name], markers[name], **look)
        axes.set_title(parameter.symbol)
        axes.set_xlabel("Change (%)")
    if len(conditions) > 1:
        legend_outside(panels[0])
