"""What the ratings say beside their test: means, contrasts, offsets, and what they go with.

Correlation and agreement take a visit: a day of a subject in a condition. The correlation over all
visits holds what the conditions do to both; that within conditions does not.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any, NamedTuple

import pandas as pd

from rigidimeter.analysis.statistics import (
    Contrast,
    RankCorrelation,
    contrast,
    difference,
    holm,
    interval_of,
    joint_test,
    rank_correlation,
)
from rigidimeter.analysis.study.measures import RATING, Measure, off_first
from rigidimeter.analysis.study.ratings import groupings, line_of
from rigidimeter.analysis.study.rows import counting, measures_of
from rigidimeter.analysis.study.study import Ratings
from rigidimeter.analysis.study.tests import Pair

RATINGS_SCHEMA = "rigidimeter.ratings/1"
RELATED = ("stiffness_nm_rad", "damping_nm_s_rad", "work_j")

_VISIT = ["subject", "day", "condition"]
_CHOICES = ("residual", "satterthwaite", "kenward_roger")


def ratings_document(ratings: Ratings, pair: Pair) -> dict[str, Any]:
    """Return everything that was computed; contrasts are the other condition less the reference."""
    fit, (reference, other) = ratings.fit, pair
    means = dict(zip(fit.conditions, map(_mean_interval, _means(ratings)), strict=True))
    errors = [math.sqrt(value) for value in fit.covariance.diagonal().tolist()]
    by_day = None if ratings.by_day is None else difference(ratings.by_day, other, reference)
    return {
        "schema": RATINGS_SCHEMA,
        "source": ratings.source,
        "n": fit.n,
        "counts": _counts(list(ratings.rows["condition"])),
        "means": dict(zip(fit.conditions, fit.means.tolist(), strict=True)),
        "means_se": dict(zip(fit.conditions, errors, strict=True)),
        "means_low": {name: low for name, (low, _) in means.items()},
        "means_high": {name: high for name, (_, high) in means.items()},
        "contrast": _contrast(difference(fit, other, reference), other, reference),
        "contrast_days": None if by_day is None else _contrast(by_day, other, reference),
        "contrasts": _contrasts(ratings),
        "joint": asdict(joint_test(fit)),
        "offsets": dict(next(iter(fit.offsets.values()))),
        "offsets_by": {name: dict(offsets) for name, offsets in fit.offsets.items()},
        "variance_examiner": fit.variances.get("examiner"),
        "variance_residual": fit.variance_residual,
        "variances": dict(fit.variances),
        "reml_deviance": fit.deviance,
        "corrected": fit.corrected.tolist(),
        "rows": rating_rows(ratings),
        "left_out_lines": list(ratings.left_out_lines),
        "notices": [*ratings.notices, *ratings.model_notices],
    }


def rating_rows(ratings: Ratings) -> list[dict[str, Any]]:
    """Return every rating as given, and less the offsets; what a table lacks is not there."""
    rows = ratings.rows
    cells = {
        "line": map(line_of, rows["epoch"]),
        "condition": rows["condition"],
        "score": rows["value"],
        "examiner": rows["rater"],
        "subject": rows["subject"],
        "day": rows["day"],
        "corrected": ratings.fit.corrected.tolist(),
    }
    return [
        {name: cell for name, cell in zip(cells, row, strict=True) if cell != ""}
        for row in zip(*cells.values(), strict=True)
    ]


def rating_offsets(ratings: Ratings) -> Iterator[dict[str, Any]]:
    """Yield every offset, with the number of ratings that it was predicted from."""
    for grouping, offsets in ratings.fit.offsets.items():
        counts = _counts(groupings(ratings.rows, [grouping])[grouping])
        sd = math.sqrt(ratings.fit.variances[grouping])
        for name, offset in offsets.items():
            row = {"grouping": grouping, "name": name, "ratings": counts[name]}
            yield row | {"offset": offset, "sd": sd}


def rating_contrast(ratings: Ratings, pair: Pair) -> Iterator[dict[str, Any]]:
    """Yield the contrast by each choice of degrees of freedom, with its 95 % interval."""
    reference, other = pair
    yield from _by_choices(difference(ratings.fit, other, reference))
    if ratings.by_day is not None:
        *_, last = _by_choices(difference(ratings.by_day, other, reference))
        yield last | {"freedom": f"{last['freedom']}, with an offset for each day too"}


def _means(ratings: Ratings) -> Iterator[Contrast]:
    names = ratings.fit.conditions
    for name in names:
        yield contrast(ratings.fit, [float(each == name) for each in names])


def _mean_interval(one: Contrast) -> tuple[float, float]:
    return interval_of(one.estimate, one.se_kenward_roger, one.df_kenward_roger)


def _contrasts(ratings: Ratings) -> list[dict[str, Any]]:
    """Return the contrasts of every two conditions: a later one less an earlier one, OFF first."""
    pairs = [(b, a) for a, b in itertools.combinations(off_first(ratings.fit.conditions), 2)]
    every = [difference(ratings.fit, *pair) for pair in pairs]
    adjusted = {
        f"p_{name}_holm": holm([getattr(one, f"p_{name}") for one in every]) for name in _CHOICES
    }
    return [
        _contrast(one, *pair) | {name: p[k] for name, p in adjusted.items()}
        for k, (one, pair) in enumerate(zip(every, pairs, strict=True))
    ]


def _by_choices(c: Contrast) -> Iterator[dict[str, Any]]:
    words = ("residual, n − p", "Satterthwaite", "Kenward–Roger")
    for freedom, name in zip(words, _CHOICES, strict=True):
        own = "_kenward_roger" if name == "kenward_roger" else ""
        se, f, df = getattr(c, f"se{own}"), getattr(c, f"f{own}"), getattr(c, f"df_{name}")
        low, high = interval_of(c.estimate, se, df)
        row = {"freedom": freedom, "estimate": c.estimate, "low": low, "high": high, "se": se}
        yield row | {"f": f, "df": df, "p": getattr(c, f"p_{name}")}


def _contrast(c: Contrast, first: str, second: str) -> dict[str, Any]:
    who = {"first": first, "second": second, "convention": f"{first} minus {second}"}
    known = ("weights", "df_numerator")  # from first, second: 1, −1 and one contrast
    return who | {name: value for name, value in asdict(c).items() if name not in known}


def _counts(labels: Sequence[str]) -> dict[str, int]:
    return {name: labels.count(name) for name in dict.fromkeys(labels)}


class Relation(NamedTuple):
    """One measure beside the ratings.

    Attributes
    ----------
    measure : Measure
    visits : tuple of (str, str, str)
        Subject, day and condition of each pair of values.
    values, ratings : tuple of float
        Means over the epochs and over the ratings of a visit, less the examiners' offsets.
    over_all, within : RankCorrelation
        Over all visits, and within conditions.
    """

    measure: Measure
    visits: tuple[tuple[str, str, str], ...]
    values: tuple[float, ...]
    ratings: tuple[float, ...]
    over_all: RankCorrelation
    within: RankCorrelation

    def row(self) -> dict[str, Any]:
        """Return the correlations as documents and tables have them."""
        numbers = {"rho": self.over_all, "rho_within": self.within}
        return self.measure.names | {
            "visits": len(self.visits),
            **{
                f"{name}{end}": value
                for name, found in numbers.items()
                for end, value in zip(("", "_low", "_high"), found, strict=True)
            },
        }


def relations(rows: pd.DataFrame) -> tuple[Relation, ...]:
    """Return stiffness, damping and work beside the ratings; nothing without ratings by days."""
    measures = {one.name: one for one in measures_of(rows)}
    if RATING.name not in measures:
        return ()
    scores = _by_visit(counting(rows, RATING.name))
    found = []
    for name in filter(measures.__contains__, RELATED):
        both = pd.DataFrame({"value": _by_visit(counting(rows, name))}).join(scores, how="inner")
        if len(both) < 3:
            continue
        x, y = list(both["value"]), list(both[scores.name])
        groups = [f"{subject}/{condition}" for subject, _, condition in both.index]
        correlations = rank_correlation(x, y), rank_correlation(x, y, groups)
        found.append(Relation(measures[name], tuple(both.index), (*x,), (*y,), *correlations))
    return tuple(found)


def _by_visit(rows: pd.DataFrame) -> pd.Series:
    """Return means, rounded once: visits with the same scores are equal, which ranks depend on."""
    days = rows[rows["day"] != ""].groupby(_VISIT, sort=False)
    return days["value"].agg(lambda own: math.fsum(own) / len(own)).rename("rating")


class Agreement(NamedTuple):
    """Pairs of scores by two examiners of one visit: how many, how far apart, how many equal."""

    pairs: int
    mean_difference: float
    equal: int


def agreement(ratings: Ratings) -> Agreement:
    """Return how the examiners agree where two of them rated the same visit."""
    rows = ratings.rows[ratings.rows["day"] != ""]
    apart = [
        abs(one - two)
        for _, own in rows.groupby(_VISIT, sort=False)
        for (first, one), (second, two) in itertools.combinations(
            zip(own["rater"], own["value"], strict=True), 2
        )
        if first != second
    ]
    mean = math.fsum(apart) / len(apart) if apart else math.nan
    return Agreement(len(apart), mean, sum(not size for size in apart))
