"""Estimates as points: of all epochs in the order of recording, and of one fit in pairs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from rigidimeter.analysis.figures.style import (
    GREY,
    OTHERS,
    Look,
    condition_colours,
    condition_markers,
    legend_above,
    listed,
    with_intervals,
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
    """What one panel shows of every epoch, in the order of the results; NaN where unknown.

    `rows` has the shape (n, 3): values and the ends of their intervals; so has `pooled` by
    condition, the shape (3,).
    """

    title: str
    unit: str
    rows: Array
    pooled: Mapping[str, Array]


def quantities(analysis: Analysis) -> list[Quantity]:
    """Return J, B and K of the fits; of an analysis of sinusoids alone, impulse and work."""
    if analysis.fits:
        several = len({fit.condition for fit in analysis.fits}) > 1
        pooled = [fit for fit in analysis.pooled if fit.condition or not several]
        return [
            Quantity(
                f"{p.title.capitalize()} {p.symbol}",
                p.unit,
                np.array([(fit.value[i], fit.low[i], fit.high[i]) for fit in analysis.fits]),
                {
                    condition_name(fit.condition): np.array([fit.value[i], fit.low[i], fit.high[i]])
                    for fit in pooled
                },
            )
            for i, p in enumerate(PARAMETERS)
        ]
    scored = [
        ("Angular impulse", "N·m·s", [score.impulse_nm_s for score in analysis.scores]),
        ("Work", "J", [score.work_j for score in analysis.scores]),
    ]
    return [
        Quantity(title, unit, np.array([(value, np.nan, np.nan) for value in values]), {})
        for title, unit, values in scored
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
        factor, unit = axis_unit(what.rows[:, 0], what.unit)
        rows = factor * what.rows
        known = np.isfinite(rows[:, 0])
        for name, colour in colours.items():
            own = conditions == name
            title = name if any(conditions != _NONE) else "epochs"
            for of, fill, word in (
                (own & included, colour, ""),
                (own & ~included, "white", ", does not count"),
            ):
                if np.any(drawn := of & known):
                    look: Look = {
                        "width": 0.9,
                        "mfc": fill,
                        "ms": 4.5,
                        "label": listed(f"{title}{word}"),
                    }
                    with_intervals(axes, place[drawn], rows[drawn], colour, markers[name], **look)
            value, low, high = factor * what.pooled.get(name, np.full(3, np.nan))
            if np.isfinite(value):
                ends = [place[own].min() - 0.4, place[own].max() + 0.4]
                label = listed(f"all epochs{'' if name == _NONE else f' {name}'}, 95 %")
                axes.plot(ends, [value] * 2, color=colour, lw=0.9, zorder=1, label=label)
                axes.fill_between(ends, low, high, color=colour, alpha=0.13, linewidth=0)
        if not known.all():
            foot = np.full((~known).sum(), 0.04)
            at = axes.get_xaxis_transform()
            axes.plot(place[~known], foot, "x", color=GREY, transform=at, label="no estimate")
        axes.set_ylabel(f"{what.title}\n({unit})")
        axes.set_xlim(0.4, len(results) + 0.6)
        axes.grid(visible=False, axis="x")
    _name_epochs(panels, results)
    legend_above(panels[0])


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
    factors = np.array([factor for factor, _ in scaled])
    value, low, high = (factors * ends for ends in (fit.value, fit.low, fit.high))
    label = "all epochs" if fit.epoch == "pooled" else f"epoch {fit.epoch}"
    label = listed(f"{label} {fit.condition}")
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    for axes, (i, k) in zip(panels, _PAIRS, strict=True):
        axes.hlines(value[k], low[i], high[i], color=colour, linewidth=1.6)
        upward = value[k], low[k], high[k]
        with_intervals(axes, value[i], upward, colour, "o", width=1.6, ms=5, label=label)
        covariance = (fit.covariance * np.outer(factors, factors))[np.ix_((i, k), (i, k))]
        if np.all(np.isfinite(covariance)) and np.linalg.det(covariance) > 0:
            circle = np.sqrt(_CHI2_95) * np.array([np.cos(turn), np.sin(turn)])
            across, up = np.linalg.cholesky(covariance) @ circle
            axes.plot(value[i] + across, value[k] + up, color=colour, linewidth=0.9)
        for axis, at in ((axes.xaxis, i), (axes.yaxis, k)):
            p = PARAMETERS[at]
            axis.set_label_text(f"{p.title.capitalize()} {p.symbol} ({scaled[at][1]})")
            axis.set_major_locator(MaxNLocator(4))
    panels[0].set_title("95 % intervals and ellipses", loc="left", fontsize=9)
    legend_above(panels[-1])
