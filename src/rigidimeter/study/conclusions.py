"""What a comparison of two conditions shows of each measure, and what it does not.

A difference is shown where p, adjusted by Holm's method for the measures, is below the level, and
nothing that the checks found can have made it. What is tested is, in this order,

- days: the test by days of a study folder;
- recordings: the same test with each recording in the place of a day, where days are not known:
  what differs between two recordings need not be their condition;
- values: the rank-sum test of the values of a table, which are taken as independent.

A difference that was found is not supported if the epochs that carry a doubt make it, that is if
the test without them does not find it; if a check doubts all epochs of a condition together; or if
the inertia of the joint, which no treatment changes, differs at least half as much. A method that
the subject's own torque does not bias clears the doubts which such torque raises. A difference of
ratings is not supported if it is made by examiners who rated one of the conditions alone.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from rigidimeter.estimation import method_named
from rigidimeter.records import Analysis, Finding
from rigidimeter.statistics import holm, ranksum
from rigidimeter.study.compared import Comparison, measure_names
from rigidimeter.study.comparison import day_test, rank_test
from rigidimeter.study.differences import Difference, by_units, by_values
from rigidimeter.study.ratings_found import RatingsFound
from rigidimeter.study.ratings_model import rated_one_condition, without_examiners
from rigidimeter.study.results import StudyResult

LEVEL = 0.05

Basis = Literal["days", "recordings", "values"]
Verdict = Literal["lower", "higher", "no difference shown", "not supported", "cannot be decided"]

OF_SUBJECT = ("voluntary_torque", "active_movement", "emg_activity", "tremor", "loop_bias")
"""Checks of the subject's own torque."""

ALIKE_IN_BOTH = ("between_samples", "varying_between_epochs")
"""Checks that make no difference: of the rig, and of a scatter that is in the test."""

SHARE_OF_INERTIA = 0.5
"""Of a measure's relative difference: if that of the inertia is larger, the joint or the contact
was another one."""


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
    reason : str
        A clause; empty where the test is the whole reason.
    difference : Difference
        Of the test, with both values.
    """

    comparison: Comparison
    verdict: Verdict
    difference: Difference
    p: float = math.nan
    reason: str = ""


@dataclass(frozen=True)
class Conclusions:
    """The conclusions on all measures, what was tested, and how many measures it was."""

    basis: Basis
    each: tuple[Conclusion, ...]

    def of(self, *verdicts: Verdict) -> tuple[Conclusion, ...]:
        """Return those with one of these verdicts."""
        return tuple(one for one in self.each if one.verdict in verdicts)

    @property
    def tested(self) -> int:
        """The number of measures that were tested."""
        return sum(not math.isnan(one.p) for one in self.each)


@dataclass(frozen=True)
class _Test:
    """A test of one measure; `sign` is that of reference − other."""

    comparison: Comparison
    difference: Difference
    sign: float = 0.0
    remark: str = ""

    @property
    def p(self) -> float:
        return self.difference.p

    @property
    def found(self) -> bool:
        return self.p < LEVEL


def conclude(result: StudyResult) -> Conclusions | None:
    """Return what is concluded of each measure; None where no two conditions were compared."""
    compared = [c for c in result.comparisons if c.paired]
    if not compared:
        return None
    basis = _basis(compared)
    tests = [_tested(c, basis) for c in compared]
    adjusted = holm([test.p for test in tests])
    with_p = len([test for test in tests if not math.isnan(test.p)])
    moved = next(
        (
            test.comparison
            for test, p in zip(tests, adjusted, strict=True)
            if test.comparison.measure.name == "inertia_kg_m2" and p < LEVEL
        ),
        None,
    )
    found = []
    for test, p in zip(tests, adjusted, strict=True):
        c = test.comparison
        verdict: Verdict
        if math.isnan(p):
            verdict, reason = "cannot be decided", test.remark
        elif p < LEVEL:
            reason = next(_objections(test, basis, result, moved), "")
            verdict = "not supported" if reason else "lower" if test.sign > 0 else "higher"
        elif reason := _too_few(test, basis, with_p):
            verdict = "cannot be decided"
        else:
            few = c.days.few if c.days is not None and basis == "days" else ""
            verdict, reason = "no difference shown", _hidden(c, result) or few
        found.append(Conclusion(c, verdict, test.difference, p, reason))
    return Conclusions(basis, tuple(sorted(found, key=lambda one: one.comparison.measure.place)))


def conclusion_rows(result: StudyResult) -> list[dict[str, Any]]:
    """Return the conclusions as rows of a document."""
    concluded = conclude(result)
    if concluded is None:
        return []
    return [
        {
            **measure_names(one.comparison.measure),
            "reference": one.comparison.reference,
            "other": one.comparison.other,
            "verdict": one.verdict,
            **one.difference.row(),
            "p_holm": one.p,
            "tested_by": concluded.basis,
            "reason": one.reason,
        }
        for one in concluded.each
    ]


def _basis(compared: Sequence[Comparison]) -> Basis:
    if any(c.days is not None for c in compared):
        return "days"
    return "values" if all(c.measure.origin == "column" for c in compared) else "recordings"


def _tested(c: Comparison, basis: Basis) -> _Test:
    if basis == "values":
        return _by_values(c)
    if basis == "recordings":
        return _by_recordings(c)
    found = by_units(c, c.days)
    if c.days is None:
        return _Test(c, found, remark=c.remark)
    return _Test(c, found, c.days.estimate, c.days.remark)


def _by_values(c: Comparison) -> _Test:
    found = by_values(c)
    if c.test is None:
        return _Test(c, found, remark=c.remark)
    return _Test(c, found, c.test.z)


def _by_recordings(c: Comparison) -> _Test:
    by_source = replace(c, observations=tuple(replace(o, day=o.source) for o in c.observations))
    found = day_test(by_source)
    remark = found.remark.replace("days", "recordings").replace("day", "recording")
    return _Test(c, by_units(by_source, found), found.estimate, remark)


def _too_few(test: _Test, basis: Basis, tests: int) -> str:
    """Return that no values could be far enough apart for this test; else nothing."""
    if basis != "values":
        return ""
    n_x, n_y = (len(test.comparison.values[name]) for name in test.comparison.pair)
    least = ranksum(range(n_x), range(n_x, n_x + n_y)).p * tests
    if least < LEVEL:
        return ""
    of = f" for {tests} measures" if tests > 1 else ""
    return f"{n_x} values against {n_y} cannot reach p < {LEVEL:g}{of}, whatever they are"


def _hidden(c: Comparison, result: StudyResult) -> str:
    doubted = _doubted(c, result.analysis)
    if not doubted:
        return ""
    return f"{_carried(c, doubted)}, which can hide a difference"


def _objections(
    test: _Test, basis: Basis, result: StudyResult, inertia: Comparison | None
) -> Iterator[str]:
    """Yield what else may have made a difference that was found."""
    c = test.comparison
    if result.ratings is not None and c.measure.origin == "ratings":
        yield from _one_sided(test, result.ratings)
    if c.measure.origin not in ("fits", "fixed_inertia", "scores"):
        return
    if inertia is not None and (
        c is inertia or _relative(inertia) > SHARE_OF_INERTIA * _relative(c)
    ):
        yield (
            f"inertia differs by {100 * _relative(inertia):.2g} %, and no treatment changes it: "
            "the posture, the contact with the robot, or the subject's own torque was different"
        )
    fits = c.measure.origin != "scores"
    together = _doubted_together(c, result.analysis) if fits else []
    if together:
        yield f"{together[0]} casts doubt on all epochs of a condition together"
    doubted = _doubted(c, result.analysis)
    if doubted and not _agrees(again := _without(test, basis, doubted), test):
        names = {name for one in doubted.values() for name in one}
        if not (names <= {*OF_SUBJECT} and _cleared(test, result)):
            yield f"{_carried(c, doubted)}; without these epochs {_said(again)}"


def _one_sided(test: _Test, ratings: RatingsFound) -> Iterator[str]:
    """Yield that an examiner who rated one condition alone makes the difference."""
    examiners = rated_one_condition(ratings)
    if not examiners:
        return
    rest = without_examiners(ratings, examiners)
    c = test.comparison
    again = _Test(c, by_units(c, rest), rest.estimate, rest.remark)
    if not _agrees(again, test):
        who = f"{'examiners' if len(examiners) > 1 else 'examiner'} {', '.join(examiners)}"
        yield f"{who} rated one of the conditions alone; without these ratings {_said(again)}"


def _agrees(again: _Test, test: _Test) -> bool:
    return again.found and again.sign * test.sign > 0


def _said(again: _Test) -> str:
    return again.remark if math.isnan(again.p) else f"p = {again.p:.2g}"


def _relative(c: Comparison) -> float:
    """Return the size of the difference of the medians, as a share of the larger one."""
    first, second = (c.summaries[name].median for name in c.pair)
    return abs(first - second) / max(abs(first), abs(second))


def _doubted(c: Comparison, analysis: Analysis) -> dict[tuple[str, str], list[str]]:
    """Return the checks that doubt each epoch which counts in the comparison, where there are any.

    A score is not an estimate: only torque of the subject's own changes it, which may be a note for
    the method of the estimate.
    """
    counting = {(o.source, o.epoch) for name in c.pair for o in c.of(name)}
    found = {}
    for fit in analysis.fits:
        names = [f.name for f in fit.findings if _counts(f, of_score=c.measure.origin == "scores")]
        if names and (fit.source, fit.epoch) in counting:
            found[fit.source, fit.epoch] = names
    return found


def _counts(finding: Finding, *, of_score: bool) -> bool:
    if of_score:
        return finding.name in OF_SUBJECT and bool(finding.remedy)
    return finding.level != "note" and finding.name not in ALIKE_IN_BOTH


def _doubted_together(c: Comparison, analysis: Analysis) -> list[str]:
    return [
        finding.name
        for fit in analysis.pooled
        if fit.condition in c.pair
        for finding in fit.findings
        if _counts(finding, of_score=False)
    ]


def _carried(c: Comparison, doubted: Mapping[tuple[str, str], Sequence[str]]) -> str:
    """Return which check doubts most epochs, and how many of each condition are doubted."""
    ((name, _),) = Counter(name for names in doubted.values() for name in names).most_common(1)
    parts = []
    for condition in c.pair:
        of = c.of(condition)
        carry = sum((o.source, o.epoch) in doubted for o in of)
        parts.append(f"{carry} of {len(of)} epochs in {condition or 'no condition'}")
    others = len({name for names in doubted.values() for name in names}) - 1
    more = f" (and {others} other check{'s' if others > 1 else ''})" if others else ""
    return f"{name}{more} casts doubt on {' and '.join(parts)}"


def _without(test: _Test, basis: Basis, doubted: Mapping[tuple[str, str], Sequence[str]]) -> _Test:
    """Return the test of the epochs without a doubt."""
    c = test.comparison
    sound = tuple(o for o in c.observations if (o.source, o.epoch) not in doubted)
    rest = replace(c, observations=sound)
    if basis == "days":
        rest = replace(rest, days=day_test(rank_test(rest)))
    return _tested(rank_test(rest), basis)


def _cleared(test: _Test, result: StudyResult) -> bool:
    """Whether a method that the subject's own torque does not bias shows the difference too."""
    return any(
        row.measure.name == test.comparison.measure.name
        and method_named(row.method).uses_perturbation
        and (row.p if math.isnan(row.p_day) else row.p_day) < LEVEL
        and row.shift * test.sign > 0
        for row in result.sensitivity
    )
