"""What else than the condition may have made a difference that a test found.

Each objection is a clause that names the cause; the most specific comes first.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from datetime import date

from rigidimeter.analysis.estimation import method_named
from rigidimeter.analysis.study.compared import Comparison
from rigidimeter.analysis.study.doubted_epochs import (
    OF_SUBJECT,
    carried,
    doubted_epochs,
    doubted_together,
    in_words,
)
from rigidimeter.analysis.study.ratings_found import RatingsFound
from rigidimeter.analysis.study.ratings_model import rated_one_condition, without_examiners
from rigidimeter.analysis.study.results import StudyResult
from rigidimeter.analysis.study.tested import LEVEL, Basis, Test, by_days, tested_again
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Fit

SHARE_THAT_HIDES = 0.1
"""Of the epochs of a condition: so many with a caution can hide a difference."""

SHARE_OF_INERTIA = 0.5
"""Of a measure's relative difference: if that of the inertia is larger, the joint or the contact
was another one."""

DEGREES = 180.0 / math.pi
UNIT_WITHIN = 1.5
"""Factor by which a ratio of inertias may miss that of the units."""


def objections(
    test: Test, basis: Basis, result: StudyResult, inertia: Comparison | None
) -> Iterator[str]:
    """Yield what else may have made a difference that was found.

    Parameters
    ----------
    test : Test
    basis : str
    result : StudyResult
    inertia : Comparison or None
        Of the inertia, where that is found to differ.
    """
    c = test.comparison
    if result.ratings is not None and c.measure.origin == "ratings":
        yield from _one_sided(test, result.ratings)
    if c.measure.origin in ("fits", "scores"):
        yield from _of_degrees(inertia)
        yield from _of_epochs(test, basis, result)
        yield from _of_conditions(test, result)
        if inertia is not None:
            yield from _of_inertia(test, result, inertia)
    if basis == "recordings":
        yield (
            "which recordings are of one day is not known, and a day may move all of them alike; "
            "a study folder states their days"
        )
    elif basis == "days":
        yield from _in_order(c)


def hidden(c: Comparison, result: StudyResult) -> str:
    """Return what can hide a difference that was not found; empty without any."""
    said = ""
    doubted = doubted_epochs(c, result.analysis)
    shares = [
        sum((o.source, o.epoch) in doubted for o in own) / len(own)
        for own in map(c.of, c.pair)
        if own
    ]
    if max(shares, default=0.0) >= SHARE_THAT_HIDES:
        said = carried(c, doubted)
    elif result.ratings is not None and c.measure.origin == "ratings":
        said = _who_rated_one(rated_one_condition(result.ratings))
    return f"{said}, which can hide a difference" if said else ""


def untested(c: Comparison, result: StudyResult) -> str:
    """Return why a condition has no values, where the recordings say so."""
    read = {session.condition for session in result.sessions}
    for name in c.pair:
        lost = [out for out in result.left_out if out.condition == name]
        if lost and name not in read:
            which = "the recording" if len(lost) == 1 else f"all {len(lost)} recordings"
            return f"{which} in {name} could not be used: {lost[0].reason}"
    return ""


def negligible(c: Comparison, result: StudyResult) -> str:
    """Return that a difference is smaller than an error which no check doubts; else nothing.

    How the joint moves between the samples is known to `max_between_samples_percent` alone.
    """
    allowed = result.settings.diagnostics.max_between_samples_percent
    if c.measure.origin != "fits":
        return ""
    size = 100.0 * _relative(*(c.summaries[name].median for name in c.pair))
    if size > allowed:
        return ""
    return (
        f"the difference of {size:.2g} % is within the {allowed:g} % by which the motion between "
        "samples may move it"
    )


def _of_epochs(test: Test, basis: Basis, result: StudyResult) -> Iterator[str]:
    """Yield the checks that doubt epochs, if the others do not show the difference."""
    c = test.comparison
    doubted = doubted_epochs(c, result.analysis)
    if not doubted:
        return
    sound = [o for o in c.observations if (o.source, o.epoch) not in doubted]
    again = tested_again(c, sound, basis)
    names = {name for one in doubted.values() for name in one}
    if not (again.agrees(test) or (names <= {*OF_SUBJECT} and _cleared(test, result))):
        yield f"{carried(c, doubted)}; without these epochs {again.said}"


def _of_conditions(test: Test, result: StudyResult) -> Iterator[str]:
    """Yield what a check doubts in all epochs of a condition, unless it is too small for it."""
    c = test.comparison
    if c.measure.origin == "scores":
        return
    found = list(doubted_together(c, result.analysis))
    bias = sum(_bias(c, fit, finding) for fit, finding in found)
    if not found or test.stands_against(bias):
        return
    names = list(dict.fromkeys(finding.name for _, finding in found))
    if {*names} <= {*OF_SUBJECT} and _cleared(test, result):
        return
    doubted = doubted_epochs(c, result.analysis)
    epochs = f"; {carried(c, doubted)}" if doubted else ""
    yield f"{in_words(names[0])} in all epochs of a condition together{epochs}"


def _bias(c: Comparison, fit: Fit, finding: Finding) -> float:
    """Return the largest bias of a condition that a finding allows; infinite where it is not told.

    `loop_bias` computes it: the largest of J, B and K, in % of half their intervals.
    """
    if finding.name != "loop_bias":
        return math.inf
    low, high = (getattr(fit, f"{c.measure.name}_{end}") for end in ("low", "high"))
    bias = finding.value / 100.0 * (high - low) / 2.0
    return bias if math.isfinite(bias) else math.inf


def _differs(inertia: Comparison) -> str:
    size = 100 * _relative(*(inertia.summaries[name].median for name in inertia.pair))
    return f"inertia differs by {size:.2g} %, and no treatment changes it"


def _of_degrees(inertia: Comparison | None) -> Iterator[str]:
    """Yield that inertias differ as degrees do from radians."""
    if inertia is None:
        return
    low, high = sorted(inertia.summaries[name].median for name in inertia.pair)
    if low > 0 and DEGREES / UNIT_WITHIN < high / low < DEGREES * UNIT_WITHIN:
        yield (
            f"{_differs(inertia)}: one is about {DEGREES:.0f} times the other, as where degrees "
            "are read as radians"
        )


def _of_inertia(test: Test, result: StudyResult, inertia: Comparison) -> Iterator[str]:
    """Yield that the inertia differs, as far as that may have made the difference.

    What makes another inertia, such as a unit or torque of the subject, changes B and K in
    proportion.
    """
    c = test.comparison
    of_inertia = _relative(*(inertia.summaries[name].median for name in inertia.pair))
    medians = (c.summaries[name].median for name in c.pair)
    if c is inertia or of_inertia > SHARE_OF_INERTIA * _relative(*medians):
        doubted = doubted_epochs(c, result.analysis)
        cause = "the posture, the contact with the robot, a unit, or the subject's own torque was "
        yield f"{_differs(inertia)}: {carried(c, doubted) if doubted else f'{cause}different'}"


def _relative(first: float, second: float) -> float:
    """Return a difference as a share of the larger value."""
    return abs(first - second) / max(abs(first), abs(second))


def _cleared(test: Test, result: StudyResult) -> bool:
    """Whether a method that the subject's own torque does not bias shows the difference too."""
    return any(
        row.measure.name == test.comparison.measure.name
        and method_named(row.method).uses_perturbation
        and (row.p if math.isnan(row.p_day) else row.p_day) < LEVEL
        and row.shift * test.sign < 0  # the shift is reference − other
        for row in result.sensitivity
    )


def _one_sided(test: Test, ratings: RatingsFound) -> Iterator[str]:
    """Yield that an examiner who rated one condition alone makes the difference."""
    examiners = rated_one_condition(ratings)
    if not examiners:
        return
    again = by_days(test.comparison, without_examiners(ratings, examiners))
    if not again.agrees(test):
        yield f"{_who_rated_one(examiners)}; without these ratings {again.said}"


def _who_rated_one(examiners: Sequence[str]) -> str:
    if not examiners:
        return ""
    who = f"{'examiners' if len(examiners) > 1 else 'examiner'} {', '.join(examiners)}"
    return f"{who} rated one of the conditions alone"


def _in_order(c: Comparison) -> Iterator[str]:
    """Yield that all days of one condition came after all days of the other, in every subject."""
    days: dict[str, tuple[set[str], set[str]]] = {}
    for k, name in enumerate(c.pair):
        for o in c.of(name):
            days.setdefault(o.subject, (set(), set()))[k].add(o.day)
    later = {_later(*both) for both in days.values() if all(both)}
    if len(later) == 1 and (last := later.pop()) is not None:
        yield (
            f"all days in {c.pair[last]} came after all days in {c.pair[1 - last]}, and a "
            "change with time would have the same effect; alternate days, or days with both "
            "conditions, separate them"
        )


def _later(x: Iterable[str], y: Iterable[str]) -> int | None:
    """Return which of two sets of days comes after all of the other; None if neither does."""
    order = _order([*x, *y])
    if order is None:
        return None
    first, second = ([order[day] for day in days] for days in (x, y))
    if max(first) < min(second):
        return 1
    return 0 if max(second) < min(first) else None


def _order(labels: Sequence[str]) -> dict[str, float] | None:
    """Return the place of each day in time, where labels are dates or numbers; else None."""
    try:
        return {label: float(date.fromisoformat(label).toordinal()) for label in labels}
    except ValueError:
        parts = [re.fullmatch(r"(\D*)(\d+)", label) for label in labels]
    if not all(parts) or len({part[1] for part in parts if part}) > 1:
        return None
    return {label: float(part[2]) for label, part in zip(labels, parts, strict=True) if part}
