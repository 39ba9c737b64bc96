"""One measure in two conditions, and how it stands in tables and documents."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from rigidimeter.analysis.statistics import DayDifference, Effects, RankSum, Summary
from rigidimeter.analysis.study.measures import Measure, Observation

TEST = "Wilcoxon rank-sum, two-sided, asymptotic, tie and continuity corrected"

_TESTED = tuple(field.name for field in fields(RankSum))
_SIZES = ("r_low", "r_high", "rank_biserial", "rank_biserial_low", "rank_biserial_high")
_SUMMARY = ("median", "q1", "q3", "sd_percent")


@dataclass(frozen=True)
class DayMedian:
    """The included values of one measure on one day of one subject, in one condition."""

    subject: str
    day: str
    condition: str
    n: int
    median: float
    q1: float
    q3: float


@dataclass(frozen=True)
class Comparison:
    """One measure in every condition, and what sets two of them apart.

    Attributes
    ----------
    measure : Measure
    reference, other : str
        The two conditions that are compared; differences are reference − other. `other` is empty
        where there is only one.
    observations : tuple of Observation
        The included values of all conditions, in the order of recording.
    summaries : mapping of str to Summary
        By condition; the compared ones first.
    excluded : mapping of str to int
        How many epochs of each condition have no included value.
    pooled : mapping of str to Observation
        The estimate from all epochs of a condition together, where there is one.
    test : RankSum or None
        None when a condition has too few values, for the reason in `remark`.
    p_holm : float
        p of `test`, adjusted by Holm's method for all measures that were tested.
    effects : Effects or None
        Effect sizes with bootstrap intervals.
    days : DayDifference or None
        The test in which days count, not epochs; None where days are not known.
    days_p_holm : float
        p of `days`, adjusted in its family (`families`).
    day_medians : tuple of DayMedian
    """

    measure: Measure
    reference: str
    other: str
    observations: tuple[Observation, ...]
    summaries: Mapping[str, Summary]
    excluded: Mapping[str, int]
    pooled: Mapping[str, Observation] = field(default_factory=dict)
    test: RankSum | None = None
    remark: str = ""
    p_holm: float = math.nan
    effects: Effects | None = None
    days: DayDifference | None = None
    days_p_holm: float = math.nan
    day_medians: tuple[DayMedian, ...] = ()

    @property
    def pair(self) -> tuple[str, ...]:
        """The conditions that are compared: two, or the only one."""
        return (self.reference, self.other) if self.other else (self.reference,)

    @property
    def paired(self) -> bool:
        """Whether there are two conditions to compare."""
        return bool(self.other)

    @property
    def values(self) -> dict[str, tuple[float, ...]]:
        """The included values by condition, in the order of recording."""
        return {name: tuple(o.value for o in self.of(name)) for name in self.summaries}

    @property
    def groups(self) -> tuple[str, ...]:
        """The groups of subjects of the compared values; none where they are the conditions."""
        own = [o for o in self.observations if o.condition in self.pair and o.group]
        if all(o.group == o.condition for o in own):
            return ()
        found = tuple(dict.fromkeys(o.group for o in own))
        return found if len(found) > 1 else ()

    def of(self, condition: str) -> tuple[Observation, ...]:
        """Return the observations of one condition."""
        return tuple(each for each in self.observations if each.condition == condition)


def comparison_values(c: Comparison) -> dict[str, Any]:
    """Return one comparison; the keys of its test are flat, those by days are under `days`."""
    return {
        **_names(c),
        "groups": {
            name: asdict(c.summaries[name]) | {"excluded": c.excluded[name]} for name in c.pair
        },
        "test": TEST,
        **_tested(c),
        "remark": c.remark,
        "days": None if c.days is None else _days(c),
    }


def measure_names(measure: Measure) -> dict[str, str]:
    """Return how tables and documents name a measure."""
    return {"measure": measure.name, "title": measure.title, "unit": measure.unit}


def _names(c: Comparison) -> dict[str, str]:
    return measure_names(c.measure) | {"reference": c.reference, "other": c.other}


def _tested(c: Comparison) -> dict[str, Any]:
    return {
        **{name: getattr(c.test, name, None) for name in _TESTED},
        "p_holm": c.p_holm,
        **{name: getattr(c.effects, name, None) for name in _SIZES},
        "interval_method": getattr(c.effects, "method", None),
    }


def _days(c: Comparison) -> dict[str, Any]:
    row: dict[str, Any] = asdict(c.days) if c.days is not None else {}
    row.pop("weights", None)
    row["days_reference"], row["days_other"] = row.pop("n_days_x"), row.pop("n_days_y")
    row["days_both"] = row.pop("n_days_both")
    row["mean_reference"], row["mean_other"] = row.pop("mean_x"), row.pop("mean_y")
    return row | {"p_holm": c.days_p_holm}


def comparison_rows(comparisons: Iterable[Comparison]) -> list[dict[str, Any]]:
    """Return the comparisons as a table, one row for each measure."""
    rows = []
    for c in comparisons:
        row: dict[str, Any] = dict(_names(c))
        for side, name in zip(("reference", "other"), (c.reference, c.other), strict=True):
            known = name in c.pair
            numbers = asdict(c.summaries[name]) if known else dict.fromkeys(("n", *_SUMMARY))
            row[f"n_{side}"] = numbers["n"]
            row[f"excluded_{side}"] = c.excluded[name] if known else None
            row |= {f"{key}_{side}": numbers[key] for key in _SUMMARY}
        row |= _tested(c) | {"remark": c.remark}
        if c.days is not None:
            days = _days(c)
            days["offsets"] = " + ".join(days["offsets"])
            row |= {
                name if name.startswith("days_") else f"days_{name}": value
                for name, value in days.items()
            }
        rows.append(row)
    return rows
