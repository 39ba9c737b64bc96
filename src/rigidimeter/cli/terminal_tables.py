"""What a command shows: paragraphs, headings and tables, laid out for the terminal by rich.

A text is a paragraph: it is wrapped, and its leading spaces are its indent. Names come from other
people's files, so control characters are shown as escapes, and nothing in a text is read as rich's
markup. Bold letters are for a terminal alone.
"""

from __future__ import annotations

import io
import shutil
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from itertools import compress, groupby
from typing import TYPE_CHECKING, NamedTuple

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from rigidimeter.core.words import Table as Description

ROWS = 24
"""Lines of a first screen."""

WIDEST = 100
"""Longer lines are hard to read, however wide the terminal."""

NARROWEST = 40

_GAP = 2
_LEAST_WORDS = 8
_ANY_WIDTH = 100_000
"""Of the console: the widths are chosen here, so that rich cuts nothing off."""


class Heading(str):
    """A line that says what follows it."""

    __slots__ = ()


class Table(NamedTuple):
    """Rows of cells under headings.

    Parameters
    ----------
    headings : sequence of str
        A line feed begins a second line, such as that of the unit. None: rows alone.
    rows : sequence
        As many cells as headings; or one text, which stands alone on its line across all columns.
    align : str
        For each column ``<`` (words, folded where room is short), ``>`` or ``=`` (numbers, to the
        right or to the left, never folded).
    indent : int
        Spaces before each line.
    """

    headings: Sequence[str]
    rows: Sequence[Sequence[str] | str]
    align: str
    indent: int = 2


Block = str | Table


def show(blocks: Iterable[Block]) -> None:
    """Print to the standard output."""
    typer.echo(_rendered(blocks, columns(), terminal=sys.stdout.isatty()), nl=False)


def text_lines(blocks: Iterable[Block], width: int = 80) -> list[str]:
    """Return what is shown in a file or a pipe.

    Examples
    --------
    >>> text_lines([Table(("name", "n"), [("a", "10"), ("of b", "2")], "<>", 0)])
    ['name   n', 'a     10', 'of b   2']
    """
    return _rendered(blocks, width).splitlines()


def columns() -> int:
    """Return how many letters a line has: those of the terminal within limits, else 80."""
    return min(max(shutil.get_terminal_size((80, 24)).columns, NARROWEST), WIDEST)


def _rendered(blocks: Iterable[Block], width: int, *, terminal: bool = False) -> str:
    from rich.console import Console

    shown = io.StringIO()
    console = Console(
        file=shown, width=_ANY_WIDTH, force_terminal=terminal, highlight=False, legacy_windows=False
    )
    for block in blocks:
        if isinstance(block, Table):
            _print_table(console, block, width)
        else:
            _print_text(console, block, width, "bold" if isinstance(block, Heading) else "")
    return "\n".join(line.rstrip() for line in shown.getvalue().split("\n"))


def _print_text(console: Console, text: str, width: int, style: str = "") -> None:
    from rich.text import Text

    for line in paragraph(text, width):
        console.print(Text(line, style=style))


def paragraph(text: str, width: int) -> list[str]:
    """Return a text as lines; one that is empty is an empty line.

    Examples
    --------
    >>> paragraph("  K is 1.75 N·m/rad", 13)
    ['  K is 1.75', '    N·m/rad']
    """
    from rigidimeter.core.files import visible

    indent = text[: len(text) - len(text.lstrip(" "))]
    return textwrap.wrap(
        visible(text.lstrip(" ")),
        width,
        initial_indent=indent,
        subsequent_indent=f"{indent}  " if indent else "",
        break_long_words=False,
        break_on_hyphens=False,
    ) or [""]


def _print_table(console: Console, table: Table, width: int) -> None:
    """Print a table, wider than the terminal where its numbers alone are: nothing is cut off.

    Without the columns in which no row has an entry, such as the condition.
    """
    from rich.padding import Padding
    from rich.table import Table as Grid
    from rich.text import Text

    from rigidimeter.core.files import visible

    rows_of_cells = [row for row in table.rows if not isinstance(row, str)]
    named = table.headings or ("",) * len(table.align)
    columns = zip(named, *rows_of_cells, strict=True)
    filled = [any(cells) or not rows_of_cells for _, *cells in columns]

    def shown(cells: Iterable[str]) -> list[str]:
        return [visible(cell, lines=True) for cell in compress(cells, filled)]

    headings, align = shown(named), list(compress(table.align, filled))
    rows = [row if isinstance(row, str) else shown(row) for row in table.rows]
    columns = zip(headings, *map(shown, rows_of_cells), strict=True)
    widths = _widths(["\n".join(cells) for cells in columns], align, width - table.indent)

    def print_grid(rows: Iterable[Sequence[str]], *, header: bool = False) -> None:
        grid = Grid(
            box=None, padding=(0, _GAP, 0, 0), pad_edge=False, show_header=header,
            header_style="bold",
        )  # fmt: skip
        for heading, side, column_width in zip(headings, align, widths, strict=True):
            grid.add_column(
                Text(heading), justify="right" if side == ">" else "left", width=column_width,
                overflow="fold",
            )  # fmt: skip
        for row in rows:
            grid.add_row(*map(Text, row))
        console.print(Padding.indent(grid, table.indent))

    if table.headings:
        print_grid([], header=True)
    for is_text, group in groupby(rows, lambda row: isinstance(row, str)):
        if is_text:
            for text in group:
                _print_text(console, " " * table.indent + str(text), width)
        else:
            print_grid(group)


def _widths(columns: Sequence[str], align: Sequence[str], room: int) -> list[int]:
    """Return widths that fit: of the columns of words the widest is folded first.

    Between words; within them only if there is no room otherwise.
    """
    from rich.cells import cell_len

    natural = [max(map(cell_len, text.split("\n"))) for text in columns]
    words = [max([_LEAST_WORDS, *map(cell_len, text.split())]) for text in columns]
    widths = unbroken = list(natural)
    for least in (words, [_LEAST_WORDS] * len(columns)):
        unbroken = list(widths)
        narrowest = [
            min(all_, one) if side == "<" else all_
            for all_, one, side in zip(natural, least, align, strict=True)
        ]
        while sum(widths) + _GAP * (len(widths) - 1) > room and widths != narrowest:
            foldable = [w if w > n else 0 for w, n in zip(widths, narrowest, strict=True)]
            widths[foldable.index(max(foldable))] -= 1
    fits = sum(widths) + _GAP * (len(widths) - 1) <= room
    return widths if fits else unbroken  # too wide whatever is broken


def shown_table(table: Description, names: Mapping[str, str]) -> Table:
    """Return a table as the page describes it, with the interval beside its value.

    Parameters
    ----------
    table : core.words.Table
    names : mapping of str to str
        What each source is called.
    """
    from rigidimeter.core.words import WORDS, shown_below, shown_value

    columns = table.shown_columns(several_sources=len(names) > 1)
    rows = [
        tuple(
            " ".join(filter(None, (shown_value(row, c, names), shown_below(row, c, names))))
            for c in columns
        )
        for row in table.rows
    ]
    align = "".join("<" if c.kind in WORDS else ">" for c in columns)
    return Table(["\n".join(filter(None, (c.group, c.heading))) for c in columns], rows, align)
