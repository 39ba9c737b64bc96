"""Examiners' ratings: as given and less the offsets, the mixed model, and what was measured."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from rigidimeter.analysis.report.contents import (
    Block,
    Figure,
    Section,
    from_result,
    from_study_folder,
    paragraph,
)
from rigidimeter.analysis.report.points import draw_ratings, draw_relations, relation_words
from rigidimeter.analysis.report.style import drawn
from rigidimeter.analysis.study import StudyResult, agreement, relations
from rigidimeter.core.words import (
    INTERVAL,
    SESSION,
    Column,
    condition_name,
    interval,
    number,
    plural,
)


def _ratings(result: StudyResult) -> Iterator[Block]:
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
        partial(drawn, (7.4, 3.3), draw_ratings, found, order, columns=2, sharey=True),
    )
    yield paragraph(f"Means of the model with 95 % Kenward–Roger intervals: {words}.")
    yield from_result(
        result,
        "rating_contrast",
        f"Contrast of the ratings, {found.other} − {found.reference}",
        Column("freedom", "Degrees of freedom by", "text"),
        Column("estimate", f"Difference {INTERVAL}", ends=("low", "high")),
        Column("se", "SE"),
        Column("f", "F"),
        Column("df", "df"),
        Column("p", "p", "p"),
    )
    yield from_result(
        result,
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
        result,
        "ratings",
        "Ratings as given, and less the offsets",
        *SESSION,
        Column("examiner", "Examiner", "label"),
        Column("score", "Score", "setting"),
        Column("corrected", "Score less offsets"),
        folding=True,
    )


def _relation(result: StudyResult) -> Iterator[Block]:
    found = relations(result)
    if not found or result.ratings is None:
        return
    order = [condition_name(name) for name in result.condition_names]
    words = "; ".join(f"{one.measure.title} {relation_words(one)}" for one in found)
    yield Figure(
        "rating_relation",
        "Each point is a day of a subject in a condition: the mean of its epochs, and of its "
        "ratings less the examiners’ offsets. ρ: Spearman’s rank correlation over all points.",
        f"Ratings against measures, by day. Rank correlations: {words}.",
        partial(drawn, (7.4, 2.9), draw_relations, found, order, columns=len(found), sharey=True),
    )
    yield from_result(
        result,
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
    agree = agreement(result.ratings)
    if agree.pairs:
        share = 100 * agree.equal / agree.pairs
        yield paragraph(
            f"Examiners: of {plural(agree.pairs, 'pair')} of scores that two of them gave on one "
            f"day in one condition, {agree.equal} are equal ({share:.0f} %); on average they are "
            f"{number(agree.mean_difference, 2)} apart."
        )


RATINGS = Section("ratings", "Ratings", _ratings, from_study_folder)
RELATION = Section("rating_relation", "Ratings and what was measured", _relation, from_study_folder)
