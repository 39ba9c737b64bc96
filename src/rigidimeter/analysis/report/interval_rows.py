"""Estimates with their intervals below each other: effect sizes, other methods, other bands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from scipy.stats import norm

from rigidimeter.analysis.report.style import (
    GREY,
    INK,
    Look,
    condition_colours,
    condition_markers,
    drawable,
    legend_outside,
    listed,
    with_intervals,
    wrapped,
    write_at,
)
from rigidimeter.analysis.statistics import Effects, largest_r
from rigidimeter.analysis.study import Comparison, Measure, SensitivityRow, StudyResult
from rigidimeter.core.records import PARAMETERS, BandEstimate
from rigidimeter.core.words import axis_unit, condition_name, interval, number

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


def effect_words(found: Effects) -> str:
    """Return r of other − reference with its interval."""
    r, low, high = _turned(found)
    return f"{number(r, 2)} {interval(low, high, 2)}"


def _turned(found: Effects) -> tuple[float, float, float]:
    """Return r and its interval of other − reference; those of a test are reference − other."""
    return -found.r, -found.r_high, -found.r_low


def effects_label(result: StudyResult) -> str:
    """Return what the horizontal axis of effect sizes shows."""
    reference, other = condition_name(result.reference), condition_name(result.other)
    return f"Effect size r; above zero: {other} larger than {reference}"


def effects_size(rows: int) -> tuple[float, float]:
    """Return the size of the figure of effect sizes in inches."""
    return 7.4, 0.9 + 0.42 * rows


def draw_effects(
    panels: Sequence[Axes], found: Sequence[tuple[Comparison, Effects]], label: str
) -> None:
    """Draw the effect size of each measure with its interval; the numbers are at the right.

    Parameters
    ----------
    panels : sequence of Axes
        One.
    found : sequence of (Comparison, Effects)
        At least one. A thin grey tick on either side is the largest r that the group sizes allow.
    label : str
        Of the horizontal axis.
    """
    (axes,) = panels
    tests = [effects.test for _, effects in found]
    names = [wrapped(c.measure.title, 28, 2) for c, _ in found]
    _rows(axes, [f"{n}\nn = {t.n_x} and {t.n_y}" for n, t in zip(names, tests, strict=True)])
    for size in COHEN:
        for x in (-size, size):
            axes.axvline(x, color=GREY, linewidth=0.6, dashes=(1, 3), zorder=0)
    most = [largest_r(test.n_x, test.n_y) for test in tests]
    for place, (_, effects) in enumerate(found):
        r, *ends = _turned(effects)
        with_intervals(axes, place, (r, *ends), INK, "s", across=True, width=1.6, ms=6)
        if np.all(np.isfinite(ends)):
            axes.plot(ends, [place] * 2, "|", color=INK, ms=7)
        bounds = (-most[place], most[place])
        axes.plot(bounds, [place] * 2, "|", color=GREY, ms=13, mew=0.7, alpha=0.7)
        write_at(axes, 1.02, place, effect_words(effects), share="x", va="center")
    values = [_turned(effects) for _, effects in found]
    least, largest = np.nanmin(values), np.nanmax(values)
    reach = 1.05 * max(0.5, *most, abs(least), abs(largest))
    axes.set_xlim(
        -reach if least < -0.15 else min(1.1 * least, -0.15),
        reach if largest > 0.15 else max(1.1 * largest, 0.15),
    )
    axes.grid(visible=False)
    axes.set_xlabel(label)


def by_measure(found: Sequence[SensitivityRow]) -> dict[Measure, list[SensitivityRow]]:
    """Return the rows of each measure: a panel of the figure."""
    return {row.measure: [one for one in found if one.measure == row.measure] for row in found}


def methods_in(found: Sequence[SensitivityRow]) -> list[tuple[str, str]]:
    """Return methods with how J was treated, a row of each panel: what is concluded from first."""
    every = sorted(found, key=lambda row: (not row.chosen, row.inertia == "fixed"))
    return list(dict.fromkeys((row.method, row.inertia) for row in every))


def draw_methods(panels: Sequence[Axes], found: Sequence[SensitivityRow], label: str) -> None:
    """Draw a panel for each measure with one row for each method.

    Parameters
    ----------
    panels : sequence of Axes
        At least one for each of `by_measure`; the others are hidden.
    found : sequence of SensitivityRow
        At least one.
    label : str
        Of the horizontal axes, without a unit.
    """
    methods = methods_in(found)
    for axes in panels[len(by_measure(found)) :]:
        axes.set_visible(False)
    for axes, (measure, own) in zip(panels, by_measure(found).items(), strict=False):
        shifts = -np.array([(row.shift, row.shift_high, row.shift_low) for row in own])
        factor, unit = axis_unit(shifts.ravel(), measure.unit)
        _rows(axes, [f"{drawable(method)}, J {inertia}" for method, inertia in methods])
        for row, shift in zip(own, factor * shifts, strict=True):
            place, colour = methods.index((row.method, row.inertia)), INK if row.chosen else _OTHER
            marker, face = ("s", colour) if row.inertia == "fixed" else ("o", "white")
            width, size = (2.2, 6.5) if row.chosen else (1.2, 5.0)
            look: Look = {"width": width, "ms": size, "mfc": face, "mew": 1.2}
            with_intervals(axes, place, shift, colour, marker, across=True, **look)
        axes.set_title(wrapped(replace(measure, unit=unit).label, 30), fontsize=8.5)
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
