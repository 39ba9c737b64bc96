"""How many days, subjects or values would decide whether a measure differs.

As many as show the smallest difference worth finding with a chance of 80 %, at the level of the
first test of the family. The SD of the difference is that of the test, and of J, B and K with few
days that which is assumed where no study is known (`rigidimeter.planning`), with the scatter
between epochs of these recordings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rigidimeter.analysis.study.compared import Comparison
from rigidimeter.analysis.study.measures import Observation
from rigidimeter.analysis.study.tested import Test
from rigidimeter.core.records import PARAMETERS
from rigidimeter.planning import ASSUMED, day_difference_sd, pairs_needed

_MIN_DEGREES = 2
"""With fewer degrees of freedom within days the scatter of epochs is the assumed one."""

_FEW_DF = 3.0
"""With fewer degrees of freedom the SD of days is hardly known."""


class Needed(NamedTuple):
    """How many would decide: days with both conditions, subjects, recordings or values of each."""

    number: int
    unit: str


def needed(test: Test, size: float, level: float) -> Needed | None:
    """Return what would show a difference with a chance of 80 %; None where that is not known.

    Parameters
    ----------
    test : Test
    size : float
        The difference, in the unit of the measure.
    level : float
        Of the test.
    """
    c, unit = test.comparison, "day"
    if test.by is not None and not math.isnan(test.p):
        unit = test.by.unit
    few = test.by is not None and unit != "subject" and test.by.df < _FEW_DF
    if math.isnan(test.p) or few:
        sd = _assumed_sd(c)
        if sd is None and not math.isnan(test.p):
            sd = _tested_sd(test)
    elif test.by is None:
        sd, unit = math.hypot(*(np.std(c.values[name], ddof=1) for name in c.pair)), "value"
    else:
        sd = _tested_sd(test)
    number = None if sd is None or not size > 0 else pairs_needed(size, sd, alpha=level)
    if number is None or number <= _count(test):
        return None
    return Needed(number, unit)


def _count(test: Test) -> float:
    """Return the number of units in each condition, their harmonic mean; 0 without a test."""
    c, by = test.comparison, test.by
    if math.isnan(test.p):
        return 0.0
    counts = [len(c.values[name]) for name in c.pair]
    if by is not None:
        counts = [
            len({subject for subject, _ in own} if by.unit == "subject" else own) or days
            for own, days in zip(by.weights, (by.n_days_x, by.n_days_y), strict=True)
        ]
    return 2 / sum(1 / count for count in counts)


def _tested_sd(test: Test) -> float:
    """Return the SD of the difference of one unit with both conditions."""
    assert test.by is not None
    return test.by.se * math.sqrt(_count(test))


def _assumed_sd(c: Comparison) -> float | None:
    """Return the SD of the difference of one day, of J, B and K, with as many epochs as there are.

    None for other measures, and where a condition has no epoch.
    """
    title = {parameter.name: parameter.title for parameter in PARAMETERS}.get(c.measure.name)
    each = [c.of(name) for name in c.pair]
    if title is None or c.measure.origin != "fits" or not all(each):
        return None
    values = [math.fsum(o.value for o in own) / len(own) for own in each]
    days = [len({(o.subject, o.day, o.source) for o in own}) for own in each]
    epochs = [max(round(len(own) / n), 1) for own, n in zip(each, days, strict=True)]
    scatter = ASSUMED[title]
    if min(values) <= 0:
        return None
    within = [_within_days(own) for own in each]
    if all(degrees >= _MIN_DEGREES for _, degrees in within):
        percents = (100.0 * sd / value for (sd, _), value in zip(within, values, strict=True))
        scatter = replace(scatter, between_epochs_percent=max(percents))
    return day_difference_sd(scatter, (values[0], values[1]), (0.0, 0.0), (epochs[0], epochs[1]))


def _within_days(observations: Sequence[Observation]) -> tuple[float, int]:
    """Return the SD of epochs about the mean of their day, and its degrees of freedom."""
    days: dict[tuple[str, str, str], list[float]] = {}
    for o in observations:
        days.setdefault((o.subject, o.day, o.source), []).append(o.value)
    degrees = sum(len(own) - 1 for own in days.values())
    squares = math.fsum(float(np.var(own)) * len(own) for own in days.values())
    return (math.sqrt(squares / degrees) if degrees else math.nan), degrees
