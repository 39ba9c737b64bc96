"""The first screen of a report: differences, precision, and the traffic light."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from importlib import resources
from typing import NamedTuple

import jinja2
from markupsafe import Markup

from rigidimeter.analysis.study import (
    WANTED_PERCENT,
    DifferenceRow,
    Precision,
    Statements,
    StudyResult,
    TrafficLight,
    conclude,
    difference_rows,
    precisions,
    precisions_untested,
    statements,
)
from rigidimeter.analysis.study.drawing import channel_facts
from rigidimeter.core.words import (
    number,
    plural,
    scaled,
    series,
    within,
)

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

    pair: StudyResult
    said: Statements
    p_name: str
    rows: tuple[tuple[DifferenceRow, Markup], ...]


def strips(result: StudyResult) -> list[Strip]:
    """Return the comparisons of the first screen; none where there were not two conditions."""
    found = []
    for pair in (result, *result.further_pairs):
        concluded, said = conclude(pair), statements(pair)
        if concluded is None or said is None:
            continue
        percents = [size for one in concluded.each for size in one.difference.percent]
        to = reach(percents, MOST_PERCENT)
        rows = tuple((row, _plot(row, to)) for row in difference_rows(concluded))
        found.append(Strip(pair, said, concluded.p_name, rows))
    return found


def _plot(row: DifferenceRow, to: float) -> Markup:
    """Draw the difference with the interval of its test, in % where that has a meaning."""
    d = row.conclusion.difference
    if math.isnan(d.estimate):
        return Markup("")
    drawn, unit = d.percent, " %"
    if math.isnan(d.percent[0]):
        drawn, unit = d.tested, f" {row.unit}".rstrip()
        to = reach(drawn)
    kind = KINDS.get(row.conclusion.verdict, "")
    words = f"{row.measure} {row.difference}, 95 % interval {row.interval or 'unknown'}"
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
    where = f" in {result.reference}" if result.reference else ""
    found = {f"All epochs together{where}": precisions(result)} | {
        f"All epochs in {name} together; what differs between days is not in these intervals": each
        for name, each in precisions_untested(result).items()
    }
    halves = [one.percent for each in found.values() for one in each]
    to = reach([WANTED_PERCENT, *halves], MOST_PERCENT)
    return {
        caption: [_precision_row(one, to) for one in each]
        for caption, each in found.items()
        if each
    }


def _precision_row(one: Precision, to: float) -> PrecisionRow:
    factor, unit = scaled(one.value, one.measure.unit)
    digits = resolving(one.value, (one.high - one.low) / 2)
    low, high = (number(factor * end, digits) for end in (one.low, one.high))
    known = not math.isnan(one.percent)
    percent = f"±\N{NO-BREAK SPACE}{number(one.percent, 2)}{_PERCENT}" if known else ""
    return PrecisionRow(
        one.measure.title,
        unit,
        number(factor * one.value, digits),
        f"{low} to {high}" if known else "not known from one epoch",
        percent,
        "" if math.isnan(one.sd_percent) else f"{number(one.sd_percent, 2)}{_PERCENT}",
        one.n,
        "" if one.epochs_needed is None else str(one.epochs_needed),
        interval_plot(
            (0.0, -one.percent, one.percent),
            to,
            _PERCENT,
            kind="shown",
            middle="estimate",
            band=WANTED_PERCENT,
            words=f"{one.measure.title} {percent}",
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


def light_words(light: TrafficLight) -> str:
    """Return how many epochs have no caution, and what of the others."""
    text = f"{light.sound} of {plural(light.epochs, 'epoch')} without a caution"
    others = []
    if light.doubted:
        others.append(f"{light.doubted} with a caution")
    if light.excluded:
        others.append(f"{light.excluded} excluded")
    more = f" ({', '.join(others)})" if others else ""
    return f"{text}{more}."


def main_finding(light: TrafficLight) -> str:
    """Return the name of the main finding and where it is; what was found, if it is no check."""
    if not light.doubt:
        text = light.text.removesuffix(".")
        return f"{text[:1].upper()}{text[1:]}." if text else ""
    name = light.doubt.replace("_", " ")
    where = f"{light.doubt_epochs} of them" if light.doubt_epochs else "all epochs together"
    return f"Main finding: {name}, in {where}."


def advice(result: StudyResult, light: TrafficLight | None) -> list[str]:
    """Return what would make the estimates of one condition better."""
    found = []
    perturbed = [
        {channel.name for channel in channels}
        for epoch, channels in zip(result.epochs, channel_facts(result), strict=True)
        if epoch.task != "sinusoid"
    ]
    if perturbed and not any("perturbation_nm" in names for names in perturbed):
        found.append(
            "Record the perturbation (perturbation_nm): without it torque of the subject is "
            "separated from the joint by its frequencies alone."
        )
    measured = precisions(result)
    more = [
        f"{one.epochs_needed} for {within(one.measure.title)} (now {one.n})"
        for one in measured
        if one.epochs_needed is not None and one.epochs_needed > one.n
    ]
    if more:
        found.append(
            f"Repeat epochs like these, for ±\N{NO-BREAK SPACE}{WANTED_PERCENT:g}{_PERCENT} about "
            f"{series(more)}."
        )
    unknown = [within(one.measure.title) for one in measured if one.epochs_needed is None]
    if unknown:
        found.append(f"Record several epochs: one gives no interval of {series(unknown)}.")
    if light is not None and light.remedy:
        name = light.doubt.replace("_", " ")
        found.append(f"Because of {name}: {light.remedy}")
    return found
