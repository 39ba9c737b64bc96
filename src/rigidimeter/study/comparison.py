"""Two conditions side by side, in every measure of an analysis."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from rigidimeter.records import Analysis, Fit, Score
from rigidimeter.statistics import RankSum, Summary, ranksum, summarise

__all__ = ["MEASURES", "Comparison", "Measure", "compare", "compare_results", "conditions"]

FEWEST_FOR_TEST = 3
"""Below this many values in a condition there is no rank-sum test."""


class Measure(NamedTuple):
    """What is compared: stored name, name for people, unit, and where an analysis holds it."""

    name: str
    title: str
    unit: str
    results: Callable[[Analysis], Sequence[Fit | Score]]


MEASURES = (
    Measure("inertia_kg_m2", "Inertia J", "kg·m²", lambda found: found.fits),
    Measure("damping_nm_s_rad", "Viscous damping B", "N·m·s/rad", lambda f: f.fixed_inertia),
    Measure("stiffness_nm_rad", "Stiffness K", "N·m/rad", lambda f: f.fixed_inertia),
    Measure("impulse_nm_s", "Angular impulse", "N·m·s", lambda found: found.scores),
    Measure("work_j", "Work", "J", lambda found: found.scores),
)
"""Inertia is from the first stage; damping and stiffness are from the second, at fixed inertia."""


@dataclass(frozen=True)
class Comparison:
    """One measure in two conditions.

    Attributes
    ----------
    measure : str
        Stored name with unit, for example ``damping_nm_s_rad``.
    title : str
        Name for people, for example ``Viscous damping B``.
    unit : str
        For axes and tables, for example ``N·m·s/rad``.
    reference, other : str
        The two conditions; differences are reference − other.
    values : mapping of str to tuple of float
        The included values by condition, in the order of recording.
    summaries : mapping of str to Summary
        By condition.
    excluded : mapping of str to int
        How many epochs of each condition have no included value.
    test : RankSum or None
        None when a condition has too few values, for the reason in `remark`.
    remark : str
        Why there is no test, else empty.
    """

    measure: str
    title: str
    unit: str
    reference: str
    other: str
    values: Mapping[str, tuple[float, ...]]
    summaries: Mapping[str, Summary]
    excluded: Mapping[str, int]
    test: RankSum | None
    remark: str = ""

    @property
    def paired(self) -> bool:
        """Whether there are two conditions; with one, `other` means nothing."""
        return len(self.summaries) == 2


def conditions(analysis: Analysis) -> tuple[str, ...]:
    """Return the named conditions in order of appearance, ``OFF`` first where it occurs."""
    results: list[Fit | Score] = [*analysis.fits, *analysis.scores]
    seen = dict.fromkeys(result.condition for result in results if result.condition)
    return tuple(sorted(seen, key=lambda condition: condition != "OFF"))


def compare(
    analysis: Analysis, reference: str | None = None, other: str | None = None
) -> tuple[Comparison, ...]:
    """Compare two conditions in J, B, K, impulse and work; B and K with the inertia held.

    Without names, the first two conditions that `conditions` gives. An analysis with one condition
    gives its summaries and no test.
    """
    names = conditions(analysis) or ("",)
    first = reference if reference is not None else names[0]
    rest = [name for name in names if name != first]
    second = other if other is not None else (rest[0] if rest else "")
    return tuple(
        compare_results(measure, results, first, second)
        for measure in MEASURES
        if (results := measure.results(analysis))
    )


def compare_results(
    measure: Measure,
    results: Sequence[Fit | Score],
    reference: str,
    other: str,
) -> Comparison:
    """Compare two conditions in one measure; an empty `other` gives summaries alone."""
    groups = [reference, other] if other else [reference]
    values = {
        name: tuple(
            float(getattr(result, measure.name))
            for result in results
            if result.condition == name and result.outcome.included
        )
        for name in groups
    }
    excluded = {
        name: sum(r.condition == name and not r.outcome.included for r in results)
        for name in groups
    }
    test, remark = None, ""
    if not other:
        remark = "only one condition was recorded"
    elif min(len(values[name]) for name in groups) < FEWEST_FOR_TEST:
        counts = " and ".join(f"{len(values[name])} in {name}" for name in groups)
        remark = f"a test needs {FEWEST_FOR_TEST} epochs in each condition; there are {counts}"
    else:
        test = ranksum(values[reference], values[other])
    summaries = {name: summarise(values[name]) for name in groups}
    return Comparison(
        measure.name,
        measure.title,
        measure.unit,
        reference,
        other,
        values,
        summaries,
        excluded,
        test,
        remark,
    )
