"""The table of a plan on the page."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from rigidimeter.core.study_files import PLAN_COLUMNS


def plan_table(rows: Sequence[Sequence[str]], caption: str = "") -> str:
    """Return the sessions of a subject as a table; `rows` are those of `plan_rows`."""
    heads = "".join(f"<th>{escape(name)}</th>" for name in PLAN_COLUMNS)
    cells = ("".join(f"<td>{escape(cell)}</td>" for cell in row) for row in rows)
    lines = "".join(f"<tr>{row}</tr>" for row in cells)
    said = f"<caption>{escape(caption)}</caption>" if caption else ""
    return f"<table>{said}<thead><tr>{heads}</tr></thead><tbody>{lines}</tbody></table>"
