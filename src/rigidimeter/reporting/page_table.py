"""A table: full precision inside, to CSV as it is, to the page rounded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from rigidimeter import documents

__all__ = ["Cell", "Column", "Kind", "Table", "csv_text"]

Cell = str | int | float | None
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
    "setting",
]


@dataclass(frozen=True)
class Column:
    """A column: its stored name with the unit, its heading for people, what it holds.

    A column that is not `on_page` is in the CSV only. On the page `ends` are the columns that hold
    the ends of the number's interval, and the number is shown `page_factor` times as large, in the
    unit that the heading states.
    """

    name: str
    heading: str
    kind: Kind = "number"
    on_page: bool = True
    ends: tuple[str, str] | None = None
    page_factor: float = 1.0


@dataclass(frozen=True)
class Table:
    """Rows of unrounded cells; `None` is a cell that has no value."""

    name: str
    caption: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]


def csv_text(table: Table) -> str:
    """Return the table as CSV: stored names as header, floats so that they read back equal."""
    return documents.csv_text([column.name for column in table.columns], table.rows)
