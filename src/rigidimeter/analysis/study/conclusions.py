"""What a comparison of two conditions shows of each measure, and what it does not.

A difference is shown where p of the test (`tested`), adjusted by Holm's method for the measures, is
below the level, and nothing that is known of the recordings can have made it (`objections`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

from rigidimeter.analysis.statistics import holm
from rigidimeter.analysis.study.compared import Comparison, measure_names
from rigidimeter.analysis.study.differences import Difference, simulated_difference
from rigidimeter.analysis.study.objections import (
    hidden,
    negligible,
    objections,
    too_few,
    without_test,
)
from rigidimeter.analysis.study.results import StudyResult
from rigidimeter.analysis.study.sensitivity import method_caveats
from rigidimeter.analysis.study.tested import LEVEL, Basis, basis_of, tested
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import PARAMETERS, FindingGroup
from rigidimeter.core.words import series, within
from rigidimeter.planning import ASSUMED, day_difference_sd, pairs_needed

Verdict = Literal["lower", "higher", "no difference shown", "not supported", "cannot be decided"]

WANTED = 0.2
"""The difference, as a share of the reference."""

_MIN_EPOCHS = 3
"""With fewer epochs of a condition their scatter is the assumed one."""


@dataclass(frozen=True)
class Conclusion:
    """What is concluded of one measure: the second condition against the first.

    Attributes
    ----------
    comparison : Comparison
    verdict : str
        ``lower``, ``higher``, ``no difference shown``, ``not supported`` (one was found and
        something else may have made it) or ``cannot be decided``.
    p : float
        Of the test, adjusted for the measures; NaN without one.
    finding : Finding or None
        The reason; None where the test is the whole reason.
    difference : Difference
        With both values, and the intervals of the measurement and of the test.
    test : str
        The test in words, such as ``paired t-test of 5 days``; empty without one.
    days_to_decide : int or None
        Where there are too few days: how many would show a difference of 20 %.
    simulated : Difference or None
        What a virtual study simulated.
    """

    comparison: Comparison
    verdict: Verdict
    difference: Difference
    p: float = math.nan
    finding: Finding | None = None
    simulated: Difference | None = None
    test: str = ""
    days_to_decide: int | None = None

    @property
    def reason(self) -> str:
        """The headline of the finding as a clause; empty without one."""
        return "" if self.finding is None else within(self.finding.headline)


@dataclass(frozen=True)
class Conclusions:
    """The conclusions on all measures, what was tested, and how many tests p is adjusted for."""

    basis: Basis
    each: tuple[Conclusion, ...]
    adjusted_for: int = 0

    def of(self, *verdicts: Verdict) -> tuple[Conclusion, ...]:
        """Return those with one of these verdicts."""
        return tuple(one for one in self.each if one.verdict in verdicts)

    @property
    def units(self) -> str:
        """What the tests compared: days, subjects, recordings or values."""
        tests = (one.comparison.days for one in self.each if not math.isnan(one.p))
        units = [f"{test.unit}s" for test in tests if test is not None]
        return " and ".join(dict.fromkeys(units)) if self.basis == "days" and units else self.basis

    @property
    def tested(self) -> int:
        """The number of measures that were tested."""
        return sum(not math.isnan(one.p) for one in self.each)


def conclude(result: StudyResult) -> Conclusions | None:
    """Return what is concluded of each measure; None where no two conditions were compared."""
    compared = [c for c in result.comparisons if c.paired]
    if not compared:
        return None
    basis = basis_of(compared)
    tests = [tested(c, basis) for c in compared]
    # Of each other condition with the reference: p is adjusted for these as well.
    p_further = [tested(c, basis).p for c in result.further if c.paired]
    adjusted = holm([*(test.p for test in tests), *p_further])[: len(tests)]
    with_p = sum(not math.isnan(p) for p in (*(test.p for test in tests), *p_further))
    moved = next(
        (
            test.comparison
            for test, p in zip(tests, adjusted, strict=True)
            if test.comparison.measure.name == "inertia_kg_m2"
            and p < LEVEL
            and not negligible(test.comparison, result)
        ),
        None,
    )
    found = []
    for test, p in zip(tests, adjusted, strict=True):
        c = test.comparison
        verdict: Verdict
        why: Finding | None
        if math.isnan(p):
            verdict, why = "cannot be decided", without_test(c, result, test.remark)
        elif p < LEVEL and (why := negligible(c, result)):
            verdict = "no difference shown"
        elif p < LEVEL:
            why = next(objections(test, basis, result, moved), None)
            verdict = "not supported" if why else "lower" if test.sign < 0 else "higher"
        elif basis == "values" and (why := too_few(c, with_p)):
            verdict = "cannot be decided"
        else:
            verdict, why = "no difference shown", hidden(c, result, with_p)
        simulated = simulated_difference(c, result.conditions)
        wanted = days_to_decide(c) if math.isnan(p) else None
        found.append(Conclusion(c, verdict, test.difference, p, why, simulated, test.words, wanted))
    ordered = tuple(sorted(found, key=lambda one: one.comparison.measure.place))
    return Conclusions(basis, ordered, with_p)


def days_to_decide(c: Comparison) -> int | None:
    """Return how many days with both conditions would show a difference of `WANTED`.

    The SD of the difference of one day is that of `rigidimeter.planning.days_needed`, with the
    scatter between epochs of these recordings and the scatter of days that is assumed there, since
    a single day does not show it. With as many epochs a day as there are, at a power of 0.8 and a
    level of 0.05 for this measure alone. None for other measures than J, B and K, and where a
    condition has no epoch.
    """
    title = {parameter.name: parameter.title for parameter in PARAMETERS}.get(c.measure.name)
    each = [c.of(name) for name in c.pair]
    if title is None or c.measure.origin != "fits" or not all(each):
        return None
    values = [math.fsum(o.value for o in own) / len(own) for own in each]
    days = [len({(o.subject, o.day, o.source) for o in own}) for own in each]
    epochs = [max(round(len(own) / n), 1) for own, n in zip(each, days, strict=True)]
    scatter = ASSUMED[title]
    if min(map(len, each)) >= _MIN_EPOCHS:
        sd_percent = max(c.summaries[name].sd_percent for name in c.pair)
        scatter = replace(scatter, between_epochs_percent=sd_percent)
    if min(values) <= 0:
        return None
    sd = day_difference_sd(scatter, (values[0], values[1]), (0.0, 0.0), (epochs[0], epochs[1]))
    return pairs_needed(WANTED * values[0], sd)


def reasons(result: StudyResult) -> tuple[FindingGroup, ...]:
    """Return the findings that verdicts follow from, each with its measures."""
    found: dict[Finding, list[str]] = {}
    for pair in (result, *result.further_pairs):
        concluded = conclude(pair)
        for one in () if concluded is None else concluded.each:
            if one.finding is not None:
                found.setdefault(one.finding, []).append(one.comparison.measure.short)
    return tuple(
        FindingGroup(finding, (), series(list(dict.fromkeys(measures))))
        for finding, measures in found.items()
    )


def conclusion_rows(result: StudyResult) -> list[dict[str, Any]]:
    """Return the conclusions as rows of a document."""
    caveats = method_caveats(result.sensitivity)
    return [
        {
            **measure_names(one.comparison.measure),
            "reference": one.comparison.reference,
            "other": one.comparison.other,
            "verdict": one.verdict,
            **one.difference.row(),
            "p_holm": one.p,
            "tested_by": concluded.basis,
            "test": one.test,
            "reason": one.reason,
            "finding": "" if one.finding is None else one.finding.name,
            "days_to_decide": one.days_to_decide,
            "caveat": caveats.get(one.comparison.measure.name, ""),
            **(
                {}
                if (made := one.simulated) is None
                else {
                    "simulated_reference": made.reference,
                    "simulated_other": made.other,
                    "simulated_difference": made.estimate,
                    "simulated_difference_percent": made.percent[0],
                }
            ),
        }
        for concluded in map(conclude, (result, *result.further_pairs))
        if concluded is not None
        for one in concluded.each
    ]
