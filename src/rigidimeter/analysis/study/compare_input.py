"""Compare two conditions of whatever holds them: a study folder, estimates, or a table."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigidimeter.analysis.estimation import Progress
from rigidimeter.analysis.reading import read_estimates
from rigidimeter.analysis.reading.formats import READERS
from rigidimeter.analysis.study.compared import Comparison
from rigidimeter.analysis.study.comparison import (
    against_reference,
    compare_analysis,
    compare_measures,
    day_tests,
    measured,
    with_further,
)
from rigidimeter.analysis.study.measures import (
    Measure,
    Observation,
    chosen_pair,
    conditions,
    off_first,
)
from rigidimeter.analysis.study.results import StudyResult
from rigidimeter.analysis.study.study_analysis import (
    GROUP,
    analyse_study,
    no_such_group,
    read_study,
)
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import TextTable, is_missing, lines_text, read_text_table
from rigidimeter.core.records import Analysis, Notice
from rigidimeter.core.settings import Settings, settings_from
from rigidimeter.core.study_files import is_study
from rigidimeter.core.words import series

if TYPE_CHECKING:
    import pandas as pd

_FEW_SESSIONS = 10
_LARGEST = 1e100
"""Squares of larger values overflow in the tests."""
_OCCASIONS = ("visit", "session", "block", "run")
"""Columns that split the rows also where their labels are numbers."""
_ZEROS = re.compile(r"(?<!\d)0+(?=\d)")
_OF_DAY = ("subject", "day")
"""Columns of a table that say which values belong together."""


def compare(
    x: str | PathLike[str] | Analysis | pd.DataFrame,
    other: str | None = None,
    *,
    reference: str | None = None,
    value: str | Sequence[str] | None = None,
    by: str = "condition",
    session: str | None = None,
    group: str | None = None,
    key: str | PathLike[str] | None = None,
    settings: Settings | str | Path | Mapping[str, Any] | None = None,
    method: str = "auto",
    seed: int = 1,
    resamples: int = 9999,
    progress: Progress = lambda _: None,
) -> StudyResult:
    """Compare two conditions: medians, rank-sum tests, shifts, effect sizes.

    Parameters
    ----------
    x : path, Analysis or pandas.DataFrame
        A study folder, which adds tests by days, ratings and other methods; estimates, or the JSON
        file of them; or a table, or the CSV file of one, with `value` and `by`.
    other, reference : str, optional
        The two conditions; differences are other − reference, but `shift`, `z`, `r` and the
        `estimate` by days, as documented, are reference − other. Where not given, those of the
        study, or the first two, ``OFF`` first. Without `other` each further condition is compared
        with the reference, too.
    value : str or sequence of str, optional
        Columns of the table to compare.
    by : str
        The table's column of conditions.
    session : str, optional
        The table's column whose labels the bootstrap resamples, and the days of the test where the
        table has no column `day`. By default each row, or each subject and day where the table's
        columns `subject` and `day` have several rows of one, such as one in each condition.
    group : str, optional
        Compare the subjects of this group alone, of the column `group` of the table, or of the
        study's table of sessions. Without it a difference is claimed only where each group shows
        it by itself.
    key : path, optional
        The blinding key of a study folder that is stored elsewhere.
    settings : Settings, path or mapping, optional
        Of a study folder, instead of those that its first session was recorded with.
    method : str
        Of a study folder: the estimator, instead of that of its ``study.toml``.
    seed, resamples : int
        Of the bootstrap.
    progress : callable
        Called with the share of the work that was done since, 1 in all.

    Raises
    ------
    UserError
        If there is nothing to compare, or a name is unknown.

    Examples
    --------
    >>> import pandas as pd, rigidimeter as rm
    >>> table = pd.DataFrame({"state": ["OFF", "ON"] * 6, "k": [1.8, 1.4, 1.7, 1.5] * 3})
    >>> result = rm.compare(table, value="k", by="state")
    >>> comparison = result.comparisons[0]
    >>> comparison.summaries["OFF"].median, comparison.summaries["ON"].median
    (1.75, 1.45)
    """
    wanted = (reference, other)
    path = Path(x) if isinstance(x, (str, PathLike)) else None
    tabled = value is not None or not (isinstance(x, Analysis) or path)
    if tabled and path is None and not hasattr(x, "columns"):
        raise UserError(
            "compare takes a study folder, estimates, their JSON file, or a table; not something "
            f"of type {type(x).__name__}"
        )
    if tabled:
        table = _as_text(x) if path is None else read_text_table(path)
        return _compare_columns(
            table,
            _names(value),
            by,
            wanted,
            session=session,
            group=group,
            seed=seed,
            resamples=resamples,
            progress=progress,
        )
    if path is not None and is_study(path):
        secret = None if key is None else Path(key)
        chosen = None if settings is None else settings_from(settings)
        read = read_study(
            path, key=secret, settings=chosen, method=method, pair=wanted, group=group
        )
        return analyse_study(read, seed=seed, resamples=resamples, progress=progress)
    if path is not None and (
        path.is_dir() or any(path.suffix.lower() in reader.suffixes for reader in READERS)
    ):
        raise UserError(
            f"{path} is neither a study folder nor a JSON file of estimates; for a recording give "
            "what estimate returns, for a table also value=, the columns to compare"
        )
    if group is not None:
        raise UserError(f"group {group}: estimates name no group; give a study folder or a table")
    analysis = x if isinstance(x, Analysis) else read_estimates(Path(x))
    known = conditions(analysis)
    pair = chosen_pair(known, wanted)
    return compare_analysis(
        analysis,
        *pair,
        seed=seed,
        resamples=resamples,
        further=() if other is not None else [name for name in known if name not in pair],
        progress=progress,
    )


def _names(value: str | Sequence[str] | None) -> list[str]:
    names = [value] if isinstance(value, str) else value
    if not isinstance(names, Iterable) or not (listed := [str(name) for name in names]):
        raise UserError("a table needs value=, the column or columns to compare")
    return listed


def _as_text(table: Any) -> TextTable:
    """Return a table of pandas as text, its rows numbered as in a file with one header line."""
    if not table.columns.is_unique:
        twice = table.columns[table.columns.duplicated()][0]
        raise UserError(f"the table has two columns with the name {twice}")
    columns = {
        str(name): tuple("" if missing else str(cell) for cell, missing in zip(
            table[name], table[name].isna(), strict=True))
        for name in table.columns
    }  # fmt: skip
    return TextTable("the table", columns, tuple(range(2, len(table) + 2)))


def _compare_columns(
    table: TextTable,
    values: Sequence[str],
    by: str,
    pair: tuple[str | None, str | None] = (None, None),
    *,
    session: str | None = None,
    group: str | None = None,
    seed: int = 1,
    resamples: int = 9999,
    progress: Progress = lambda _: None,
) -> StudyResult:
    """Compare two groups of a table in one column or several.

    Several rows of a subject and day, in one group or in two, are no independent values: they are
    tested by days, as the epochs of a study.

    Parameters
    ----------
    table : TextTable
    values : sequence of str
        Columns of numbers.
    by : str
        The column that names the group.
    pair : tuple of str or None
        Reference and other group; the first two where not given, ``OFF`` first where it occurs, and
        without the other each further group with the reference.
    session : str, optional
        A column whose labels are resampled as units, and are days where there is no column of them;
        else each row is one.
    group : str, optional
        Take the rows of this group of subjects alone.
    seed, resamples : int
        Of the bootstrap.
    progress : callable

    Raises
    ------
    UserError
        If a column or a group is not there, or a cell is no number.
    """
    if group is not None:
        table = _of_group(table, group)
    labels = table.column(by, "--by")
    for name in values:
        table.column(name, "--value")
    units = table.column(session, "--session") if session is not None else None
    known = off_first(labels)
    names = chosen_pair(
        known,
        pair,
        holder=f"column {by} of {table.source} has",
        remedy="name another column with --by",
    )
    further = [name for name in known if name not in names] if pair[1] is None else []
    rows, notices = _kept(table, labels, [*names, *further], by)
    days = _days(table, rows, by, session)
    if splits := _splitting(table, rows, {*values, by, session or by}):
        which = f"column {splits[0]} splits the rows and is"
        if len(splits) > 1:
            which = f"columns {series(splits)} split the rows and are"
        notices.append(f"{table.source}: {which} not used; compare each part by itself")
    comparisons = []
    for name in dict.fromkeys(values):
        one, said = _column(table, name, labels, units, days, names, rows)
        comparisons.append(one)
        notices += said
    tested, differences = compare_measures(
        comparisons, seed=seed, resamples=resamples, progress=progress
    )
    tested, more = with_further(tested, against_reference(tested, further))
    if days:
        every = day_tests((*tested, *more))
        tested, more = every[: len(tested)], every[len(tested) :]
    for each in (*tested, *more) if units is not None else ():
        count = min(len({o.unit for o in each.of(group)}) for group in each.pair)
        if count < _FEW_SESSIONS:
            notices.append(
                f"{table.source}: {each.measure.name} has {count} sessions in one group; so few "
                "make a bootstrap interval too narrow"
            )
    return StudyResult(
        "" if group is None else f"group {group}",
        *names,
        tested,
        differences,
        tuple(Notice("warning", text) for text in notices),
        seed,
        resamples,
        source=table.source,
        by=by,
        further=more,
    )


def _of_group(table: TextTable, group: str) -> TextTable:
    """Return the rows of one group of subjects."""
    labels = table.column(_spelled(table, GROUP), "group=")
    rows = [k for k, label in enumerate(labels) if label == group]
    if not rows:
        raise UserError(no_such_group(table.source, group, labels))
    columns = {name: tuple(cells[k] for k in rows) for name, cells in table.columns.items()}
    return replace(table, columns=columns, lines=tuple(table.lines[k] for k in rows))


def _splitting(table: TextTable, rows: Sequence[int], used: Collection[str]) -> list[str]:
    """Return columns that put the rows into a few parts, and that nothing uses.

    Tables that this program wrote have such columns too; what they mean is known.
    """
    if "outcome" in table.columns:
        return []
    found = []
    for name, cells in table.columns.items():
        labels = Counter(cells[k] for k in rows if cells[k])
        words = not all(label.replace(".", "", 1).lstrip("+-").isdigit() for label in labels)
        few = len(labels) > 1 and min(labels.values()) > 1
        if few and (words or name in _OCCASIONS) and name.lower() not in {*used, *_OF_DAY, GROUP}:
            found.append(name)
    return found


def _kept(
    table: TextTable, labels: Sequence[str], names: Sequence[str], by: str
) -> tuple[list[int], list[str]]:
    """Return the rows of both groups, without those that an analysis has excluded."""
    rows = [k for k, label in enumerate(labels) if label in names]
    notices = []
    nameless = [table.lines[k] for k, label in enumerate(labels) if not label]
    if nameless:
        notices.append(f"{table.source}: no {by} in {lines_text(nameless)}; left out")
    outcomes = table.columns.get("outcome")
    if outcomes is not None and set(outcomes) <= {"included", "excluded", "failed"}:
        out = [table.lines[k] for k in rows if outcomes[k] != "included"]
        rows = [k for k in rows if outcomes[k] == "included"]
        if out:
            notices.append(
                f"{table.source}: outcome is excluded or failed in {lines_text(out)}; left out"
            )
    return rows, notices


def _days(
    table: TextTable, rows: Sequence[int], by: str, session: str | None
) -> list[tuple[str, str]]:
    """Return subject and day of every row, the same for all where no row has one.

    Nothing where no two of the rows are of one day, or of one of several subjects.
    """
    subject, day = (_spelled(table, name) for name in _OF_DAY)
    subjects, days = (_of_every(table, rows, name) if name != by else () for name in (subject, day))
    if not days and session not in (None, by, subject):
        days = _of_every(table, rows, session)
    if not (subjects or days):
        return []
    alike = ("1",) * len(table.lines)
    found = list(zip(subjects or alike, days or alike, strict=True))
    several = {found[row][0] for row in rows}
    apart = several if len(several) > 1 else {found[row] for row in rows}
    return found if len(apart) < len(rows) else []


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


def _spelled(table: TextTable, name: str) -> str:
    """Return a name as the table capitalises it."""
    return next((own for own in table.columns if own.lower() == name), name)


def _column(
    table: TextTable,
    name: str,
    labels: Sequence[str],
    units: Sequence[str] | None,
    days: Sequence[tuple[str, str]],
    names: tuple[str, str],
    rows: Sequence[int],
) -> tuple[Comparison, list[str]]:
    observations, missing = [], []
    nowhere = ("",) * len(labels)
    subjects, groups = (
        table.columns.get(_spelled(table, of), nowhere) for of in (_OF_DAY[0], GROUP)
    )
    for row in rows:
        line = table.lines[row]
        value = table.number(name, row)
        if value is not None and abs(value) > _LARGEST:
            raise UserError(
                f"{table.source}, line {line}: {name} is {value:g}; values up to {_LARGEST:g} can "
                "be compared"
            )
        of_day = "/".join(days[row]) if days else f"line {line}"
        unit = units[row] if units is not None else of_day
        if value is None or not unit:
            missing.append(line)
        else:
            observations.append(
                Observation(
                    value,
                    labels[row],
                    subjects[row],
                    days[row][1] if days else "",
                    epoch=f"line {line}",
                    unit=unit,
                    group=groups[row],
                )
            )
    found = measured(Measure(name, name, "", "column"), observations, names)
    for group in names:
        if not found.summaries[group].n:
            raise UserError(
                f"{table.source}: {name} has no value in {group}, so there is nothing to compare"
            )
    notices = [f"{table.source}: no {name} in {lines_text(missing)}; left out"] if missing else []
    return found, notices
