"""What a comparison of two conditions shows of each measure, and what it does not.

A difference is shown where p of the test (`tested`), adjusted in its family (`families`), is below
the level, and nothing that is known of the recordings can have made it (`objections`). That none of
the size that is worth finding is shown is concluded where the test had a chance of one half to show
it, and its interval excludes it:

    half the interval at the level of the first test of the family ≤ size
    the 95 % interval lies within ± size

Otherwise it cannot be decided, and `deciding` finds what would decide it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Literal

from rigidimeter.analysis.study.compared import Comparison, measure_names
from rigidimeter.analysis.study.deciding import Needed, needed
from rigidimeter.analysis.study.differences import Difference, simulated_difference
from rigidimeter.analysis.study.families import CHECK, Family, Role, adjusted
from rigidimeter.analysis.study.objections import (
    hidden,
    negligible,
    objections,
    wide,
    without_test,
)
from rigidimeter.analysis.study.results import StudyResult
from rigidimeter.analysis.study.sensitivity import method_caveats
from rigidimeter.analysis.study.tested import LEVEL, Basis, Test, basis_of, tested
from rigidimeter.core.findings import Finding, found_between
from rigidimeter.core.records import FindingGroup
from rigidimeter.core.words import series, within

Verdict = Literal["lower", "higher", "no difference shown", "not supported", "cannot be decided"]


@dataclass(frozen=True)
class Conclusion:
    """What is concluded of one measure: the second condition against the first.

    Attributes
    ----------
    comparison : Comparison
    verdict : str
        ``lower``, ``higher``, ``no difference shown`` (of the size that is worth finding), ``not
        supported`` (one was found and something else may have made it) or ``cannot be decided``.
    difference : Difference
        With both values, and the intervals of the measurement and of the test.
    family : Family
        The tests that p is adjusted for.
    p : float
        Of the test, adjusted in its family; NaN without one.
    half_width : float
        Half the interval at the level of the first test of the family, in the unit of the measure;
        NaN without a test.
    wanted_percent : float
        The smallest difference worth finding, of the reference.
    finding : Finding or None
        The reason; None where the test is the whole reason.
    caution : Finding or None
        What stands beside the verdict: that the inertia differs.
    test : str
        The test in words, such as ``paired t-test of 5 days``; empty without one.
    needed : Needed or None
        What would decide, where it cannot be decided.
    simulated : Difference or None
        What a virtual study simulated.
    """

    comparison: Comparison
    verdict: Verdict
    difference: Difference
    family: Family
    p: float = math.nan
    half_width: float = math.nan
    wanted_percent: float = math.nan
    finding: Finding | None = None
    caution: Finding | None = None
    test: str = ""
    needed: Needed | None = None
    simulated: Difference | None = None

    @property
    def reason(self) -> str:
        """The headline of the finding as a clause; empty without one."""
        return "" if self.finding is None else within(self.finding.headline)

    @property
    def role(self) -> Role:
        """Whether the measure is primary, secondary, or the check of the instrument."""
        return self.family.role


@dataclass(frozen=True)
class Conclusions:
    """The conclusions on all measures, and what was tested."""

    basis: Basis
    each: tuple[Conclusion, ...]

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

    @property
    def adjusted(self) -> bool:
        """Whether p of a measure is adjusted for other tests."""
        return any(one.family.tests > 1 for one in self.each)

    @property
    def p_name(self) -> str:
        """What a column of p is called: Holm's method is not that of a sequence."""
        if any(one.family.rule == "sequence" for one in self.each):
            return "p, adjusted"
        return "p, Holm" if self.adjusted else "p"


def conclude(result: StudyResult) -> Conclusions | None:
    """Return what is concluded of each measure; None where no two conditions were compared."""
    compared = [c for c in result.comparisons if c.paired]
    if not compared:
        return None
    basis = basis_of(compared)
    tests = [tested(c, basis) for c in compared]
    # Of each other condition with the reference: p is adjusted for these as well.
    every = [*tests, *(tested(c, basis) for c in result.further if c.paired)]
    families = adjusted(
        [(one.comparison.measure, one.comparison.other, one.p) for one in every], result.primary
    )
    own = list(zip(tests, families, strict=False))
    moved = next(
        (
            test.comparison
            for test, (p, _) in own
            if test.comparison.measure.name == CHECK and p < LEVEL and not negligible(test, result)
        ),
        None,
    )
    found = [_concluded(test, p, family, basis, result, moved) for test, (p, family) in own]
    found = _in_sequence(found, result)
    if moved is not None:
        (why,) = (one.finding for one in found if one.comparison is moved)
        found = [_beside(one, why) for one in found]
    ordered = tuple(sorted(found, key=lambda one: one.comparison.measure.place))
    return Conclusions(basis, ordered)


def _concluded(
    test: Test,
    p: float,
    family: Family,
    basis: Basis,
    result: StudyResult,
    moved: Comparison | None,
) -> Conclusion:
    c, level = test.comparison, family.level(LEVEL)
    percent = result.primary.table.difference_percent
    scaled = test.difference.ratio or c.measure.origin == "ratings"
    wanted = percent / 100.0 * abs(test.difference.reference) if scaled else math.nan
    half = test.half_width(level)
    verdict: Verdict = "cannot be decided"
    why: Finding | None
    if math.isnan(p):
        why = without_test(c, result, test.remark)
    elif p < LEVEL and (why := negligible(test, result)):
        verdict = "no difference shown"
    elif p < LEVEL:
        why = next(objections(test, basis, result, moved), None)
        verdict = "not supported" if why else "lower" if test.sign < 0 else "higher"
    elif family.rule == "sequence" and test.p * family.first < LEVEL:
        before = result.primary.before(c.measure)
        why = found_between("earlier_in_sequence", {"before": before}, test.p)
    elif half <= wanted and max(abs(test.difference.low), abs(test.difference.high)) < wanted:
        why = hidden(c, result)
        verdict = "cannot be decided" if why else "no difference shown"
    else:
        why = hidden(c, result) or wide(test, family, half, percent)
    return Conclusion(
        comparison=c,
        verdict=verdict,
        difference=test.difference,
        family=family,
        p=p,
        half_width=half,
        wanted_percent=percent,
        finding=why,
        test=test.words,
        needed=needed(test, wanted, level) if verdict == "cannot be decided" else None,
        simulated=simulated_difference(c, result.conditions),
    )


def _in_sequence(found: list[Conclusion], result: StudyResult) -> list[Conclusion]:
    """Return the conclusions; of a declared sequence none is claimed behind one that is not."""
    shown = True
    ordered: dict[str, int] = {name: k for k, name in enumerate(result.primary.table.measures)}
    own = [k for k, one in enumerate(found) if one.family.rule == "sequence"]
    for k in sorted(own, key=lambda k: ordered[found[k].comparison.measure.name]):
        one = found[k]
        claimed = one.verdict in ("lower", "higher")
        if claimed and not shown:
            before = result.primary.before(one.comparison.measure)
            why = found_between("earlier_in_sequence", {"before": before}, one.difference.p)
            found[k] = replace(one, verdict="cannot be decided", finding=why)
        shown = shown and claimed
    return found


def _beside(one: Conclusion, moved: Finding | None) -> Conclusion:
    """Return a conclusion with the caution that the inertia differs, unless that is its reason."""
    same = moved is None or (one.finding is not None and one.finding.name == moved.name)
    fits = one.comparison.measure.origin == "fits" and one.comparison.measure.name != CHECK
    if same or not fits or one.verdict == "not supported":
        return one
    return replace(one, caution=moved)


def reasons(result: StudyResult) -> tuple[FindingGroup, ...]:
    """Return the findings that verdicts follow from, each with its measures."""
    found: dict[Finding, list[str]] = {}
    for pair in (result, *result.further_pairs):
        concluded = conclude(pair)
        for one in () if concluded is None else concluded.each:
            for why in (one.finding, one.caution):
                if why is not None:
                    found.setdefault(why, []).append(one.comparison.measure.short)
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
            "role": one.role,
            "adjusted_for": one.family.tests,
            "level": one.family.level(LEVEL),
            "half_width": one.half_width,
            "wanted_percent": one.wanted_percent,
            "tested_by": concluded.basis,
            "test": one.test,
            "reason": one.reason,
            "finding": "" if one.finding is None else one.finding.name,
            "caution": "" if one.caution is None else within(one.caution.headline),
            **_needed(one.needed),
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


def _needed(found: Needed | None) -> dict[str, Any]:
    of_days = found is not None and found.unit == "day"
    return {
        "days_to_decide": found.number if found is not None and of_days else None,
        "units_to_decide": None if found is None else found.number,
        "unit_to_decide": "" if found is None else found.unit,
    }
