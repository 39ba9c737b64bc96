"""Estimates as points: of all epochs in the order of recording, and of one fit in pairs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from rigidimeter.analysis.report.style import (
    GREY,
    OTHERS,
    condition_colours,
    condition_markers,
    legend_above,
    listed,
    wrapped,
)
from rigidimeter.core.records import PARAMETERS, Analysis, Fit, Score
from rigidimeter.core.words import axis_unit, condition_name, short_names

Array = NDArray[np.float64]

_NONE = condition_name("")
_MOST_NAMED = 25
"""Of more epochs the axis has numbers, not names."""
_MOST_SOURCES = 8
_CHI2_95 = 5.991
"""95 % quantile of χ² with two degrees of freedom."""
_PAIRS = ((0, 1), (0, 2), (1, 2))


class Quantity(NamedTuple):
    """What one panel shows of every epoch, in the order of the results; NaN where unknown."""

    title: str
    unit: str
    values: Array
    low: Array
    high: Array
    pooled: Mapping[str, tuple[float, float, float]]


def quantities(analysis: Analysis) -> list[Quantity]:
    """Return J, B and K of the fits; of an analysis of sinusoids alone, impulse and work."""
    if analysis.fits:
        values, low, high = (
            np.array([getattr(fit, at) for fit in analysis.fits]) for at in ("value", "low", "high")
        )
        several = len({fit.condition for fit in analysis.fits}) > 1
        pooled = [fit for fit in analysis.pooled if fit.condition or not several]
        return [
            Quantity(
                f"{p.title.capitalize()} {p.symbol}",
                p.unit,
                values[:, i],
                low[:, i],
                high[:, i],
                {fit.condition: (fit.value[i], fit.low[i], fit.high[i]) for fit in pooled},
            )
            for i, p in enumerate(PARAMETERS)
        ]
    unknown = np.full(len(analysis.scores), np.nan)
    impulse = np.array([score.impulse_nm_s for score in analysis.scores])
    work = np.array([score.work_j for score in analysis.scores])
    return [
        Quantity("Angular impulse", "N·m·s", impulse, unknown, unknown, {}),
        Quantity("Work", "J", work, unknown, unknown, {}),
    ]


def draw_epochs(
    panels: Sequence[Axes], results: Sequence[Fit | Score], shown: Sequence[Quantity]
) -> None:
    """Draw every epoch as a point with its 95 % interval, and that of all epochs as a band.

    A hollow point is an epoch that does not count; one without numbers is a cross at the bottom.

    Parameters
    ----------
    panels : sequence of Axes
        One for each of `shown`.
    results : sequence of Fit or Score
        In the order of recording; at least one.
    shown : sequence of Quantity
    """
    conditions = np.array([condition_name(one.condition) for one in results])
    included = np.array([one.outcome.included for one in results])
    place = np.arange(1, len(results) + 1)
    colours, markers = condition_colours(conditions), condition_markers(conditions)
    for axes, what in zip(panels, shown, strict=True):
        factor, unit = axis_unit(what.values, what.unit)
        for name, colour in colours.items():
            own = conditions == name
            for of, fill, word in (
                (own & included, colour, ""),
                (own & ~included, "white", ", does not count"),
            ):
                known = of & np.isfinite(what.values)
                if not known.any():
                    continue
                bars = known & np.isfinite(what.low) & np.isfinite(what.high)
                axes.vlines(
                    place[bars], factor * what.low[bars], factor * what.high[bars],
                    color=colour, linewidth=0.9,
                )  # fmt: skip
                label = listed(f"{name if any(conditions != _NONE) else 'epochs'}{word}")
                axes.plot(
                    place[known], factor * what.values[known], markers[name], color=colour,
                    mfc=fill, ms=4.5, label=label,
                )  # fmt: skip
            _band(axes, what, name, place[own], factor, colour)
        lost = ~np.isfinite(what.values)
        if lost.any():
            at = axes.get_xaxis_transform()
            axes.plot(
                place[lost], np.full(lost.sum(), 0.04), "x", color=GREY, transform=at,
                label="no estimate",
            )  # fmt: skip
        axes.set_ylabel(f"{what.title}\n({unit})")
        axes.set_xlim(0.4, len(results) + 0.6)
        axes.grid(visible=False, axis="x")
    _name_epochs(panels, results)
    legend_above(panels[0])


def _band(
    axes: Axes, what: Quantity, condition: str, place: Array, factor: float, colour: str
) -> None:
    """Draw the estimate of all epochs of a condition together, where they are."""
    pooled = {condition_name(name): ends for name, ends in what.pooled.items()}
    value, low, high = (factor * end for end in pooled.get(condition, (np.nan,) * 3))
    if not np.isfinite(value):
        return
    first, last = place.min() - 0.4, place.max() + 0.4
    axes.plot(
        [first, last], [value] * 2, color=colour, linewidth=0.9, zorder=1,
        label=listed(f"all epochs{'' if condition == _NONE else f' {condition}'}, 95 %"),
    )  # fmt: skip
    if np.isfinite(low) and np.isfinite(high):
        axes.fill_between([first, last], low, high, color=colour, alpha=0.13, linewidth=0)


def _name_epochs(panels: Sequence[Axes], results: Sequence[Fit | Score]) -> None:
    last = panels[-1]
    last.set_xlabel("Epoch, in the order of recording")
    if len(results) <= _MOST_NAMED:
        labels = [wrapped(one.epoch, 12, 1) for one in results]
        last.set_xticks(range(1, len(results) + 1), labels)
        if max(map(len, labels)) > 4:
            for label in last.get_xticklabels():
                label.set(rotation=45, ha="right", rotation_mode="anchor")
    else:
        last.xaxis.set_major_locator(MaxNLocator(integer=True))
    names = short_names(one.source for one in results)
    if len(names) < 2:
        return
    place = 0
    for source, own in groupby(results, lambda one: one.source):
        for axes in panels if place else ():
            axes.axvline(place + 0.5, color="#C8C8C8", linewidth=0.6, zorder=0)
        if len(names) <= _MOST_SOURCES:
            panels[0].annotate(
                wrapped(names[source], 24, 1), (place + 0.6, 0.99), va="top", fontsize=7,
                xycoords=panels[0].get_xaxis_transform(), color=GREY,
            )  # fmt: skip
        place += len(list(own))


def draw_pairs(panels: Sequence[Axes], fit: Fit) -> None:
    """Draw J, B and K of a fit in pairs: point, 95 % intervals and 95 % ellipse.

    Parameters
    ----------
    panels : sequence of Axes
        Three: J and B, J and K, B and K.
    fit : Fit
        With numbers; no ellipse where the covariance is not known.
    """
    own = condition_colours([condition_name(fit.condition)])
    taken = {line.get_color() for line in panels[0].lines}  # of a fit that was drawn before
    colour = next((one for one in (*own.values(), *OTHERS) if one not in taken), GREY)
    scaled = [axis_unit([value], p.unit) for value, p in zip(fit.value, PARAMETERS, strict=True)]
    label = "all epochs" if fit.epoch == "pooled" else f"epoch {fit.epoch}"
    label = listed(f"{label} {fit.condition}")
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    for axes, (i, k) in zip(panels, _PAIRS, strict=True):
        (x, y), (in_x, in_y) = fit.value[[i, k]], (scaled[i][0], scaled[k][0])
        axes.hlines(in_y * y, in_x * fit.low[i], in_x * fit.high[i], color=colour, linewidth=1.6)
        axes.vlines(in_x * x, in_y * fit.low[k], in_y * fit.high[k], color=colour, linewidth=1.6)
        axes.plot(in_x * x, in_y * y, "o", color=colour, ms=5, label=label)
        covariance = fit.covariance[np.ix_((i, k), (i, k))]
        if np.all(np.isfinite(covariance)) and np.linalg.det(covariance) > 0:
            circle = np.sqrt(_CHI2_95) * np.array([np.cos(turn), np.sin(turn)])
            across, up = np.linalg.cholesky(covariance) @ circle
            axes.plot(in_x * (x + across), in_y * (y + up), color=colour, linewidth=0.9)
        for axis, at in ((axes.xaxis, i), (axes.yaxis, k)):
            p = PARAMETERS[at]
            axis.set_label_text(f"{p.title.capitalize()} {p.symbol} ({scaled[at][1]})")
            axis.set_major_locator(MaxNLocator(4))
        axes.ticklabel_format(useOffset=False, style="plain")
    panels[0].set_title("95 % intervals and ellipses", loc="left", fontsize=9)
    legend_above(panels[-1])
