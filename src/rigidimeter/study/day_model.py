"""Days of a study: the median of each in every measure, and tests in which days count."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rigidimeter.records import Fit, Score
from rigidimeter.statistics import day_difference, summarise
from rigidimeter.study.comparison import FEWEST_FOR_TEST, Comparison, Measure
from rigidimeter.study.results import DayMedian, DayTest, SessionEntry

__all__ = ["Valued", "day_medians_of", "day_test", "valued"]


@dataclass(frozen=True)
class Valued:
    """One included value of a measure: in what condition, of whom, on what day."""

    value: float
    condition: str
    subject: str
    day: str

    @property
    def unit(self) -> str:
        """The day within its subject: what is sampled."""
        return f"{self.subject}/{self.day}"


def valued(
    measure: str, results: Sequence[Fit | Score], sessions: Mapping[str, SessionEntry]
) -> list[Valued]:
    """Return the included values of one measure; `sessions` are by source."""
    return [
        Valued(
            float(getattr(result, measure)),
            result.condition,
            sessions[result.source].subject,
            sessions[result.source].day,
        )
        for result in results
        if result.outcome.included
    ]


def day_medians_of(measure: Measure, values: Sequence[Valued]) -> list[DayMedian]:
    """Return median and quartiles of every day of every subject and condition."""
    found = []
    for key in dict.fromkeys((v.subject, v.day, v.condition) for v in values):
        s = summarise([v.value for v in values if (v.subject, v.day, v.condition) == key])
        found.append(DayMedian(measure.name, *key, s.n, s.median, s.q1, s.q3))
    return found


def day_test(
    comparison: Comparison,
    values: Sequence[Valued],
    confidence: float = 0.95,
    *,
    one_offset: bool = False,
) -> DayTest:
    """Compare the two conditions of a comparison by days.

    With `one_offset` a day is taken to move both its conditions alike.
    """
    sides = [
        [v for v in values if v.condition == name]
        for name in (comparison.reference, comparison.other)
    ]
    days = [len({v.unit for v in side}) for side in sides]
    remark = ""
    numbers = (math.nan,) * 7
    offsets: tuple[str, ...] = ()
    if min(map(len, sides)) < FEWEST_FOR_TEST:
        remark = comparison.remark
    else:
        (x, y) = sides
        try:
            d = day_difference(
                [v.value for v in x],
                [v.value for v in y],
                [v.day for v in x],
                [v.day for v in y],
                x_subjects=[v.subject for v in x],
                y_subjects=[v.subject for v in y],
                one_offset=one_offset,
                confidence=confidence,
            )
        except (ValueError, ArithmeticError) as error:
            remark = str(error)
        else:
            offsets = d.offsets
            numbers = (d.estimate, d.low, d.high, d.p, d.df, d.p_days, d.day_share)
    estimate, low, high, p, df, p_days, day_share = numbers
    return DayTest(
        measure=comparison.measure,
        title=comparison.title,
        unit=comparison.unit,
        reference=comparison.reference,
        other=comparison.other,
        estimate=estimate,
        low=low,
        high=high,
        p=p,
        df=df,
        days_reference=days[0],
        days_other=days[1],
        p_days=p_days,
        day_share=day_share,
        confidence=confidence,
        offsets=offsets,
        remark=remark,
    )
