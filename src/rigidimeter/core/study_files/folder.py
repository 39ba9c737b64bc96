"""The study folder: `study.toml`, and tables of sessions, ratings, exclusions and blinding codes.

    study.toml      title, the two conditions and their stimulation, the rating scale
    sessions.csv    path, subject, day, condition [, part] [, note]
    ratings.csv     subject, day, condition, examiner, score
    exclusions.csv  path, epoch, reason, by
    key.csv         code, condition

Only the first two must exist. What is wrong with one row is a notice of level `error`, and the row
is left out; what leaves nothing to analyse is a `UserError`. Nothing is decided here about what
the rows mean.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import (
    cell_number,
    lines_text,
    noted_digests,
    read_text_table,
)
from rigidimeter.core.records import Notice
from rigidimeter.core.study_files.study_toml import STUDY_FILE, StudyToml, read_study_toml

TABLE_COLUMNS: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "sessions": (
        ("path", "subject", "day", "condition"),
        ("group", "part", "mapping", "join", "clock_offset", "note"),
    ),
    "ratings": (("subject", "day", "condition", "examiner", "score"), ("note",)),
    "exclusions": (("path", "epoch", "reason"), ("by", "note")),
    "key": (("code", "condition"), ("note",)),
    "stimulation": (("changed_utc", "subject", "stimulation"), ("by", "note")),
}
"""The columns of each table: those that it must have, and those that it may have."""

_OF_THE_ANALYSIS = ("sessions", "ratings", "exclusions", "key")

_MAY_BE_EMPTY = ("note", "part", "by", "mapping", "join", "clock_offset")


@dataclass(frozen=True)
class TableRow:
    """One row of a table: its file and line, and its cells by column."""

    source: str
    line: int
    cells: Mapping[str, str]

    @property
    def where(self) -> str:
        """File and line, for the beginning of a message."""
        return f"{self.source}, line {self.line}"

    def __getitem__(self, column: str) -> str:
        """Return a cell; of a column that the table lacks it is empty."""
        return self.cells.get(column, "")

    def number(self, column: str) -> float | None:
        """Return a cell as a number, None where it is missing.

        Raises
        ------
        UserError
            If it is neither.
        """
        return cell_number(self[column], column, self.where)


@dataclass(frozen=True)
class StudyFolder:
    """What a study folder holds, row by row.

    Attributes
    ----------
    folder : Path
    about : StudyToml
    sessions, ratings, exclusions : tuple of TableRow
    key : tuple of TableRow or None
        None where there is no blinding key.
    files : mapping of str to Path
        The tables and `study.toml` that exist, by the name under which a digest is kept.
    digests : mapping of str to str
        SHA-256 of what was read of each, by the same names.
    notices : tuple of Notice
        What is wrong with single rows and columns.
    """

    folder: Path
    about: StudyToml
    sessions: tuple[TableRow, ...]
    ratings: tuple[TableRow, ...]
    exclusions: tuple[TableRow, ...]
    key: tuple[TableRow, ...] | None
    files: Mapping[str, Path]
    digests: Mapping[str, str]
    notices: tuple[Notice, ...]


def is_study(path: Path) -> bool:
    """Whether the path is a folder with a `study.toml`."""
    return (path / STUDY_FILE).is_file()


def read_study_folder(folder: Path, key: Path | None = None) -> StudyFolder:
    """Read a study folder's description and tables; `key` is a blinding key kept elsewhere.

    Raises
    ------
    UserError
        If `study.toml` or a table cannot be read, a column that must exist is missing, or there is
        no session.
    """
    with noted_digests() as noted:
        about = read_study_toml(folder / STUDY_FILE)
        notices: list[Notice] = []
        if "one_offset_a_day" in about.analysis.model_fields_set:
            text = (
                f"{folder / STUDY_FILE}: one_offset_a_day has no effect any more, for the test by "
                "days is chosen by which days have which conditions; remove the line"
            )
            notices.append(Notice("warning", text))
        files = {STUDY_FILE: folder / STUDY_FILE}
        tables: dict[str, tuple[TableRow, ...] | None] = {}
        for name in _OF_THE_ANALYSIS:
            path, namer = folder / getattr(about, name), STUDY_FILE
            named = name in about.model_fields_set or name == "sessions"
            if name == "key" and key is not None:
                path, named, namer = key, True, "--key"
            if not path.exists():
                if named:
                    raise UserError(
                        f"{path}: there is no such file, but {namer} names it as the table "
                        f"with the columns {', '.join(TABLE_COLUMNS[name][0])}"
                    )
                tables[name] = None
                continue
            # A key is listed by its role: it may be kept anywhere, and its place is not recorded.
            files["key" if name == "key" else getattr(about, name)] = path
            tables[name] = _read_table(path, name, notices)
        if not tables["sessions"]:
            raise UserError(
                f"{folder / about.sessions}: holds no session; write a row with "
                "path,subject,day,condition for each"
            )
        return StudyFolder(
            folder,
            about,
            tables["sessions"] or (),
            tables["ratings"] or (),
            tables["exclusions"] or (),
            tables["key"],
            files,
            {name: noted[path] for name, path in files.items()},
            tuple(notices),
        )


def _read_table(path: Path, name: str, notices: list[Notice]) -> tuple[TableRow, ...]:
    table = read_text_table(path, may_be_empty=True)
    needed, allowed = TABLE_COLUMNS[name]
    present = tuple(table.columns)
    missing = [column for column in needed if column not in present]
    if missing:
        spare = [column for column in present if column not in (*needed, *allowed)]
        near = difflib.get_close_matches(missing[0], spare, n=1, cutoff=0.5)
        hint = f" (the nearest is {near[0]})" if near else ""
        raise UserError(
            f"{path}: there is no column {missing[0]}{hint}; its columns are {', '.join(present)}, "
            f"and it must have {', '.join(needed)}"
        )
    for column in present:
        if column in (*needed, *allowed) or column.startswith("column "):
            continue
        free = [name for name in (*needed, *allowed) if name not in present]
        near = difflib.get_close_matches(column, free, n=1, cutoff=0.6)
        nearest = f"the nearest that is known is {near[0]}" if near else "it means nothing here"
        text = f"{path}: column {column} is not read; {nearest}"
        notices.append(Notice("warning", text))
    rows: list[TableRow] = []
    lacking: dict[str, list[int]] = {}
    for index, line in enumerate(table.lines):
        cells = {name: cells[index] for name, cells in table.columns.items()}
        empty = [name for name in needed if name not in _MAY_BE_EMPTY and not cells[name]]
        if empty:
            lacking.setdefault(" and ".join(empty), []).append(line)
            continue
        rows.append(TableRow(table.source, line, cells))
    for names, lines in lacking.items():
        left = "the row is" if len(lines) == 1 else "the rows are"
        text = f"{table.source}, {lines_text(lines)}: no {names} is given; {left} left out"
        notices.append(Notice("error", text))
    return tuple(rows)
