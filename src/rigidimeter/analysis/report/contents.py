"""What a section of the report is made of: text, tables, figures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from markupsafe import Markup
from matplotlib.figure import Figure as Drawing

from rigidimeter.analysis.report.shown import Shown
from rigidimeter.analysis.study import deviation_sentence, result_table
from rigidimeter.core.records import Epoch, Fit, Score
from rigidimeter.core.words import Column, Table, epoch_name, short_names


@dataclass(frozen=True)
class Figure:
    """A figure of the report, also written to ``figures/NAME.svg``.

    Attributes
    ----------
    name : str
        Of the file.
    caption : str
        Below the figure.
    alt : str
        What it shows, for those who cannot see it.
    draw : callable
        Returns the drawing; called when the report is written.
    size : {"page", "broad", "tall", "small"}
        On the page: as wide as the page, as wide as its text, as high as a printed sheet, or side
        by side.
    marks : mapping of str to sequence of (str, str)
        Source and label of the epochs that points stand for, in the order of the points, by the
        `gid` of their line.
    """

    name: str
    caption: str
    alt: str
    draw: Callable[[], Drawing]
    size: Literal["page", "broad", "tall", "small"] = "broad"
    marks: Mapping[str, Sequence[tuple[str, str]]] = field(default_factory=dict)


Block = Markup | Table | Figure
"""What a section yields, in the order of the page."""


@dataclass(frozen=True)
class Section:
    """A section of the page.

    Attributes
    ----------
    name : str
        The `id` of the section in the page.
    title : str
        Its heading.
    blocks : callable
        Takes what is shown; returns text, tables and figures in the order of the page.
    shown_if : callable
        Takes what is shown; whether the page has this section.
    part : str
        The part of the page, an entry of its contents bar; sections of one part follow each other.
        One without a part is a part by itself.
    printed : bool
        Whether it is printed where not everything is asked for.
    """

    name: str
    title: str
    blocks: Callable[[Shown], Iterable[Block]]
    shown_if: Callable[[Shown], bool] = lambda _: True
    part: str = ""
    printed: bool = False


def part(title: str, *sections: Section, printed: int = 0) -> list[Section]:
    """Return the sections of a part of the page; the first ones are printed."""
    return [
        replace(section, part=title, printed=place < printed)
        for place, section in enumerate(sections)
    ]


def from_study_folder(shown: Shown) -> bool:
    """Return whether a result comes from a study folder, which has days, ratings and exclusions."""
    return bool(shown.study.sessions)


def from_result(shown: Shown, name: str, title: str, *columns: Column, **options: Any) -> Table:
    """Return a table of the rows of that name in a result; `options` are those of `Table`."""
    return Table(name, title, columns, result_table(shown.result, name), **options)


def deviations_in_words(shown: Shown) -> str:
    """Return one sentence on all deviations from the plan, and what depends on them; or nothing."""
    return deviation_sentence(shown.study, result_table(shown.result, "without_deviating"))


def named(shown: Shown, one: Epoch | Fit | Score) -> str:
    """Return what the page calls an epoch."""
    names = short_names(epoch.source for epoch in shown.epochs)
    label = one.label if isinstance(one, Epoch) else one.epoch
    return epoch_name(label, one.source, names)


def paragraph(text: str, kind: Literal["", "remark", "banner"] = "") -> Markup:
    """Return a paragraph; text that is not `Markup` is escaped."""
    start = Markup('<p class="{}">').format(kind) if kind else Markup("<p>")
    return start + text + Markup("</p>")


def bullets(items: Iterable[str]) -> Markup:
    """Return sentences as a list."""
    lines = Markup("\n").join(Markup("<li>{}</li>").format(item) for item in items)
    return Markup('<ul class="sentences">\n{}\n</ul>').format(lines)
