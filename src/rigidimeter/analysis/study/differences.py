"""The two values of a measure, and their difference: as it was measured, and as it was tested.

    difference = other − reference          per cent = 100 · difference / reference

Both values are means with the weights of the test: value = Σ w_e x_e over epochs, Σ w_e = 1. What
was measured holds for these recordings alone. With half the 95 % interval h_e of each epoch,

    half the interval of the difference = √(Σ w_e² h_e²) over the epochs of both conditions

and never less than what the instrument is accurate to. The test adds what differs between days, or
subjects. In per cent the value in the reference is taken as known, so that an interval excludes
zero where the one in units does.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from rigidimeter.analysis.statistics import DayDifference
from rigidimeter.analysis.study.compared import Comparison
from rigidimeter.analysis.study.measures import Observation
from rigidimeter.analysis.study.results import Condition
from rigidimeter.core.words import clear_of_zero, decimals, fixed

ACCURACY = 0.001
"""As a share: the mean error of J, B and K of relaxed epochs is below it (accuracy.md)."""

Three = tuple[float, float, float]


class Signed(NamedTuple):
    """A difference in words with its sign, and the ends of its interval; `ends` may be empty."""

    value: str
    ends: str


@dataclass(frozen=True)
class Difference:
    """Two conditions in one measure, in its unit; differences are other − reference.

    Attributes
    ----------
    centre : str
        What `reference` and `other` are: ``mean`` (of days, or of recordings) or ``median``.
    reference, other : float
    estimate, low, high, p : float
        Of the test, with its 95 % interval; an interval and p of NaN where there is no test.
    measured_half : float
        Half the 95 % interval of the measurement alone; NaN of measures without one.
    ratio : bool
        Whether a per cent has a meaning: not for scores of a scale, values of a table some of
        which are negative, nor if the reference is not positive.
    """

    centre: Literal["mean", "median"]
    reference: float
    other: float
    estimate: float
    low: float = math.nan
    high: float = math.nan
    p: float = math.nan
    measured_half: float = math.nan
    ratio: bool = True

    @property
    def tested(self) -> Three:
        """Estimate and interval of the test."""
        return self.estimate, self.low, self.high

    @property
    def measured(self) -> Three:
        """Estimate and interval of the measurement."""
        half = self.measured_half
        return self.estimate, self.estimate - half, self.estimate + half

    def in_percent(self, sizes: Three) -> Three:
        """Return a difference and its interval in % of the reference; NaN if without a meaning."""
        scale = 100 / self.reference if self.ratio and self.reference > 0 else math.nan
        estimate, low, high = sizes
        return estimate * scale, low * scale, high * scale

    @property
    def percent(self) -> Three:
        """Estimate and interval of the test in % of the reference; NaN if without a meaning."""
        return self.in_percent(self.tested)

    @property
    def measured_percent(self) -> Three:
        """Estimate and interval of the measurement in % of the reference."""
        return self.in_percent(self.measured)

    def row(self) -> dict[str, Any]:
        """Return all numbers as documents and tables have them."""
        ends = ("", "_low", "_high")
        return {
            "centre": self.centre,
            "value_reference": self.reference,
            "value_other": self.other,
            **dict(zip((f"difference{end}" for end in ends), self.tested, strict=True)),
            **dict(zip((f"difference_percent{end}" for end in ends), self.percent, strict=True)),
            **dict(zip(("measured_low", "measured_high"), self.measured[1:], strict=True)),
            **dict(
                zip(
                    ("measured_percent_low", "measured_percent_high"),
                    self.measured_percent[1:],
                    strict=True,
                )
            ),
            "p": self.p,
        }


def signed(percent: Three, own: Three, unit: str = "", two_below: float = 5.0) -> Signed:
    """Return a difference and its interval in words: in per cent where that has a meaning.

    Examples
    --------
    >>> signed((-18.2, -29.0, -7.4), (-0.3, -0.5, -0.1), "N·m/rad")
    Signed(value='−18 %', ends='−29 to −7 %')
    """
    known = not math.isnan(percent[0])
    estimate, low, high = percent if known else own
    if math.isnan(estimate):
        return Signed("–", "")
    after = " %" if known else f" {unit}".rstrip()
    digits = clear_of_zero(decimals((high - low) / 2, estimate, two_below), low, high)
    value, *ends = (fixed(size, digits, sign=True) for size in (estimate, low, high))
    return Signed(f"{value}{after}", "" if math.isnan(low) else f"{' to '.join(ends)}{after}")


def by_units(c: Comparison, found: DayDifference | None) -> Difference:
    """Return the difference of a test by days, or by recordings in their place.

    Without a test it is that of the means over days, or recordings, and has no interval of a test.
    """
    ratio = is_ratio(c)
    if found is None or math.isnan(found.p):
        of_days = [_alike(c.of(name)) for name in c.pair]
        first, second = (_mean(c.of(name), own) for name, own in zip(c.pair, of_days, strict=True))
        half = _measured_half(c, of_days)
        return Difference("mean", first, second, second - first, measured_half=half, ratio=ratio)
    return Difference(
        "mean",
        found.mean_x,
        found.mean_y,
        -found.estimate,
        -found.high,
        -found.low,
        found.p,
        _measured_half(c, found.weights),
        ratio,
    )


def by_values(c: Comparison) -> Difference:
    """Return the medians of a table's values, and the shift of the rank-sum test."""
    first, second = (c.summaries[name].median for name in c.pair)
    ratio = is_ratio(c)
    if c.test is None:
        return Difference("median", first, second, second - first, ratio=ratio)
    t = c.test
    # All differences of too few values are no interval of this confidence.
    low, high = (-t.shift_high, -t.shift_low) if t.shift_bounded else (math.nan, math.nan)
    return Difference("median", first, second, -t.shift, low, high, t.p, ratio=ratio)


def is_ratio(c: Comparison) -> bool:
    """Whether differences of a measure have a meaning in per cent."""
    if c.measure.origin == "column":
        return all(o.value >= 0 for o in c.observations)
    return c.measure.origin != "ratings"


def simulated_difference(c: Comparison, conditions: Iterable[Condition]) -> Difference | None:
    """Return the medians that a virtual study simulated; None where none was simulated."""
    known = {one.name: one.simulated.get(c.measure.name) for one in conditions}
    first, second = (known.get(name) for name in c.pair)
    if first is None or second is None:
        return None
    return Difference("median", first, second, second - first, ratio=c.measure.origin != "ratings")


Weights = Mapping[tuple[str, str], float]


def _alike(observations: Iterable[Observation]) -> Weights:
    """Return the same weight for each day."""
    days = dict.fromkeys((o.subject, o.day) for o in observations)
    return {day: 1 / len(days) for day in days}


def _mean(observations: Iterable[Observation], of_days: Weights) -> float:
    each = list(_weighted(observations, of_days))
    return math.fsum(weight * o.value for weight, o in each) if each else math.nan


def _weighted(
    observations: Iterable[Observation], of_days: Weights
) -> list[tuple[float, Observation]]:
    """Return each epoch with its weight; days that do not count are left out."""
    counting = [o for o in observations if (o.subject, o.day) in of_days]
    counts = Counter((o.subject, o.day) for o in counting)
    return [(of_days[o.subject, o.day] / counts[o.subject, o.day], o) for o in counting]


def _measured_half(c: Comparison, weights: Iterable[Weights]) -> float:
    each = [
        one for name, own in zip(c.pair, weights, strict=True) for one in _weighted(c.of(name), own)
    ]
    if not each or c.measure.origin != "fits":
        return math.nan
    half = math.sqrt(math.fsum((weight * (o.high - o.low) / 2) ** 2 for weight, o in each))
    size = math.fsum(weight * abs(o.value) for weight, o in each) / 2
    return max(half, ACCURACY * size)
