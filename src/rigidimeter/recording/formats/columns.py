"""The columns of somebody else's file, found by name and turned into numbers or labels.

A file calls its torque whatever it likes. Here a column gets its standard name, by itself or as
the user says, and every refusal names the option that would put it right.
"""

from __future__ import annotations

import difflib
import math
import re
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.errors import UserError
from rigidimeter.records import CHANNEL_UNITS

__all__ = [
    "LABELS",
    "MISSING",
    "MOTION",
    "Table",
    "find_columns",
    "listed",
    "nearest",
    "numbers",
    "plain",
    "printable",
]

LABELS = ("epoch", "condition", "task")
MOTION = ("velocity_rad_s", "angle_rad")
STANDARD = ("time_s", *CHANNEL_UNITS, *LABELS)
MISSING = frozenset({"", "na", "n/a", "#n/a", "#na", "nan", "-nan", "null", "none", "<na>"})
"""Texts, in lower case, that stand for a sample that is not there."""

_ALIASES: Mapping[str, tuple[str, ...]] = {
    "time_s": ("time", "t"),
    "torque_nm": ("torque", "moment"),
    "angle_rad": ("angle", "position", "theta"),
    "velocity_rad_s": ("velocity", "speed", "omega"),
    "emg_v": ("emg",),
}
_SHOWN = 20


@dataclass(frozen=True)
class Table:
    """What a file holds, before anything is known of its meaning.

    Parameters
    ----------
    source : str
        The file, as messages name it.
    columns : mapping of str to array, shape (n,)
        By the file's own names: float64, NaN where a number is missing, or objects that are str.
    scalars : mapping of str to float or str
        Entries with a single value, such as a sampling rate.
    others : mapping of str to str
        Entries that cannot be a column, and what they are instead.
    lines : array of int, shape (n,), or None
        The line of the file that each row came from; None for files without lines.
    """

    source: str
    columns: Mapping[str, NDArray[Any]]
    scalars: Mapping[str, float | str] = field(default_factory=dict)
    others: Mapping[str, str] = field(default_factory=dict)
    lines: NDArray[np.int64] | None = None

    def where(self, row: int) -> str:
        """Name a row, counted from 0, as the user would find it in the file."""
        if self.lines is None:
            return f"{self.source}, row {row + 1}"
        return f"{self.source}, line {int(self.lines[row])}"


def find_columns(table: Table, wanted: Mapping[str, str]) -> dict[str, str]:
    """Return the file's name of each standard column that is there.

    Parameters
    ----------
    table : Table
        The file.
    wanted : mapping of str to str
        Standard name to the file's name, as the user gave them; other columns go by their own
        name.

    Raises
    ------
    UserError
        If a name is unknown on either side, or if the torque or the motion is missing.
    """
    for standard, name in wanted.items():
        if standard not in STANDARD:
            raise UserError(
                f"--column {shlex.quote(f'{standard}={name}')}: {standard} is not a name that is "
                f"read; the nearest is {nearest(standard, STANDARD)} (known are "
                f"{', '.join(STANDARD)})"
            )
        if name not in table.columns and not (standard in LABELS and name in table.scalars):
            raise UserError(_no_such_column(table, standard, name))
    found = {
        name: wanted.get(name, name)
        for name in STANDARD
        if name in wanted or name in table.columns or (name in LABELS and name in table.scalars)
    }
    if "torque_nm" not in found:
        raise UserError(_missing(table, found, "has no column torque_nm", ("torque_nm",)))
    if not any(name in found for name in MOTION):
        raise UserError(
            _missing(table, found, f"has neither column {MOTION[0]} nor {MOTION[1]}", MOTION)
        )
    _same_length(table, found)
    return found


STRAY_SHARE = 0.01
"""Up to this share of entries may be text in a column of numbers and still be left out singly."""


def numbers(
    table: Table, standard: str, name: str, strays: list[str] | None = None
) -> NDArray[np.float64]:
    """Return a column as float64, shape (n,), with NaN where a number is missing.

    Parameters
    ----------
    table : Table
    standard, name : str
        What we and what the file call the column.
    strays : list of str, optional
        Where given, a few entries that are not numbers are missing too, and a sentence about each
        is added here.

    Raises
    ------
    UserError
        If the column holds a text that is not a number; it names the row and the text.
    """
    column = table.columns[name]
    if column.dtype != object:
        return column.astype(np.float64, copy=False)
    values = np.empty(column.size)
    found: list[str] = []
    for row, entry in enumerate(column):
        text = str(entry).strip()
        try:
            values[row] = math.nan if text.lower() in MISSING else float(text)
        except ValueError:
            label = standard if standard == name else f"{standard} (column {name!r})"
            found.append(f"{table.where(row)}: {label} holds {text[:60]!r}, which is not a number")
            values[row] = math.nan
            # The first row is more often a row of units than a slip.
            if strays is None or row == 0 or len(found) > STRAY_SHARE * column.size:
                raise UserError(found[0]) from None
    if strays is not None:
        strays += found
    return values


def plain(value: object) -> str:
    """Return a label as text: `1` for 1.0, nothing for NaN and other marks of absence."""
    if isinstance(value, float):
        if math.isnan(value):
            return ""
        return str(int(value)) if value.is_integer() else repr(float(value))
    text = printable(" ".join(str(value).split()))
    if text.lower() in MISSING:
        return ""
    return re.sub(r"^(-?\d+)\.0+$", r"\1", text)


def printable(name: str) -> str:
    """Return a name without line feeds and the like, as it can stand in a sentence."""
    return "".join(letter if letter.isprintable() else "?" for letter in name)


def nearest(name: str, candidates: Iterable[str], *, least: float = 0.0) -> str:
    """Return the candidate most like a name, or nothing if none is like it by `least` (0 to 1)."""
    ranked = [(_likeness(name, candidate), candidate) for candidate in candidates]
    likeness, best = max(ranked, key=lambda pair: pair[0], default=(-1.0, ""))
    return best if likeness >= least else ""


def listed(table: Table) -> str:
    """Return the names of the columns as sentences show them."""
    names = list(table.columns)
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(name[:60] for name in names[:_SHOWN]) + more


def _likeness(standard: str, candidate: str) -> float:
    spoken = {candidate.lower(), candidate.lower().rsplit(".", 1)[-1]}
    known = (standard.lower(), *_ALIASES.get(standard, ()))
    return max(difflib.SequenceMatcher(None, a, b).ratio() for a in known for b in spoken)


def _no_such_column(table: Table, standard: str, name: str) -> str:
    option = f"--column {shlex.quote(f'{standard}={name}')}"
    if name in table.others:
        return (
            f"{table.source}: {option}: {name} is {table.others[name]}; a column has one "
            "dimension and a real number or text for each sample"
        )
    if name in table.scalars:
        return f"{table.source}: {option}: {name} is a single value, not a column of samples"
    near = nearest(name, table.columns)
    right = f"--column {shlex.quote(f'{standard}={near}')}"
    return (
        f"{table.source}: {option}: there is no column {name}; the nearest is {near}, so perhaps "
        f"{right} (its columns are {listed(table)})"
    )


def _missing(table: Table, found: Mapping[str, str], what: str, standards: tuple[str, ...]) -> str:
    taken = set(found.values())
    free = [name for name in table.columns if name not in taken]
    text = f"{table.source} {what}; its columns are {listed(table)}"
    if not free:
        return f"{text}, and none is left to be it"
    ranked = [
        (_likeness(standard, name), standard, name) for standard in standards for name in free
    ]
    _, standard, name = max(ranked, key=lambda entry: entry[0])
    option = shlex.quote(f"{standard}={name}")
    return f"{text}; the nearest is {name}: if it is the one, say --column {option}"


def _same_length(table: Table, found: Mapping[str, str]) -> None:
    first = found["torque_nm"]
    length = table.columns[first].size
    for name in found.values():
        if name in table.columns and table.columns[name].size != length:
            raise UserError(
                f"{table.source}: column {name} has {table.columns[name].size} values and column "
                f"{first} has {length}; all columns must have the same length"
            )
    if length < 2:
        raise UserError(
            f"{table.source} holds {length} sample{'' if length == 1 else 's'}; a recording needs "
            "at least 2, and an estimate some seconds"
        )
