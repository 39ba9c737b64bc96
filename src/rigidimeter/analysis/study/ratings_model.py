"""Examiners' ratings of a study, or of any table, and the mixed model of them.

Of a study as in Sec. 2.2 of the paper: score = mean of condition + offset of examiner + error. With
several subjects each has an offset too. Beside it the same contrast with an offset for every day,
since all scores of one day are of one arm on that day.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rigidimeter.analysis.statistics import DayDifference, Mixed, fit_mixed, interval_of
from rigidimeter.analysis.study.blinding import Naming
from rigidimeter.analysis.study.compared import Comparison
from rigidimeter.analysis.study.comparison import measured, no_days
from rigidimeter.analysis.study.measures import RATING, Observation, off_first
from rigidimeter.analysis.study.rating_table import (
    FEWEST,
    RANDOM,
    Rating,
    day_grouping,
    groupings,
    oddities,
    ratings_of,
    visits,
)
from rigidimeter.analysis.study.ratings_found import RatingsFound, fit_ratings, with_days
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import TextTable, lines_text
from rigidimeter.core.records import Notice
from rigidimeter.core.study_files import StudyFolder, TableRow

_ONE_DAY = (
    "each condition was rated on one day, so how much days differ is unknown, and the contrast is "
    "of these days alone; rate each condition on two days or more"
)
_WITHOUT_DAYS = "the model has no offset for days, so ratings of one day count as independent"


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
    random = ("examiner", "subject") if len({row.subject for row in rows}) > 1 else ("examiner",)
    low, step = read.about.rating.scale[0], read.about.rating.step
    odd = oddities(source, rows, random, low, step, with_day=True)
    try:
        found = fit_ratings(source, rows, random, (first, second), odd)
    except (ValueError, ArithmeticError) as error:
        return None, [*notices, Notice("error", f"{source}: {error}")]
    notices += [Notice("warning", text) for text in (*odd, *found.model_notices)]
    return with_days(found, _fit_with_days(rows, random)), notices


def _rows(read: StudyFolder, names: Naming) -> tuple[list[Rating], list[Notice]]:
    low, high = read.about.rating.scale
    days = {(row["subject"], row["day"]) for row in read.sessions}
    rows: list[Rating] = []
    notices: list[Notice] = []
    unrecorded: list[TableRow] = []
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
                unrecorded.append(row)
    if unrecorded:
        first = unrecorded[0]
        are = "the rating is" if len(unrecorded) == 1 else f"these {len(unrecorded)} ratings are"
        text = (
            f"{first.source}, {lines_text([row.line for row in unrecorded])}: there is no session "
            f"of subject {first['subject']} on day {first['day']}"
            f"{' and others' if len(unrecorded) > 1 else ''}; {are} used all the same"
        )
        notices.append(Notice("warning", text))
    return rows, notices


def _fit_with_days(rows: list[Rating], random: tuple[str, ...]) -> Mixed | None:
    """Return the model with days, and with what a condition had to itself on a day."""
    if visits(rows) in (len(rows), len({row.condition for row in rows})):
        return None  # one rating a day says nothing of days; nor does one day a condition
    labels = groupings(rows, (*random, day_grouping(rows)))
    try:
        return fit_mixed([r.score for r in rows], [r.condition for r in rows], labels)
    except (ValueError, ArithmeticError):
        return None


def ratings_comparison(found: RatingsFound) -> Comparison:
    """Return the corrected scores as a measure; a rating without a day is a day of its own."""
    observations = [
        Observation(
            score,
            row.condition,
            row.subject,
            row.day,
            unit=f"{row.subject}/{row.day or f'row {number}'}",
        )
        for number, (row, score) in enumerate(
            zip(found.rows, found.fit.corrected.tolist(), strict=True), start=1
        )
    ]
    return measured(RATING, observations, (found.reference, found.other))


def ratings_days(found: RatingsFound) -> DayDifference:
    """Return the contrast with an offset for every day as a test by days."""
    days_x, days_y = (
        len({(row.subject, row.day) for row in found.rows if row.condition == condition})
        for condition in (found.reference, found.other)
    )
    c = found.contrast_days
    if c is None:
        return no_days(days_x, days_y, "the ratings cannot separate days from the residual")
    se, df = c.se_kenward_roger, c.df_kenward_roger
    low, high = interval_of(c.estimate, se, df)
    return DayDifference(
        estimate=-c.estimate,  # of a test by days: reference − other
        se=se,
        low=-high,
        high=-low,
        p=c.p_kenward_roger,
        df=df,
        n_days_x=days_x,
        n_days_y=days_y,
        test="mixed model of examiners and days",
        mean_x=found.means_days[0],
        mean_y=found.means_days[1],
    )


def rated_one_condition(found: RatingsFound) -> tuple[str, ...]:
    """Return the examiners who rated one of the two conditions alone."""
    pair = {found.reference, found.other}
    rated: dict[str, set[str]] = {}
    for row in found.rows:
        if row.condition in pair:
            rated.setdefault(row.examiner, set()).add(row.condition)
    return tuple(examiner for examiner, conditions in rated.items() if conditions != pair)


def without_examiners(found: RatingsFound, examiners: Sequence[str]) -> DayDifference:
    """Return the test by days without some examiners; NaN and a remark where there is none."""
    rows = [row for row in found.rows if row.examiner not in examiners]
    if not rows:
        return no_days(0, 0, "no score is left")
    random, pair = tuple(found.fit.offsets), (found.reference, found.other)
    try:
        rest = fit_ratings(found.source, rows, random, pair)
    except (ValueError, ArithmeticError) as error:
        return no_days(0, 0, str(error))
    return ratings_days(with_days(rest, _fit_with_days(rows, random)))


def model_ratings(
    table: TextTable,
    columns: Mapping[str, str],
    random: Sequence[str] | None = None,
    *,
    scale: tuple[float, float] = (0.0, 3.0),
    step: float = 0.5,
    pair: tuple[str, str] | None = None,
) -> RatingsFound:
    """Fit a mean for each condition and a random offset for each label of the groupings.

    Parameters
    ----------
    table : TextTable
    columns : mapping of str to str
        What the table calls condition, score, examiner, subject and day.
    random : sequence of str, optional
        Names out of `RANDOM`. By default ``examiner``, and the day of one subject over several
        days (with its conditions, where a day has several), for ratings of one day are no
        independent values.
    scale : tuple of float
        Lowest and highest rating there is.
    step : float
        Of the scale; 0 for none.
    pair : (str, str), optional
        The contrast, A less B; by default of the first two conditions, ``OFF`` first where it
        occurs, the second less the first.

    Raises
    ------
    UserError
        If an option is wrong, or the table holds no ratings that can be modelled.
    """
    chosen = tuple(dict.fromkeys(random or ("examiner",)))
    for name in chosen:
        if name not in RANDOM:
            raise UserError(f"--random {name}: must be one of {', '.join(RANDOM)}")
    if not (scale[0] < scale[1] and step >= 0 and abs(sum(scale)) < float("inf")):
        raise UserError(
            f"--scale {scale[0]:g} {scale[1]:g} --step {step:g}: write the lowest and then the "
            "highest rating, and a step of 0 or more"
        )
    by_day = random is None and _over_days(table, columns)
    found = ratings_of(table, columns, (*chosen, "day") if by_day else chosen, scale, step)
    conditions = [row.condition for row in found.rows]
    first, second = pair or off_first(conditions)[:2][::-1]
    for name in (first, second):
        if name not in conditions:
            known = ", ".join(dict.fromkeys(conditions))
            raise UserError(f"--contrast {name}: there is no such condition; rated are: {known}")
    if first == second:
        raise UserError(f"--contrast {first} {second}: name two different conditions")

    def fitted(chosen: tuple[str, ...], *said: str) -> RatingsFound:
        notices = (*found.notices, *said)
        return fit_ratings(
            table.source, found.rows, chosen, (second, first), notices, found.left_out
        )

    try:
        if not by_day or visits(found.rows) == len(found.rows) == len({r.day for r in found.rows}):
            return fitted(chosen)  # with one rating a day the residual holds what days differ by
        if visits(found.rows) == len(set(conditions)):
            return fitted(chosen, f"{table.source}: {_ONE_DAY}")
        try:
            return fitted((*chosen, day_grouping(found.rows)))
        except (ValueError, ArithmeticError) as error:
            return fitted(chosen, f"{table.source}: {_WITHOUT_DAYS}, for {error}")
    except (ValueError, ArithmeticError) as error:
        raise UserError(f"{table.source}: {error}") from None


def _over_days(table: TextTable, columns: Mapping[str, str]) -> bool:
    """Return whether a table has the days of one subject."""
    days, subjects = (set(table.columns.get(columns[name], ())) for name in ("day", "subject"))
    return len(days - {""}) > 0 and len(subjects) < 2
