"""Whose folder a report would be written into: only an empty one and its own older report are."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable
from pathlib import Path

from rigidimeter.core.errors import refused
from rigidimeter.core.files import as_read

INPUTS = "inputs, from the report's folder"
"""The fact of the provenance by which a report knows its own older version."""

_PROVENANCE = Path("tables", "provenance.csv")
_BETWEEN = "; "
_NAMED = 3


def inputs_seen_from(out: Path, inputs: Iterable[Path]) -> str:
    """Return the paths of the inputs as they are seen from the folder of a report."""
    return joined_names(_seen_from(out, path) for path in inputs)


def joined_names(names: Iterable[str]) -> str:
    """Return names as one fact."""
    return _BETWEEN.join(sorted(set(names)))


def _seen_from(out: Path, path: Path) -> str:
    try:
        return os.path.relpath(os.path.realpath(path), os.path.realpath(out))
    except ValueError:  # on another drive
        return os.path.realpath(path)


def why_not_own(out: Path, names: str) -> str:
    """Return what a folder holds that a report must not be written over; empty if nothing.

    Parameters
    ----------
    out : Path
        The folder; it need not exist.
    names : str
        How the report names its inputs: see `inputs_seen_from`.

    Raises
    ------
    UserError
        If the folder cannot be read.
    """
    if not out.is_dir():
        return ""
    with refused(out, "cannot be read"):
        there = sorted(path.name for path in out.iterdir() if not path.name.startswith("."))
        facts = _facts(out / _PROVENANCE)
    if not there:
        return ""
    if facts is None:
        more = ", …" if len(there) > _NAMED else ""
        return f"holds files that are not of a report ({', '.join(there[:_NAMED])}{more})"
    others = facts.get(INPUTS, "")
    same = not set(names.split(_BETWEEN)).isdisjoint(others.split(_BETWEEN))
    return "" if same else f"holds the report of something else ({others})"


def _facts(path: Path) -> dict[str, str] | None:
    """Return the provenance of an older report; None if there is none."""
    if not path.is_file():
        return None
    with path.open(encoding="utf-8", errors="replace", newline="") as file:
        rows = [[as_read(cell) for cell in row] for row in csv.reader(file) if len(row) == 2]
    return dict(rows[1:]) if rows[:1] == [["key", "value"]] else None
