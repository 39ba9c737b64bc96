"""What was measured, what was tested, and what is concluded, in words.

Always in this order, the same on the terminal, on the page and in documents. The first speaks of
these recordings alone, whatever their number; only the last speaks of the conditions.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Literal, NamedTuple

from rigidimeter.analysis.study.compared import Comparison
from rigidimeter.analysis.study.conclusions import Conclusion, Conclusions, Verdict, conclude
from rigidimeter.analysis.study.differences import signed
from rigidimeter.analysis.study.families import Role
from rigidimeter.analysis.study.reached_precision import precisions
from rigidimeter.analysis.study.results import StudyResult
from rigidimeter.analysis.study.tested import LEVEL
from rigidimeter.core.words import (
    amount,
    clear_of_zero,
    condition_name,
    decimals,
    fixed,
    number,
    p_text,
    plural,
    series,
    within,
)

_ALL_PERCENT = 100.0

LEAST_P = 0.0001
"""Below this a sentence does not say how small p is; tables do."""
FEWEST_SUBJECTS = 3
"""Fewer subjects than this stand for themselves alone."""
MEASUREMENT_ALONE = (
    "In brackets: 95 % interval from measurement error only, without day-to-day variation."
)


class Statements(NamedTuple):
    """Three statements on two conditions; `concluded` has a sentence for each verdict."""

    measured: str
    tested: str
    concluded: tuple[str, ...]


def statements(result: StudyResult) -> Statements | None:
    """Return the statements on a pair of conditions; None where no two were compared."""
    concluded = conclude(result)
    if concluded is None:
        return None
    return Statements(_measured(concluded), _tested(concluded), tuple(_concluded(concluded)))


def statements_of_all(result: StudyResult) -> Statements | None:
    """Return the statements on each comparison with the reference, beside each other.

    Where there are several, each begins with the difference that it is of.
    """
    told = [
        (f"{condition_name(pair.other)} − {condition_name(pair.reference)}: ", said)
        for pair in (result, *result.further_pairs)
        if (said := statements(pair)) is not None
    ]
    if len(told) < 2:
        return told[0][1] if told else None
    measured = [said.measured.removesuffix(f" {MEASUREMENT_ALONE}") for _, said in told]
    if any(said.measured.endswith(MEASUREMENT_ALONE) for _, said in told):
        measured.append(MEASUREMENT_ALONE)
    tested = [said.tested for _, said in told]
    if len(set(tested)) > 1:
        tested = [f"{which}{said.tested}" for which, said in told]
    return Statements(
        " ".join(measured),
        " ".join(dict.fromkeys(tested)),
        tuple(f"{which}{sentence}" for which, said in told for sentence in said.concluded),
    )


def lead(result: StudyResult) -> str:
    """Return the sentence to quote."""
    prefix = ""
    if result.virtual or any(epoch.virtual for epoch in result.epochs):
        prefix = "Virtual data. "
    if result.blinded:
        prefix += "Blinded: the names of the conditions are codes. "
    concluded = conclude(result)
    if concluded is None:
        return prefix + _only_condition(result)
    shown = [one for one in concluded.of("lower", "higher") if one.role == "primary"]
    said = f"{_measured(concluded)} {_concluded(concluded)[0]}"
    if shown:
        where, reach = _whom(concluded)
        quoted = _beginning(where, _quoted(shown), _columns(concluded))
        intervals = f" The intervals hold for {reach}." if reach else ""
        said = f"{quoted}{_adjusted(concluded, 'primary')}.{intervals}"
    paths = {out.path for out in result.left_out}
    if paths:
        total = len(paths | {session.source for session in result.sessions})
        are = "is" if len(paths) == 1 else "are"
        said += f" {len(paths)} of {plural(total, 'session')} {are} left out."
    return prefix + said


def _quoted(shown: Sequence[Conclusion]) -> str:
    """Return ``stiffness K was lower in DBS than in OFF: −18 % (95 % interval …, p = 0.004)``."""
    parts: list[str] = []
    before: Conclusion | None = None
    for one in shown:
        c, d = one.comparison, one.difference
        size = signed(d.percent, d.tested, c.measure.unit)
        inside = [f"95 % interval {size.ends}"] if size.ends else []
        inside += [one.test] if one.test and (before is None or one.test != before.test) else []
        inside.append(p_text(one.p, LEAST_P))
        went = ""
        if before is None:
            went = f" was {one.verdict} {_than(c)}:"
        elif one.verdict != before.verdict:
            went = f" was {one.verdict}:"
        parts.append(f"{within(c.measure.title)}{went} {size.value} ({', '.join(inside)})")
        before = one
    return series(parts)


def _whom(concluded: Conclusions) -> tuple[str, str]:
    """Return whom a conclusion speaks of, and what its intervals hold for beyond the recordings.

    Days sampled of one subject or two say nothing of other subjects. Both are empty where the
    subjects are not known, or no test sampled days or subjects.
    """
    weighed: dict[str, None] = {}
    units = set()
    for one in concluded.each:
        days = one.comparison.days
        if days is not None and not math.isnan(one.p):
            units.add(days.unit)
            weighed.update((subject, None) for own in days.weights for subject, _ in own)
    if not weighed:
        weighed.update(
            (o.subject, None)
            for one in concluded.each
            for name in one.comparison.pair
            for o in one.comparison.of(name)
        )
    if not weighed or "" in weighed:
        return "", ""
    count = len(weighed)
    these = {1: "this subject", 2: "these two subjects"}.get(count, f"these {count} subjects")
    if concluded.basis != "days":
        return f"in {these}", ""
    if units == {"subject"} and count >= FEWEST_SUBJECTS:
        return f"in {these}", "subjects like these"
    return f"in {these}", f"other days of {these}, not for other subjects"


def _than(c: Comparison) -> str:
    """Return ``in DBS than in OFF``; a difference is claimed of all groups or of none."""
    each = f" in each of the groups {series(c.groups)}" if c.groups else ""
    return f"in {condition_name(c.other)} than in {condition_name(c.reference)}{each}"


def _beginning(where: str, clause: str, names: Iterable[str] = ()) -> str:
    """Return a clause as the beginning of a sentence, after whom it speaks of.

    One of the `names`, of columns of a table, stays as it is.
    """
    text = f"{where}, {clause}" if where else clause
    if any(text.startswith(f"{name} ") for name in names):
        return text
    return text[:1].upper() + text[1:]


def _columns(concluded: Conclusions) -> list[str]:
    measures = (one.comparison.measure for one in concluded.each)
    return [measure.short for measure in measures if measure.origin == "column"]


def _measured(concluded: Conclusions) -> str:
    """Return ``Between these recordings, DBS − OFF: K −26 % (−26.1 to −25.9), …``.

    Measures without an interval of their own stand in the table alone, where others have one.
    """
    parts: list[str] = []
    known = [one for one in concluded.each if not math.isnan(one.difference.estimate)]
    for one in [o for o in known if not math.isnan(o.difference.measured_half)] or known:
        c, d = one.comparison, one.difference
        size = signed(d.measured_percent, d.measured, c.measure.unit, 1.0)
        ends = f" ({size.ends.removesuffix(' %')})" if size.ends else ""
        parts.append(f"{c.measure.short} {size.value}{ends}")
    if not parts:
        return "No measure has values in both conditions."
    pair = concluded.each[0].comparison
    difference = f"{condition_name(pair.other)} − {condition_name(pair.reference)}"
    alone = f" {MEASUREMENT_ALONE}" if "(" in "".join(parts) else ""
    of = f" of {series(pair.groups)} together" if pair.groups else ""
    what = "values" if concluded.basis == "values" else "recordings"
    return f"Between these {what}{of}, {difference}: {series(parts)}.{alone}"


def _tested(concluded: Conclusions) -> str:
    """Return by what the measures were tested, and for how many tests p is adjusted."""
    tests: dict[str, list[str]] = {}
    for one in concluded.each:
        if one.test and not math.isnan(one.p):
            tests.setdefault(one.test, []).append(one.comparison.measure.short)
    if not tests:
        return "Nothing could be tested."
    of = len(tests) > 1
    text = "; ".join(f"{test} ({', '.join(own)})" if of else test for test, own in tests.items())
    return f"{text[:1].upper()}{text[1:]}{_adjusted(concluded, 'primary', 'secondary')}."


def _adjusted(concluded: Conclusions, *roles: Role) -> str:
    """Return for which tests p is adjusted, as the end of a sentence that gives p."""
    parts: list[str] = []
    for role in roles:
        own = [one for one in concluded.each if one.role == role and not math.isnan(one.p)]
        if not own or (tests := own[0].family.tests) < 2:
            continue
        family = own[0].family
        if family.rule == "sequence":
            own.sort(key=lambda one: family.order.index(one.comparison.measure.name))
        names = series([one.comparison.measure.short for one in own])
        further = f" ({tests} tests)" if tests != len(own) else ""
        if family.rule == "sequence":
            parts.append(f"adjusted in the declared sequence of {names}{further}")
        else:
            again = bool(parts) and parts[-1].startswith("Holm")  # named once
            parts.append(f"{'' if again else 'Holm-adjusted '}over {names}{further}")
    text = ", and apart ".join(parts)
    return f"; p {text}; each 95 % interval is unadjusted" if parts else ""


def _concluded(concluded: Conclusions) -> list[str]:
    """Return a sentence for each verdict and reason, the most important first."""
    pair = concluded.each[0].comparison
    both = f"{condition_name(pair.reference)} and {condition_name(pair.other)}"
    where, reach = _whom(concluded)
    wanted = f"{concluded.each[0].wanted_percent:g} %"

    def names(members: Iterable[Conclusion]) -> str:
        return series([one.comparison.measure.short for one in members])

    def claims(role: Role) -> list[str]:
        found = []
        sides: tuple[Literal["lower", "higher"], ...] = ("lower", "higher")
        for side in sides:
            if own := [one for one in concluded.of(side) if one.role == role]:
                are = "is" if len(own) == 1 else "are"
                found.append(f"{names(own)} {are} {side} {_than(pair)}")
        return found

    def foremost(members: Sequence[Conclusion]) -> Sequence[Conclusion]:
        """Leave secondary measures to the table, where there are primary ones."""
        primary = any(one.role == "primary" for one in concluded.each)
        return [one for one in members if one.role == "primary" or not primary]

    outcomes = [one for one in concluded.each if one.role != "check"] or concluded.each
    found = claims("primary")
    if found and reach:
        found[-1] += f". This holds for {reach}"
    of_whom = max(len(found), 1)
    for caution, beside in _by_caution(outcomes):
        found.append(f"caution for {names(beside)}: {caution}")
    for reason, withheld in _by_reason(outcomes, "not supported"):
        found.append(f"a difference in {names(withheld)} is not supported: {reason}")
    for reason, withheld in _by_reason(outcomes, "no difference shown"):
        why = f": {reason}" if reason else ""
        found.append(
            f"no difference of {wanted} between {both} is shown in {names(withheld)}{why}"
            f"{_excluded(foremost(withheld))}"
        )
    for reason, withheld in _by_reason(outcomes, "cannot be decided"):
        found.append(
            f"whether {both} differ in {names(withheld)} cannot be decided: {reason}"
            f"{_excluded(foremost(withheld))}{_would_decide(foremost(withheld))}"
        )
    columns = _columns(concluded)
    sentences = [
        _beginning(where if k < of_whom else "", one, columns) for k, one in enumerate(found)
    ]
    in_whom = f"{where}, " if where and found else ""
    sentences += [_beginning("", f"secondary: {in_whom}{one}") for one in claims("secondary")]
    return [f"{sentence}." for sentence in sentences]


def _excluded(members: Iterable[Conclusion]) -> str:
    """Return ``; excluded (95 %): K more than 31 % lower or 4 % higher, B …``."""
    parts: list[str] = []
    alone: list[str] = []
    for one in members:
        if one.difference.p < LEVEL <= one.p:
            each = p_text(one.difference.p), p_text(one.p)
            alone.append(
                f"; {one.comparison.measure.short} has {each[0]} alone, {each[1]} adjusted"
            )
        known = not math.isnan(one.difference.percent[0])
        estimate, low, high = one.difference.percent if known else one.difference.tested
        if math.isnan(low):
            continue
        after = " %" if known else f" {one.comparison.measure.unit}".rstrip()
        digits = clear_of_zero(decimals((high - low) / 2, estimate), low, high)
        sides = [("lower", -low), ("higher", high)]
        if known and -low >= _ALL_PERCENT:  # of what is above zero no more can be lost
            sides = sides[1:]
        if not one.p < LEVEL:  # what p does not exclude after the adjustment
            sides = [side for side in sides if side[1] > 0]
        words = [
            f"{'more than ' * (not k)}{fixed(end, digits)}{after} {side}"
            if end > 0
            else f"{side} at all"
            for k, (side, end) in enumerate(sides)
        ]
        if words:
            parts.append(f"{one.comparison.measure.short} {' or '.join(words)}")
    excluded = f"; excluded (95 %): {', '.join(parts)}" if parts else ""
    return f"{excluded}{''.join(alone)}"


def _would_decide(withheld: Iterable[Conclusion]) -> str:
    """Return what would show a difference, for the first measure where that is known."""
    for one in withheld:
        if one.needed is not None:
            number, unit = one.needed
            in_each = {"day": " in both conditions", "value": " in each", "recording": " in each"}
            many = f"{plural(number, unit)}{in_each.get(unit, '')}"
            return (
                f"; with {many} a difference of {one.wanted_percent:g} % in "
                f"{one.comparison.measure.short} would be shown with a chance of 80 %"
            )
    return ""


def _by_caution(members: Iterable[Conclusion]) -> list[tuple[str, list[Conclusion]]]:
    """Return the conclusions that a caution stands beside, by the caution."""
    found: dict[str, list[Conclusion]] = {}
    for one in members:
        if one.caution is not None:
            found.setdefault(within(one.caution.headline), []).append(one)
    return list(found.items())


def _by_reason(
    members: Iterable[Conclusion], verdict: Verdict
) -> list[tuple[str, list[Conclusion]]]:
    """Return the conclusions of a verdict that share a reason, as the first of each come."""
    found: dict[str, list[Conclusion]] = {}
    for one in members:
        if one.verdict == verdict:
            found.setdefault(one.reason, []).append(one)
    return list(found.items())


def _only_condition(result: StudyResult) -> str:
    """Return the values of the only condition, where there is nothing to compare."""
    parts = []
    for one in precisions(result):
        ends = "" if math.isnan(one.percent) else f" ± {number(one.percent, 2)} %"
        parts.append(f"{within(one.measure.title)} {amount(one.value, one.measure.unit, 3)}{ends}")
    if not parts:
        return "No epoch could be included; the reasons are listed under “Exclusions”."
    name = f"{condition_name(result.reference)}: " if result.reference else ""
    text = f"{name}{', '.join(parts)} (95 % intervals)."
    return text[:1].upper() + text[1:]
