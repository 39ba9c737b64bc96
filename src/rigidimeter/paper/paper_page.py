"""The rows as files: a page that needs nothing beside it, ``ledger.json`` and the figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from importlib import resources
from pathlib import Path

import jinja2
from markupsafe import Markup

from rigidimeter.analysis.report.numbers import number
from rigidimeter.analysis.report.page import data_uri, shown_text
from rigidimeter.analysis.report.style import svg_text
from rigidimeter.core.files import json_text, write_text
from rigidimeter.core.version import __version__
from rigidimeter.paper.comparison_table import AGREES, DIFFERS, UNPUBLISHED, VERDICTS, Row, Verdict
from rigidimeter.paper.rows import SECTIONS

_SHORT = {AGREES: "agrees", DIFFERS: "differs", UNPUBLISHED: "unpublished"}
"""As names of CSS classes."""


def tally(rows: Sequence[Row]) -> dict[Verdict, int]:
    """Return how many rows have each verdict."""
    counted = Counter(row.verdict for row in rows)
    return {verdict: counted[verdict] for verdict in VERDICTS}


def ledger_text(rows: Sequence[Row]) -> str:
    """Return ``ledger.json``: a list with one object for each row."""
    return json_text([row.as_dict() for row in rows])


def drawn(rows: Sequence[Row], progress: Callable[[str], None] = lambda _: None) -> dict[str, str]:
    """Return every figure as SVG by its name; those of virtual data are marked."""
    svg = {}
    for row in rows:
        for figure in row.figures:
            svg[figure.name] = svg_text(figure.draw(), "virtual data" if row.virtual else "")
        progress(row.id)
    return svg


def render_page(rows: Sequence[Row], svg: Mapping[str, str], seed: int) -> str:
    """Return the page as text, with its style inside, and the figures that `svg` has by name."""
    own, report = (
        resources.files("rigidimeter.paper"),
        resources.files("rigidimeter.analysis.report"),
    )
    environment = jinja2.Environment(
        autoescape=True,
        finalize=shown_text,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals["number"] = number
    environment.globals["short"] = _SHORT
    template = environment.from_string((own / "page.html").read_text(encoding="utf-8"))
    css = [(room / "page.css").read_text(encoding="utf-8") for room in (report, own)]
    by_id = {row.id: row for row in rows}
    return template.render(
        # The styles are this package's own files, so they may stand as they are.
        css=Markup("\n".join(css)),
        sections=[
            (title, kept)
            for title, makers in SECTIONS.items()
            if (kept := [by_id[row_id] for row_id in makers if row_id in by_id])
        ],
        images={name: data_uri(text) for name, text in svg.items()},
        tally=tally(rows),
        virtual=any(row.virtual for row in rows),
        seed=seed,
        version=__version__,
    )


def write_ledger(
    rows: Sequence[Row], out: Path, seed: int, progress: Callable[[str], None] = lambda _: None
) -> Path:
    """Write page, ledger and figures into a folder; return the page's path.

    Parameters
    ----------
    rows : sequence of Row
    out : Path
        Made if it does not exist. Files of the same names are replaced.
    seed : int
        As the page states it.
    progress : callable
        Called with the id of each row once its figures are drawn.
    """
    (out / "figures").mkdir(parents=True, exist_ok=True)
    svg = drawn(rows, progress)
    for name, text in svg.items():
        write_text(out / "figures" / f"{name}.svg", text)
    write_text(out / "ledger.json", ledger_text(rows))
    page = out / "paper.html"
    write_text(page, render_page(rows, svg, seed))
    return page
