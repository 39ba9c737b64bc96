"""What was measured, what was tested, and what is concluded, in words.

Always in this order, the same on the terminal, on the page and in documents. The first speaks of
these recordings alone, whatever their number; only the last speaks of the conditions.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, NamedTuple

from rigidimeter.analysis.study.caveats import groups_of
from rigidimeter.analysis.study.compared import Compared, Verdict, signed
from rigidimeter.analysis.study.comparisons import precisions
from rigidimeter.analysis.study.measures import LEVEL, Role
from rigidimeter.analysis.study.rows import counting
from rigidimeter.analysis.study.study import Study
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

LEAST_P = 0.0001
"""Below this a sentence does not say how small p is; tables do."""
FEWEST_SUBJECTS = 3
"""Fewer subjects than this stand for themselves alone."""
MEASUREMENT_ALONE = (
    "In brackets: 95 % interval from measurement error only, without day-to-day variation."
)
KINDS = {
    "not done": "not recorded",
    "not planned": "not planned",
    "out of order": "out of order",
    "short wait": "begun too early",
    "unknown wait": "begun after an unknown wait",
    "other protocol": "with another protocol",
    "cut short": "with epochs missing",
    "plan edited": "before the plan was changed",
}
"""What a deviation from the plan is called in a sentence on several."""

_ALL_PERCENT = 100.0
_EACH = {"day": " in both conditions", "value": " in each", "recording": " in each"}


class Statement(NamedTuple):
    """Three statements on two conditions; `concluded` has a sentence for each verdict."""

    measured: str
    tested: str
    concluded: tuple[str, ...]


class _Pair:
    """What is concluded of two conditions, and in whom."""

    def __init__(self, study: Study, concluded: Sequence[Compared]) -> None:
        self.each = concluded
        self.reference, self.other = map(condition_name, concluded[0].pair)
        self.by = concluded[0].by
        self.groups = groups_of(counting(study.rows, concluded[0].measure.name), concluded[0].pair)
        self.columns = [one.measure.short for one in concluded if one.measure.origin == "column"]
        self.where, self.reach = self._whom(study)

    def of(self, verdict: Verdict, role: Role | None = None) -> list[Compared]:
        """Return those with a verdict, of one role where that is given."""
        return [one for one in self.each if one.verdict == verdict and role in (None, one.role)]

    def _whom(self, study: Study) -> tuple[str, str]:
        """Return whom a conclusion speaks of, and for what other days or subjects it holds.

        Days sampled of one subject or two say nothing of other subjects. Both are empty where the
        subjects are not known, or no test sampled days or subjects.
        """
        sampled = [one for one in self.each if one.by == "days" and one.tested]
        weighed = {s for one in sampled for own in one.weights for s, _ in own}
        if not weighed:
            for one in self.each:
                rows = counting(study.rows, one.measure.name)
                weighed |= {*rows.loc[rows["condition"].isin(one.pair), "subject"]}
        if not weighed or "" in weighed:
            return "", ""
        count = len(weighed)
        these = {1: "this subject", 2: "these two subjects"}.get(count, f"these {count} subjects")
        if self.by != "days":
            return f"in {these}", ""
        if {one.unit for one in sampled} == {"subject"} and count >= FEWEST_SUBJECTS:
            return f"in {these}", "subjects like these"
        return f"in {these}", f"other days of {these}, not for other subjects"

    @property
    def than(self) -> str:
        """``in DBS than in OFF``; a difference is claimed of all groups or of none."""
        each = f" in each of the groups {series(self.groups)}" if self.groups else ""
        return f"in {self.other} than in {self.reference}{each}"

    def beginning(self, where: str, clause: str) -> str:
        """Return a clause as the beginning of a sentence, after whom it speaks of.

        The name of a column of a table stays as it is.
        """
        text = f"{where}, {clause}" if where else clause
        if any(text.startswith(f"{name} ") for name in self.columns):
            return text
        return text[:1].upper() + text[1:]


def statements(study: Study, concluded: Sequence[Compared]) -> dict[str, Statement]:
    """Return the statements on each condition beside the reference, by its name."""
    return {
        pair.each[0].other: Statement(_measured(pair), _tested(pair), tuple(_concluded(pair)))
        for pair in _pairs(study, concluded)
    }


def statement(study: Study, concluded: Sequence[Compared]) -> Statement | None:
    """Return the statements on all pairs beside each other; None where no two were compared.

    Where there are several, each begins with the difference that it is of.
    """
    each = tuple(statements(study, concluded).values())
    if len(each) < 2:
        return each[0] if each else None
    which = [f"{pair.other} − {pair.reference}: " for pair in _pairs(study, concluded)]
    measured = [one.measured.removesuffix(f" {MEASUREMENT_ALONE}") for one in each]
    if any(one.measured.endswith(MEASUREMENT_ALONE) for one in each):
        measured.append(MEASUREMENT_ALONE)
    tested = [one.tested for one in each]
    if len(set(tested)) > 1:
        tested = [f"{name}{text}" for name, text in zip(which, tested, strict=True)]
    return Statement(
        " ".join(measured),
        " ".join(dict.fromkeys(tested)),
        tuple(
            f"{name}{sentence}"
            for name, one in zip(which, each, strict=True)
            for sentence in one.concluded
        ),
    )


def lead(study: Study, concluded: Sequence[Compared]) -> str:
    """Return the sentence to quote."""
    prefix = "Virtual data. " if study.virtual or study.partly_virtual else ""
    if study.blinded:
        prefix += "Blinded: the names of the conditions are codes. "
    pairs = _pairs(study, concluded)
    if not pairs:
        return prefix + _only_condition(study)
    main = pairs[0]
    shown = [one for one in main.each if one.verdict in ("lower", "higher")]
    shown = [one for one in shown if one.role == "primary"]
    text = f"{_measured(main)} {_concluded(main)[0]}"
    if shown:
        quoted = main.beginning(main.where, _quoted(main, shown))
        intervals = f" The intervals hold for {main.reach}." if main.reach else ""
        text = f"{quoted}{_adjusted(main, 'primary')}.{intervals}"
    paths = {out.path for out in study.left_out}
    if paths:
        total = len(paths | {session.source for session in study.sessions})
        are = "is" if len(paths) == 1 else "are"
        text += f" {len(paths)} of {plural(total, 'session')} {are} left out."
    return prefix + text


def deviation_sentence(study: Study, again: Sequence[Mapping[str, Any]]) -> str:
    """Return one sentence on all deviations from the plan, and what depends on them; or nothing.

    Parameters
    ----------
    study : Study
    again : sequence of mapping
        As `without_deviating`.
    """
    if not study.deviations:
        return ""
    kinds = Counter(one.kind for one in study.deviations)
    counted = series([f"{count} {KINDS[kind]}" for kind, count in kinds.items()])
    words = series([row["words"] for row in again])
    depends = f" Without the sessions that deviate: {words} (p unadjusted)." if again else ""
    return f"Sessions not as planned: {counted}.{depends}"


def _pairs(study: Study, concluded: Sequence[Compared]) -> list[_Pair]:
    """Return the pairs of two conditions."""
    others = dict.fromkeys(one.other for one in concluded if one.other)
    return [_Pair(study, [one for one in concluded if one.other == other]) for other in others]


def _quoted(pair: _Pair, shown: Sequence[Compared]) -> str:
    """Return ``stiffness K was lower in DBS than in OFF: −18 % (95 % interval …, p = 0.004)``."""
    parts: list[str] = []
    before: Compared | None = None
    for one in shown:
        size = signed(one.percent(one.of_test), one.of_test, one.measure.unit)
        inside = [f"95 % interval {size.ends}"] if size.ends else []
        inside += [one.test] if one.test and (before is None or one.test != before.test) else []
        inside.append(p_text(one.p_adjusted, LEAST_P))
        went = ""
        if before is None:
            went = f" was {one.verdict} {pair.than}:"
        elif one.verdict != before.verdict:
            went = f" was {one.verdict}:"
        parts.append(f"{within(one.measure.title)}{went} {size.value} ({', '.join(inside)})")
        before = one
    return series(parts)


def _measured(pair: _Pair) -> str:
    """Return ``Between these recordings, DBS − OFF: K −26 % (−26.1 to −25.9), …``.

    Measures without an interval of their own stand in the table alone, where others have one.
    """
    parts: list[str] = []
    known = [one for one in pair.each if not math.isnan(one.difference)]
    for one in [o for o in known if not math.isnan(o.measured_half)] or known:
        sizes = one.of_measurement
        size = signed(one.percent(sizes), sizes, one.measure.unit, 1.0)
        ends = f" ({size.ends.removesuffix(' %')})" if size.ends else ""
        parts.append(f"{one.measure.short} {size.value}{ends}")
    if not parts:
        return "No measure has values in both conditions."
    alone = f" {MEASUREMENT_ALONE}" if "(" in "".join(parts) else ""
    of = f" of {series(pair.groups)} together" if pair.groups else ""
    what = "values" if pair.by == "values" else "recordings"
    return f"Between these {what}{of}, {pair.other} − {pair.reference}: {series(parts)}.{alone}"


def _tested(pair: _Pair) -> str:
    """Return by what the measures were tested, and for how many tests p is adjusted."""
    tests: dict[str, list[str]] = {}
    for one in pair.each:
        if one.test and one.tested:
            tests.setdefault(one.test, []).append(one.measure.short)
    if not tests:
        return "Nothing could be tested."
    of = len(tests) > 1
    text = "; ".join(f"{test} ({', '.join(own)})" if of else test for test, own in tests.items())
    return f"{text[:1].upper()}{text[1:]}{_adjusted(pair, 'primary', 'secondary')}."


def _adjusted(pair: _Pair, *roles: Role) -> str:
    """Return for which tests p is adjusted, as the end of a sentence that gives p."""
    parts: list[str] = []
    for role in roles:
        own = [one for one in pair.each if one.role == role and one.tested]
        if not own or (tests := own[0].family.tests) < 2:
            continue
        family = own[0].family
        if family.rule == "sequence":
            own.sort(key=lambda one: family.order.index(one.measure.name))
        names = _names(own)
        further = f" ({tests} tests)" if tests != len(own) else ""
        if family.rule == "sequence":
            parts.append(f"adjusted in the declared sequence of {names}{further}")
        else:
            again = bool(parts) and parts[-1].startswith("Holm")  # named once
            parts.append(f"{'' if again else 'Holm-adjusted '}over {names}{further}")
    text = ", and apart ".join(parts)
    return f"; p {text}; each 95 % interval is unadjusted" if parts else ""


def _concluded(pair: _Pair) -> list[str]:
    """Return a sentence for each verdict and reason, the most important first."""
    both = f"{pair.reference} and {pair.other}"
    wanted = f"{pair.each[0].wanted_percent:g} %"
    outcomes = [one for one in pair.each if one.role != "check"] or pair.each
    found = _claims(pair, "primary")
    if found and pair.reach:
        found[-1] += f". This holds for {pair.reach}"
    of_whom = max(len(found), 1)
    for caution, beside in _by_caution(outcomes):
        found.append(f"caution for {_names(beside)}: {caution}")
    for reason, withheld in _by_reason(outcomes, "not supported"):
        found.append(f"a difference in {_names(withheld)} is not supported: {reason}")
    for reason, withheld in _by_reason(outcomes, "no difference shown"):
        why = f": {reason}" if reason else ""
        found.append(
            f"no difference of {wanted} between {both} is shown in {_names(withheld)}{why}"
            f"{_excluded(_foremost(pair, withheld))}"
        )
    for reason, withheld in _by_reason(outcomes, "cannot be decided"):
        foremost = _foremost(pair, withheld)
        found.append(
            f"whether {both} differ in {_names(withheld)} cannot be decided: {reason}"
            f"{_excluded(foremost)}{_would_decide(foremost)}"
        )
    sentences = [
        pair.beginning(pair.where if k < of_whom else "", one) for k, one in enumerate(found)
    ]
    in_whom = f"{pair.where}, " if pair.where and found else ""
    secondary = _claims(pair, "secondary")
    sentences += [pair.beginning("", f"secondary: {in_whom}{one}") for one in secondary]
    return [f"{sentence}." for sentence in sentences]


def _claims(pair: _Pair, role: Role) -> list[str]:
    found = []
    sides: tuple[Literal["lower", "higher"], ...] = ("lower", "higher")
    for side in sides:
        if own := pair.of(side, role):
            are = "is" if len(own) == 1 else "are"
            found.append(f"{_names(own)} {are} {side} {pair.than}")
    return found


def _foremost(pair: _Pair, members: Sequence[Compared]) -> Sequence[Compared]:
    """Leave secondary measures to the table, where there are primary ones."""
    primary = any(one.role == "primary" for one in pair.each)
    return [one for one in members if one.role == "primary" or not primary]


def _names(members: Iterable[Compared]) -> str:
    return series([one.measure.short for one in members])


def _excluded(members: Iterable[Compared]) -> str:
    """Return ``; excluded (95 %): K more than 31 % lower or 4 % higher, B …``."""
    parts: list[str] = []
    alone: list[str] = []
    for one in members:
        if one.p < LEVEL <= one.p_adjusted:
            each = p_text(one.p), p_text(one.p_adjusted)
            alone.append(f"; {one.measure.short} has {each[0]} alone, {each[1]} adjusted")
        percent = one.percent(one.of_test)
        known = not math.isnan(percent[0])
        estimate, low, high = percent if known else one.of_test
        if math.isnan(low):
            continue
        after = " %" if known else f" {one.measure.unit}".rstrip()
        digits = clear_of_zero(decimals((high - low) / 2, estimate), low, high)
        sides = [("lower", -low), ("higher", high)]
        if known and -low >= _ALL_PERCENT:  # of what is above zero no more can be lost
            sides = sides[1:]
        if not one.p_adjusted < LEVEL:  # what p does not exclude after the adjustment
            sides = [side for side in sides if side[1] > 0]
        words = [
            f"{'more than ' * (not k)}{fixed(end, digits)}{after} {side}"
            if end > 0
            else f"{side} at all"
            for k, (side, end) in enumerate(sides)
        ]
        if words:
            parts.append(f"{one.measure.short} {' or '.join(words)}")
    excluded = f"; excluded (95 %): {', '.join(parts)}" if parts else ""
    return f"{excluded}{''.join(alone)}"


def _would_decide(withheld: Iterable[Compared]) -> str:
    """Return what would show a difference, for the first measure where that is known."""
    for one in withheld:
        if one.needed is not None:
            many = f"{plural(one.needed.number, one.needed.unit)}{_EACH.get(one.needed.unit, '')}"
            return (
                f"; with {many} a difference of {one.wanted_percent:g} % in "
                f"{one.measure.short} would be shown with a chance of 80 %"
            )
    return ""


def _by_caution(members: Iterable[Compared]) -> list[tuple[str, list[Compared]]]:
    """Return the rows that a caution stands beside, by the caution."""
    found: dict[str, list[Compared]] = {}
    for one in members:
        if one.caution is not None:
            found.setdefault(within(one.caution.headline), []).append(one)
    return list(found.items())


def _by_reason(members: Iterable[Compared], verdict: Verdict) -> list[tuple[str, list[Compared]]]:
    """Return the rows of a verdict that share a reason, as the first of each come."""
    found: dict[str, list[Compared]] = {}
    for one in members:
        if one.verdict == verdict:
            found.setdefault(one.reason, []).append(one)
    return list(found.items())


def _only_condition(study: Study) -> str:
    """Return the values of the only condition, where there is nothing to compare."""
    parts = []
    for one in precisions(study.rows, study.reference):
        half = one["half_width_percent"]
        ends = "" if math.isnan(half) else f" ± {number(half, 2)} %"
        parts.append(f"{within(one['title'])} {amount(one['value'], one['unit'], 3)}{ends}")
    if not parts:
        return "No epoch could be included; the reasons are listed under “Exclusions”."
    name = f"{condition_name(study.reference)}: " if study.reference else ""
    text = f"{name}{', '.join(parts)} (95 % intervals)."
    return text[:1].upper() + text[1:]
