"""The report: one page that needs no other file, and its tables and figures as files."""

from __future__ import annotations

import base64
import functools
import hashlib
import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
from markupsafe import Markup

from rigidimeter.analysis.figures import inline_svg, svg_text
from rigidimeter.analysis.report import first_screen
from rigidimeter.analysis.report.contents import Block, Figure, Section, deviations_in_words
from rigidimeter.analysis.report.epoch_traces import page_traces, traces_json
from rigidimeter.analysis.report.methods import methods_prose
from rigidimeter.analysis.report.sections import SECTIONS
from rigidimeter.analysis.report.shown import Shown
from rigidimeter.analysis.study import lead, traffic_light
from rigidimeter.core.files import DICTIONARY, csv_text, dictionary_text, visible
from rigidimeter.core.version import __version__
from rigidimeter.core.words import Column, Table, epoch_name, short_names, shown_below, shown_value

MOST_PRINTED = 30
"""A longer table that is folded on the page is not printed unless everything is."""

MOST_OPEN = 5
"""A table that could be folded is open where it is as short as this."""

Contents = Sequence[tuple[Section, Sequence[Block]]]
"""The sections of a page, each with its text, tables and figures."""


def sections_of(shown: Shown, progress: Callable[[float], None] = lambda _: None) -> Contents:
    """Return the sections in the order of the page, also those with nothing to show."""
    sections = [section for section in SECTIONS if section.shown_if(shown)]
    made = []
    for done, section in enumerate(sections, start=1):
        made.append((section, tuple(section.blocks(shown))))
        progress(done / len(sections))
    return made


class Part(NamedTuple):
    """A part of the page: an entry of its contents bar, with one section or several."""

    anchor: str
    title: str
    printed: bool
    sections: Contents


def parts(made: Contents) -> list[Part]:
    """Return the sections that show anything, by part, each part once."""
    found: dict[str, list[tuple[Section, Sequence[Block]]]] = {}
    for section, blocks in made:
        if any(map(_is_shown, blocks)):
            found.setdefault(section.part or section.title, []).append((section, blocks))
    return [
        Part(
            f"part-{place}",
            title,
            any(section.printed for section, _ in own),
            own,
        )
        for place, (title, own) in enumerate(found.items(), start=1)
    ]


def _is_shown(block: Block) -> bool:
    if isinstance(block, Table):
        return bool(block.columns and block.rows)
    return True


def tables(made: Contents) -> dict[str, Table]:
    """Return every table by name, those without rows and those that are files only too."""
    return {block.name: block for _, blocks in made for block in blocks if isinstance(block, Table)}


def write_report(
    shown: Shown, out: Path, progress: Callable[[float], None] = lambda _: None
) -> Path:
    """Write ``report.html``, ``tables/*.csv`` and ``figures/*`` into a folder.

    ``tables/data-dictionary.csv`` has unit and meaning of every column of the others.

    A study folder also gets ``methods.txt``, the paragraphs of methods as plain text. The same
    result gives the same bytes.

    Parameters
    ----------
    shown : Shown
    out : Path
        The folder; made if it does not exist. Files of the same names are replaced.
    progress : callable
        Takes the share that is done, from 0 to 1.

    Returns
    -------
    Path
        Of the page.
    """
    made = sections_of(shown, lambda share: progress(share / 2))
    figures = [block for _, blocks in made for block in blocks if isinstance(block, Figure)]
    mark = _mark(shown)
    svg: dict[str, str] = {}
    for figure in figures:
        svg[figure.name] = svg_text(figure.draw(), mark)
        progress(0.5 + 0.5 * len(svg) / len(figures))
    (out / "tables").mkdir(parents=True, exist_ok=True)
    (out / "figures").mkdir(parents=True, exist_ok=True)
    written = {f"{table.name}.csv": table for table in tables(made).values()}
    for name, table in written.items():
        _write(out / "tables" / name, _csv(table))
    described = dictionary_text({name: _columns(table) for name, table in written.items()})
    _write(out / "tables" / DICTIONARY, described)
    for name, text in svg.items():
        _write(out / "figures" / f"{file_stem(name)}.svg", text)
    if shown.study.sessions:
        _write(out / "methods.txt", methods_prose(shown).text)
    page = out / "report.html"
    _write(page, render_page(shown, made, svg))
    progress(1.0)
    return page


def file_stem(name: str) -> str:
    """Return the name of the files of a figure."""
    return name.replace("/", "_")


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n")


def _csv(table: Table) -> str:
    """Return all values of the rows; without rows, a header of what the page would show."""
    return csv_text(_columns(table), table.rows)


def _columns(table: Table) -> list[str]:
    names = dict.fromkeys(name for row in table.rows for name in row)
    return list(names) or [column.name for column in table.columns]


def _mark(shown: Shown) -> str:
    """Return what is written into every figure where data were simulated."""
    virtual = sum(epoch.virtual for epoch in shown.epochs)
    if shown.study.virtual or 0 < virtual == len(shown.epochs):
        return "virtual data"
    return "some of the data are virtual" if virtual else ""


def shown_tables(shown: Shown) -> list[Table]:
    """Return the tables that the page shows, in its order."""
    blocks = itertools.chain.from_iterable(blocks for _, blocks in sections_of(shown))
    return [block for block in blocks if isinstance(block, Table) and _is_shown(block)]


def page_text(shown: Shown) -> str:
    """Return the page without its figures, whose drawing takes long."""
    return render_page(shown, sections_of(shown), {})


def source_names(shown: Shown) -> dict[str, str]:
    """Return what each source is called in tables, as short as keeps them apart."""
    analysis = shown.analysis
    sources = [epoch.source for epoch in shown.epochs]
    sources += [fit.source for fit in (*analysis.fits, *analysis.fixed_inertia)]
    return short_names([*sources, *(score.source for score in analysis.scores)])


def render_page(shown: Shown, made: Contents, svg: Mapping[str, str]) -> str:
    """Return the page as text, with its style inside, and the figures that `svg` has by name."""
    study, concluded = shown.study, shown.result.comparisons
    names = source_names(shown)
    light = traffic_light(study, concluded)
    traces = page_traces(shown)
    script = _script() if traces else ""
    own = parts(made)
    return _template().render(
        shown=shown,
        show=lambda row, column: shown_value(row, column, names),
        below=lambda row, column: shown_below(row, column, names),
        shown_columns=lambda table: table.shown_columns(several_sources=len(names) > 1),
        # The style is this package's own file and needs no escaping.
        css=Markup("\n".join([_text("page.css"), *([_plot(".min.css")] if traces else [])])),
        parts=own,
        most_printed=MOST_PRINTED,
        most_open=MOST_OPEN,
        not_printed=[
            section.title for each in own for section, _ in each.sections if not section.printed
        ],
        images=_images(made, svg, {key: place for place, key in enumerate(traces)}, names),
        traces=Markup(traces_json(traces.values())) if traces else "",
        script=Markup(script),
        script_digest=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii"),
        lead=lead(study, concluded),
        deviations=deviations_in_words(shown),
        strips=first_screen.strips(shown.result),
        precision=first_screen.precision_tables(shown.result),
        light=light,
        screen=first_screen,
        advice=() if study.other else first_screen.advice(shown, light),
        virtual=sum(epoch.virtual for epoch in shown.epochs),
        version=__version__,
    )


@functools.cache
def _template() -> jinja2.Template:
    """Return the template of the page, which takes longer to compile than to fill."""
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_text),
        autoescape=True,
        finalize=shown_text,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.tests["table"] = lambda block: isinstance(block, Table)
    environment.tests["figure"] = lambda block: isinstance(block, Figure)
    environment.globals["heads"] = _heads
    environment.globals["file_stem"] = file_stem
    return environment.get_template("page.html")


def _images(
    made: Contents,
    svg: Mapping[str, str],
    places: Mapping[tuple[str, str], int],
    names: Mapping[str, str],
) -> dict[str, Markup]:
    """Return the figures that are drawn as elements of the page."""

    def called(source: str, label: str) -> str:
        return epoch_name(label, source, names)

    return {
        block.name: inline_svg(svg[block.name], block.name, block.alt, block.marks, places, called)
        for _, blocks in made
        for block in blocks
        if isinstance(block, Figure) and block.name in svg
    }


def _text(name: str) -> str:
    """Return a file of this room."""
    return (resources.files("rigidimeter.analysis.report") / name).read_text(encoding="utf-8")


def _plot(ending: str) -> str:
    """Return a file of uPlot, which the operator's page shows, too."""
    place = resources.files("rigidimeter") / "vendored" / f"uPlot{ending}"
    return place.read_text(encoding="utf-8")


def _script() -> str:
    """Return what the page runs: uPlot with its licence, and what opens the traces of an epoch."""
    # Its first line names an address, and the page names none outside itself.
    plot = _plot(".iife.min.js").partition("*/")[2].strip()
    licence, page = _plot(".LICENSE").strip(), _text("page.js").strip()
    return f"/*! uPlot 1.6.32\n{licence}\n*/\n{plot}\n{page}"


def shown_text(value: Any) -> Any:
    """Return a value of a page; in text control characters are escapes, which HTML forbids."""
    return visible(value, lines=True) if type(value) is str else value


def data_uri(svg: str) -> str:
    """Return an SVG document as the source of an image."""
    return "data:image/svg+xml;base64," + base64.b64encode(svg.encode()).decode("ascii")


def _heads(columns: Iterable[Column]) -> list[tuple[str, list[Column]]]:
    """Return the columns by their groups; each column without a group by itself."""
    found: list[tuple[str, list[Column]]] = []
    for group, members in itertools.groupby(columns, lambda column: column.group):
        own = list(members)
        found += [(group, own)] if group else [("", [column]) for column in own]
    return found
