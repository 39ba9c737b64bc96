"""Columns: what a file of any format becomes before anything in it has a meaning."""

from __future__ import annotations

import difflib
import itertools
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import printable

Array = NDArray[np.float64]

MISSING = frozenset({"", "na", "n/a", "#n/a", "#na", "nan", "-nan", "null", "none", "<na>"})
"""Texts, in lower case, that mark a missing sample."""
STRAY_SHARE = 0.01
"""Up to this share of entries may be text in a column of numbers and be left out singly."""
_SHOWN = 20
_NUMBER_SIGNS = str.maketrans({"\u2212": "-", "\u2013": "-"})
_FORTRAN = re.compile(r"([-+]?[\d.]+)[dD]([-+]?\d+)")


class Column(NamedTuple):
    """One column.

    Attributes
    ----------
    read : callable
        Returns its values, shape (n,): float64, NaN where a number is missing, or objects that are
        str.
    size : int
    unit : str
        As the file states it apart from the name, or nothing.
    clock : str
        Which of the clocks of the file it has; nothing for the rows of a table.
    """

    read: Callable[[], NDArray[Any]]
    size: int
    unit: str = ""
    clock: str = ""

    @classmethod
    def of(cls, values: NDArray[Any], unit: str = "", clock: str = "") -> Column:
        """Return a column whose values are in memory."""
        return cls(lambda: values, values.size, unit, clock)


class Interval(NamedTuple):
    """A stretch of time to which a file gives labels, both ends included, in s."""

    start_s: float
    stop_s: float
    labels: Mapping[str, str]


@dataclass(frozen=True)
class Columns:
    """The columns of a file, or of what is read from it.

    Parameters
    ----------
    source : str
        The file, as messages name it.
    columns : mapping of str to Column
        By the file's own names.
    clocks : mapping of str to array, shape (n,)
        Stamps in s of clocks that the file states apart from its columns, by name.
    facts : mapping of str to float or str
        Single values and lines of a head, such as a sampling rate.
    others : mapping of str to str
        What cannot be a column, and what it is instead.
    lines : array of int, shape (n,), int or None
        The line of the file of each row, or of the first of rows that follow one another; None for
        files without lines.
    intervals : tuple of Interval
        Labels by time. Of two that overlap the later one counts.
    virtual : bool
        Whether the file says that it was simulated.
    """

    source: str
    columns: Mapping[str, Column]
    clocks: Mapping[str, Array] = field(default_factory=dict)
    facts: Mapping[str, float | str] = field(default_factory=dict)
    others: Mapping[str, str] = field(default_factory=dict)
    lines: NDArray[np.int64] | int | None = None
    intervals: tuple[Interval, ...] = ()
    virtual: bool = False

    def where(self, row: int) -> str:
        """Name a row, counted from 0, as the user would find it in the file."""
        if self.lines is None:
            return f"{self.source}, row {row + 1}"
        line = self.lines + row if isinstance(self.lines, int) else int(self.lines[row])
        return f"{self.source}, line {line}"

    @property
    def listed(self) -> str:
        """The names of the columns, for messages."""
        names = list(self.columns)
        more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
        return ", ".join(name[:60] for name in names[:_SHOWN]) + more


def number(text: str) -> float:
    """Return a cell as a number: also with the minus sign of print, and with Fortran's D.

    Raises
    ------
    ValueError
        If it is none.
    """
    try:
        return float(text)
    except ValueError:
        plain = text.translate(_NUMBER_SIGNS)
        found = _FORTRAN.fullmatch(plain)
        return float(plain if found is None else f"{found[1]}e{found[2]}")


def numbers(file: Columns, name: str, spoken: str, strays: list[str] | None = None) -> Array:
    """Return a column as float64, shape (n,), with NaN where a number is missing.

    Parameters
    ----------
    file : Columns
    name, spoken : str
        What the file calls the column, and the sentences.
    strays : list of str, optional
        Where given, a few entries that are not numbers are missing too, and a sentence about them
        is added here.

    Raises
    ------
    UserError
        If the column holds a text that is not a number; it names the row and the text.
    """
    column = file.columns[name].read()
    if column.dtype != object:
        return column.astype(np.float64, copy=False)
    values = np.empty(column.size)
    found: list[str] = []
    for row, entry in enumerate(column):
        text = str(entry).strip()
        try:
            values[row] = math.nan if text.lower() in MISSING else number(text)
        except ValueError:
            values[row] = math.nan
            label = spoken if spoken == name else f"{spoken} (column {name!r})"
            found.append(f"{file.where(row)}: {label} holds {text[:60]!r}, which is not a number")
            # The first row is more often a row of units than a slip.
            if strays is None or row == 0 or len(found) > STRAY_SHARE * column.size:
                raise UserError(found[0]) from None
    if strays is not None and found:
        more = f", nor are {len(found) - 1} other entries of the column" if found[1:] else ""
        left = "they were" if more else "the entry was"
        strays.append(f"{found[0]}{more}; {left} left out")
    return values


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


def unique(names: Iterable[str], but: Iterable[str] = ()) -> list[str]:
    """Return names of which no two are the same, and none is one of `but`: ``Fx``, ``Fx (2)``.

    Examples
    --------
    >>> unique(["Fx", "Fy", "Fx"])
    ['Fx', 'Fy', 'Fx (2)']
    """
    found: dict[str, None] = dict.fromkeys(but)
    n_taken = len(found)
    for name in map(printable, names):
        free = (f"{name} ({k})" for k in itertools.count(2))
        found[name if name not in found else next(one for one in free if one not in found)] = None
    return list(found)[n_taken:]


def nearest(name: str, candidates: Iterable[str], *, least: float = 0.0) -> str:
    """Return the candidate most like a name, or nothing if none is like it by `least` (0 to 1)."""
    best = max(candidates, key=lambda one: alike(name, one), default="")
    return best if best and alike(name, best) >= least else ""


_SYNONYMS: Mapping[str, tuple[str, ...]] = {
    "time": ("t",),
    "torque": ("moment",),
    "angle": ("position", "theta"),
    "velocity": ("speed", "omega"),
}


def alike(name: str, candidate: str) -> float:
    """Return how similar a name is to another or its common synonyms, 0 to 1."""
    spoken = {candidate.lower(), candidate.lower().rsplit(".", 1)[-1]}
    known = (name.lower(), *_SYNONYMS.get(name.lower(), ()))
    return max(difflib.SequenceMatcher(None, a, b).ratio() for a in known for b in spoken)


def even_clock(start_s: float, rate_hz: float, count: int) -> Array:
    """Return the stamps of even samples, shape (count,).

    Raises
    ------
    ValueError
        If the rate cannot be one.
    """
    if not (0 < rate_hz < math.inf and math.isfinite(start_s)):
        raise ValueError(f"a clock from {start_s:g} s at {rate_hz:g} samples/s")
    return start_s + np.arange(count) / rate_hz
