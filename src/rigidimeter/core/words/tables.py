"""A table: columns described once, for the terminal, the page, a file and a data frame.

Rows are unrounded. A file has all of their values; the terminal and the page show some, rounded.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from rigidimeter.core.words.numbers import interval, number, p_value, times_ten, with_error

Kind = Literal[
    "text",
    "label",
    "check",
    "reason",
    "source",
    "condition",
    "outcome",
    "count",
    "number",
    "p",
    "percent",
    "setting",
]

WORDS = ("text", "label", "check", "reason", "source", "condition", "outcome")
"""Kinds of columns that hold words; the others hold numbers, which are set to the right."""

TURNED = -1.0
"""`Column.page_factor` of what is stored as reference − other: people see other − reference."""

SMALL = 0.01
"""A value and its interval below this are written with a power of ten, as J is in text."""

INTERVAL = "[95\N{NO-BREAK SPACE}%\N{NO-BREAK SPACE}interval]"
"""What the heading of a column with `ends` says after the quantity."""


@dataclass(frozen=True)
class Column:
    """A column of a table on the page.

    Attributes
    ----------
    name : str
        The key of its values in the rows.
    heading : str
    kind : str
        How values are shown.
    ends : (str, str) or None
        The keys of the ends of this number's interval, which is shown below the number.
    page_factor : float
        The page shows the number times this, in the unit that the heading states.
    digits : int
        Significant digits that the page shows of a number without `error`.
    error : str
        The key of the number's standard error, which is shown behind it.
    group : str
        Neighbouring columns of one group share a heading above their own.
    below : str
        The key of a second value, which is shown in brackets below the first.
    """

    name: str
    heading: str
    kind: Kind = "number"
    ends: tuple[str, str] | None = None
    page_factor: float = 1.0
    digits: int = 4
    group: str = ""
    below: str = ""
    error: str = ""


SESSION = (
    Column("subject", "Subject", "label"),
    Column("day", "Day", "label"),
    Column("condition", "Condition", "condition"),
)
"""Columns of whatever belongs to a session of a study."""


@dataclass(frozen=True)
class Table:
    """A table of the report, also written to ``tables/NAME.csv``.

    Attributes
    ----------
    name : str
        Of the file. Two tables of one name show different columns of the same rows.
    title : str
    columns : tuple of Column
        What the page shows; none for a table that is written as a file only.
    rows : sequence of mappings
        Unrounded values by name with unit; the file has all of them. All rows have the same keys.
    note : str or Markup
        Below the table on the page, where it has rows.
    empty : str
        What the page says in place of a table without rows; a section of nothing else is not shown.
    folding : bool
        A long table, which the reader can fold away.
    """

    name: str
    title: str
    columns: tuple[Column, ...]
    rows: Sequence[Mapping[str, Any]]
    note: str = ""
    empty: str = ""
    folding: bool = False

    def shown_columns(self, *, several_sources: bool) -> list[Column]:
        """Return the columns without those that would say nothing.

        A column of reasons is left out if all are empty, and that of sources if there is only one.
        """
        by_epoch = any(column.name == "epoch" for column in self.columns)
        return [
            column
            for column in self.columns
            if (column.kind != "reason" or any(row.get(column.name) for row in self.rows))
            and (column.kind != "source" or several_sources or not by_epoch)
        ]


def shown_value(row: Mapping[str, Any], column: Column, names: Mapping[str, str]) -> str:
    """Return the value of a row in a column as the page prints it."""
    value = row.get(column.name)
    if column.error and isinstance(value, float):
        error = row.get(column.error, math.nan)
        return with_error(value * column.page_factor, error * column.page_factor)
    if column.kind == "number" and isinstance(value, float) and (power := _power(row, column)):
        text = number(value * column.page_factor / 10.0**power, column.digits)
        return text + times_ten(power) * math.isfinite(value)
    return _shown(value, column, names)


def _power(row: Mapping[str, Any], column: Column) -> int:
    """Return the power of ten that a small value and its interval share, 0 of others."""
    if column.ends is None:
        return 0
    shown = [row.get(name) for name in (column.name, *column.ends)]
    largest = max((abs(x) for x in shown if isinstance(x, float) and math.isfinite(x)), default=0.0)
    largest *= abs(column.page_factor)
    return 3 * math.floor(math.log10(largest) / 3) if 0 < largest < SMALL else 0


def _shown(value: Any, column: Column, names: Mapping[str, str]) -> str:
    if value is None or value == "":
        return "(no condition)" if column.kind == "condition" else "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if column.kind == "source":
        return names.get(str(value), str(value))
    if column.kind == "p":
        return p_value(value)
    if column.kind == "percent":
        return "–" if math.isnan(value) else f"{100 * value:.0f} %"
    if isinstance(value, float):
        if column.kind == "setting":
            return f"{value:g}"
        return number(value * column.page_factor, column.digits)
    return str(value)


def shown_below(row: Mapping[str, Any], column: Column, names: Mapping[str, str]) -> str:
    """Return what is shown below a value: the second value of its column, or its interval.

    A value that was held has no interval.
    """
    if column.below:
        second = row.get(column.below)
        return "" if second in (None, "") else f"({_shown(second, column, names)})"
    if column.ends is None:
        return ""
    low, high = (row.get(name) for name in column.ends)
    if not isinstance(low, float) or not isinstance(high, float) or not low < high:
        return ""
    power = _power(row, column)
    low, high = sorted(end * column.page_factor / 10.0**power for end in (low, high))
    return interval(low, high, column.digits) + times_ten(power)
