"""Rows added to the tables of a study folder; what stands there already stays as it is.

A table may have been edited by hand or by a spreadsheet: with other separators, more columns,
comments. So rows are put behind its last line, in its own order of columns, and the file is
replaced at once.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

from rigidimeter.core.errors import UserError, refused
from rigidimeter.core.files import (
    DICTIONARY,
    TABLE_BYTES,
    TextTable,
    as_written,
    dictionary_text,
    read_text_table,
    read_utf8,
    replace_file,
    text_bytes,
    write_dictionary,
    write_text,
)
from rigidimeter.core.study_files.day_plan import COLUMNS as PLAN_COLUMNS
from rigidimeter.core.study_files.day_plan import PLAN_TABLE
from rigidimeter.core.study_files.folder import TABLE_COLUMNS, is_study
from rigidimeter.core.study_files.study_toml import STUDY_FILE, read_study_toml

_ABOUT = {
    "sessions": "# One row a recording and condition: a session folder, or a file with the "
    "standard names.\n# part distinguishes two sessions of one day in one condition.\n",
    "ratings": "# One row a score.\n",
    "exclusions": "# Epochs that you take out: which, why, and who says so.\n",
    "stimulation": "# One row a change of a subject's stimulation: on or off, and since when.\n",
}
_COLUMNS = {
    "sessions": ("path", "subject", "day", "condition", "part", "mapping", "note"),
    "ratings": ("subject", "day", "condition", "examiner", "score", "note"),
    "exclusions": ("path", "epoch", "reason", "by"),
    "stimulation": ("changed_utc", "subject", "stimulation", "by"),
}
_MAY_BE_LOST = "note"


def empty_table(name: str) -> str:
    """Return a table without rows: what it is for, and its columns."""
    return f"{_ABOUT[name]}{','.join(_COLUMNS[name])}\n"


def write_study_dictionary(folder: Path, **named: str) -> None:
    """Write what is in each column of every table that a study may have.

    Parameters
    ----------
    folder : Path
    **named : str
        The files of tables that are called otherwise.

    Raises
    ------
    UserError
        If it cannot be written.
    """
    files = {name: named.get(name, f"{name}.csv") for name in TABLE_COLUMNS}
    columns = {files[name]: (*needed, *more) for name, (needed, more) in TABLE_COLUMNS.items()}
    tables = dict(zip(columns, files, strict=True))
    text = dictionary_text(columns | {PLAN_TABLE: PLAN_COLUMNS}, tables)
    write_dictionary(folder / DICTIONARY, text)


def table_path(folder: Path, name: str) -> Path:
    """Return where a table of a study lies, or would lie.

    Raises
    ------
    UserError
        If there is a `study.toml` that cannot be read.
    """
    if is_study(folder):
        return folder / str(getattr(read_study_toml(folder / STUDY_FILE), name))
    return folder / f"{name}.csv"


def table_rows(path: Path, name: str) -> list[dict[str, str]]:
    """Return the rows of a table; none if there is no such file.

    Raises
    ------
    UserError
        If the table cannot be read, or lacks a column that it must have.
    """
    if not path.exists():
        return []
    table = checked_table(path, name)
    return [
        {column: cells[k] for column, cells in table.columns.items()}
        for k in range(len(table.lines))
    ]


def commented_cells(path: Path) -> set[str]:
    """Return the cells of rows that were made comments, and so are out of the table on purpose."""
    if not path.exists():
        return set()
    lines = read_utf8(path, TABLE_BYTES).decode("utf-8").splitlines()
    rows = (line.lstrip("# ") for line in lines if line.lstrip().startswith("#"))
    return {cell.strip(' "') for row in rows for cell in row.replace(";", ",").split(",")}


def add_rows(path: Path, name: str, rows: Sequence[Mapping[str, str]]) -> None:
    """Put rows behind the last one of a table; the file is made if there is none.

    Raises
    ------
    UserError
        If the table cannot be read or written, or lacks a column for which a row has a value.
    """
    if not rows:
        return
    if not path.exists():
        with refused(path, "cannot be made"):
            path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, empty_table(name))
        write_study_dictionary(path.parent, **{name: path.name})
    table = checked_table(path, name)
    for row in rows:
        absent = [
            column
            for column, cell in row.items()
            if cell and column not in table.columns and column != _MAY_BE_LOST
        ]
        if absent:
            raise UserError(
                f"{path}: there is no column {absent[0]} for {row[absent[0]]!r}; add it to the "
                "table's first line, and a separator to every row"
            )
    with refused(path, "cannot be read"):
        before = path.read_bytes()
    try:
        before.decode("utf-8")
    except UnicodeDecodeError:  # as a spreadsheet may have written it
        before = read_utf8(path, TABLE_BYTES)
    end = b"\r\n" if b"\r\n" in before else b"\n"
    text = io.StringIO(newline="")
    writer = csv.writer(text, delimiter=table.delimiter, lineterminator=end.decode())
    writer.writerows([as_written(row.get(column, "")) for column in table.columns] for row in rows)
    between = b"" if before.endswith((b"\n", b"\r")) else end
    with refused(path, "cannot be written"):
        replace_file(path, before + between + text_bytes(text.getvalue()))


def checked_table(path: Path, name: str) -> TextTable:
    """Read a table that has the columns which it must have, and may have no rows.

    Raises
    ------
    UserError
    """
    table = read_text_table(path, may_be_empty=True)
    missing = [column for column in TABLE_COLUMNS[name][0] if column not in table.columns]
    if missing:
        raise UserError(
            f"{path}: there is no column {missing[0]}; its columns are {', '.join(table.columns)}, "
            f"and it must have {', '.join(TABLE_COLUMNS[name][0])}"
        )
    return table
