"""A study out of any table: columns of values, and a column that says of what condition each is.

Several rows of a subject and day are no independent values: they are tested by days, as the epochs
of a study. What cannot be used is left out and stated, by the lines of the table.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import pandas as pd

from rigidimeter.analysis.study.measures import chosen_pair, off_first
from rigidimeter.analysis.study.rows import as_rows
from rigidimeter.analysis.study.study import GROUP, Study, no_such_group
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import TextTable, is_missing, lines_text
from rigidimeter.core.records import Notice
from rigidimeter.core.words import series

_FEW_SESSIONS = 10
_LARGEST = 1e100
"""Squares of larger values overflow in the tests."""
_OCCASIONS = ("visit", "session", "block", "run")
"""Columns that split the rows also where their labels are numbers."""
_ZEROS = re.compile(r"(?<!\d)0+(?=\d)")
_OUTCOMES = {"included", "excluded", "failed"}


class Columns(NamedTuple):
    """What the columns of a table are.

    Attributes
    ----------
    values : sequence of str
        Columns of numbers, each a measure.
    by : str
        The column that names the condition.
    session : str or None
        A column whose labels are resampled as units, and are days where there is no column of them.
    """

    values: Sequence[str]
    by: str = "condition"
    session: str | None = None


def table_study(
    table: TextTable | pd.DataFrame,
    columns: Columns,
    pair: tuple[str | None, str | None] = (None, None),
    group: str | None = None,
) -> Study:
    """Return the study of some columns of a table.

    Parameters
    ----------
    table : TextTable or pandas.DataFrame
    columns : Columns
    pair : tuple of str or None
        Reference and other; the first two where not given, ``OFF`` first where it occurs, and
        without the other each further condition with the reference.
    group : str, optional
        Take the rows of this group of subjects alone.

    Raises
    ------
    UserError
        If a column or a condition is not there, or a cell is no number.
    """
    if not isinstance(table, TextTable):
        table = _as_text(table)
    if group is not None:
        table = _of_group(table, group)
    labels = table.column(columns.by, "--by")
    for name in columns.values:
        table.column(name, "--value")
    if columns.session is not None:
        table.column(columns.session, "--session")
    known = off_first(labels)
    names = chosen_pair(
        known,
        pair,
        holder=f"column {columns.by} of {table.source} has",
        remedy="name another column with --by",
    )
    further = tuple(name for name in known if name not in names) if pair[1] is None else ()
    lines, notices = _kept(table, labels, {*names, *further}, columns.by)
    days = _days(table, lines, columns)
    notices += _splitting(table, lines, columns)
    records: list[dict[str, Any]] = []
    for name in dict.fromkeys(columns.values):
        found, missing = _of_column(table, name, columns, days, lines)
        absent = {*names} - {record["condition"] for record in found}
        for one in filter(absent.__contains__, names):
            raise UserError(
                f"{table.source}: {name} has no value in {one}, so there is nothing to compare"
            )
        if missing:
            notices.append(f"{table.source}: no {name} in {lines_text(missing)}; left out")
        records += found
    rows = as_rows(records)
    if columns.session is not None:
        notices += _few_sessions(table.source, rows, names[0], (names[1], *further))
    return Study(
        rows,
        *names,
        further,
        title="" if group is None else f"group {group}",
        source=table.source,
        by=columns.by,
        notices=tuple(Notice("warning", text) for text in notices),
    )


def _as_text(table: pd.DataFrame) -> TextTable:
    """Return a table of pandas as text, its rows numbered as in a file with one header line."""
    if not table.columns.is_unique:
        twice = table.columns[table.columns.duplicated()][0]
        raise UserError(f"the table has two columns with the name {twice}")
    cells = {
        str(name): tuple("" if pd.isna(cell) else str(cell) for cell in table[name])
        for name in table.columns
    }
    return TextTable("the table", cells, tuple(range(2, len(table) + 2)))


def _of_group(table: TextTable, group: str) -> TextTable:
    """Return the rows of one group of subjects."""
    labels = table.column(_spelled(table, GROUP), "group=")
    kept = [k for k, label in enumerate(labels) if label == group]
    if not kept:
        raise UserError(no_such_group(table.source, group, labels))
    columns = {name: tuple(cells[k] for k in kept) for name, cells in table.columns.items()}
    return replace(table, columns=columns, lines=tuple(table.lines[k] for k in kept))


def _kept(
    table: TextTable, labels: Sequence[str], names: Collection[str], by: str
) -> tuple[list[int], list[str]]:
    """Return the rows of these conditions, without those that an analysis has excluded."""
    rows = [k for k, label in enumerate(labels) if label in names]
    notices = []
    nameless = [table.lines[k] for k, label in enumerate(labels) if not label]
    if nameless:
        notices.append(f"{table.source}: no {by} in {lines_text(nameless)}; left out")
    outcomes = table.columns.get("outcome")
    if outcomes is not None and {*outcomes} <= _OUTCOMES:
        out = [table.lines[k] for k in rows if outcomes[k] != "included"]
        rows = [k for k in rows if outcomes[k] == "included"]
        if out:
            where = lines_text(out)
            notices.append(f"{table.source}: outcome is excluded or failed in {where}; left out")
    return rows, notices


def _splitting(table: TextTable, rows: Sequence[int], columns: Columns) -> Iterator[str]:
    """Yield that columns put the rows into a few parts, and that nothing uses them.

    Tables that this program wrote have such columns too; what they mean is known.
    """
    if "outcome" in table.columns:
        return
    used = {*columns.values, columns.by, columns.session, "subject", "day", GROUP}
    found = []
    for name, cells in table.columns.items():
        labels = Counter(cells[k] for k in rows if cells[k])
        words = not all(label.replace(".", "", 1).lstrip("+-").isdigit() for label in labels)
        few = len(labels) > 1 and min(labels.values()) > 1
        if few and (words or name in _OCCASIONS) and name.lower() not in used:
            found.append(name)
    if found:
        which = f"column {found[0]} splits the rows and is"
        if len(found) > 1:
            which = f"columns {series(found)} split the rows and are"
        yield f"{table.source}: {which} not used; compare each part by itself"


def _days(table: TextTable, rows: Sequence[int], columns: Columns) -> list[tuple[str, str]]:
    """Return subject and day of every row, the same for all where no row has one.

    Nothing where no two of the rows are of one day, or of one of several subjects.
    """
    subject, day = (_spelled(table, name) for name in ("subject", "day"))
    subjects, days = (
        _of_every(table, rows, name) if name != columns.by else () for name in (subject, day)
    )
    if not days and columns.session is not None and columns.session not in (columns.by, subject):
        days = _of_every(table, rows, columns.session)
    if not (subjects or days):
        return []
    alike = ("1",) * len(table.lines)
    found = list(zip(subjects or alike, days or alike, strict=True))
    several = {found[row][0] for row in rows}
    apart = len(several if len(several) > 1 else {found[row] for row in rows})
    return found if apart < len(rows) else []


def _of_every(table: TextTable, rows: Sequence[int], name: str) -> Sequence[str]:
    """Return the labels of a column, nothing where it is not there or blank in each of the rows.

    Raises
    ------
    UserError
        If it is blank in some, or writes one label in two ways.
    """
    cells = table.columns.get(name, ())
    blank = [row for row in rows if not cells or is_missing(cells[row])]
    if len(blank) == len(rows):
        return ()
    plain = [_ZEROS.sub("", cells[row].casefold()) for row in rows]
    written = dict(zip(plain, (cells[row] for row in rows), strict=True))
    other = [row for row in rows if cells[row] not in written.values()]
    if wrong := blank or other:
        what = "is blank" if blank else f"{cells[other[0]]} is written in another way elsewhere"
        lines = lines_text([table.lines[row] for row in wrong])
        raise UserError(f"{table.source}, {lines}: {name} {what}; say it in every row, in one way")
    return cells


def _of_column(
    table: TextTable,
    name: str,
    columns: Columns,
    days: Sequence[tuple[str, str]],
    rows: Sequence[int],
) -> tuple[list[dict[str, Any]], list[int]]:
    """Return the records of a column, and the lines that have no value of it."""
    nowhere = ("",) * len(table.lines)
    subjects, groups = (
        table.columns.get(_spelled(table, of), nowhere) for of in ("subject", GROUP)
    )
    records, missing = [], []
    for row in rows:
        line = table.lines[row]
        value = table.number(name, row)
        if value is not None and abs(value) > _LARGEST:
            raise UserError(
                f"{table.source}, line {line}: {name} is {value:g}; values up to {_LARGEST:g} can "
                "be compared"
            )
        unit = "/".join(days[row]) if days else f"line {line}"
        if columns.session is not None:
            unit = table.columns[columns.session][row]
        if value is None or not unit:
            missing.append(line)
            continue
        records.append(
            {
                "subject": subjects[row],
                "group": groups[row],
                "day": days[row][1] if days else "",
                "epoch": f"line {line}",
                "unit": unit,
                "condition": table.columns[columns.by][row],
                "measure": name,
                "value": value,
            }
        )
    return records, missing


def _few_sessions(
    source: str, rows: pd.DataFrame, reference: str, others: Sequence[str]
) -> Iterator[str]:
    """Yield that a bootstrap of few sessions has intervals that are too narrow."""
    units = rows.groupby(["condition", "measure"], observed=True, sort=False)["unit"].nunique()
    for other in others:
        for name in rows["measure"].drop_duplicates():
            of_pair = [units.get((condition, name), 0) for condition in (reference, other)]
            if 0 < min(of_pair) < _FEW_SESSIONS:
                yield (
                    f"{source}: {name} has {min(of_pair)} sessions in one group; so few make a "
                    "bootstrap interval too narrow"
                )


def _spelled(table: TextTable, name: str) -> str:
    """Return a name as the table capitalises it."""
    return next((own for own in table.columns if own.lower() == name), name)
