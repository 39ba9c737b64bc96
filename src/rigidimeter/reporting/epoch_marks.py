"""What a drawn point stands for: which epoch it is, and its value, in words."""

from __future__ import annotations

import math
from typing import NamedTuple

from rigidimeter.reporting.numbers import condition_name, interval, number, scaled
from rigidimeter.study import Measure, Observation


class Mark(NamedTuple):
    """An epoch by its source and label, and the words that a page shows at its point."""

    source: str
    epoch: str
    words: str


def mark_of(one: Observation, measure: Measure) -> Mark:
    """Return the mark of a value that counts.

    Examples
    --------
    >>> one = Observation(0.00451, "OFF", day="3", epoch="7", low=0.0044, high=0.0046)
    >>> mark_of(one, Measure("inertia_kg_m2", "Inertia J", "kg·m²", "fits")).words
    'OFF, day 3, epoch 7: Inertia J 4.510 [4.400 to 4.600] 10⁻³ kg·m²'
    """
    factor, unit = scaled(one.value, measure.unit)
    where = [condition_name(one.condition), one.subject]
    where += [
        f"{name} {label}" for name, label in (("day", one.day), ("epoch", one.epoch)) if label
    ]
    value = number(factor * one.value)
    if math.isfinite(one.low) and math.isfinite(one.high):
        value += f" {interval(factor * one.low, factor * one.high)}"
    words = f"{', '.join(filter(None, where))}: {measure.title} {value} {unit}"
    return Mark(one.source, one.epoch, words.strip())
