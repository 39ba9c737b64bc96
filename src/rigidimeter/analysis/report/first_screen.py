"""The first screen of a report in words: two values, their difference, and the traffic light."""

from __future__ import annotations

import math
from typing import NamedTuple

from markupsafe import Markup

from rigidimeter.analysis.report.interval_plot import MOST_PERCENT, interval_plot, reach
from rigidimeter.analysis.report.numbers import (
    condition_name,
    number,
    p_value,
    plural,
    scaled,
    series,
    within,
)
from rigidimeter.analysis.study import (
    WANTED_PERCENT,
    Conclusion,
    Difference,
    Precision,
    StudyResult,
    TrafficLight,
    conclude,
    precisions,
    precisions_untested,
)
from rigidimeter.analysis.study.drawing import channel_facts

DIGITS = 3
_PERCENT = "\N{NO-BREAK SPACE}%"
_KIND = {"lower": "shown", "higher": "shown", "not supported": "unsupported"}


class StripRow(NamedTuple):
    """One measure of two conditions as the first screen shows it; all text but the plot."""

    title: str
    unit: str
    reference: str
    other: str
    difference: str
    interval: str
    percent: str
    percent_interval: str
    simulated: str
    p: str
    p_holm: str
    verdict: str
    kind: str
    plot: Markup


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


def strip(result: StudyResult) -> list[StripRow]:
    """Return a row for each measure that was compared; none where there were not two conditions."""
    concluded = conclude(result)
    if concluded is None:
        return []
    percents = [size for one in concluded.each for size in one.difference.percent]
    to = reach(percents, MOST_PERCENT)
    other = condition_name(result.other)
    return [_strip_row(one, to, other) for one in concluded.each]


def tested_words(result: StudyResult) -> str:
    """Return what the values of the strip are, and what was tested."""
    concluded = conclude(result)
    if concluded is None:
        return ""
    centres = {one.difference.centre for one in concluded.each}
    what = "medians" if centres == {"median"} else f"means of {concluded.units}"
    text = f"{what}; p and intervals by the test of {concluded.units}"
    if concluded.tested > 1:
        text += " for each measure alone; the conclusion follows Holm's p"
    return text


def _strip_row(one: Conclusion, to: float, other: str) -> StripRow:
    d, measure = one.difference, one.comparison.measure
    factor, unit = scaled(max(abs(d.reference), abs(d.other)), measure.unit)
    estimate, low, high = (factor * size for size in (d.estimate, d.low, d.high))
    percent, percent_low, percent_high = d.percent
    words = f"{other} {difference_words(d, measure.unit)}"
    if math.isnan(percent):
        own = reach([low, high, estimate])
        axis, drawn, to = f"{number(own, 1)} {unit}".strip(), (estimate, low, high), own
    else:
        axis, drawn = f"{number(to, 2 + (to >= 100))}{_PERCENT}", d.percent
    value, *ends = (-size for size in drawn)
    return StripRow(
        measure.title,
        unit,
        number(factor * d.reference, DIGITS),
        number(factor * d.other, DIGITS),
        _sided(estimate),
        _sided_interval(low, high),
        _percent(d),
        "" if math.isnan(percent_low) else _sided_interval(percent_low, percent_high, 2, _PERCENT),
        "" if one.simulated is None else _simulated(one.simulated, factor),
        p_value(d.p),
        "" if math.isnan(one.p) else p_value(one.p),
        one.verdict,
        _KIND.get(one.verdict, ""),
        interval_plot(
            value,
            (ends[0], ends[1]),
            (f"{axis} lower", "0", f"{axis} higher"),
            to,
            kind=_KIND.get(one.verdict, ""),
            words=words,
        )
        if math.isfinite(value)
        else Markup(""),
    )


def difference_words(d: Difference, unit: str) -> str:
    """Return ``lower by 0.27 N·m/rad, 15 %, 95 % interval 0.1 to 0.4 lower``."""
    factor, in_unit = scaled(max(abs(d.reference), abs(d.other)), unit)
    if math.isnan(d.estimate):
        return "unknown"
    size = f"{number(abs(factor * d.estimate), DIGITS)} {in_unit}".strip()
    text = f"{d.side} by {size}" if d.estimate else "the same"
    if not math.isnan(d.percent[0]):
        text += f", {number(abs(d.percent[0]), 2)} %"
    if not math.isnan(d.low):
        text += f", 95 % interval {_sided_interval(factor * d.low, factor * d.high)}"
    return text


def _percent(d: Difference) -> str:
    """Return a difference in per cent of the reference, in words for the other."""
    percent = d.percent[0]
    return "" if math.isnan(percent) else f"{number(abs(percent), 2)}{_PERCENT} {d.side}"


def _simulated(d: Difference, factor: float) -> str:
    if not d.estimate:
        return d.side
    return _percent(d) or _sided(factor * d.estimate)


def _sided(size: float, digits: int = DIGITS) -> str:
    """Return a difference, reference − other, in words for the other: ``0.27 lower``."""
    if math.isnan(size):
        return "–"
    return f"{number(abs(size), digits)} {'lower' if size > 0 else 'higher'}" if size else "0"


def _sided_interval(low: float, high: float, digits: int = DIGITS, unit: str = "") -> str:
    """Return an interval of reference − other in words for the other."""
    if math.isnan(low) or math.isnan(high):
        return ""
    if low < 0 < high:
        return f"{number(-low, digits)}{unit} higher to {number(high, digits)}{unit} lower"
    ends = sorted((abs(low), abs(high)))
    side = "lower" if high > 0 else "higher"
    return f"{number(ends[0], digits)} to {number(ends[1], digits)}{unit} {side}"


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
    axis = f"{number(to, 2 + (to >= 100))}{_PERCENT}"
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
            0.0,
            (-one.percent, one.percent),
            (f"−{axis}", "estimate", f"+{axis}"),
            to,
            kind="shown",
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
    """Return how many epochs are sound, and what of the others."""
    text = f"{light.sound} of {plural(light.epochs, 'epoch')} "
    text += "is sound" if light.sound == 1 else "are sound"
    others = []
    if light.doubted:
        others.append(f"checks cast doubt on {light.doubted}")
    if light.excluded:
        others.append(f"{light.excluded} {'is' if light.excluded == 1 else 'are'} excluded")
    more = f" ({', '.join(others)})" if others else ""
    return f"{text}{more}."


def main_finding(light: TrafficLight) -> str:
    """Return the name of the main finding and where it is; what was found, if it is no check."""
    if not light.doubt:
        text = light.text or "No check casts doubt on an epoch"
        return f"{text[:1].upper()}{text[1:].removesuffix('.')}."
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
            "Record the perturbation (perturbation_nm): without it torque that something but the "
            "robot adds biases J, B and K, whatever the number of epochs."
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
