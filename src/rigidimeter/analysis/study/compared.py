"""A row of a comparison: one measure in two conditions, tested in one way, and what is concluded.

    difference = other − reference          per cent = 100 · difference / reference

Both values are means with the weights of the test (days, subjects, recordings), or medians (values
of a table). A test that cannot be made is a row too, with NaN for its numbers and the reason in
`remark`. In per cent the value in the reference is taken as known, so that an interval excludes
zero where the one in units does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from rigidimeter.analysis.statistics import DayDifference, RankSum
from rigidimeter.analysis.study.measures import LEVEL, RATING, Family, Measure, Role
from rigidimeter.core.findings import Finding
from rigidimeter.core.words import clear_of_zero, decimals, fixed, p_text, within

By = Literal["days", "recordings", "blocks", "values"]
Verdict = Literal["lower", "higher", "no difference shown", "not supported", "cannot be decided"]
Three = tuple[float, float, float]
"""A difference and the ends of its interval."""
Weights = Mapping[tuple[str, str], float]
"""Of the mean of each day in a condition, by subject and day."""


class Signed(NamedTuple):
    """A difference in words with its sign, and the ends of its interval; `ends` may be empty."""

    value: str
    ends: str


class Needed(NamedTuple):
    """How many would decide: days with both conditions, subjects, recordings or values of each."""

    number: int
    unit: str


@dataclass(frozen=True)
class Compared:
    """One measure in two conditions.

    Attributes
    ----------
    measure : Measure
    reference, other : str
        `other` is empty where there is one condition.
    by : str
        What counts as one: a day, a recording in its place, a block, or each value.
    n : (int, int)
        Values in each condition.
    test : str
        In words, such as ``paired t-test of 5 days``; empty without one.
    unit : str
        What the test compared: ``day``, ``subject``, ``recording``, ``block`` or ``value``.
    units : (int, int)
        How many of them in each condition.
    value_reference, value_other, difference : float
        In the unit of the measure.
    se, df, low, high, p : float
        Of the difference, with the 95 % interval of the test.
    sign : float
        That of the difference, as the test sees it.
    measured_half : float
        Half the 95 % interval of the measurement alone; NaN of measures without one.
    ratio : bool
        Whether per cent has a meaning: not for scores of a scale, nor values of a table some of
        which are negative.
    weights : (mapping, mapping)
        Of the days in both means.
    remark : str
        Why there is no test.
    statistic : RankSum, DayDifference or None
        Everything that the test gave; its signs are reference − other.
    p_adjusted : float
        p in its family.
    family : Family
    half_width : float
        Half the interval at the level of the first test of the family: the smallest difference that
        is shown in one study of two. NaN without a test, infinite where no p can reach the level.
    wanted_percent : float
        The smallest difference worth finding, of the reference.
    verdict : str
        ``lower``, ``higher``, ``no difference shown`` (of the size that is worth finding), ``not
        supported`` (one was found and something else may have made it), ``cannot be decided``;
        empty before it is concluded.
    finding : Finding or None
        The reason; None where the test is the only reason.
    caution : Finding or None
        What is to be known beside the verdict: that the inertia differs.
    needed : Needed or None
        What would decide, where it cannot be decided.
    simulated : (float, float) or None
        The medians that a virtual study simulated.
    """

    measure: Measure
    reference: str
    other: str
    by: By
    n: tuple[int, int]
    test: str = ""
    unit: str = "day"
    units: tuple[int, int] = (0, 0)
    value_reference: float = math.nan
    value_other: float = math.nan
    difference: float = math.nan
    se: float = math.nan
    df: float = math.nan
    low: float = math.nan
    high: float = math.nan
    p: float = math.nan
    sign: float = 0.0
    measured_half: float = math.nan
    ratio: bool = True
    weights: tuple[Weights, Weights] = field(default=({}, {}), repr=False)
    remark: str = ""
    statistic: RankSum | DayDifference | None = field(default=None, repr=False)
    p_adjusted: float = math.nan
    family: Family = field(default_factory=Family)
    half_width: float = math.nan
    wanted_percent: float = math.nan
    verdict: Verdict | Literal[""] = ""
    finding: Finding | None = None
    caution: Finding | None = None
    needed: Needed | None = None
    simulated: tuple[float, float] | None = None

    @property
    def pair(self) -> tuple[str, str]:
        """Reference and other."""
        return self.reference, self.other

    @property
    def tested(self) -> bool:
        """Whether there is a test."""
        return not math.isnan(self.p)

    @property
    def found(self) -> bool:
        """Whether there is a difference at the level, of this measure alone."""
        return self.p < LEVEL

    def agrees(self, other: Compared) -> bool:
        """Whether this test finds a difference of the sign of another."""
        return self.found and self.sign * other.sign > 0

    @property
    def p_words(self) -> str:
        """p, or why there is none."""
        return p_text(self.p) if self.tested else self.remark

    @property
    def role(self) -> Role:
        """Whether the measure is primary, secondary, or the check of the instrument."""
        return self.family.role

    @property
    def reason(self) -> str:
        """The headline of the finding as a clause; empty without one."""
        return "" if self.finding is None else within(self.finding.headline)

    @property
    def of_test(self) -> Three:
        """The difference with the interval of the test."""
        return self.difference, self.low, self.high

    @property
    def of_measurement(self) -> Three:
        """The difference with the interval of the measurement alone."""
        d, half = self.difference, self.measured_half
        return d, d - half, d + half

    def percent(self, sizes: Three) -> Three:
        """Return a difference and its interval in % of the reference; NaN if without a meaning."""
        positive = self.ratio and self.value_reference > 0
        scale = 100 / self.value_reference if positive else math.nan
        estimate, low, high = sizes
        return estimate * scale, low * scale, high * scale

    @property
    def share(self) -> float:
        """The difference as a share of the larger value."""
        return abs(self.difference) / max(abs(self.value_reference), abs(self.value_other))

    @property
    def simulated_difference(self) -> tuple[float, float]:
        """The difference that was simulated, and in % of the reference; NaN without a meaning."""
        first, second = self.simulated or (math.nan, math.nan)
        known = first > 0 and self.measure != RATING
        return second - first, 100 / first * (second - first) if known else math.nan

    def numbers(self) -> dict[str, Any]:
        """Return the values and the difference as documents and tables have them."""
        found: dict[str, Any] = {
            "centre": "median" if self.by == "values" else "mean",
            "value_reference": self.value_reference,
            "value_other": self.value_other,
        }
        for name, sizes in (("difference", self.of_test), ("measured", self.of_measurement)):
            for key, three in ((name, sizes), (f"{name}_percent", self.percent(sizes))):
                found |= {key: three[0], f"{key}_low": three[1], f"{key}_high": three[2]}
        del found["measured"], found["measured_percent"]  # the difference is that of the test
        return found | {"p": self.p}


def signed(percent: Three, own: Three, unit: str = "", two_below: float = 5.0) -> Signed:
    """Return a difference and its interval in words: in per cent where that has a meaning.

    Parameters
    ----------
    percent, own : (float, float, float)
        In % and in the unit.
    unit : str
    two_below : float
        A half interval below this is given with two digits.

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
