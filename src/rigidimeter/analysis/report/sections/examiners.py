"""Examiners' ratings: as given and less the offsets, the mixed model, and what was measured."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from rigidimeter.analysis.figures import draw_ratings, draw_relations, drawn, relation_words
from rigidimeter.analysis.report.contents import (
    Block,
    Figure,
    Section,
    from_result,
    from_study_folder,
    paragraph,
)
from rigidimeter.analysis.report.shown import Shown
from rigidimeter.analysis.statistics import contrast, interval_of
from rigidimeter.analysis.study import Ratings, agreement, relations
from rigidimeter.core.words import (
    INTERVAL,
    SESSION,
    Column,
    condition_name,
    interval,
    number,
    plural,
)


def _ratings(shown: Shown) -> Iterator[Block]:
    found = shown.study.ratings
    if found is None:
        return
    means = dict(_means(found))
    words = "; ".join(
        f"{name} {number(mean, 3)} {interval(low, high, 3)}"
        for name, (mean, low, high) in means.items()
    )
    order = [condition_name(name) for name in (*shown.condition_names, *found.fit.conditions)]
    yield Figure(
        "ratings",
        f"All {len(found.rows)} scores: as given (left) and less each examiner’s predicted offset "
        "(right). Equal scores are drawn side by side. Bars: means of the model with 95 % "
        "intervals.",
        f"Examiners' scores as given and corrected. Means of the model: {words}.",
        partial(drawn, (7.4, 3.3), draw_ratings, found, means, order, columns=2, sharey=True),
    )
    yield paragraph(f"Means of the model with 95 % Kenward–Roger intervals: {words}.")
    yield from_result(
        shown,
        "rating_contrast",
        f"Contrast of the ratings, {shown.study.other} − {shown.study.reference}",
        Column("freedom", "Degrees of freedom by", "text"),
        Column("estimate", f"Difference {INTERVAL}", ends=("low", "high")),
        Column("se", "SE"),
        Column("f", "F"),
        Column("df", "df"),
        Column("p", "p", "p"),
    )
    yield from_result(
        shown,
        "rating_offsets",
        "Predicted offsets (shrunk toward zero)",
        Column("grouping", "Offset of", "label"),
        Column("name", "Name", "label"),
        Column("ratings", "Ratings", "count"),
        Column("offset", "Offset"),
        Column("sd", "SD of such offsets"),
    )
    for text in (*found.notices, *found.model_notices):
        yield paragraph(f"{text}.", "remark")
    yield from_result(
        shown,
        "ratings",
        "Ratings as given, and less the offsets",
        *SESSION,
        Column("examiner", "Examiner", "label"),
        Column("score", "Score", "setting"),
        Column("corrected", "Score less offsets"),
        folding=True,
    )


def _means(found: Ratings) -> Iterator[tuple[str, tuple[float, float, float]]]:
    """Yield the mean of each condition in the model, with its interval."""
    names = found.fit.conditions
    for name in names:
        one = contrast(found.fit, [float(each == name) for each in names])
        low, high = interval_of(one.estimate, one.se_kenward_roger, one.df_kenward_roger)
        yield condition_name(name), (one.estimate, low, high)


def _relation(shown: Shown) -> Iterator[Block]:
    found = relations(shown.study.rows)
    if not found or shown.study.ratings is None:
        return
    order = [condition_name(name) for name in shown.condition_names]
    words = "; ".join(f"{one.measure.title} {relation_words(one)}" for one in found)
    yield Figure(
        "rating_relation",
        "Each point is a day of a subject in a condition: the mean of its epochs, and of its "
        "ratings less the examiners’ offsets. ρ: Spearman’s rank correlation over all points.",
        f"Ratings against measures, by day. Rank correlations: {words}.",
        partial(drawn, (7.4, 2.9), draw_relations, found, order, columns=len(found), sharey=True),
    )
    yield from_result(
        shown,
        "rating_relation",
        "Rank correlation of the ratings with what was measured",
        Column("title", "Measure", "text", below="unit"),
        Column("visits", "Days in a condition", "count"),
        Column("rho", f"ρ over all {INTERVAL}", ends=("rho_low", "rho_high"), digits=2),
        Column(
            "rho_within",
            f"ρ within conditions {INTERVAL}",
            ends=("rho_within_low", "rho_within_high"),
            digits=2,
        ),
        note="Over all: ratings and measures may go together because the conditions change both. "
        "Within conditions: only what differs between days of one condition counts.",
    )
    agree = agreement(shown.study.ratings)
    if agree.pairs:
        share = 100 * agree.equal / agree.pairs
        yield paragraph(
            f"Examiners: of {plural(agree.pairs, 'pair')} of scores that two of them gave on one "
            f"day in one condition, {agree.equal} are equal ({share:.0f} %); on average they are "
            f"{number(agree.mean_difference, 2)} apart."
        )


RATINGS = Section("ratings", "Ratings", _ratings, from_study_folder)
RELATION = Section("rating_relation", "Ratings and what was measured", _relation, from_study_folder)
