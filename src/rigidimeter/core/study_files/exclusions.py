"""Epochs that a person leaves out of a study, and includes again: rows of `exclusions.csv`.

Nothing is deleted. The row of an epoch that is included again becomes a comment which says when,
by whom and why, so that every reader of the table, also an older one, counts the epoch.
"""

from __future__ import annotations

import csv
import difflib
import io
import os
from datetime import UTC, datetime
from pathlib import Path

from rigidimeter.core.errors import UserError, refused
from rigidimeter.core.files import TABLE_BYTES, read_utf8, replace_file, text_bytes, visible
from rigidimeter.core.session import EVENTS, is_session, read_events
from rigidimeter.core.study_files.tables import add_rows, checked_table, table_path, table_rows

_TABLE = "exclusions"


def excluded_epochs(study: Path) -> dict[tuple[str, str], str]:
    """Return why each epoch is left out, and who wrote it, by normalised path and label.

    Raises
    ------
    UserError
        If the table cannot be read.
    """
    return {
        (os.path.normpath(row["path"]), row["epoch"]): row["reason"]
        + (f" ({row['by']})" if row.get("by") else "")
        for row in table_rows(table_path(study, _TABLE), _TABLE)
    }


def row_path(study: Path, path: str, epoch: str) -> str:
    """Return how the table of sessions names a recording that has such an epoch.

    The last part of a path will do if no other ends so. Of a recording that is no session folder
    the epochs are not known before it is read.

    Raises
    ------
    UserError
        If it is not in the table, or a session folder without the epoch.
    """
    table = table_path(study, "sessions")
    named = {os.path.normpath(row["path"]): row["path"] for row in table_rows(table, "sessions")}
    within = os.path.relpath(os.path.realpath(path), os.path.realpath(study))
    ends = [one for one in named if os.path.basename(one) == path]
    asked = (os.path.normpath(path), within, *(ends if len(ends) == 1 else ()))
    found = next((one for one in asked if one in named), None)
    if found is None:
        near = difflib.get_close_matches(path, named, n=1, cutoff=0.5)
        hint = f"; the nearest is {near[0]}" if near else ""
        raise UserError(f"{path}: is not in {table}{hint}")
    if is_session(study / found):
        events, _ = read_events(study / found / EVENTS)
        labels = [event["label"] for event in events if event["event"] == "epoch_started"]
        if epoch not in labels:
            raise UserError(f"{path} has no epoch {epoch}; its epochs are {', '.join(labels)}")
    return named[found]


def exclude_epoch(study: Path, path: str, epoch: str, reason: str, by: str) -> None:
    """Leave an epoch out of results, with a reason and a name.

    Parameters
    ----------
    study : Path
        The folder of the table.
    path, epoch : str
        As the table names them; the recording is not read.
    reason, by : str

    Raises
    ------
    UserError
        If it is left out already, reason or name is missing, or the table cannot be written.
    """
    _require(reason, by, "leave an epoch out")
    if (os.path.normpath(path), epoch) in excluded_epochs(study):
        raise UserError(f"epoch {epoch} of {path} is left out already")
    row = {"path": path, "epoch": epoch, "reason": reason.strip(), "by": by.strip()}
    add_rows(table_path(study, _TABLE), _TABLE, [row])


def include_epoch(study: Path, path: str, epoch: str, reason: str, by: str) -> None:
    """Include an epoch again that was left out; its row becomes a comment with date, name, reason.

    Parameters
    ----------
    study : Path
        The folder of the table.
    path, epoch : str
        As the table names them.
    reason, by : str

    Raises
    ------
    UserError
        If it is not left out, reason or name is missing, or the table cannot be written.
    """
    _require(reason, by, "include an epoch again")
    wanted = (os.path.normpath(path), epoch)
    if wanted not in excluded_epochs(study):
        raise UserError(f"epoch {epoch} of {path} is not left out")
    table_file = table_path(study, _TABLE)
    table = checked_table(table_file, _TABLE)
    lines = read_utf8(table_file, TABLE_BYTES).decode("utf-8").split("\n")
    now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    said = visible(f"# included again {now} by {by.strip()} ({reason.strip()}): ")
    for row, first in enumerate(table.lines):
        if (os.path.normpath(table.columns["path"][row]), table.columns["epoch"][row]) == wanted:
            for number in _lines_of_row(lines, first, table.delimiter):
                lines[number - 1] = f"{said if number == first else '# '}{lines[number - 1]}"
    with refused(table_file, "cannot be written"):
        before = table_file.read_bytes()
        text = text_bytes("\n".join(lines))
        if b"\r\n" in before:
            text = text.replace(b"\n", b"\r\n")
        bom = b"\xef\xbb\xbf"
        replace_file(table_file, (bom if before.startswith(bom) else b"") + text)


def _lines_of_row(lines: list[str], first: int, delimiter: str) -> range:
    """Return the numbers of the lines of a row: a cell in quotes may go over several."""
    reader = csv.reader(io.StringIO("\n".join(lines[first - 1 :])), delimiter=delimiter)
    next(reader)
    return range(first, first + reader.line_num)


def _require(reason: str, by: str, what: str) -> None:
    if not reason.strip() or not by.strip():
        raise UserError(f"to {what}, give a reason and your name")
