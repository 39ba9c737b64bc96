"""All rows in the order of the page: their texts, the functions that compute ours, and the files.

The files are a page that needs nothing beside it, ``ledger.json`` and the figures.
"""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from rigidimeter.analysis.figures import svg_text
from rigidimeter.analysis.report import data_uri, shown_text
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import json_text, write_text
from rigidimeter.core.version import __version__
from rigidimeter.core.words import number
from rigidimeter.paper import appendix, controller, highpass, rig_drawings, score_rows
from rigidimeter.paper import printed_effects as effects
from rigidimeter.paper import protocol_rows as protocol
from rigidimeter.paper import sensitivity_rows as sensitivity
from rigidimeter.paper import simulated_epochs as simulated
from rigidimeter.paper import virtual_rows as virtual
from rigidimeter.paper.comparison_table import (
    AGREES,
    DIFFERS,
    UNPUBLISHED,
    VERDICTS,
    Claim,
    RowVerdict,
)
from rigidimeter.paper.context import Context

_SHORT = {AGREES: "agrees", DIFFERS: "differs", UNPUBLISHED: "unpublished"}
"""As names of CSS classes."""

Maker = Callable[[Context], Claim]

STATEMENTS: Mapping[str, Mapping[str, Mapping[str, Any]]] = tomllib.loads(
    (resources.files("rigidimeter.paper") / "statements.toml").read_text(encoding="utf-8")
)
"""The page: by section and row, those texts of a row that do not depend on our numbers."""

MAKERS: Mapping[str, Maker] = {
    "eq-1": score_rows.equation_1,
    "eq-2": score_rows.equation_2,
    "eq-3": controller.equation_3,
    "eq-4": controller.equation_4,
    "eq-5": controller.equation_5,
    "eq-6": highpass.equation_6,
    "eq-6-highpass": partial(highpass.highpass, "per degree"),
    "eq-6-highpass-per-radian": partial(highpass.highpass, "per radian"),
    "eq-7": highpass.equation_7,
    "eq-7-median": virtual.median_inertia,
    "eq-8": appendix.equation_8,
    "eq-8-largest": appendix.largest_bandwidth,
    "fig-1": rig_drawings.figure_1,
    "fig-2": rig_drawings.figure_2,
    "fig-3a": appendix.figure_3a,
    "fig-3b": protocol.figure_3b,
    "fig-4a": protocol.figure_4a,
    "fig-4b": partial(virtual.torque_figure, "fig-4b"),
    "fig-4c": partial(virtual.torque_figure, "fig-4c"),
    "fig-4d": partial(virtual.torque_figure, "fig-4d"),
    "fig-5a": virtual.figure_5a,
    "fig-5b": partial(virtual.measure_figure, "fig-5b", "impulse_nm_s"),
    "fig-5c": partial(virtual.measure_figure, "fig-5c", "work_j"),
    "fig-6a": sensitivity.figure_6a,
    "fig-6b": sensitivity.figure_6b,
    "fig-6b-left-sum": sensitivity.left_sum,
    "fig-6b-delay": sensitivity.delay,
    "fig-7": virtual.figure_7,
    "fig-7-asymmetry": score_rows.asymmetry,
    "fig-8a": partial(virtual.measure_figure, "fig-8a", "inertia_kg_m2"),
    "fig-8b": partial(virtual.measure_figure, "fig-8b", "damping_nm_s_rad"),
    "fig-8c": partial(virtual.measure_figure, "fig-8c", "stiffness_nm_rad"),
    "table-1": protocol.table_1,
    "table-2": virtual.table_2,
    "table-2-mupdrs": partial(effects.line_of_table_2, "mupdrs"),
    "table-2-impulse": partial(effects.line_of_table_2, "impulse"),
    "table-2-work": partial(effects.line_of_table_2, "work"),
    "table-2-viscosity": partial(effects.line_of_table_2, "viscosity"),
    "table-2-stiffness": partial(effects.line_of_table_2, "stiffness"),
    "sec-1-voluntary-ols": simulated.voluntary_least_squares,
    "sec-1-voluntary-iv": simulated.voluntary_instruments,
    "sec-2.3-cycles-motion": protocol.cycles_of_motion,
    "sec-2.3-cycles-epoch": protocol.cycles_of_epoch,
    "sec-2.3-duration": protocol.session_length,
    "sec-2.4.2-units": partial(controller.units, "per degree"),
    "sec-2.4.3-bandwidth": appendix.bandwidth,
    "sec-2.5-sequences": protocol.sequences,
    "sec-2.5-wash-out": protocol.wash_out,
    "sec-3.1-f-test": effects.f_test,
    "sec-3.2-cancel": sensitivity.cancelling,
    "p-mupdrs": partial(effects.p_of_text, "mupdrs"),
    "p-work": partial(effects.p_of_text, "work"),
    "p-viscosity": partial(effects.p_of_text, "viscosity"),
    "p-stiffness": partial(effects.p_of_text, "stiffness"),
    "k-printed": protocol.one_stiffness,
    "sec-3.6-order": effects.order_of_effects,
    "sec-4-better": partial(effects.larger_effects, ("viscosity", "stiffness"), "work"),
    "sec-4-mupdrs": partial(
        effects.larger_effects, ("impulse", "work", "viscosity", "stiffness"), "mupdrs"
    ),
    "sec-3.4-mean": simulated.mean_errors,
    "sec-3.4-mean-iv": simulated.mean_errors_by_instruments,
    "sec-3.4-sd": simulated.spread_of_errors,
    "sec-3.4-noise": simulated.implied_noise,
    "app-a-units": partial(controller.units, "per radian"),
    "app-a-forearm": appendix.forearm_inertia,
    "app-a-inertia": appendix.total_inertia,
    "app-a-damping": appendix.total_damping,
}
"""By row: the function that makes it, in any order and on its own."""


def chosen(only: Iterable[str]) -> tuple[str, ...]:
    """Return the rows to make, in the order of the page; all of them if none is named.

    Raises
    ------
    UserError
        If a name is no row.
    """
    wanted = set(only)
    unknown = sorted(wanted - MAKERS.keys())
    if unknown:
        every = ", ".join(row_id for texts in STATEMENTS.values() for row_id in texts)
        raise UserError(f"--only {unknown[0]}: there is no such row; the rows are {every}")
    return tuple(
        row_id
        for texts in STATEMENTS.values()
        for row_id in texts
        if not wanted or row_id in wanted
    )


def make_rows(
    context: Context, only: Iterable[str] = (), progress: Callable[[str], None] = lambda _: None
) -> list[Claim]:
    """Make rows in the order of the page.

    Parameters
    ----------
    context : Context
    only : iterable of str
        Rows by id; all of them if empty.
    progress : callable
        Called with the id of each row once it is made.

    Raises
    ------
    UserError
        If a name is no row.
    """
    texts = {row_id: each for section in STATEMENTS.values() for row_id, each in section.items()}
    rows = []
    for row_id in chosen(only):
        rows.append(replace(MAKERS[row_id](context), id=row_id, **texts[row_id]))
        progress(row_id)
    return rows


def tally(rows: Sequence[Claim]) -> dict[RowVerdict, int]:
    """Return how many rows have each verdict."""
    counted = Counter(row.verdict for row in rows)
    return {verdict: counted[verdict] for verdict in VERDICTS}


def ledger_text(rows: Sequence[Claim]) -> str:
    """Return ``ledger.json``: a list with one object for each row."""
    return json_text([row.as_dict() for row in rows])


def drawn(
    rows: Sequence[Claim], progress: Callable[[str], None] = lambda _: None
) -> dict[str, str]:
    """Return every figure as SVG by its name; those of virtual data are marked."""
    svg = {}
    for row in rows:
        for figure in row.figures:
            svg[figure.name] = svg_text(figure.draw(), "virtual data" if row.virtual else "")
        progress(row.id)
    return svg


def render_paper(rows: Sequence[Claim], svg: Mapping[str, str], seed: int) -> str:
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
            for title, makers in STATEMENTS.items()
            if (kept := [by_id[row_id] for row_id in makers if row_id in by_id])
        ],
        images={name: data_uri(text) for name, text in svg.items()},
        tally=tally(rows),
        virtual=any(row.virtual for row in rows),
        seed=seed,
        version=__version__,
    )


def write_ledger(
    rows: Sequence[Claim], out: Path, seed: int, progress: Callable[[str], None] = lambda _: None
) -> Path:
    """Write page, ledger and figures into a folder; return the page's path.

    Parameters
    ----------
    rows : sequence of Claim
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
    write_text(page, render_paper(rows, svg, seed))
    return page
