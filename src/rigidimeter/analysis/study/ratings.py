"""Examiners' ratings: out of their table, checked; their mixed model; rows corrected by it.

As in Sec. 2.2 of the paper: score = mean of condition + offset of examiner + error. With several
subjects each has an offset too. Beside it the same contrast with an offset for every day, since all
scores of one day are of one arm on that day: that is the test of a study. What is wrong in a table
is left out and stated, what is odd is stated.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

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
from rigidimeter.analysis.study.measures import RATING, SCORE
from rigidimeter.analysis.study.rows import TEXT, as_rows, typed
from rigidimeter.analysis.study.study import Naming, Ratings
from rigidimeter.analysis.study.tests import Pair
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import MAX_NOTICES, lines_text
from rigidimeter.core.records import Notice
from rigidimeter.core.study_files import StudyFolder, TableRow

RANDOM = ("examiner", "subject", "subject/day", "day", "day/condition")
"""What may have an offset. ``subject/day`` is a subject, and a day within."""

FEWEST = 3
"""Ratings of two conditions that a contrast needs."""

EXAMINERS = "examiners"
"""The method by which ratings are made."""

COLUMNS = {"examiner": "rater", "subject": "subject", "day": "day", "condition": "condition"}
"""Where rows hold what has an offset."""

_SHOWN = 4
_LINE = "line "


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
    return "day/condition" if visits(rows) > distinct(rows, "subject", "day") else "day"


def visits(rows: pd.DataFrame) -> int:
    """Return how many days of a subject in a condition were rated."""
    return distinct(rows, "subject", "day", "condition")


def corrected(ratings: Ratings) -> pd.DataFrame:
    """Return the ratings as a study compares them: scores less the offsets of their examiners.

    A rating without a day is a day of its own to the bootstrap.
    """
    rows = ratings.rows
    own_day = [f"row {number}" for number in range(1, len(rows) + 1)]
    days = rows["day"].where(rows["day"] != "", own_day)
    changed = rows.assign(
        measure=RATING.name,
        chosen=True,
        method=EXAMINERS,
        value=np.asarray(ratings.fit.corrected, dtype=np.float64),
        unit=rows["subject"] + "/" + days,
    )
    return typed(changed)


def rating_test(ratings: Ratings, pair: Pair) -> DayDifference:
    """Return the contrast with an offset for every day as a test by days."""
    counts = [
        distinct(ratings.rows[ratings.rows["condition"] == name], "subject", "day") for name in pair
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


def distinct(rows: pd.DataFrame, *columns: str) -> int:
    """Return how many different cells, or combinations of cells, some columns have."""
    return int(rows[list(columns)].drop_duplicates().shape[0]) if len(rows) else 0


def study_ratings(
    read: StudyFolder, names: Naming, groups: Mapping[str, str]
) -> tuple[Ratings | None, list[Notice]]:
    """Return the ratings of a study folder, and what is wrong with them.

    A row that cannot be used is left out and stated. None if there is no table, or what is left of
    it gives no contrast.

    Parameters
    ----------
    read : StudyFolder
    names : Naming
    groups : mapping of str to str
        Of the subjects.
    """
    if not read.ratings:
        return None, []
    source = read.about.ratings
    records, notices = _kept(read, names)
    rows = as_rows(record | {"group": groups.get(record["subject"], "")} for record in records)
    counts = {name: int((rows["condition"] == name).sum()) for name in names.pair}
    if min(counts.values()) == 0 or sum(counts.values()) < FEWEST:
        there = " and ".join(f"{n} in {name}" for name, n in counts.items() if name)
        text = (
            f"{source}: a contrast of ratings needs both conditions and at least {FEWEST} ratings; "
            f"there are {there}"
        )
        return None, [*notices, Notice("error", text)]
    random = RANDOM[: 2 if rows["subject"].nunique() > 1 else 1]
    low, step = read.about.rating.scale[0], read.about.rating.step
    odd = [*oddities(source, rows, random, low, step)]
    try:
        found = ratings_of(source, rows, random, odd)
    except (ValueError, ArithmeticError) as error:
        return None, [*notices, Notice("error", f"{source}: {error}")]
    return found, [*notices, *(Notice("warning", text) for text in (*odd, *found.model_notices))]


def _kept(read: StudyFolder, names: Naming) -> tuple[list[dict[str, Any]], list[Notice]]:
    """Return the records of the ratings that can be used, and what is wrong with the others."""
    low, high = read.about.rating.scale
    days = {(row["subject"], row["day"]) for row in read.sessions}
    kept: list[dict[str, Any]] = []
    unrecorded: list[TableRow] = []
    notices: list[Notice] = []
    for row in read.ratings:
        condition = names.named(row["condition"])
        try:
            score = row.number("score")
        except UserError as error:
            notices.append(Notice("error", f"{error}; the rating is left out"))
            continue
        if score is None:
            notices.append(Notice("error", f"{row.where}: no score is given; it is left out"))
        elif not low <= score <= high:
            text = (
                f"{row.where}: score is {score:g}, outside the scale of {low:g} to {high:g} in "
                "study.toml; the rating is left out"
            )
            notices.append(Notice("error", text))
        elif condition is None:
            text = f"{row.where}: {names.unknown(row['condition'])}; the rating is left out"
            notices.append(Notice("error", text))
        else:
            cells = {name: row[name] for name in ("subject", "day")}
            cells |= {"epoch": f"{_LINE}{row.line}", "rater": row["examiner"]}
            cells |= {"condition": condition, "measure": SCORE}
            kept.append({**cells, "chosen": False, "value": score})
            if (row["subject"], row["day"]) not in days:
                unrecorded.append(row)
    return kept, notices + _unrecorded(unrecorded)


def _unrecorded(unrecorded: Sequence[TableRow]) -> list[Notice]:
    """Return that ratings are of days on which nothing was recorded."""
    if not unrecorded:
        return []
    first, several = unrecorded[0], len(unrecorded) > 1
    are = f"these {len(unrecorded)} ratings are" if several else "the rating is"
    text = (
        f"{first.source}, {lines_text([row.line for row in unrecorded])}: there is no session "
        f"of subject {first['subject']} on day {first['day']}{' and others' * several}; {are} "
        "used all the same"
    )
    return [Notice("warning", text)]


def line_of(epoch: str) -> int:
    """Return the line of the table that a rating is from."""
    return int(epoch.removeprefix(_LINE))


def oddities(
    source: str, rows: pd.DataFrame, random: Sequence[str], low: float, step: float
) -> Iterator[str]:
    """Yield what is odd about ratings that are used all the same.

    Parameters
    ----------
    source : str
        The table.
    rows : pandas.DataFrame
        With lines of the table as epochs.
    random : sequence of str
        What has an offset.
    low, step : float
        Of the scale; a step of 0 for none.
    """
    lines = rows["epoch"].map(line_of)
    steps = (rows["value"] - low) / step if step > 0 else pd.Series(0.0, rows.index)
    odd = rows[(steps - steps.round()).abs() > 1e-6]
    if len(odd):
        shown = ", ".join(f"{odd['value'][k]:g} in line {lines[k]}" for k in odd.index[:_SHOWN])
        more = f" and {len(odd) - _SHOWN} more" if len(odd) > _SHOWN else ""
        yield f"{source}: not in steps of {step:g}: {shown}{more}; used as they are"
    yield from _repeated(source, rows[rows["day"] != ""], lines)
    for name, labels in groupings(rows, random).items():
        counts = pd.Series(labels).value_counts(sort=False)
        once = list(counts.index[counts == 1])
        if not 0 < len(once) < len(counts) or name not in ("examiner", "subject"):
            continue
        if name == "examiner":
            yield f"{name} {_some(once)} gave one rating; its offset is strongly shrunken"
        else:
            yield f"{name} {_some(once)} has one rating; its offset is shrunken"


def _repeated(source: str, rows: pd.DataFrame, lines: pd.Series) -> Iterator[str]:
    key = ["subject", "rater", "condition", "day"]
    several = [
        (names, own) for names, own in rows.groupby(key, observed=True, sort=False) if len(own) > 1
    ]
    for (_, rater, condition, day), own in several[:MAX_NOTICES]:
        of = " and ".join(map(str, lines[own.index[:MAX_NOTICES]]))
        by = f" by examiner {rater}" if rater else ""
        scores = ", ".join(f"{value:g}" for value in own["value"][:MAX_NOTICES])
        yield (
            f"{source}, lines {of}: rated more than once{by} in {condition} on day {day} "
            f"({scores}); all are used as separate ratings. If one is a copy, p is too small: "
            "take it out"
        )
    if len(several) > MAX_NOTICES:
        more = len(several) - MAX_NOTICES
        yield f"{source}: {more} more were rated more than once, and are used in the same way"


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - MAX_NOTICES} more" if len(names) > MAX_NOTICES else ""
    return ", ".join(names[:MAX_NOTICES]) + more
