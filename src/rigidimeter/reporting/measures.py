"""What is compared, condition by condition, and the one sentence that sums it up."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import NamedTuple

from rigidimeter.records import Analysis, Fit, Score
from rigidimeter.reporting.numbers import number, p_and_r
from rigidimeter.statistics import summarise
from rigidimeter.study import MEASURES, Comparison, Study

__all__ = [
    "Estimate",
    "Measure",
    "condition_name",
    "conditions",
    "measures",
    "short_names",
    "split_pooled",
    "verdict",
]


class Estimate(NamedTuple):
    """A number and the ends of its 95 % interval, NaN where it has none."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Measure:
    """One measure, by condition.

    `estimates` are those of the included epochs, `excluded` is how many epochs have none, and
    `pooled` is the estimate from all epochs together, where there is one.
    """

    name: str
    title: str
    unit: str
    estimates: Mapping[str, tuple[Estimate, ...]]
    excluded: Mapping[str, int]
    pooled: Mapping[str, Estimate]

    @property
    def values(self) -> dict[str, tuple[float, ...]]:
        """The included values without their intervals."""
        return {key: tuple(e.value for e in found) for key, found in self.estimates.items()}

    @property
    def label(self) -> str:
        """Title and unit, for axes and headings."""
        return f"{self.title} ({self.unit})"


def condition_name(condition: str) -> str:
    """Return the condition as people read it."""
    return condition or "(no condition)"


def short_names(sources: Iterable[str]) -> dict[str, str]:
    """Return the last parts of each path: as few as tell the sources apart."""
    unique = list(dict.fromkeys(sources))
    parts = {source: PurePath(source).parts for source in unique}
    for depth in range(1, max(map(len, parts.values()), default=1) + 1):
        names = {source: "/".join(parts[source][-depth:]) or source for source in unique}
        if len(set(names.values())) == len(unique):
            return names
    return {source: source for source in unique}


def conditions(study: Study) -> tuple[str, ...]:
    """Return the conditions in one order for the whole report: as compared, then as recorded."""
    compared = [name for c in study.comparisons for name in c.summaries]
    analysis = study.analysis
    results: tuple[Fit | Score, ...] = (*analysis.fits, *analysis.fixed_inertia, *analysis.scores)
    recorded = [item.condition for item in (*study.epochs, *results)]
    return tuple(dict.fromkeys([*compared, *recorded]))


def split_pooled(analysis: Analysis) -> tuple[dict[str, Fit], Fit | None]:
    """Return the fit to all epochs of each condition, and the one to all epochs if there is one.

    The latter has no condition, as recordings without a name for theirs have none: it comes last.
    """
    recorded = {fit.condition for fit in analysis.fits}
    by_condition: dict[str, Fit] = {}
    overall = None
    for fit in analysis.pooled:
        if fit.condition in by_condition or fit.condition not in recorded:
            overall = fit
        else:
            by_condition[fit.condition] = fit
    return by_condition, overall


def _estimate(result: Fit | Score, name: str) -> Estimate:
    value, low, high = (
        float(getattr(result, name + ending, math.nan)) for ending in ("", "_low", "_high")
    )
    return Estimate(value, low, high)


def measures(study: Study) -> tuple[Measure, ...]:
    """Return the five measures, those without any epoch left out."""
    found = []
    by_condition, _ = split_pooled(study.analysis)
    for name, title, unit, results_of in MEASURES:
        results = results_of(study.analysis)
        if not results:
            continue
        present = {result.condition for result in results}
        order = [condition for condition in conditions(study) if condition in present]
        left_out = Counter(result.condition for result in results if not result.outcome.included)
        estimates = {
            condition: tuple(
                _estimate(result, name)
                for result in results
                if result.outcome.included and result.condition == condition
            )
            for condition in order
        }
        excluded = {condition: left_out[condition] for condition in order}
        pooled = {
            condition: _estimate(fit, name)
            for condition, fit in by_condition.items()
            if isinstance(results[0], Fit)
        }
        found.append(Measure(name, title, unit, estimates, excluded, pooled))
    return tuple(found)


def verdict(study: Study) -> str:
    """Return what the study shows, in a line."""
    prefix = "Virtual subject. " if any(epoch.virtual for epoch in study.epochs) else ""
    tested = [comparison for comparison in study.comparisons if comparison.test is not None]
    if tested:
        pairs = dict.fromkeys((c.reference, c.other) for c in tested)
        lines = [
            _pair_verdict(pair, [c for c in tested if (c.reference, c.other) == pair])
            for pair in pairs
        ]
        return prefix + " ".join(lines)
    medians = [
        text for name in conditions(study) if (text := _condition_verdict(name, measures(study)))
    ]
    if medians:
        return f"{prefix}No comparison of conditions. Medians, {'; '.join(medians)}."
    return f"{prefix}No epoch could be included; the reasons are listed under “Exclusions”."


def _pair_verdict(pair: tuple[str, str], comparisons: Sequence[Comparison]) -> str:
    groups: dict[str, list[str]] = {"lower": [], "higher": [], "no difference shown in": []}
    for comparison in comparisons:
        test = comparison.test
        if test is None:
            continue
        shown = test.p < 1 - test.confidence
        direction = "lower" if test.z > 0 else "higher"
        title = comparison.title[:1].lower() + comparison.title[1:]
        groups[direction if shown else "no difference shown in"].append(
            f"{title} ({p_and_r(test.p, test.r)})"
        )
    parts = [f"{heading} {', '.join(items)}" for heading, items in groups.items() if items]
    reference, other = (condition_name(name) for name in pair)
    return f"{other} against {reference}: {'; '.join(parts)}."


def _condition_verdict(condition: str, found: Sequence[Measure]) -> str:
    medians = [
        f"{measure.title} {number(summarise(values).median)} {measure.unit} (n = {len(values)})"
        for measure in found
        if (values := measure.values.get(condition))
    ]
    return f"{condition_name(condition)}: {', '.join(medians)}" if medians else ""
