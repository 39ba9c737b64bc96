"""The ledger as files: a page that needs nothing beside it, ``ledger.json`` and the figures."""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

import jinja2
from markupsafe import Markup

from rigidimeter.documents import json_text, write_text
from rigidimeter.paper.comparison_table import AGREES, DIFFERS, UNPUBLISHED, VERDICTS, Row, Verdict
from rigidimeter.paper.rows import SECTIONS
from rigidimeter.reporting.numbers import number
from rigidimeter.version import __version__

__all__ = ["ledger_text", "render_page", "tally", "write_ledger"]

_SHORT = {AGREES: "agrees", DIFFERS: "differs", UNPUBLISHED: "unpublished"}
"""As names of CSS classes."""


def tally(rows: Sequence[Row]) -> dict[Verdict, int]:
    """Return how many rows have each verdict."""
    counted = Counter(row.verdict for row in rows)
    return {verdict: counted[verdict] for verdict in VERDICTS}


def ledger_text(rows: Sequence[Row]) -> str:
    """Return ``ledger.json``: a list with one object for each row."""
    return json_text([row.as_dict() for row in rows])


def render_page(rows: Sequence[Row], seed: int) -> str:
    """Return the page as text, with its style and its figures inside."""
    css = [
        (resources.files(room) / name).read_text(encoding="utf-8")
        for room, name in (
            ("rigidimeter.reporting", "page.css"),
            ("rigidimeter.paper", "page.css"),
        )
    ]
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters["data_uri"] = _data_uri
    environment.globals["number"] = number
    environment.globals["short"] = _SHORT
    by_id = {row.id: row for row in rows}
    template = environment.from_string(
        (resources.files("rigidimeter.paper") / "page.html").read_text(encoding="utf-8")
    )
    return template.render(
        # The styles are this package's own files, so they may stand as they are.
        css=Markup("\n".join(css)),
        sections=[
            (title, kept)
            for title, ids in SECTIONS.items()
            if (kept := [by_id[row_id] for row_id in ids if row_id in by_id])
        ],
        tally=tally(rows),
        virtual=any(row.virtual for row in rows),
        seed=seed,
        version=__version__,
    )


def write_ledger(rows: Sequence[Row], out: Path, seed: int) -> Path:
    """Write page, ledger and figures into a folder; return the page's path.

    Parameters
    ----------
    rows : sequence of Row
    out : Path
        Made if it does not exist. Files of the same names are replaced.
    seed : int
        As the page states it.
    """
    (out / "figures").mkdir(parents=True, exist_ok=True)
    for row in rows:
        for picture in row.pictures:
            write_text(out / "figures" / f"{picture.name}.svg", picture.svg)
    write_text(out / "ledger.json", ledger_text(rows))
    page = out / "paper.html"
    write_text(page, render_page(rows, seed))
    return page


def _data_uri(svg: str) -> str:
    return "data:image/svg+xml;base64," + base64.b64encode(svg.encode()).decode("ascii")
