"""What a command shows: paragraphs, headings and tables, laid out for the terminal by rich.

A text is a paragraph: it is wrapped, and its leading spaces are its indent. Names come from other
people's files, so control characters are shown as escapes, and nothing in a text is read as rich's
markup. Bold letters are for a terminal alone.
"""

from __future__ import annotations

import io
import math
import shutil
import sys
import textwrap
from collections.abc import Iterable, Sequence
from itertools import compress, groupby
from typing import TYPE_CHECKING, Literal, NamedTuple

import typer

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

WIDEST = 100
"""Longer lines are hard to read, however wide the terminal."""

NARROWEST = 40

_GAP = 2
_LEAST_WORDS = 8


class Heading(str):
    """A line that says what follows it."""

    __slots__ = ()


class Table(NamedTuple):
    """Rows of cells under headings.

    Parameters
    ----------
    headings : sequence of str
        A line feed begins a second line, such as that of the unit.
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
        file=shown, width=width, force_terminal=terminal, highlight=False, legacy_windows=False
    )
    for block in blocks:
        if isinstance(block, Table):
            _print_table(console, _filled(block), width)
        else:
            _print_text(console, block, width, "bold" if isinstance(block, Heading) else "")
    return "\n".join(line.rstrip() for line in shown.getvalue().split("\n"))


def _print_text(console: Console, text: str, width: int, style: str = "") -> None:
    from rich.text import Text

    for line in paragraph(text, width):
        console.print(Text(line, style=style), soft_wrap=True)


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


def _filled(table: Table) -> Table:
    """Return a table without the columns in which no row has an entry, such as the condition."""
    rows = [row for row in table.rows if not isinstance(row, str)]
    filled = [any(cells) or not rows for _, *cells in zip(table.headings, *rows, strict=True)]

    def cut(cells: Iterable[str]) -> tuple[str, ...]:
        return tuple(compress(cells, filled))

    return table._replace(
        headings=cut(table.headings),
        rows=[row if isinstance(row, str) else cut(row) for row in table.rows],
        align="".join(cut(table.align)),
    )


def _print_table(console: Console, table: Table, width: int) -> None:
    """Print a table, wider than the terminal where its numbers alone are: nothing is cut off."""
    from rich.segment import Segment, Segments
    from rich.style import Style
    from rich.table import Table as Grid

    grid = Grid(box=None, padding=(0, _GAP, 0, 0), pad_edge=False, header_style="bold")
    for heading, side in zip(table.headings, table.align, strict=True):
        justify: Literal["left", "right"] = "right" if side == ">" else "left"
        grid.add_column(_cell(heading), justify=justify, no_wrap=side != "<", overflow="fold")
    below: dict[int, list[str]] = {}
    for cells in table.rows:
        if isinstance(cells, str):
            below.setdefault(grid.row_count, []).append(cells)
        else:
            # Each line of the grid says of which row it is, so that a text can follow that row.
            number = Style(meta={"row": grid.row_count + 1})
            grid.add_row(*map(_cell, cells), style=number)
    options = console.options.update(width=max(width - table.indent, _least_width(table)))
    indent = " " * table.indent

    def row_of(line: list[Segment]) -> int:
        return next((int(s.style.meta["row"]) for s in line if s.style and s.style.meta), 0)

    for row, lines in groupby(console.render_lines(grid, options), row_of):
        for line in lines:
            whole = Segments([Segment(indent), *line, Segment.line()])
            console.print(whole, end="", soft_wrap=True)
        for text in below.get(row, ()):
            _print_text(console, indent + text, width)


def _least_width(table: Table) -> int:
    """Return the width that shows every number whole, and of words `_LEAST_WORDS` letters."""
    from rich.cells import cell_len

    rows = [table.headings, *(row for row in table.rows if not isinstance(row, str))]
    widths = []
    for cells, side in zip(zip(*rows, strict=True), table.align, strict=True):
        natural = max(cell_len(line) for cell in cells for line in cell.split("\n"))
        widths.append(min(natural, _LEAST_WORDS) if side == "<" else natural)
    return sum(widths) + _GAP * (len(widths) - 1)


def _cell(text: str) -> Text:
    from rich.text import Text

    from rigidimeter.core.files import visible

    return Text(visible(text, lines=True))


def number_text(value: float, digits: str = ".2g") -> str:
    """Return a number, or a dash where there is none."""
    return "–" if math.isnan(value) else f"{value:{digits}}"


def with_error(value: float, standard_error: float, digits: str) -> str:
    """Return a number ± its standard error to the same decimal, or alone without an error.

    The error has two digits if they are below 36 and one above, as the Particle Data Group rounds.

    Examples
    --------
    >>> with_error(0.136801, 8.7e-05, ".4g"), with_error(4.50012, 0.00281, ".5g")
    ('0.13680±0.00009', '4.5001±0.0028')
    """
    shown = number_text(value, digits)
    if math.isnan(standard_error):
        return shown
    if not 1e-8 < standard_error < 1e4 or not abs(value) < 1e6:
        return f"{shown}±{standard_error:.2g}"
    size = math.floor(math.log10(standard_error))
    decimals = max((1 if standard_error < 3.55 * 10.0**size else 0) - size, 0)
    return f"{value:.{decimals}f}±{standard_error:.{decimals}f}"
