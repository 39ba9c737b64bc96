"""The first screen of a report: differences, precision, and the traffic light."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Mapping
from importlib import resources
from typing import Any, NamedTuple

import jinja2
from markupsafe import Markup

from rigidimeter.analysis.report.shown import Shown
from rigidimeter.analysis.statistics import WANTED_PERCENT
from rigidimeter.analysis.study import (
    Compared,
    Statement,
    StudyResult,
    p_name,
    result_table,
    shown_cells,
    statements,
)
from rigidimeter.core.words import condition_name, number, plural, scaled, series, within

_WIDTH, _PAD = 190, 12
MOST_PERCENT = 100.0
"""An axis in per cent reaches at most so far; what is beyond it is drawn as an arrow."""
DIGITS = 3
_PERCENT = "\N{NO-BREAK SPACE}%"
KINDS = {"lower": "shown", "higher": "shown", "not supported": "unsupported"}


class PrecisionRow(NamedTuple):
    """One measure of a condition as the first screen shows it."""

    title: str
    unit: str
    value: str
    interval: str
    percent: str
    sd: str
    epochs: int
    needed: str
    plot: Markup


class Strip(NamedTuple):
    """Two conditions as the first screen shows them: a row and a drawing for each measure."""

    reference: str
    other: str
    said: Statement
    p_name: str
    rows: tuple[tuple[Compared, dict[str, str], Markup], ...]


def strips(result: StudyResult) -> list[Strip]:
    """Return the comparisons of the first screen; none where there were not two conditions."""
    found = []
    for other, said in statements(result.study, result.comparisons).items():
        each = [one for one in result.comparisons if one.other == other]
        to = reach((size for one in each for size in one.percent(one.of_test)), MOST_PERCENT)
        rows = tuple((one, row := shown_cells(one), _plot(one, row, to)) for one in each)
        names = condition_name(result.study.reference), condition_name(other)
        found.append(Strip(*names, said, p_name(each), rows))
    return found


def _plot(one: Compared, row: dict[str, str], to: float) -> Markup:
    """Draw the difference with the interval of its test, in % where that has a meaning."""
    if math.isnan(one.difference):
        return Markup("")
    drawn, unit = one.percent(one.of_test), " %"
    if math.isnan(drawn[0]):
        drawn, unit = one.of_test, f" {row['unit']}".rstrip()
        to = reach(drawn)
    kind = KINDS.get(one.verdict, "")
    words = f"{row['measure']} {row['difference']}, 95 % interval {row['interval'] or 'unknown'}"
    return interval_plot(drawn, to, unit, kind=kind, words=words)


@functools.cache
def _drawing() -> jinja2.Template:
    place = resources.files("rigidimeter.analysis.report") / "interval.html"
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string(place.read_text(encoding="utf-8"))


def interval_plot(
    drawn: tuple[float, float, float],
    to: float,
    unit: str,
    *,
    kind: str = "",
    middle: str = "0",
    band: float = 0.0,
    words: str = "",
) -> Markup:
    """Return a value with its interval on a small axis, as SVG of the page with text as text.

    Parameters
    ----------
    drawn : (float, float, float)
        The value and the ends of its interval; what is NaN is not drawn.
    to : float
        The axis goes from −`to` to `to`; what is beyond is an arrow.
    unit : str
        Behind the numbers at the ends of the axis.
    kind : str
        A class of the page's style: ``shown``, ``unsupported`` or nothing.
    middle : str
        What is written below zero.
    band : float
        The half width of a shaded band around zero.
    words : str
        What the drawing shows, for those who cannot see it.
    """

    def x(at: float) -> float:
        inside = min(max(at / to, -1.0), 1.0)
        return round(_WIDTH / 2 + inside * (_WIDTH / 2 - _PAD), 1)

    value, *ends = drawn
    low, high = sorted(ends) if all(map(math.isfinite, ends)) else (None, None)
    end = f"{number(to, 2 + (to >= 100))}{unit}"
    text = _drawing().render(
        x=x,
        to=to,
        most=to * 1.0000001,  # a rounded end is not beyond
        value=value if math.isfinite(value) and abs(value) <= to else None,
        low=low,
        high=high,
        axis=(f"−{end}", middle, f"+{end}"),
        kind=kind,
        band=band,
        words=words,
    )
    return Markup(text)


def reach(sizes: Iterable[float], most: float = math.inf) -> float:
    """Return the end of an axis that holds these sizes: 1, 2 or 5 times a power of ten.

    Examples
    --------
    >>> reach([3.1, 17.0]), reach([0.31]), reach([260.0], most=100.0), reach([])
    (20.0, 0.5, 100.0, 1.0)
    """
    largest = max((abs(size) for size in sizes if math.isfinite(size)), default=0.0)
    if not largest:
        return min(1.0, most)
    power = 10.0 ** math.floor(math.log10(largest))
    return min(next(k * power for k in (1, 2, 5, 10) if k * power >= largest), most)


def precision_tables(result: StudyResult) -> dict[str, list[PrecisionRow]]:
    """Return by caption a row for each measure of the only condition, or of two without a test."""
    found: dict[str, list[Mapping[str, Any]]] = {}
    for row in result_table(result, "precision"):
        found.setdefault(_caption(row["condition"], result.study.other), []).append(row)
    halves = [row["half_width_percent"] for each in found.values() for row in each]
    to = reach([WANTED_PERCENT, *halves], MOST_PERCENT)
    return {caption: [_precision_row(row, to) for row in each] for caption, each in found.items()}


def _caption(condition: str, other: str) -> str:
    if other:
        alone = "what differs between days is not in these intervals"
        return f"All epochs in {condition} together; {alone}"
    return f"All epochs together in {condition}" if condition else "All epochs together"


def _precision_row(row: Mapping[str, Any], to: float) -> PrecisionRow:
    title, value, half = row["title"], row["value"], row["half_width_percent"]
    factor, unit = scaled(value, row["unit"])
    digits = resolving(value, (row["high"] - row["low"]) / 2)
    low, high = (number(factor * row[end], digits) for end in ("low", "high"))
    percent = "" if math.isnan(half) else f"±\N{NO-BREAK SPACE}{number(half, 2)}{_PERCENT}"
    needed = row["epochs_for_5_percent"]
    return PrecisionRow(
        title,
        unit,
        number(factor * value, digits),
        f"{low} to {high}" if percent else "not known from one epoch",
        percent,
        "" if math.isnan(row["sd_percent"]) else f"{number(row['sd_percent'], 2)}{_PERCENT}",
        row["epochs"],
        "" if needed is None else str(needed),
        interval_plot(
            (0.0, -half, half),
            to,
            _PERCENT,
            kind="shown",
            middle="estimate",
            band=WANTED_PERCENT,
            words=f"{title} {percent}",
        ),
    )


def resolving(value: float, half: float) -> int:
    """Return how many digits of a value show half its interval with two, from 3 to 6.

    Examples
    --------
    >>> resolving(1.8006, 0.00105), resolving(1.8, 0.2), resolving(1.8, math.nan)
    (5, 3, 3)
    """
    if not (value and 0 < half < math.inf):
        return DIGITS
    places = math.floor(math.log10(abs(value))) - math.floor(math.log10(half))
    return min(max(places + 2, DIGITS), 6)


LIGHTS = {"good": ("✓", "good"), "caution": ("!", "use with caution"), "poor": ("✕", "poor")}
"""The sign and the words of each level, so that colour is never alone."""


def light_words(light: Mapping[str, Any]) -> str:
    """Return how many epochs have no caution, and what of the others."""
    text = f"{light['sound']} of {plural(light['epochs'], 'epoch')} without a caution"
    others = []
    if light["doubted"]:
        others.append(f"{light['doubted']} with a caution")
    if light["excluded"]:
        others.append(f"{light['excluded']} excluded")
    more = f" ({', '.join(others)})" if others else ""
    return f"{text}{more}."


def main_finding(light: Mapping[str, Any]) -> str:
    """Return the name of the main finding and where it is; what was found, if it is no check."""
    if not light["doubt"]:
        text = light["text"].removesuffix(".")
        return f"{text[:1].upper()}{text[1:]}." if text else ""
    name = light["doubt"].replace("_", " ")
    epochs = light["doubt_epochs"]
    where = f"{epochs} of them" if epochs else "all epochs together"
    return f"Main finding: {name}, in {where}."


def advice(shown: Shown, light: Mapping[str, Any] | None) -> list[str]:
    """Return what would make the estimates of one condition better."""
    found = []
    perturbed = [
        {channel.name for channel in channels}
        for epoch, channels in zip(shown.epochs, shown.channels, strict=True)
        if epoch.task != "sinusoid"
    ]
    if perturbed and not any("perturbation_nm" in names for names in perturbed):
        found.append(
            "Record the perturbation (perturbation_nm): without it torque of the subject is "
            "separated from the joint by its frequencies alone."
        )
    more, unknown = [], []
    for row in result_table(shown.result, "precision"):
        title, needed = within(row["title"]), row["epochs_for_5_percent"]
        if needed is None:
            unknown.append(title)
        elif needed > row["epochs"]:
            more.append(f"{needed} for {title} (now {row['epochs']})")
    if more:
        found.append(
            f"Repeat epochs like these, for ±\N{NO-BREAK SPACE}{WANTED_PERCENT:g}{_PERCENT} about "
            f"{series(more)}."
        )
    if unknown:
        found.append(f"Record several epochs: one gives no interval of {series(unknown)}.")
    if light is not None and light["remedy"]:
        name = light["doubt"].replace("_", " ")
        found.append(f"Because of {name}: {light['remedy']}")
    return found
