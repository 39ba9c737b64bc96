"""What else than the condition may have made a difference that a test found, or have hidden one.

Each is a finding; the most specific comes first.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import date

from rigidimeter.analysis.estimation import method_named
from rigidimeter.analysis.study.compared import Comparison
from rigidimeter.analysis.study.differences import Difference, by_units, signed
from rigidimeter.analysis.study.families import Family
from rigidimeter.analysis.study.ratings_found import RatingsFound
from rigidimeter.analysis.study.ratings_model import rated_one_condition, without_examiners
from rigidimeter.analysis.study.results import StudyResult
from rigidimeter.analysis.study.tested import (
    LEVEL,
    Basis,
    Test,
    basis_of,
    by_days,
    by_groups,
    tested_again,
)
from rigidimeter.core.findings import Fact, Finding, found_between
from rigidimeter.core.records import Analysis, Fit
from rigidimeter.core.words import condition_name, plural, series

OF_SUBJECT = {"tremor", "voluntary_torque", "active_movement", "emg_activity", "loop_bias"}
"""Checks of the subject's own torque."""

CAUSES = {
    "tremor": "",
    "varying_with_time": "a joint that changes during the epoch",
    "varying_with_angle": "a joint that changes with the angle",
    "varying_with_phase": "a joint that changes with the imposed movement",
    "voluntary_torque": "torque of the subject's own",
    "active_movement": "torque of the subject's own",
    "emg_activity": "muscle activity",
    "implausible_parameters": "values that no joint has, as wrong units give",
}
"""Checks that say what is wrong, in the order in which they are named; of the others the one that
flags most epochs is named. A joint that changes leaves torque as a pushing subject does, but a
subject who pushes is hardly ever taken for a joint that changes."""

ALIKE_IN_BOTH = ("between_samples", "varying_between_epochs")
"""Checks that make no difference: of the rig, and of a scatter that is in the test."""

SHARE_THAT_HIDES = 10.0
"""In % of the epochs of a condition: so many with a caution can hide a difference."""

SHARE_OF_INERTIA = 0.5
"""Of a measure's relative difference: if that of the inertia is larger, the joint or the contact
was another one."""

DEGREES = 180.0 / math.pi
UNIT_WITHIN = 1.5
"""Factor by which a ratio of inertias may miss that of the units."""

Flagged = Mapping[tuple[str, str], Sequence[str]]


def objections(
    test: Test, basis: Basis, result: StudyResult, inertia: Comparison | None
) -> Iterator[Finding]:
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
    groups = by_groups(c, basis)
    if not all(again.agrees(test) for again in groups.values()):
        yield _of_groups(groups)
    if result.ratings is not None and c.measure.origin == "ratings":
        yield from _one_sided(test, result.ratings)
    if c.measure.origin in ("fits", "scores"):
        flagged = flagged_epochs(c, result.analysis)
        if inertia is not None:
            yield from _of_degrees(inertia)
        yield from _of_epochs(test, basis, result, flagged)
        yield from _of_conditions(test, result, flagged)
        if inertia is not None:
            yield from _of_inertia(c, inertia, flagged)
    if basis == "recordings":
        yield found_between("unknown_days", {}, len({o.source for o in c.observations}))
    elif basis == "days":
        yield from _in_order(c)


def hidden(c: Comparison, result: StudyResult) -> Finding | None:
    """Return what can hide a difference that was not found, the most specific; None without any."""
    groups = by_groups(c, basis_of([c]))
    if any(again.found for again in groups.values()):
        return _of_groups(groups)
    flagged = flagged_epochs(c, result.analysis)
    if flagged and (share := _largest_share(c, flagged)) >= SHARE_THAT_HIDES:
        facts = _carried(c, flagged) | {"variant": "hides"}
        return found_between("flagged_epochs", facts, share, SHARE_THAT_HIDES)
    if result.ratings is not None and c.measure.origin == "ratings":
        examiners = rated_one_condition(result.ratings)
        if examiners:
            return _of_examiners(examiners, {"variant": "hides"})
    return None


def without_test(c: Comparison, result: StudyResult, remark: str) -> Finding:
    """Return why there is no test: where the recordings say so, that they could not be read."""
    read = {session.condition for session in result.sessions}
    for name in c.pair:
        lost = [out for out in result.left_out if out.condition == name]
        if lost and name not in read:
            which = "the recording" if len(lost) == 1 else f"all {len(lost)} recordings"
            facts = {"which": which, "condition": name, "reason": lost[0].reason}
            return found_between("unused_recordings", facts, len(lost))
    return found_between("no_test", {"remark": remark})


def wide(test: Test, family: Family, half: float, wanted_percent: float) -> Finding:
    """Return that a difference of the wanted size would be found in fewer than one study of two."""
    c = test.comparison
    size = 100.0 * half / abs(test.difference.reference or math.nan)
    if test.by is None and math.isinf(half):
        n_x, n_y = (len(c.values[name]) for name in c.pair)
        of = f" for {family.tests} measures" if family.tests > 1 else ""
        facts: dict[str, Fact] = {"variant": "values", "first": n_x, "second": n_y, "of": of}
        facts |= {"alpha": LEVEL, "exact": 2.0 / math.comb(n_x + n_y, n_x)}
        return found_between("wide_interval", facts, limit=wanted_percent)
    facts = {"tests": plural(family.first, "test")}
    if not test.difference.ratio and c.measure.origin == "column":
        facts["variant"] = "negative"
    elif not test.difference.reference:
        facts["variant"] = "zero"
    elif size <= wanted_percent:
        facts["variant"] = "held"
    return found_between("wide_interval", facts, size, wanted_percent)


def negligible(test: Test, result: StudyResult) -> Finding | None:
    """Return that a difference is smaller than an error which no check finds; else None.

    How the joint moves between the samples is known to `max_between_samples_percent` alone.
    """
    allowed = result.settings.diagnostics.max_between_samples_percent
    size = 100.0 * _share(test.difference)
    if test.comparison.measure.origin != "fits" or size > allowed:
        return None
    return found_between("within_accuracy", {}, size, allowed)


def flagged_epochs(c: Comparison, analysis: Analysis) -> Flagged:
    """Return the checks that flag each epoch which counts in the comparison, where there are any.

    A score is not an estimate: only torque of the subject's own changes it, which may be a note for
    the method of the estimate.
    """
    counting = {(o.source, o.epoch) for name in c.pair for o in c.of(name)}
    flagged = {}
    for fit in analysis.fits:
        names = [f.name for f in fit.findings if _counts(f, of_score=c.measure.origin == "scores")]
        if names and (fit.source, fit.epoch) in counting:
            flagged[fit.source, fit.epoch] = names
    return flagged


def _counts(finding: Finding, *, of_score: bool = False) -> bool:
    if of_score:
        return finding.name in OF_SUBJECT
    return finding.level != "note" and finding.name not in ALIKE_IN_BOTH


def _largest_share(c: Comparison, flagged: Flagged) -> float:
    """Return the largest share of a condition's epochs that are flagged, in %."""
    of_each = [own for own in map(c.of, c.pair) if own]
    shares = (sum((o.source, o.epoch) in flagged for o in own) / len(own) for own in of_each)
    return 100.0 * max(shares, default=0.0)


def _carried(c: Comparison, flagged: Flagged) -> dict[str, Fact]:
    """Return which check flags epochs, and how many of each condition are flagged."""
    counts = Counter(name for names in flagged.values() for name in names)
    first = next((name for name in CAUSES if name in counts), counts.most_common(1)[0][0])
    parts: list[str] = []
    for condition in c.pair:
        of = c.of(condition)
        carry = sum((o.source, o.epoch) in flagged for o in of)
        epochs = "" if parts else " epochs"
        parts.append(f"{carry} of {len(of)}{epochs} in {condition_name(condition)}")
    others = f" (or {plural(len(counts) - 1, 'other finding')})" if len(counts) > 1 else ""
    return {"cause": _in_words(first), "others": others, "counts": ", ".join(parts)}


def _in_words(check: str) -> str:
    """Return a check with what it finds, where its name does not say it."""
    return f"{CAUSES[check]} ({check})" if CAUSES.get(check) else check


def _of_epochs(
    test: Test, basis: Basis, result: StudyResult, flagged: Flagged
) -> Iterator[Finding]:
    """Yield the checks that flag epochs, if the others do not show the difference."""
    if not flagged:
        return
    c = test.comparison
    sound = [o for o in c.observations if (o.source, o.epoch) not in flagged]
    again = tested_again(c, sound, basis)
    names = {name for one in flagged.values() for name in one}
    if not (again.agrees(test) or (names <= OF_SUBJECT and _cleared(test, result))):
        facts = _carried(c, flagged) | {"without": again.said}
        yield found_between("flagged_epochs", facts, _largest_share(c, flagged))


def _of_conditions(test: Test, result: StudyResult, flagged: Flagged) -> Iterator[Finding]:
    """Yield what a check finds in all epochs of a condition, unless it is too small for it."""
    c = test.comparison
    if c.measure.origin == "scores":
        return
    together = [
        (fit, finding)
        for fit in result.analysis.pooled
        if fit.condition in c.pair
        for finding in fit.findings
        if _counts(finding)
    ]
    if not together or test.stands_against(sum(_bias(c, *one) for one in together)):
        return
    names = list(dict.fromkeys(finding.name for _, finding in together))
    if {*names} <= OF_SUBJECT and _cleared(test, result):
        return
    where = series(list(dict.fromkeys(condition_name(fit.condition) for fit, _ in together)))
    counts = "; {cause} in {counts}".format_map(_carried(c, flagged)) if flagged else ""
    facts = {"cause": _in_words(names[0]), "where": where, "counts": counts}
    yield found_between("flagged_epochs", {**facts, "variant": "together"})


def _bias(c: Comparison, fit: Fit, finding: Finding) -> float:
    """Return the largest bias of a condition that a finding allows; infinite where it is not told.

    `loop_bias` computes it: the largest of J, B and K, in % of half their intervals.
    """
    if finding.name != "loop_bias":
        return math.inf
    low, high = (getattr(fit, f"{c.measure.name}_{end}") for end in ("low", "high"))
    bias = finding.value / 100.0 * (high - low) / 2.0
    return bias if math.isfinite(bias) else math.inf


def _of_degrees(inertia: Comparison) -> Iterator[Finding]:
    """Yield that inertias differ as degrees do from radians."""
    low, high = sorted(inertia.summaries[name].median for name in inertia.pair)
    if low > 0 and DEGREES / UNIT_WITHIN < high / low < DEGREES * UNIT_WITHIN:
        yield _differs(inertia, {"variant": "degrees"})


def _of_inertia(c: Comparison, inertia: Comparison, flagged: Flagged) -> Iterator[Finding]:
    """Yield that the inertia differs, as far as that may have made the difference.

    What makes another inertia, such as a unit or torque of the subject, changes B and K in
    proportion.
    """
    of_each = [_share(by_units(one, one.days)) for one in (inertia, c)]
    if c is inertia or of_each[0] > SHARE_OF_INERTIA * of_each[1]:
        carried = {**_carried(c, flagged), "variant": "flagged"} if flagged else {}
        yield _differs(inertia, carried)


def _differs(inertia: Comparison, facts: Mapping[str, Fact]) -> Finding:
    d = by_units(inertia, inertia.days)  # as the table of differences has it
    of_each: dict[str, Fact] = {"reference": inertia.reference, "first": d.reference}
    of_each |= {"other": inertia.other, "second": d.other}
    size = abs(100.0 * d.estimate / d.reference)
    return found_between("inertia_of_conditions", {**facts, **of_each}, size)


def _share(d: Difference) -> float:
    """Return a difference as a share of the larger value."""
    return abs(d.estimate) / max(abs(d.reference), abs(d.other))


def _cleared(test: Test, result: StudyResult) -> bool:
    """Whether a method that the subject's own torque does not bias shows the difference too."""
    return any(
        row.measure.name == test.comparison.measure.name
        and method_named(row.method).uses_perturbation
        and (row.p if math.isnan(row.p_day) else row.p_day) < LEVEL
        and row.shift * test.sign < 0  # the shift is reference − other
        for row in result.sensitivity
    )


def _of_groups(groups: Mapping[str, Test]) -> Finding:
    """Return that groups of subjects differ in what the condition does, and how."""
    each = [
        f"{name} {signed(again.difference.percent, again.difference.tested).value} ({again.said})"
        for name, again in groups.items()
    ]
    return found_between("groups_differ", {"groups": ", ".join(each)}, len(groups))


def _one_sided(test: Test, ratings: RatingsFound) -> Iterator[Finding]:
    """Yield that an examiner who rated one condition alone makes the difference."""
    if examiners := rated_one_condition(ratings):
        again = by_days(test.comparison, without_examiners(ratings, examiners))
        if not again.agrees(test):
            yield _of_examiners(examiners, {"without": again.said})


def _of_examiners(examiners: Sequence[str], facts: Mapping[str, Fact]) -> Finding:
    who = f"examiner{'s' * (len(examiners) > 1)} {', '.join(examiners)}"
    name = "examiners_of_one_condition"
    return found_between(name, {**facts, "who": who}, len(examiners))


def _in_order(c: Comparison) -> Iterator[Finding]:
    """Yield that all days of one condition came after all days of the other, in every subject."""
    days: dict[str, tuple[set[str], set[str]]] = {}
    for k, name in enumerate(c.pair):
        for o in c.of(name):
            days.setdefault(o.subject, (set(), set()))[k].add(o.day)
    later = {_later(*both) for both in days.values() if all(both)}
    if len(later) == 1 and (last := later.pop()) is not None:
        n = sum(len(both[last]) for both in days.values())
        facts = {"later": c.pair[last], "earlier": c.pair[1 - last]}
        yield found_between("order_of_conditions", facts, n)


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
