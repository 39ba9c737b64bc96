"""Examiners' ratings: as given and less the offsets, the means and contrast of the mixed model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

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
    MARKERS,
    condition_colours,
    listed,
    note,
    styled,
    wrapped,
)
from rigidimeter.analysis.study import RatingMean, RatingsFound, StudyResult, result_table
from rigidimeter.core.words import (
    INTERVAL,
    SESSION,
    Column,
    Table,
    condition_name,
    interval,
    number,
)

_LANES = 0.66
"""The width of a condition that its examiners share."""
_STEP = 0.9
"""How far equal scores of an examiner spread, in widths of a lane."""
_MEAN = 0.43


def _blocks(result: StudyResult) -> Iterator[Block]:
    found = result.ratings
    if found is None:
        return
    words = "; ".join(
        f"{condition_name(m.condition)} {number(m.mean, 3)} {interval(m.low, m.high, 3)}"
        for m in found.means
    )
    order = [condition_name(name) for name in (*result.condition_names, *found.fit.conditions)]
    yield Figure(
        "ratings",
        f"All {len(found.rows)} scores: as given (left) and less each examiner’s predicted offset "
        "(right). Equal scores are drawn side by side. Bars: means of the model with 95 % "
        "intervals.",
        f"Examiners' scores as given and corrected. Means of the model: {words}.",
        partial(ratings, found, order),
    )
    yield paragraph(f"Means of the model with 95 % Kenward–Roger intervals: {words}.")
    yield Table(
        "rating_contrast",
        f"Contrast of the ratings, {found.other} − {found.reference}",
        (
            Column("freedom", "Degrees of freedom by", "text"),
            Column("estimate", f"Difference {INTERVAL}", ends=("low", "high")),
            Column("se", "SE"),
            Column("f", "F"),
            Column("df", "df"),
            Column("p", "p", "p"),
        ),
        result_table(result, "rating_contrast"),
    )
    yield Table(
        "rating_offsets",
        "Predicted offsets (shrunk toward zero)",
        (
            Column("grouping", "Offset of", "label"),
            Column("name", "Name", "label"),
            Column("ratings", "Ratings", "count"),
            Column("offset", "Offset"),
            Column("sd", "SD of such offsets"),
        ),
        result_table(result, "rating_offsets"),
    )
    for text in (*found.notices, *found.model_notices):
        yield paragraph(f"{text}.", "remark")
    yield Table(
        "ratings",
        "Ratings as given, and less the offsets",
        (
            *SESSION,
            Column("examiner", "Examiner", "label"),
            Column("score", "Score", "setting"),
            Column("corrected", "Score less offsets"),
        ),
        result_table(result, "ratings"),
        folding=True,
    )


def ratings(found: RatingsFound, order: Sequence[str]) -> Drawing:
    """Draw raw scores at the left; at the right corrected ones with the means of the model.

    Parameters
    ----------
    found : RatingsFound
        At least one rating.
    order : sequence of str
        All conditions of the report, which gives them their colours.
    """
    colours = condition_colours(order)
    means = {condition_name(mean.condition): mean for mean in found.means}
    examiners = list(dict.fromkeys(row.examiner for row in found.rows))
    named = [(condition_name(row.condition), row.examiner) for row in found.rows]
    with styled():
        figure = Drawing(figsize=(7.4, 3.3))
        raw, corrected = figure.subplots(1, 2, sharey=True)
        scores = np.array([row.score for row in found.rows])
        for axes, values in ((raw, scores), (corrected, np.asarray(found.fit.corrected))):
            for place, condition in enumerate(means):
                for lane, examiner in enumerate(examiners):
                    own = values[[who == (condition, examiner) for who in named]]
                    width = _LANES / len(examiners)
                    centre = place - 0.08 + (lane - (len(examiners) - 1) / 2) * width
                    _lane(axes, centre, _STEP * width, own, colours[condition], lane)
            axes.set_xlim(-0.6, len(means) - 0.4)
            axes.set_xticks(
                range(len(means)),
                [
                    f"{wrapped(name, 16)}\nn = {sum(who[0] == name for who in named)}"
                    for name in means
                ],
            )
            axes.tick_params(axis="x", length=0)
            axes.grid(visible=False, axis="x")
        for place, (condition, mean) in enumerate(means.items()):
            _mean(corrected, place + _MEAN, mean, colours[condition])
        for lane, examiner in enumerate(examiners):
            marker = MARKERS[lane % len(MARKERS)]
            label = listed(f"examiner {examiner}")
            raw.plot([], [], marker, color=GREY, markersize=5, label=label)
        figure.legend(loc="outside upper left", ncols=6, handletextpad=0.2)
        raw.set_ylabel("Score")
        note(raw, "as given")
        note(corrected, "less the examiner's offset; bar: mean, 95 % interval")
    return figure


def _lane(
    axes: Axes, centre: float, width: float, values: np.ndarray, colour: str, lane: int
) -> None:
    """Draw one examiner's scores; equal ones side by side, so that each is seen."""
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


def _mean(axes: Axes, place: float, mean: RatingMean, colour: str) -> None:
    if np.isfinite(mean.low) and np.isfinite(mean.high):
        axes.vlines(place, mean.low, mean.high, color=colour, linewidth=2.0)
    axes.plot(place, mean.mean, "_", color=colour, markersize=11, markeredgewidth=2.2)


SECTION = Section("ratings", "Ratings", _blocks, from_study_folder)
