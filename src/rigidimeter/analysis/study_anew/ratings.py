"""Examiners' ratings: their mixed model, and the rows that are corrected by it.

As in Sec. 2.2 of the paper: score = mean of condition + offset of examiner + error. With several
subjects each has an offset too. Beside it the same contrast with an offset for every day, since all
scores of one day are of one arm on that day: that is the test of a study.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from rigidimeter.analysis.statistics import (
    DayDifference,
    Mixed,
    difference,
    fit_mixed,
    interval_of,
    nested,
)
from rigidimeter.analysis.study_anew.measures import RATING
from rigidimeter.analysis.study_anew.rows import FIELDS, TEXT
from rigidimeter.analysis.study_anew.study import Ratings
from rigidimeter.analysis.study_anew.tests import Pair

RANDOM = ("examiner", "subject", "subject/day", "day", "day/condition")
"""What may have an offset. ``subject/day`` is a subject, and a day within."""

FEWEST = 3
"""Ratings of two conditions that a contrast needs."""

EXAMINERS = "examiners"
"""The method by which ratings are made."""

COLUMNS = {"examiner": "rater", "subject": "subject", "day": "day", "condition": "condition"}
"""Where rows hold what has an offset."""


def ratings_of(
    source: str, rows: pd.DataFrame, random: Sequence[str], notices: Sequence[str] = ()
) -> Ratings:
    """Return the models of some scores.

    Parameters
    ----------
    source : str
        The table that they are from.
    rows : pandas.DataFrame
        With measure `SCORE`.
    random : sequence of str
        Names out of `RANDOM`.
    notices : sequence of str

    Raises
    ------
    ValueError, ArithmeticError
        If these ratings cannot be modelled.
    """
    rows = rows.astype(dict.fromkeys(TEXT, object))
    fit = fit_scores(rows, random)
    return Ratings(source, rows, tuple(random), fit, with_days(rows, random), tuple(notices))


def fit_scores(rows: pd.DataFrame, random: Sequence[str]) -> Mixed:
    """Return the model of scores with a mean for each condition and the offsets that are named.

    Raises
    ------
    ValueError, ArithmeticError
        If these ratings cannot be modelled.
    """
    return fit_mixed(list(rows["value"]), list(rows["condition"]), groupings(rows, random))


def with_days(rows: pd.DataFrame, random: Sequence[str]) -> Mixed | None:
    """Return the model with days too, and with what a condition had to itself on a day.

    None where one rating a day says nothing of days, nor one day a condition, or where days and the
    residual cannot be separated.
    """
    if visits(rows) in (len(rows), rows["condition"].nunique()):
        return None
    try:
        return fit_scores(rows, (*random, day_grouping(rows)))
    except (ValueError, ArithmeticError):
        return None


def groupings(rows: pd.DataFrame, random: Iterable[str]) -> dict[str, list[str]]:
    """Return the labels of each grouping; a day belongs to its subject."""
    columns = {name: list(rows[column]) for name, column in COLUMNS.items()}
    days = columns["day"]
    if len(set(columns["subject"])) > 1:
        columns["day"] = nested(columns["subject"], days)
    found: dict[str, list[str]] = {}
    for name in random:
        outer, _, inner = name.partition("/")
        found[outer] = columns[outer]
        if inner:
            found[name] = nested(columns[outer], days if inner == "day" else columns[inner])
    return found


def day_grouping(rows: pd.DataFrame) -> str:
    """Return ``day``, or ``day/condition`` where days have several conditions."""
    return "day/condition" if visits(rows) > _distinct(rows, "subject", "day") else "day"


def visits(rows: pd.DataFrame) -> int:
    """Return how many days of a subject in a condition were rated."""
    return _distinct(rows, "subject", "day", "condition")


def corrected(ratings: Ratings) -> pd.DataFrame:
    """Return the ratings as a study compares them: scores less the offsets of their examiners.

    A rating without a day is a day of its own to the bootstrap.
    """
    rows = ratings.rows
    own_day = [f"row {number}" for number in range(1, len(rows) + 1)]
    days = rows["day"].where(rows["day"] != "", own_day)
    return rows.assign(
        measure=RATING.name,
        chosen=True,
        method=EXAMINERS,
        value=np.asarray(ratings.fit.corrected, dtype=np.float64),
        unit=rows["subject"] + "/" + days,
    )[list(FIELDS)]


def rating_test(ratings: Ratings, pair: Pair) -> DayDifference:
    """Return the contrast with an offset for every day as a test by days."""
    counts = [
        _distinct(ratings.rows[ratings.rows["condition"] == name], "subject", "day")
        for name in pair
    ]
    fit = ratings.by_day
    if fit is None:
        remark = "the ratings cannot separate days from the residual"
        return DayDifference(n_days_x=counts[0], n_days_y=counts[1], remark=remark)
    first, second = (float(fit.means[fit.conditions.index(name)]) for name in pair)
    c = difference(fit, pair[1], pair[0])
    low, high = interval_of(c.estimate, c.se_kenward_roger, c.df_kenward_roger)
    return DayDifference(
        estimate=-c.estimate,  # of a test by days: reference − other
        se=c.se_kenward_roger,
        low=-high,
        high=-low,
        p=c.p_kenward_roger,
        df=c.df_kenward_roger,
        n_days_x=counts[0],
        n_days_y=counts[1],
        test="mixed model of examiners and days",
        mean_x=first,
        mean_y=second,
    )


def one_sided(rows: pd.DataFrame, pair: Pair) -> tuple[str, ...]:
    """Return the examiners who rated one of two conditions alone."""
    of_pair = rows[rows["condition"].isin(pair)]
    counts = of_pair.groupby("rater", sort=False)["condition"].nunique()
    return tuple(counts.index[counts < len(pair)])


def without_raters(ratings: Ratings, raters: Sequence[str], pair: Pair) -> DayDifference:
    """Return the test by days without some examiners; NaN and a remark where there is none."""
    rows = ratings.rows[~ratings.rows["rater"].isin(raters)]
    if not len(rows):
        return DayDifference(remark="no score is left")
    try:
        fit = fit_scores(rows, ratings.random)
    except (ValueError, ArithmeticError) as error:
        return DayDifference(remark=str(error))
    by_day = with_days(rows, ratings.random)
    if by_day is not None and not {*pair} <= {*fit.conditions}:
        return DayDifference(remark="a condition has no score left")
    return rating_test(ratings._replace(rows=rows, fit=fit, by_day=by_day), pair)


def _distinct(rows: pd.DataFrame, *columns: str) -> int:
    return int(rows[list(columns)].drop_duplicates().shape[0]) if len(rows) else 0
