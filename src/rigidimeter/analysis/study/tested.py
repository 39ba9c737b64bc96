"""The test of one measure on which its verdict rests.

What is tested is, in this order,

- days: the test by days of a study folder;
- recordings: the same test with each recording in the place of a day, where days are not known:
  what differs between two recordings need not be their condition;
- values: the rank-sum test of the values of a table, which are taken as independent.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import scipy

from rigidimeter.analysis.statistics import DayDifference, ranksum, summarise
from rigidimeter.analysis.study.compared import Comparison
from rigidimeter.analysis.study.comparison import day_test, rank_test
from rigidimeter.analysis.study.differences import Difference, by_units, by_values
from rigidimeter.analysis.study.measures import Observation
from rigidimeter.core.words import p_text

LEVEL = 0.05

Basis = Literal["days", "recordings", "values"]


@dataclass(frozen=True)
class Test:
    """A test of one measure.

    Attributes
    ----------
    comparison : Comparison
    difference : Difference
        With an interval and p of NaN where there is no test, for the reason in `remark`.
    sign : float
        That of other − reference.
    remark : str
    words : str
        The test, such as ``paired t-test of 5 days``.
    by : DayDifference or None
        Of days, subjects, or recordings in their place.
    """

    comparison: Comparison
    difference: Difference
    sign: float = 0.0
    remark: str = ""
    words: str = ""
    by: DayDifference | None = None

    @property
    def p(self) -> float:
        """Of this measure alone."""
        return self.difference.p

    @property
    def found(self) -> bool:
        """Whether there is a difference at the level, of this measure alone."""
        return self.p < LEVEL

    def agrees(self, other: Test) -> bool:
        """Whether this test finds a difference of the sign of another."""
        return self.found and self.sign * other.sign > 0

    def stands_against(self, bias: float) -> bool:
        """Whether the interval would exclude zero if the difference were smaller by a bias."""
        d = self.difference
        return abs(d.estimate) - bias > (d.high - d.low) / 2.0

    def half_width(self, level: float) -> float:
        """Return half the interval whose ends a test at a level tells from the estimate.

        A difference of this size is found in one study of two. NaN without a test, infinite where
        so few values cannot reach the level.
        """
        if math.isnan(self.p):
            return math.nan
        if self.by is not None:
            return float(scipy.stats.t.isf(level / 2, self.by.df)) * self.by.se
        return _half_of_shift(*(self.comparison.values[n] for n in self.comparison.pair), level)

    @property
    def said(self) -> str:
        """p, or why there is none."""
        return self.remark if math.isnan(self.p) else p_text(self.p)


def basis_of(compared: Sequence[Comparison]) -> Basis:
    """Return what the verdicts on these measures rest on."""
    if any(c.days is not None for c in compared):
        return "days"
    return "values" if all(c.measure.origin == "column" for c in compared) else "recordings"


def tested(c: Comparison, basis: Basis) -> Test:
    """Return the test of a comparison."""
    if basis == "values":
        if c.test is None:
            return Test(c, by_values(c), remark=c.remark)
        counts = " and ".join(f"{c.summaries[name].n} values of {name}" for name in c.pair)
        return Test(c, by_values(c), -c.test.z, words=f"rank-sum test of {counts}")
    if basis == "recordings":
        by_source = replace(c, observations=tuple(replace(o, day=o.source) for o in c.observations))
        return by_days(by_source, day_test(by_source, "recording"))
    return by_days(c, c.days) if c.days is not None else Test(c, by_units(c, None), remark=c.remark)


def by_days(c: Comparison, found: DayDifference) -> Test:
    """Return a test by days as the test of a comparison."""
    return Test(c, by_units(c, found), -found.estimate, found.remark, found.test, found)


@functools.lru_cache(maxsize=64)
def _half_of_shift(x: tuple[float, ...], y: tuple[float, ...], level: float) -> float:
    test = ranksum(x, y, confidence=1 - level)
    return (test.shift_high - test.shift_low) / 2 if test.shift_bounded else math.inf


def by_groups(c: Comparison, basis: Basis) -> dict[str, Test]:
    """Return the test within each group of subjects; nothing where there are not two."""
    return {
        group: tested_again(c, [o for o in c.observations if o.group == group], basis)
        for group in c.groups
    }


def tested_again(c: Comparison, observations: Sequence[Observation], basis: Basis) -> Test:
    """Return the test of a comparison with other observations."""
    values = {name: [o.value for o in observations if o.condition == name] for name in c.summaries}
    summaries = {name: summarise(own) for name, own in values.items()}
    again = replace(c, observations=tuple(observations), summaries=summaries)
    if basis == "days":
        again = replace(again, days=day_test(rank_test(again)))
    return tested(rank_test(again), basis)
