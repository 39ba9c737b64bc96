"""How the examiners' ratings go with what the robot measured, and how examiners agree.

One value of each for a day of a subject in a condition: the means of its epochs and of its ratings,
less the examiners' offsets. The correlation over all of them holds what the conditions do to
both; that within conditions does not.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rigidimeter.analysis.statistics import RankCorrelation, rank_correlation
from rigidimeter.analysis.study.compared import Comparison, measure_names
from rigidimeter.analysis.study.measures import RATING, Measure
from rigidimeter.analysis.study.ratings_found import RatingsFound
from rigidimeter.analysis.study.results import StudyResult

RELATED = ("stiffness_nm_rad", "damping_nm_s_rad", "work_j")

Visit = tuple[str, str, str]
"""Subject, day and condition."""


@dataclass(frozen=True)
class Relation:
    """One measure against the ratings.

    Attributes
    ----------
    measure : Measure
    visits : tuple of (str, str, str)
        Subject, day and condition of each pair of values.
    values, ratings : tuple of float
    over_all, within : RankCorrelation
        Over all visits, and within conditions.
    """

    measure: Measure
    visits: tuple[Visit, ...]
    values: tuple[float, ...]
    ratings: tuple[float, ...]
    over_all: RankCorrelation
    within: RankCorrelation

    def row(self) -> dict[str, Any]:
        """Return the correlations as documents and tables have them."""
        numbers = {"rho": self.over_all, "rho_within": self.within}
        return measure_names(self.measure) | {
            "visits": len(self.visits),
            **{
                f"{name}{end}": value
                for name, found in numbers.items()
                for end, value in zip(("", "_low", "_high"), found, strict=True)
            },
        }


def relations(result: StudyResult) -> tuple[Relation, ...]:
    """Return stiffness, damping and work against the ratings; nothing without ratings by days."""
    rated = result.comparison(RATING.name)
    if result.ratings is None or rated is None:
        return ()
    scores = _by_visit(rated)
    found = []
    for name in RELATED:
        c = result.comparison(name)
        if c is None:
            continue
        values = _by_visit(c)
        visits = tuple(visit for visit in values if visit in scores)
        if len(visits) < 3:
            continue
        x, y = [values[visit] for visit in visits], [scores[visit] for visit in visits]
        groups = [f"{subject}/{condition}" for subject, _, condition in visits]
        found.append(
            Relation(
                c.measure,
                visits,
                tuple(x),
                tuple(y),
                rank_correlation(x, y),
                rank_correlation(x, y, groups),
            )
        )
    return tuple(found)


def _by_visit(c: Comparison) -> dict[Visit, float]:
    visits: dict[Visit, list[float]] = {}
    for o in c.observations:
        if o.day:
            visits.setdefault((o.subject, o.day, o.condition), []).append(o.value)
    return {visit: math.fsum(own) / len(own) for visit, own in visits.items()}


@dataclass(frozen=True)
class Agreement:
    """Pairs of scores by two examiners of one visit: how many, how far apart, how many equal."""

    pairs: int
    mean_difference: float
    equal: int


def agreement(found: RatingsFound) -> Agreement:
    """Return how the examiners agree where two of them rated the same visit."""
    visits: dict[Visit, list[tuple[str, float]]] = {}
    for row in found.rows:
        if row.day:
            own = visits.setdefault((row.subject, row.day, row.condition), [])
            own.append((row.examiner, row.score))
    apart: Sequence[float] = [
        abs(one[1] - two[1])
        for own in visits.values()
        for one, two in itertools.combinations(own, 2)
        if one[0] != two[0]
    ]
    mean = math.fsum(apart) / len(apart) if apart else math.nan
    return Agreement(len(apart), mean, sum(not size for size in apart))
