"""The two values of a measure, and their difference as the test that counts has it.

    per cent = 100 · difference / value in the reference

The value in the reference is taken as known, so that an interval in per cent excludes zero where
the one in units does. It does not hold the uncertainty of that value.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

from rigidimeter.analysis.statistics import DayDifference
from rigidimeter.analysis.study.compared import Comparison
from rigidimeter.analysis.study.measures import Observation
from rigidimeter.analysis.study.results import Condition


@dataclass(frozen=True)
class Difference:
    """Two conditions in one measure, in its unit; differences are reference − other.

    Attributes
    ----------
    centre : str
        What `reference` and `other` are: ``mean`` (of days, or of recordings) or ``median``.
    reference, other : float
    estimate, low, high, p : float
        Of the test, with its 95 % interval; an interval and p of NaN where there is no test.
    ratio : bool
        Whether a per cent has a meaning: not for scores of a scale, nor if the reference is not
        positive.
    """

    centre: Literal["mean", "median"]
    reference: float
    other: float
    estimate: float
    low: float = math.nan
    high: float = math.nan
    p: float = math.nan
    ratio: bool = True

    @property
    def percent(self) -> tuple[float, float, float]:
        """Difference and interval in per cent of the reference; NaN where it has no meaning."""
        scale = 100 / self.reference if self.ratio and self.reference > 0 else math.nan
        return self.estimate * scale, self.low * scale, self.high * scale

    @property
    def side(self) -> Literal["lower", "higher", "the same"]:
        """How the other condition compares with the reference."""
        if not self.estimate:
            return "the same"
        return "lower" if self.estimate > 0 else "higher"

    def row(self) -> dict[str, Any]:
        """Return all numbers as documents and tables have them."""
        percent, low, high = self.percent
        return {
            "centre": self.centre,
            "value_reference": self.reference,
            "value_other": self.other,
            "estimate": self.estimate,
            "low": self.low,
            "high": self.high,
            "percent": percent,
            "percent_low": low,
            "percent_high": high,
            "p": self.p,
        }


def by_units(c: Comparison, found: DayDifference | None) -> Difference:
    """Return the difference that a test by days found, or by recordings in their place.

    Without a test it is that of the means over days, or recordings, and has no interval.
    """
    ratio = c.measure.origin != "ratings"
    if found is None or math.isnan(found.p):
        first, second = (_mean_of_units(c.of(name)) for name in c.pair)
        return Difference("mean", first, second, first - second, ratio=ratio)
    return Difference(
        "mean",
        found.mean_x,
        found.mean_y,
        found.estimate,
        found.low,
        found.high,
        found.p,
        ratio,
    )


def by_values(c: Comparison) -> Difference:
    """Return the medians of a table's values, and the shift of the rank-sum test."""
    first, second = (c.summaries[name].median for name in c.pair)
    if c.test is None:
        return Difference("median", first, second, first - second)
    t = c.test
    return Difference("median", first, second, t.shift, t.shift_low, t.shift_high, t.p)


def simulated_difference(c: Comparison, conditions: Iterable[Condition]) -> Difference | None:
    """Return the medians that a virtual study simulated; None where none was simulated."""
    known = {one.name: one.simulated.get(c.measure.name) for one in conditions}
    first, second = (known.get(name) for name in c.pair)
    if first is None or second is None:
        return None
    return Difference("median", first, second, first - second, ratio=c.measure.origin != "ratings")


def _mean_of_units(observations: Iterable[Observation]) -> float:
    units: dict[tuple[str, str], list[float]] = {}
    for o in observations:
        units.setdefault((o.subject, o.day), []).append(o.value)
    means = [math.fsum(values) / len(values) for values in units.values()]
    return math.fsum(means) / len(means) if means else math.nan
