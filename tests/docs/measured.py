"""The measured tables of the maintainers' pages: written folded, and read again.

A table stands in ``<details>``, which also folds where Sphinx does not build the page.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from tests.docs.markdown import ROOT

DEVELOPMENT = ROOT / "docs" / "development"
MARKS = "<!-- {what}: begin -->", "<!-- {what}: end -->"


def folded(lines: Iterable[str], summary: str = "The table") -> list[str]:
    """Return the lines of a table as a block to unfold."""
    return [f"<details><summary>{summary}</summary>", "", *lines, "", "</details>"]


def between_the_marks(page: Path, body: str, what: str = "measured") -> None:
    """Replace what stands between the two marks of a page."""
    first, last = (mark.format(what=what) for mark in MARKS)
    head, begin, rest = page.read_text(encoding="utf-8").partition(first)
    _, end, tail = rest.partition(last)
    if not (begin and end):
        raise SystemExit(f"{page.name} has no marks to write between: {first} … {last}")
    page.write_text(f"{head}{first}\n\n{body}\n\n{last}{tail}", encoding="utf-8")


@dataclass(frozen=True)
class Table:
    """A table of a page, under its last heading."""

    heading: str
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]] = field(default_factory=list)

    def column(self, name: str) -> list[str]:
        """Return the cells of the first column of that name."""
        at = self.columns.index(name)
        return [row[at] for row in self.rows]


def tables(page: str) -> list[Table]:
    """Return the tables of a page of ``docs/development``, in order."""
    found: list[Table] = []
    heading, inside = "", False
    for line in (DEVELOPMENT / f"{page}.md").read_text("utf-8").splitlines():
        if line.startswith("|"):
            cells = tuple(cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip())[1:-1])
            if not inside:
                found.append(Table(heading, cells))
            elif not all(re.fullmatch(r":?-+:?", cell) for cell in cells):
                found[-1].rows.append(cells)
        elif line.startswith("#"):
            heading = line.lstrip("# ")
        inside = line.startswith("|")
    return found


def numbers(cell: str) -> list[float]:
    """Return the numbers of a cell; of a dash not a number."""
    return [
        float("nan") if one == "–" else float(one)
        for one in re.findall(r"–|[+-]?\d+(?:\.\d+)?(?:e[+-]?\d+)?", cell)
    ]
