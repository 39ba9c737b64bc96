"""Ratings out of a table, checked: what is wrong is refused, what is odd is said."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rigidimeter.analysis.statistics import nested
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import MAX_NOTICES, TextTable, lines_text

RANDOM = ("examiner", "subject", "subject/day", "day", "day/condition")
FEWEST = 3
_SHOWN = 4


@dataclass(frozen=True)
class Rating:
    """One row that counts; columns that the file lacks are empty."""

    line: int
    condition: str
    score: float
    examiner: str = ""
    subject: str = ""
    day: str = ""


@dataclass(frozen=True)
class Ratings:
    """All rows that count, how many do not, and what is to be said about them."""

    rows: tuple[Rating, ...]
    left_out: tuple[int, ...]
    notices: tuple[str, ...]


def ratings_of(
    table: TextTable,
    columns: Mapping[str, str],
    random: Sequence[str],
    scale: tuple[float, float],
    step: float,
) -> Ratings:
    """Return the ratings of a table.

    Parameters
    ----------
    table : TextTable
    columns : mapping of str to str
        What the file calls condition, score, examiner, subject and day.
    random : sequence of str
        Names out of `RANDOM`; the columns that they need must exist.
    scale : tuple of float
        The lowest and highest rating that exist.
    step : float
        Of the scale; 0 for none.

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
    present = [role for role, name in columns.items() if name in table.columns]
    rows: list[Rating] = []
    left_out: dict[str, list[int]] = {}
    for index, line in enumerate(table.lines):
        where = f"{table.source}, line {line}"
        score = table.number(columns["score"], index)
        labels = {r: table.columns[columns[r]][index] for r in present if r != "score"}
        empty = [role for role in labels if role in needed and not labels[role]]
        if score is None or empty:
            lacking = "score" if score is None else " and ".join(empty)
            left_out.setdefault(lacking, []).append(line)
            continue
        if not scale[0] <= score <= scale[1]:
            raise UserError(
                f"{where}: {columns['score']} is {score:g}, outside the scale of {scale[0]:g} to "
                f"{scale[1]:g}; put the rating right, or give the scale with --scale LOW HIGH"
            )
        rows.append(Rating(line, score=score, **labels))
    n_left_out = sum(map(len, left_out.values()))
    if len(rows) < FEWEST:
        lack = f" ({n_left_out} more lack a score or a label)" if n_left_out else ""
        raise UserError(
            f"{table.source} holds {len(rows)} rating{'' if len(rows) == 1 else 's'}{lack}; at "
            f"least {FEWEST} are needed for two means and their error"
        )
    if len(named := {row.condition for row in rows}) < 2:
        raise UserError(
            f"{table.source} holds ratings of one condition only ({named.pop()}); a contrast needs "
            "two, by name in the column that --condition gives"
        )
    notices = [
        f"{table.source}, {lines_text(lines)}: no {lacking} is given; "
        f"the row{' was' if len(lines) == 1 else 's were'} left out"
        for lacking, lines in left_out.items()
    ]
    notices += oddities(table.source, rows, random, scale[0], step, with_day="day" in present)
    notices += _unmodelled(rows, random)
    out = sorted(line for lines in left_out.values() for line in lines)
    return Ratings(tuple(rows), tuple(out), tuple(notices))


def oddities(
    source: str,
    rows: Sequence[Rating],
    random: Sequence[str],
    low: float,
    step: float,
    *,
    with_day: bool,
) -> list[str]:
    """Say what is odd about ratings that are used all the same."""
    said = _odd(source, rows, low, step) + _repeated(source, rows, with_day)
    return said + _single(rows, random)


def groupings(rows: Sequence[Rating], random: Sequence[str]) -> dict[str, list[str]]:
    """Return the labels of each grouping; ``subject/day`` stands for subject and day within.

    A day belongs to its subject.
    """
    columns = {
        name: [getattr(row, name) for row in rows]
        for name in ("examiner", "subject", "day", "condition")
    }
    if len(set(columns["subject"])) > 1:
        columns["day"] = nested(columns["subject"], columns["day"])
    found: dict[str, list[str]] = {}
    for name in random:
        outer, _, inner = name.partition("/")
        found[outer] = columns[outer]
        if name == "subject/day":
            found[name] = nested(columns["subject"], [row.day for row in rows])
        elif inner:
            found[name] = nested(columns[outer], columns[inner])
    return found


def day_grouping(rows: Sequence[Rating]) -> str:
    """Return ``day``, or ``day/condition`` where days have several conditions."""
    days = {(row.subject, row.day) for row in rows}
    return "day/condition" if visits(rows) > len(days) else "day"


def visits(rows: Sequence[Rating]) -> int:
    """Return how many days of a subject in a condition were rated."""
    return len({(row.subject, row.day, row.condition) for row in rows})


def _odd(source: str, rows: Sequence[Rating], low: float, step: float) -> list[str]:
    if step <= 0:
        return []
    odd = [
        row
        for row in rows
        if abs((row.score - low) / step - round((row.score - low) / step)) > 1e-6
    ]
    if not odd:
        return []
    told = ", ".join(f"{row.score:g} in line {row.line}" for row in odd[:_SHOWN])
    more = f" and {len(odd) - _SHOWN} more" if len(odd) > _SHOWN else ""
    return [f"{source}: not in steps of {step:g}: {told}{more}; used as they are"]


def _repeated(source: str, rows: Sequence[Rating], with_day: bool) -> list[str]:
    if not with_day:
        return []
    seen: dict[tuple[str, ...], list[Rating]] = {}
    for row in rows:
        if row.day:
            key = (row.subject, row.examiner, row.condition, row.day)
            seen.setdefault(key, []).append(row)
    said = []
    repeated = {key: found for key, found in seen.items() if len(found) > 1}
    for (_, examiner, condition, day), found in list(repeated.items())[:MAX_NOTICES]:
        lines = " and ".join(str(row.line) for row in found[:MAX_NOTICES])
        by = f" by examiner {examiner}" if examiner else ""
        said.append(
            f"{source}, lines {lines}: rated more than once{by} in {condition} on day {day} "
            f"({', '.join(f'{row.score:g}' for row in found[:MAX_NOTICES])}); all are used as "
            "separate ratings. If one is a copy, p is too small: take it out"
        )
    if len(repeated) > MAX_NOTICES:
        more = len(repeated) - MAX_NOTICES
        said.append(
            f"{source}: {more} more were rated more than once, and are used in the same way"
        )
    return said


def _single(rows: Sequence[Rating], random: Sequence[str]) -> list[str]:
    said = []
    for name, labels in groupings(rows, random).items():
        once = [label for label, count in Counter(labels).items() if count == 1]
        if once and len(once) < len(set(labels)) and name in ("examiner", "subject"):
            said.append(
                f"{name} {_some(once)} gave one rating; its offset is strongly shrunken"
                if name == "examiner"
                else f"{name} {_some(once)} has one rating; its offset is shrunken"
            )
    return said


def _some(names: Sequence[str]) -> str:
    more = f" and {len(names) - MAX_NOTICES} more" if len(names) > MAX_NOTICES else ""
    return ", ".join(names[:MAX_NOTICES]) + more


def _unmodelled(rows: Sequence[Rating], random: Sequence[str]) -> list[str]:
    modelled = {name.partition("/")[0] for name in random}
    said = []
    for name in ("examiner", "subject"):
        count = len({getattr(row, name) for row in rows})
        if count > 1 and name not in modelled:
            said.append(_no_offset(count, name))
    days = len({(row.subject, row.day) for row in rows})
    if 1 < days < len(rows) and not any("day" in name for name in random):
        said.append(_no_offset(days, "day"))
    by_examiner = {(row.subject, row.condition, row.examiner) for row in rows}
    if not any(row.day for row in rows) and len(rows) > len(by_examiner) > 2:
        said.append(
            "no days are given, so ratings of one day count as independent; name their column "
            "with --day"
        )
    return said


def _no_offset(count: int, name: str) -> str:
    return (
        f"there are {count} {name}s, but the model has no offset for them; add --random {name}, or "
        f"ratings of one {name} count as independent"
    )
