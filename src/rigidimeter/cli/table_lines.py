"""Tables for a terminal."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Sequence

Rows = list[tuple[str, ...]]
"""Rows of cells, the headings first."""


def text_table(rows: Iterable[Sequence[str]], align: str, indent: str = "") -> list[str]:
    """Return rows of cells as lines with aligned columns, two spaces apart.

    Parameters
    ----------
    rows : iterable of sequences of str
        The headings are the first row. All rows have the same number of cells.
    align : str
        For each column ``<`` (left) or ``>`` (right).
    indent : str
        What every line begins with.

    Examples
    --------
    >>> text_table([("name", "n"), ("a", "10")], "<>")
    ['name   n', 'a     10']
    """
    cells = [tuple(row) for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return [
        indent
        + "  ".join(
            f"{cell:{side}{width}}" for cell, side, width in zip(row, align, widths, strict=True)
        ).rstrip()
        for row in cells
    ]


def number_text(value: float, digits: str = ".2g") -> str:
    """Return a number, or a dash where there is none."""
    return "–" if math.isnan(value) else f"{value:{digits}}"


def with_error(value: float, standard_error: float, digits: str) -> str:
    """Return a number ± its standard error, or alone where a method gives no error."""
    shown = number_text(value, digits)
    return shown if math.isnan(standard_error) else f"{shown} ±{standard_error:8.2g}"


def wrapped(text: str, indent: str = "") -> list[str]:
    """Return a sentence as lines of at most 100 characters, the later ones indented further."""
    return textwrap.wrap(text, 100, subsequent_indent=indent + "  ", initial_indent=indent)
