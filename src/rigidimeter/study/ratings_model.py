"""The examiners' ratings of a study: score = mean of condition + offset of examiner + error.

As Sec. 2.2 of the paper; with several subjects each has an offset too. Beside it the same contrast
with an offset for every day, since all scores of one day are of one arm on that day.
"""

from __future__ import annotations

import math
from dataclasses import replace

from rigidimeter.errors import UserError
from rigidimeter.recording.study_folder import StudyFolder
from rigidimeter.records import Notice
from rigidimeter.statistics import (
    Contrast,
    DayDifference,
    Mixed,
    contrast,
    difference,
    fit_mixed,
    interval_of,
)
from rigidimeter.study.blinding import Naming
from rigidimeter.study.comparison import measured, no_days
from rigidimeter.study.measures import RATING, Observation
from rigidimeter.study.rating_table import Rating, groupings, oddities
from rigidimeter.study.results import Comparison, RatingMean, RatingsFound

__all__ = ["means_of", "rated", "ratings_comparison", "ratings_days", "variance_notices"]

FEWEST = 3


def rated(read: StudyFolder, names: Naming) -> tuple[RatingsFound | None, list[Notice]]:
    """Return what the ratings of a study folder say, and what is wrong with them.

    A row that cannot be used is left out and said. None if there is no table, or what is left of
    it gives no contrast.
    """
    if not read.ratings:
        return None, []
    source = read.about.ratings
    rows, notices = _rows(read, names)
    first, second = names.pair
    of_pair = [row for row in rows if row.condition in names.pair]
    counts = {name: sum(row.condition == name for row in rows) for name in names.pair}
    if min(counts.values()) == 0 or len(of_pair) < FEWEST:
        told = " and ".join(f"{n} in {name}" for name, n in counts.items() if name)
        text = (
            f"{source}: a contrast of ratings needs both conditions and at least {FEWEST} ratings; "
            f"there are {told}"
        )
        return None, [*notices, Notice("error", text)]
    random = _random(rows)
    odd = oddities(source, rows, random, read.about.rating.scale[0], read.about.rating.step,
                   with_day=True)  # fmt: skip
    odd += _lone_examiners(rows)
    labels = groupings(rows, random)
    scores, conditions = [row.score for row in rows], [row.condition for row in rows]
    try:
        fit = fit_mixed(scores, conditions, labels)
    except (ValueError, ArithmeticError) as error:
        return None, [*notices, Notice("error", f"{source}: {error}")]
    odd += variance_notices(fit)
    notices += [Notice("warning", text) for text in odd]
    found = RatingsFound(
        source=source,
        rows=tuple((r.condition, r.examiner, r.subject, r.day, r.score) for r in rows),
        fit=fit,
        means=means_of(fit),
        contrast=difference(fit, first, second),
        reference=first,
        other=second,
        notices=tuple(odd),
    )
    return replace(found, contrast_days=_with_days(rows, random, names.pair)), notices


def _rows(read: StudyFolder, names: Naming) -> tuple[list[Rating], list[Notice]]:
    low, high = read.about.rating.scale
    days = {(row["subject"], row["day"]) for row in read.sessions}
    rows: list[Rating] = []
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
            rows.append(
                Rating(row.line, condition, score, row["examiner"], row["subject"], row["day"])
            )
            if (row["subject"], row["day"]) not in days:
                text = (
                    f"{row.where}: there is no session of subject {row['subject']} on day "
                    f"{row['day']}; the rating is used all the same"
                )
                notices.append(Notice("warning", text))
    return rows, notices


def _random(rows: list[Rating]) -> tuple[str, ...]:
    return ("examiner", "subject") if len({row.subject for row in rows}) > 1 else ("examiner",)


def _lone_examiners(rows: list[Rating]) -> list[str]:
    """Name examiners of one rating where `oddities` does not: when all have only one."""
    counts = {row.examiner: 0 for row in rows}
    for row in rows:
        counts[row.examiner] += 1
    if counts and all(count == 1 for count in counts.values()):
        return ["every examiner gave one rating, so offsets cannot be distinguished from chance"]
    return []


def variance_notices(fit: Mixed) -> list[str]:
    """Say in words where a variance is at its boundary or cannot be estimated."""
    said = [
        f"the variance of {name} is estimated as zero, its boundary: they differ no more than the "
        "residual explains, so all their offsets are zero and no score is corrected for them"
        for name in fit.at_zero
    ]
    for name, reason in fit.inseparable.items():
        said.append(f"{name} was left out of the model: {reason}; its offsets are zero")
    return said


def _with_days(
    rows: list[Rating], random: tuple[str, ...], pair: tuple[str, str]
) -> Contrast | None:
    """Return the contrast with days, and what a condition had to itself on a day, modelled."""
    labels = groupings(rows, random)
    days = [f"{row.subject}/{row.day}" for row in rows]
    visits = [f"{day}/{row.condition}" for day, row in zip(days, rows, strict=True)]
    labels["day"] = days
    if len(set(visits)) > len(set(days)):
        labels["condition in day"] = visits
    if len(set(visits)) in (len(rows), len({row.condition for row in rows})):
        return None  # one rating a day says nothing of days; nor does one day a condition
    try:
        fit = fit_mixed([r.score for r in rows], [r.condition for r in rows], labels)
    except (ValueError, ArithmeticError):
        return None
    return difference(fit, *pair)


def means_of(fit: Mixed) -> tuple[RatingMean, ...]:
    """Return the mean of each condition with its interval by Kenward and Roger."""
    means = []
    for condition in fit.conditions:
        one = contrast(fit, [float(name == condition) for name in fit.conditions])
        low, high = interval_of(one.estimate, one.se_kenward_roger, one.df_kenward_roger)
        means.append(RatingMean(condition, one.estimate, low, high))
    return tuple(means)


def ratings_comparison(found: RatingsFound) -> Comparison:
    """Return the corrected scores as a measure; a rating without a day is a day of its own."""
    observations = [
        Observation(score, condition, subject, day, unit=f"{subject}/{day or f'row {number}'}")
        for number, ((condition, _, subject, day, _), score) in enumerate(
            zip(found.rows, found.fit.corrected.tolist(), strict=True), start=1
        )
    ]
    return measured(RATING, observations, (found.reference, found.other))


def ratings_days(found: RatingsFound) -> DayDifference:
    """Return the contrast with an offset for every day as a test by days."""
    days_x, days_y = (
        len({row[2:4] for row in found.rows if row[0] == condition})
        for condition in (found.reference, found.other)
    )
    c = found.contrast_days
    if c is None:
        return no_days(days_x, days_y, "the ratings cannot separate days from the residual")
    se, df = c.se_kenward_roger, c.df_kenward_roger
    low, high = interval_of(c.estimate, se, df)
    return DayDifference(
        c.estimate,
        se,
        low,
        high,
        c.p_kenward_roger,
        df,
        days_x,
        days_y,
        math.nan,
        math.nan,
        (),
    )
