"""Effect sizes of all measures of a study, and which parts the conditions better.

Whole days are resampled: epochs of one day are alike. Ratings go with their corrected scores.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rigidimeter.statistics import (
    EffectDifference,
    TwoGroups,
    compare_effects,
    effect_sizes,
    holm,
    two_groups,
)
from rigidimeter.study.comparison import FEWEST_FOR_TEST
from rigidimeter.study.day_model import Valued
from rigidimeter.study.results import MeasureEffect, RatingsFound

__all__ = ["RATING", "Measured", "effects_of", "ratings_measured"]

RATING = ("rating", "Examiners' rating", "1")
"""Stored name, name for people and unit of the ratings as a measure."""


@dataclass(frozen=True)
class Measured:
    """All values of one measure."""

    name: str
    title: str
    unit: str
    values: Sequence[Valued]


def ratings_measured(ratings: RatingsFound) -> Measured:
    """Return the corrected scores as a measure; a rating without a day is a day of its own."""
    values = [
        Valued(score, condition, subject, day or f"row {number}")
        for number, ((condition, _, subject, day, _), score) in enumerate(
            zip(ratings.rows, ratings.fit.corrected.tolist(), strict=True), start=1
        )
    ]
    return Measured(*RATING, values)


def effects_of(
    measures: Sequence[Measured],
    pair: tuple[str, str],
    seed: int,
    resamples: int,
) -> tuple[tuple[MeasureEffect, ...], Mapping[tuple[str, str], EffectDifference]]:
    """Return the effect size of every measure that has enough values, and every difference.

    Every measure and every pair draws from a stream of its own, so one more measure moves no other
    number. p by Holm is over the rank-sum tests of all measures.
    """
    groups: dict[str, TwoGroups] = {}
    found = []
    for measured in measures:
        x, y = ([v for v in measured.values if v.condition == name] for name in pair)
        if min(len(x), len(y)) < FEWEST_FOR_TEST:
            continue
        groups[measured.name] = two_groups(
            [v.value for v in x], [v.value for v in y], [v.unit for v in x], [v.unit for v in y]
        )
        rng = _stream(seed, measured.name)
        found.append((measured, effect_sizes(groups[measured.name], rng, resamples=resamples)))
    adjusted = holm([effects.test.p for _, effects in found])
    differences = {}
    for first, second in itertools.combinations(groups, 2):
        one, two = groups[first], groups[second]
        paired = not (
            set(one.x_units).isdisjoint(two.x_units) or set(one.y_units).isdisjoint(two.y_units)
        )
        differences[first, second] = compare_effects(
            one, two, _stream(seed, first, second), paired=paired, resamples=resamples
        )
    effects = tuple(
        MeasureEffect(m.name, m.title, m.unit, effects, p)
        for (m, effects), p in zip(found, adjusted, strict=True)
    )
    return effects, differences


def _stream(seed: int, *names: str) -> np.random.Generator:
    return np.random.default_rng([seed, *" ".join(names).encode()])
