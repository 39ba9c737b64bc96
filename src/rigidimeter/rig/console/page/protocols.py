"""The protocol files among which the page offers a choice: those of one folder, and none beyond."""

from __future__ import annotations

from pathlib import Path

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import read_toml
from rigidimeter.core.settings import Settings, load_settings
from rigidimeter.core.study_files import STUDY_FILE

MOST_FILES = 100
OF_A_RIG = ("torque_sensor", "drive")
"""Tables that a rig file has, and no protocol."""


def protocol_names(folder: Path) -> list[str]:
    """Return the names of the TOML files of a folder that can be protocols, or are damaged."""
    here = folder.resolve()
    found = sorted(path for path in folder.glob("*.toml") if path.resolve().parent == here)
    return [path.name for path in found[:MOST_FILES] if path.is_file() and _may_be_one(path)]


def read_protocol(folder: Path, name: str) -> Settings:
    """Return the settings of a protocol file of the folder.

    Raises
    ------
    UserError
        If it is none of them, or wrong.
    """
    names = protocol_names(folder)
    if name not in names:
        known = ", ".join(names) or "none"
        raise UserError(f"{name[:100]}: is no protocol file of {folder}; there are: {known}")
    return load_settings(folder / name)


def _may_be_one(path: Path) -> bool:
    if path.name == STUDY_FILE:
        return False
    try:
        return not any(table in read_toml(path) for table in OF_A_RIG)
    except UserError:
        return True
