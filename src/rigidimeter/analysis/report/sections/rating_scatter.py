"""The examiners' ratings against stiffness, damping and work, day by day."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from matplotlib.figure import Figure as Drawing

from rigidimeter.analysis.report.contents import (
    Block,
    Figure,
    Section,
    from_study_folder,
    paragraph,
)
from rigidimeter.analysis.report.style import (
    condition_colours,
    condition_markers,
    listed,
    note,
    styled,
)
from rigidimeter.analysis.study import Relation, StudyResult, agreement, relations, result_table
from rigidimeter.core.words import (
    INTERVAL,
    Column,
    Table,
    axis_unit,
    condition_name,
    interval,
    number,
    plural,
)


def _blocks(result: StudyResult) -> Iterator[Block]:
    found = relations(result)
    if not found or result.ratings is None:
        return
    order = [condition_name(name) for name in result.condition_names]
    words = "; ".join(f"{one.measure.title} {_in_words(one)}" for one in found)
    yield Figure(
        "rating_relation",
        "Each point is a day of a subject in a condition: the mean of its epochs, and of its "
        "ratings less the examiners’ offsets. ρ: Spearman’s rank correlation over all points.",
        f"Ratings against measures, by day. Rank correlations: {words}.",
        partial(scatter, found, order),
    )
    yield Table(
        "rating_relation",
        "Rank correlation of the ratings with what was measured",
        (
            Column("title", "Measure", "text", below="unit"),
            Column("visits", "Days in a condition", "count"),
            Column("rho", f"ρ over all {INTERVAL}", ends=("rho_low", "rho_high"), digits=2),
            Column(
                "rho_within",
                f"ρ within conditions {INTERVAL}",
                ends=("rho_within_low", "rho_within_high"),
                digits=2,
            ),
        ),
        result_table(result, "rating_relation"),
        note="Over all: ratings and measures may go together because the conditions change both. "
        "Within conditions: only what differs between days of one condition counts.",
    )
    agree = agreement(result.ratings)
    if agree.pairs:
        share = 100 * agree.equal / agree.pairs
        yield paragraph(
            f"Examiners: of {plural(agree.pairs, 'pair')} of scores that two of them gave on one "
            f"day in one condition, {agree.equal} are equal ({share:.0f} %); on average they are "
            f"{number(agree.mean_difference, 2)} apart."
        )


def _in_words(one: Relation) -> str:
    rho, low, high = one.over_all
    return f"ρ = {number(rho, 2)} {interval(low, high, 2)}"


def scatter(found: Sequence[Relation], order: Sequence[str]) -> Drawing:
    """Draw a panel for each measure, the rating upwards.

    Parameters
    ----------
    found : sequence of Relation
        At least one.
    order : sequence of str
        All conditions of the report, which gives them their colours and markers.
    """
    colours, markers = condition_colours(order), condition_markers(order)
    with styled():
        figure = Drawing(figsize=(7.4, 2.9))
        panels = np.atleast_1d(figure.subplots(1, len(found), sharey=True))
        for axes, one in zip(panels, found, strict=True):
            conditions = [condition_name(condition) for _, _, condition in one.visits]
            factor, unit = axis_unit(one.values, one.measure.unit)
            for name in dict.fromkeys(conditions):
                own = [k for k, other in enumerate(conditions) if other == name]
                axes.plot(
                    [factor * one.values[k] for k in own],
                    [one.ratings[k] for k in own],
                    markers[name],
                    color=colours[name],
                    markersize=5,
                    markeredgewidth=0,
                    alpha=0.85,
                    label=listed(name),
                )
            axes.set_xlabel(replace(one.measure, unit=unit).label)
            note(axes, _in_words(one))
        panels[0].set_ylabel("Rating less offsets")
        figure.legend(
            *panels[0].get_legend_handles_labels(),
            loc="outside upper left",
            ncols=6,
            handletextpad=0.2,
        )
    return figure


SECTION = Section("rating_relation", "Ratings and what was measured", _blocks, from_study_folder)
