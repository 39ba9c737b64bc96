"""An empty study folder: study.toml and its tables, with comments and no rows."""

from __future__ import annotations

from pathlib import Path

from rigidimeter.core.errors import UserError, refused
from rigidimeter.core.files import write_text
from rigidimeter.core.study_files.study_text import DBS, OFF, study_text
from rigidimeter.core.study_files.study_toml import STUDY_FILE, ConditionTable
from rigidimeter.core.study_files.tables import empty_table

_TABLES = ("sessions", "ratings", "exclusions")


def write_new_study(folder: Path, title: str = "") -> None:
    """Make a study folder; without a title it has the folder's name.

    Raises
    ------
    UserError
        If one of its files is there already, or the folder cannot be written.
    """
    names = (STUDY_FILE, *(f"{name}.csv" for name in _TABLES))
    there = [name for name in names if (folder / name).exists()]
    if there:
        raise UserError(
            f"{folder / there[0]}: is there already; a study is never written over, so name "
            "another folder"
        )
    with refused(folder, "cannot be made"):
        folder.mkdir(parents=True, exist_ok=True)
    for name in _TABLES:
        write_text(folder / f"{name}.csv", empty_table(name))
    shown = title.strip() or folder.resolve().name
    conditions = {OFF: ConditionTable(), DBS: ConditionTable()}
    write_text(folder / STUDY_FILE, study_text(shown, OFF, DBS, conditions))
