"""A table of columns, as a file holds it, before its columns are interpreted."""

from __future__ import annotations

import difflib
import functools
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading.formats.stored_arrays import Columns, Stored
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import printable

MISSING = frozenset({"", "na", "n/a", "#n/a", "#na", "nan", "-nan", "null", "none", "<na>"})
"""Texts, in lower case, that mark a missing sample."""

CALIBRATION = "calibration"
"""The single value that holds a line of a head such as ``gain 0.5 Nm/V``: shown, and not used."""
_SHOWN = 20
_LONGEST_TEXT_BYTES = 4096


@dataclass(frozen=True)
class Table:
    """The columns and single values of a file.

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
    units : mapping of str to str
        By column, where the file states them apart from the names.
    virtual : bool
        Whether the file says that it was simulated.
    """

    source: str
    columns: Mapping[str, NDArray[Any]]
    scalars: Mapping[str, float | str] = field(default_factory=dict)
    others: Mapping[str, str] = field(default_factory=dict)
    lines: NDArray[np.int64] | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    virtual: bool = False

    def where(self, row: int) -> str:
        """Name a row, counted from 0, as the user would find it in the file."""
        if self.lines is None:
            return f"{self.source}, row {row + 1}"
        return f"{self.source}, line {int(self.lines[row])}"

    @property
    def listed(self) -> str:
        """The names of the columns, for messages."""
        names = list(self.columns)
        more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
        return ", ".join(name[:60] for name in names[:_SHOWN]) + more


def table_of_arrays(source: str, entries: Mapping[str, Stored]) -> Table:
    """Return named arrays, as NumPy and MATLAB files hold them, as a table.

    Raises
    ------
    UserError
        If there is no column at all.
    """
    columns, scalars, others = sorted_arrays(entries)
    if not columns:
        held = ", ".join([*scalars, *others][:_SHOWN]) or "nothing"
        raise UserError(
            f"{source} has no column of samples, that is, no array with one dimension and at least "
            f"2 values (it holds {held})"
        )
    return Table(source, Columns(columns), scalars, others)


def sorted_arrays(
    entries: Mapping[str, Stored],
) -> tuple[dict[str, Callable[[], NDArray[Any]]], dict[str, float | str], dict[str, str]]:
    """Sort named arrays into columns, single values and what is neither, with the reason.

    An array with one value is a single value; one with one dimension longer than 1 is a column.
    """
    columns: dict[str, Callable[[], NDArray[Any]]] = {}
    scalars: dict[str, float | str] = {}
    others: dict[str, str] = {}
    for key, array in entries.items():
        name = printable(key)
        text = array.dtype.kind in "OU"
        if array.dtype.itemsize > _LONGEST_TEXT_BYTES:
            others[name] = f"text of up to {array.dtype.itemsize // 4} letters"
        elif array.dtype.kind not in "fiubOU":
            kind = "objects" if array.dtype.kind == "V" else str(array.dtype)
            others[name] = f"an array of {kind}"
        elif array.size == 0:
            others[name] = "empty"
        elif array.size == 1:
            value = array.read().item()
            scalars[name] = str(value) if text else float(value)
        elif max(array.shape) == array.size:
            columns[name] = functools.partial(_column, array, object if text else np.float64)
        else:
            others[name] = f"an array of {' × '.join(map(str, array.shape))}"
    return columns, scalars, others


def _column(array: Stored, dtype: type) -> NDArray[Any]:
    return array.read().reshape(-1).astype(dtype, copy=False)


def label_text(value: object) -> str:
    """Return a label as text: `1` for 1.0, nothing for NaN and other marks of absence."""
    if isinstance(value, float):
        if math.isnan(value):
            return ""
        return str(int(value)) if value.is_integer() else repr(float(value))
    text = printable(" ".join(str(value).split()))
    if text.lower() in MISSING:
        return ""
    return re.sub(r"^(-?\d+)\.0+$", r"\1", text)


def nearest(name: str, candidates: Iterable[str], *, least: float = 0.0) -> str:
    """Return the candidate most like a name, or nothing if none is like it by `least` (0 to 1)."""
    likeness, best = max(((alike(name, c), c) for c in candidates), default=(-1.0, ""))
    return best if likeness >= least else ""


_ALIASES: Mapping[str, tuple[str, ...]] = {
    "time_s": ("time", "t"),
    "torque_nm": ("torque", "moment"),
    "angle_rad": ("angle", "position", "theta"),
    "velocity_rad_s": ("velocity", "speed", "omega"),
}


def alike(standard: str, candidate: str) -> float:
    """Return how similar a name is to a standard name or its common synonyms, 0 to 1."""
    spoken = {candidate.lower(), candidate.lower().rsplit(".", 1)[-1]}
    known = (standard.lower(), *_ALIASES.get(standard, ()))
    return max(difflib.SequenceMatcher(None, a, b).ratio() for a in known for b in spoken)
