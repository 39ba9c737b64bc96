"""Assemble the report: one page that needs nothing beside it, with its tables and figures."""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import jinja2
from markupsafe import Markup

from rigidimeter import __version__
from rigidimeter.records import Fit, Score
from rigidimeter.reporting.conclusions import study_verdict
from rigidimeter.reporting.measures import condition_name, epoch_verdict, short_names
from rigidimeter.reporting.methods import interval_basis, method_title, pooled_basis
from rigidimeter.reporting.numbers import interval, number, p_value
from rigidimeter.reporting.page_table import Cell, Column, Table, csv_text
from rigidimeter.reporting.pictures import (
    Picture,
    day_pictures,
    distribution_pictures,
    effect_pictures,
    impedance_pictures,
    loop_pictures,
    perturbation_pictures,
    rating_pictures,
    sensitivity_pictures,
    torque_pictures,
    voluntary_pictures,
)
from rigidimeter.reporting.prose import methods_prose
from rigidimeter.reporting.report_tables import all_tables
from rigidimeter.reporting.study_facts import cohort_view
from rigidimeter.study import Comparison, StudyResult

__all__ = ["render_page", "short_names", "write_report"]


@dataclass(frozen=True)
class Pair:
    """The comparisons between one pair of conditions, ready for the page."""

    reference: str
    other: str
    confidence_percent: str
    rows: tuple[Mapping[str, str], ...]
    unbounded: bool


DRAWN: Mapping[str, Callable[[StudyResult], list[Picture]]] = {
    "effects": effect_pictures,
    "days": day_pictures,
    "ratings": rating_pictures,
    "sensitivity": sensitivity_pictures,
    "distributions": distribution_pictures,
    "perturbation": perturbation_pictures,
    "impedance": impedance_pictures,
    "torque": torque_pictures,
    "voluntary": voluntary_pictures,
    "loops": loop_pictures,
}
"""The groups of figures, in the order in which they are drawn."""


def write_report(
    study: StudyResult, out: Path, progress: Callable[[float], None] = lambda _: None
) -> Path:
    """Write ``report.html``, ``tables/*.csv`` and ``figures/*.svg`` into a folder.

    A study folder also gets ``methods.txt``, the paragraph of methods as plain text. The same
    study gives the same bytes.

    Parameters
    ----------
    study : StudyResult
        What to show.
    out : Path
        The folder; made if it does not exist. Files of the same names are replaced.
    progress : callable
        Takes the share that is done, from 0 to 1.

    Returns
    -------
    Path
        Of the page.
    """
    tables = all_tables(study)
    pictures: dict[str, list[Picture]] = {}
    for done, (group_name, draw) in enumerate(DRAWN.items()):
        progress(done / len(DRAWN))
        pictures[group_name] = draw(study)
    progress(1.0)
    (out / "tables").mkdir(parents=True, exist_ok=True)
    (out / "figures").mkdir(parents=True, exist_ok=True)
    for table in tables.values():
        _write(out / "tables" / f"{table.name}.csv", csv_text(table))
    for group in pictures.values():
        for picture in group:
            _write(out / "figures" / f"{picture.name}.svg", picture.svg)
    if study.sessions:
        _write(out / "methods.txt", methods_prose(study).text)
    page = out / "report.html"
    _write(page, render_page(study, tables, pictures))
    return page


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n")


def render_page(
    study: StudyResult, tables: Mapping[str, Table], pictures: Mapping[str, Sequence[Picture]]
) -> str:
    """Return the page as text, with its style and its figures inside."""
    folder = resources.files("rigidimeter.reporting")
    names = short_names([*(e.source for e in study.epochs), *_sources(study)])
    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        loader=jinja2.FunctionLoader(lambda name: (folder / name).read_text(encoding="utf-8")),
    )
    environment.filters["data_uri"] = _data_uri
    environment.globals["show"] = lambda cell, column: _shown(cell, column, names)
    environment.globals["ends"] = _ends
    environment.globals["shown_columns"] = lambda table: _shown_columns(table, len(names) > 1)
    template = environment.get_template("page.html")
    return template.render(
        study=study,
        # The style is this package's own file, so it may stand as it is.
        css=Markup((folder / "page.css").read_text(encoding="utf-8")),
        tables=tables,
        pictures=pictures,
        pairs=(pairs := _pairs(study.comparisons)),
        uncompared=len(study.condition_names) > 2 * len(pairs),
        verdict=_verdict(study),
        virtual=sum(epoch.virtual for epoch in study.epochs),
        sources=Counter(epoch.source for epoch in study.epochs),
        source_names=names,
        inertia=number(study.analysis.inertia_kg_m2),
        method=method_title(study.analysis.method),
        interval_basis=interval_basis(study.analysis.method, study.settings.estimation),
        pooled_basis=pooled_basis(study.analysis.method),
        version=__version__,
        cohort=cohort_view(study),
    )


def _sources(study: StudyResult) -> list[str]:
    analysis = study.analysis
    results: tuple[Fit | Score, ...] = (*analysis.fits, *analysis.fixed_inertia, *analysis.scores)
    return [result.source for result in results]


def _verdict(study: StudyResult) -> str:
    """Return what days show where there are days, else what epochs show."""
    by_days = study_verdict(study) if study.sessions else ""
    return by_days or epoch_verdict(study)


def _data_uri(svg: str) -> str:
    return "data:image/svg+xml;base64," + base64.b64encode(svg.encode()).decode("ascii")


def _shown(cell: Cell, column: Column, names: Mapping[str, str]) -> str:
    """Return a cell as the page prints it."""
    if cell is None or cell == "":
        return "(no condition)" if column.kind == "condition" else "–"
    if column.kind == "source":
        return names.get(str(cell), str(cell))
    if column.kind == "p" and isinstance(cell, float):
        return p_value(cell)
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if isinstance(cell, float):
        return f"{cell:g}" if column.kind == "setting" else number(cell * column.page_factor)
    return str(cell)


def _shown_columns(table: Table, several_sources: bool) -> list[tuple[int, Column]]:
    """Return the columns for the page with their places, without those that would say nothing.

    A column of reasons without any is left out, and so is the only source beside each epoch.
    """
    by_epoch = any(column.name == "epoch" for column in table.columns)
    return [
        (place, column)
        for place, column in enumerate(table.columns)
        if column.on_page
        and (column.kind != "reason" or any(row[place] for row in table.rows))
        and (column.kind != "source" or several_sources or not by_epoch)
    ]


def _ends(table: Table, row: Sequence[Cell], column: Column) -> str:
    """Return the interval of a number, if it has one: a value that was held has none."""
    if column.ends is None:
        return ""
    places = {each.name: place for place, each in enumerate(table.columns)}
    low, high = (row[places[name]] for name in column.ends)
    if not isinstance(low, float) or not isinstance(high, float) or not low < high:
        return ""
    return interval(low, high)


def _pairs(comparisons: Iterable[Comparison]) -> list[Pair]:
    groups: dict[tuple[str, str], list[Comparison]] = {}
    for comparison in comparisons:
        if not comparison.paired:
            continue  # one condition only: its summaries say it all
        groups.setdefault((comparison.reference, comparison.other), []).append(comparison)
    pairs = []
    for (reference, other), members in groups.items():
        tests = [c.test for c in members if c.test is not None]
        confidences = dict.fromkeys(f"{100 * test.confidence:g} %" for test in tests)
        pairs.append(
            Pair(
                condition_name(reference),
                condition_name(other),
                " and ".join(confidences) or "95 %",
                tuple(_row(comparison) for comparison in members),
                any(not test.shift_bounded for test in tests),
            )
        )
    return pairs


def _row(comparison: Comparison) -> dict[str, str]:
    row = {
        "title": comparison.measure.title,
        "unit": comparison.measure.unit,
        "remark": comparison.remark,
    }
    sides = {"reference": comparison.reference, "other": comparison.other}
    for side, condition in sides.items():
        s = comparison.summaries[condition]
        row[f"n_{side}"] = str(s.n)
        row[f"excluded_{side}"] = str(comparison.excluded[condition])
        row[f"median_{side}"] = number(s.median)
        row[f"quartiles_{side}"] = interval(s.q1, s.q3, 3) if s.n else ""
    test = comparison.test
    if test is None:
        return row
    row["shift"] = number(test.shift)
    row["interval"] = interval(test.shift_low, test.shift_high, 3)
    row["interval"] += "" if test.shift_bounded else " †"
    row["z"], row["r"] = number(test.z, 3), f"{test.r:.2f}".replace("-", "−")
    row["p"] = p_value(test.p)
    return row
