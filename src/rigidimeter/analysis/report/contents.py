"""What a section of the report is made of: text, tables, figures.

The rows of a table are unrounded. Its CSV has all of their values; the page shows some, rounded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from markupsafe import Markup
from matplotlib.figure import Figure as Drawing

from rigidimeter.analysis.study import StudyResult

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
        Significant digits that the page shows of a number.
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


@dataclass(frozen=True)
class Figure:
    """A figure of the report, also written to ``figures/NAME.svg``.

    Attributes
    ----------
    name : str
        Of the file.
    caption : str
        Below the figure.
    alt : str
        What it shows, for those who cannot see it.
    draw : callable
        Returns the drawing; called when the report is written.
    size : {"broad", "tall", "small"}
        On the page; small figures are side by side.
    marks : mapping of str to sequence of (str, str)
        Source and label of the epochs that points stand for, in the order of the points, by the
        `gid` of their line.
    """

    name: str
    caption: str
    alt: str
    draw: Callable[[], Drawing]
    size: Literal["broad", "tall", "small"] = "broad"
    marks: Mapping[str, Sequence[tuple[str, str]]] = field(default_factory=dict)


Block = Markup | Table | Figure
"""What a section yields, in the order of the page."""


@dataclass(frozen=True)
class Section:
    """A section of the page.

    Attributes
    ----------
    name : str
        The `id` of the section in the page.
    title : str
        Its heading.
    blocks : callable
        Takes the result; returns text, tables and figures in the order of the page.
    shown_if : callable
        Takes the result; whether the page has this section.
    part : str
        The part of the page, an entry of its contents bar; sections of one part follow each other.
        One without a part is a part by itself.
    printed : bool
        Whether it is printed where not everything is asked for.
    """

    name: str
    title: str
    blocks: Callable[[StudyResult], Iterable[Block]]
    shown_if: Callable[[StudyResult], bool] = lambda _: True
    part: str = ""
    printed: bool = False


def from_study_folder(result: StudyResult) -> bool:
    """Return whether a result comes from a study folder, which has days, ratings and exclusions."""
    return bool(result.sessions)


def paragraph(text: str, kind: Literal["", "remark", "banner"] = "") -> Markup:
    """Return a paragraph; text that is not `Markup` is escaped."""
    start = Markup('<p class="{}">').format(kind) if kind else Markup("<p>")
    return start + text + Markup("</p>")


def bullets(items: Iterable[str]) -> Markup:
    """Return sentences as a list."""
    lines = Markup("\n").join(Markup("<li>{}</li>").format(item) for item in items)
    return Markup('<ul class="sentences">\n{}\n</ul>').format(lines)
