"""Examiners' scores, as they were given and less each examiner's offset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rigidimeter.reporting.figures.style import GREY, MARKERS, listed, note, styled, wrapped

__all__ = ["Mark", "Mean", "ratings"]

_LANES = 0.66
"""The width of a condition that its examiners share."""
_STEP = 0.9
"""How far equal scores of an examiner spread, in widths of a lane."""
_MEAN = 0.43


class Mark(NamedTuple):
    """One rating: who gave it in what, the score, and the score less the offset of who gave it."""

    condition: str
    examiner: str
    score: float
    corrected: float


class Mean(NamedTuple):
    """The model's mean of a condition and the ends of its interval."""

    value: float
    low: float
    high: float


def ratings(
    marks: Sequence[Mark], means: Mapping[str, Mean], colours: Mapping[str, str], interval: str
) -> Figure:
    """Draw raw scores at the left; at the right corrected ones with the means of the model.

    Parameters
    ----------
    marks : sequence of Mark
        At least one.
    means : mapping of str to Mean
        By condition, in the order in which conditions are drawn.
    colours : mapping of str to str
        By condition.
    interval : str
        What the ends of the means are, for example ``95 % interval``.
    """
    examiners = list(dict.fromkeys(mark.examiner for mark in marks))
    with styled():
        figure = Figure(figsize=(7.4, 3.3))
        raw, corrected = figure.subplots(1, 2, sharey=True)
        for axes, which in ((raw, "score"), (corrected, "corrected")):
            for place, condition in enumerate(means):
                for lane, examiner in enumerate(examiners):
                    values = np.array(
                        [
                            getattr(mark, which)
                            for mark in marks
                            if (mark.condition, mark.examiner) == (condition, examiner)
                        ]
                    )
                    width = _LANES / len(examiners)
                    centre = place - 0.08 + (lane - (len(examiners) - 1) / 2) * width
                    _lane(axes, centre, _STEP * width, values, colours[condition], lane)
            axes.set_xlim(-0.6, len(means) - 0.4)
            axes.set_xticks(
                range(len(means)),
                [
                    f"{wrapped(name, 16)}\nn = {sum(m.condition == name for m in marks)}"
                    for name in means
                ],
            )
            axes.tick_params(axis="x", length=0)
            axes.grid(visible=False, axis="x")
        for place, (condition, mean) in enumerate(means.items()):
            _mean(corrected, place + _MEAN, mean, colours[condition])
        for lane, examiner in enumerate(examiners):
            raw.plot(
                [],
                [],
                MARKERS[lane % len(MARKERS)],
                color=GREY,
                markersize=5,
                label=listed(f"examiner {examiner}"),
            )
        figure.legend(loc="outside upper left", ncols=6, handletextpad=0.2)
        raw.set_ylabel("Score")
        note(raw, "as given")
        note(corrected, f"less the examiner's offset; bar: mean, {interval}")
    return figure


def _lane(
    axes: Axes, centre: float, width: float, values: np.ndarray, colour: str, lane: int
) -> None:
    """Draw one examiner's scores; equal ones stand side by side, so that each is seen."""
    for level in np.unique(np.round(values, 9)):
        count = int(np.sum(np.abs(values - level) < 1e-8))
        step = min(width / max(count - 1, 1), 0.035)
        across = centre + step * (np.arange(count) - (count - 1) / 2)
        axes.plot(
            across,
            np.full(count, level),
            MARKERS[lane % len(MARKERS)],
            color=colour,
            markersize=3.8,
            alpha=0.75,
            markeredgewidth=0,
        )


def _mean(axes: Axes, place: float, mean: Mean, colour: str) -> None:
    if np.isfinite(mean.low) and np.isfinite(mean.high):
        axes.vlines(place, mean.low, mean.high, color=colour, linewidth=2.0)
    axes.plot(place, mean.value, "_", color=colour, markersize=11, markeredgewidth=2.2)
