"""Ratings out of any table, and their model: what is wrong is refused, what is odd is stated."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import pandas as pd

from rigidimeter.analysis.study.measures import SCORE, off_first
from rigidimeter.analysis.study.ratings import (
    COLUMNS,
    FEWEST,
    RANDOM,
    day_grouping,
    distinct,
    fit_scores,
    oddities,
    visits,
)
from rigidimeter.analysis.study.rows import TEXT, as_rows
from rigidimeter.analysis.study.study import Ratings
from rigidimeter.analysis.study.tests import Pair
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import TextTable, lines_text
from rigidimeter.core.words import plural

_ONE_DAY = (
    "each condition was rated on one day, so how much days differ is unknown, and the contrast is "
    "of these days alone; rate each condition on two days or more"
)
_WITHOUT_DAYS = "the model has no offset for days, so ratings of one day count as independent"


def table_ratings(
    table: TextTable,
    columns: Mapping[str, str],
    random: Sequence[str] | None = None,
    *,
    scale: tuple[float, float] = (0.0, 3.0),
    step: float = 0.5,
    contrast: tuple[str, str] | None = None,
) -> tuple[Ratings, Pair]:
    """Return the mixed model of the ratings of a table, and the two conditions to contrast.

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
    contrast : (str, str), optional
        A less B; by default of the first two conditions, ``OFF`` first where it occurs, the second
        less the first.

    Returns
    -------
    ratings : Ratings
    pair : (str, str)
        B, the reference, and A.

    Raises
    ------
    UserError
        If an option is wrong, or the table holds no ratings that can be modelled.
    """
    chosen = tuple(dict.fromkeys(random or ("examiner",)))
    for name in chosen:
        if name not in RANDOM:
            raise UserError(f"--random {name}: must be one of {', '.join(RANDOM)}")
    if not (scale[0] < scale[1] and step >= 0 and abs(sum(scale)) < math.inf):
        raise UserError(
            f"--scale {scale[0]:g} {scale[1]:g} --step {step:g}: write the lowest and then the "
            "highest rating, and a step of 0 or more"
        )
    days, subjects = (set(table.columns.get(columns[name], ())) for name in ("day", "subject"))
    over_days = random is None and len(days - {""}) > 0 and len(subjects) < 2
    modelled = (*chosen, "day") if over_days else chosen
    rows, left_out = _kept(table, columns, modelled, scale)
    notices = [
        f"{table.source}, {lines_text(lines)}: no {lacking} is given; "
        f"the row{' was' if len(lines) == 1 else 's were'} left out"
        for lacking, lines in left_out.items()
    ]
    notices += oddities(table.source, rows, modelled, scale[0], step)
    notices += _unmodelled(rows, modelled)
    conditions = list(dict.fromkeys(rows["condition"]))
    first, second = contrast or off_first(conditions)[:2][::-1]
    for name in (first, second):
        if name not in conditions:
            known = ", ".join(conditions)
            raise UserError(f"--contrast {name}: there is no such condition; rated are: {known}")
    if first == second:
        raise UserError(f"--contrast {first} {second}: name two different conditions")
    fit = None
    # With one rating a day the residual holds what days differ by.
    if over_days and not visits(rows) == len(rows) == rows["day"].nunique():
        if visits(rows) == len(conditions):
            notices.append(f"{table.source}: {_ONE_DAY}")
        else:
            try:
                fit = fit_scores(rows, (*chosen, day_grouping(rows)))
            except (ValueError, ArithmeticError) as error:
                notices.append(f"{table.source}: {_WITHOUT_DAYS}, for {error}")
    if fit is None:
        try:
            fit = fit_scores(rows, chosen)
        except (ValueError, ArithmeticError) as error:
            raise UserError(f"{table.source}: {error}") from None
    out = sorted(line for lines in left_out.values() for line in lines)
    found = Ratings(table.source, rows, (*fit.offsets,), fit, None, (*notices,), (*out,))
    return found, (second, first)


def _kept(
    table: TextTable,
    columns: Mapping[str, str],
    random: Sequence[str],
    scale: tuple[float, float],
) -> tuple[pd.DataFrame, dict[str, list[int]]]:
    """Return the ratings that count, and the lines that lack something, by what they lack.

    Raises
    ------
    UserError
        If a column is missing, a score is no number or outside the scale, fewer than three ratings
        or fewer than two conditions are left.
    """
    needed = {"condition", "score", *(part for name in random for part in name.split("/"))}
    for role in ("condition", "score", "examiner", "subject", "day"):
        if role in needed:
            table.column(columns[role], f"--{role}")
    present = [role for role in columns if role in COLUMNS and columns[role] in table.columns]
    records = []
    left_out: dict[str, list[int]] = {}
    for index, line in enumerate(table.lines):
        score = table.number(columns["score"], index)
        labels = {role: table.columns[columns[role]][index] for role in present}
        empty = [role for role in labels if role in needed and not labels[role]]
        if score is None or empty:
            lacking = "score" if score is None else " and ".join(empty)
            left_out.setdefault(lacking, []).append(line)
            continue
        if not scale[0] <= score <= scale[1]:
            raise UserError(
                f"{table.source}, line {line}: {columns['score']} is {score:g}, outside the scale "
                f"of {scale[0]:g} to {scale[1]:g}; put the rating right, or give the scale with "
                "--scale LOW HIGH"
            )
        cells = {COLUMNS[role]: label for role, label in labels.items()}
        records.append(cells | {"epoch": f"line {line}", "measure": SCORE, "value": score})
    lacks = sum(map(len, left_out.values()))
    if len(records) < FEWEST:
        lack = f" ({lacks} more lack a score or a label)" if lacks else ""
        raise UserError(
            f"{table.source} holds {plural(len(records), 'rating')}{lack}; at least {FEWEST} are "
            "needed for two means and their error"
        )
    rows = as_rows(records).astype(dict.fromkeys(TEXT, object))
    if rows["condition"].nunique() < 2:
        raise UserError(
            f"{table.source} holds ratings of one condition only ({rows['condition'][0]}); a "
            "contrast needs two, by name in the column that --condition gives"
        )
    return rows, left_out


def _unmodelled(rows: pd.DataFrame, random: Sequence[str]) -> Iterator[str]:
    """Yield that ratings have examiners, subjects or days for which the model has no offset."""
    modelled = {name.partition("/")[0] for name in random}
    for name in ("examiner", "subject"):
        count = distinct(rows, COLUMNS[name])
        if count > 1 and name not in modelled:
            yield _no_offset(count, name)
    days = distinct(rows, "subject", "day")
    if 1 < days < len(rows) and not any("day" in name for name in random):
        yield _no_offset(days, "day")
    by_examiner = distinct(rows, "subject", "condition", "rater")
    if not any(rows["day"]) and len(rows) > by_examiner > 2:
        yield (
            "no days are given, so ratings of one day count as independent; name their column "
            "with --day"
        )


def _no_offset(count: int, name: str) -> str:
    return (
        f"there are {count} {name}s, but the model has no offset for them; add --random {name}, or "
        f"ratings of one {name} count as independent"
    )
