"""What a result shows, in sentences that claim no more than its numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Literal, NamedTuple

from rigidimeter.analysis.report.numbers import (
    amount,
    condition_name,
    number,
    p_value,
    plural,
    series,
    within,
)
from rigidimeter.analysis.study import (
    Comparison,
    Conclusion,
    Conclusions,
    StudyResult,
    conclude,
    doubt_sentence,
    precisions,
)

_SIDES: tuple[Literal["lower", "higher"], ...] = ("lower", "higher")
_WITHHELD: dict[Literal["not supported", "cannot be decided"], str] = {
    "not supported": "A difference was found, but is not supported, in",
    "cannot be decided": "It cannot be decided whether the conditions differ in",
}


LEAST_P = 0.0001
"""Below this a sentence does not say how small p is; tables do."""


class Verdict(NamedTuple):
    """What a result shows: the sentence to quote, and what else there is to say."""

    lead: str
    rest: tuple[str, ...]


def verdict(result: StudyResult) -> Verdict:
    """Return what is shown, the first sentence to be quoted, and what is not."""
    prefix = ""
    if result.virtual or any(epoch.virtual for epoch in result.epochs):
        prefix = "Virtual data. "
    if result.blinded:
        prefix += "Blinded: the names of the conditions are codes. "
    concluded = conclude(result)
    if concluded is None:
        lead, *rest = [_only_condition(result)]
    else:
        lead, *rest = _sentences(result, concluded)
        for pair in result.further_pairs:
            further = conclude(pair)
            rest += [] if further is None else _sentences(pair, further)
        rest += _tested(concluded)
    lead += _left_out(result)
    return Verdict(prefix + lead, (*rest, *doubt_sentence(result.analysis)))


def _left_out(result: StudyResult) -> str:
    """Return how many sessions of a study do not count; nothing where all do."""
    paths = {out.path for out in result.left_out}
    if not paths:
        return ""
    total = len(paths | {session.source for session in result.sessions})
    are = "is" if len(paths) == 1 else "are"
    return f" {len(paths)} of {plural(total, 'session')} {are} left out."


def _sentences(result: StudyResult, concluded: Conclusions) -> list[str]:
    """Return a sentence for each kind of verdict, the most important first."""
    reference, other = condition_name(result.reference), condition_name(result.other)
    shown = [
        f"{other} is {side} than {reference} in {series(_with_size(own))}"
        for side in _SIDES
        if (own := concluded.of(side))
    ]
    if shown and (not_shown := concluded.of("not supported")):
        titles = series([_lower_first(one.comparison) for one in not_shown])
        shown.append(f"a difference in {titles} is not supported")
    found = [f"{'; '.join(shown)}."] if shown else []
    found += _withheld(concluded, "not supported")
    for reason, members in _by_reason(concluded.of("no difference shown")):
        titles = series([_lower_first(one.comparison) for one in members])
        least = min(one.p for one in members)
        p = _p(least)
        if any(one.p > least for one in members):
            p = p.replace("=", "≥")
        found.append(
            f"No difference between {reference} and {other} is shown in {titles} ({p}"
            f"{f'; {reason}' if reason else ''})."
        )
    return found + _withheld(concluded, "cannot be decided")


def _tested(concluded: Conclusions) -> list[str]:
    """Return what was compared in the tests, and for how many of them p is adjusted."""
    count = concluded.adjusted_for
    if not count:
        return []
    what = "measures" if count == concluded.tested else "tests"
    adjusted = f"; p adjusted by Holm’s method for {count} {what}" if count > 1 else ""
    return [f"Tested by {concluded.units}{adjusted}."]


def _withheld(
    concluded: Conclusions, verdict: Literal["not supported", "cannot be decided"]
) -> list[str]:
    found = []
    for reason, withheld in _by_reason(concluded.of(verdict)):
        titles = [_lower_first(one.comparison) for one in withheld]
        if verdict == "not supported":
            titles = [f"{title} ({_p(one.p)})" for title, one in zip(titles, withheld, strict=True)]
        found.append(f"{_WITHHELD[verdict]} {series(titles)}: {reason}.")
    return found


def _by_reason(members: Iterable[Conclusion]) -> list[tuple[str, list[Conclusion]]]:
    """Return the conclusions that share a reason, in the order of the first of each."""
    found: dict[str, list[Conclusion]] = {}
    for one in members:
        found.setdefault(one.reason, []).append(one)
    return list(found.items())


def _with_size(members: Iterable[Conclusion]) -> list[str]:
    """Return measures as ``stiffness K by 0.27 N·m/rad, 15 % (p = 0.003)``."""
    found = []
    for one in members:
        d = one.difference
        size = amount(abs(d.estimate), one.comparison.measure.unit, 2)
        if not math.isnan(d.percent[0]):
            size += f", {number(abs(d.percent[0]), 2)}\N{NO-BREAK SPACE}%"
        found.append(f"{_lower_first(one.comparison)} by {size} ({_p(one.p)})")
    return found


def _only_condition(result: StudyResult) -> str:
    """Return the values of the only condition, where there is nothing to compare."""
    parts = []
    for one in precisions(result):
        ends = ""
        if not math.isnan(one.percent):
            ends = f" ±\N{NO-BREAK SPACE}{number(one.percent, 2)}\N{NO-BREAK SPACE}%"
        parts.append(f"{within(one.measure.title)} {amount(one.value, one.measure.unit, 3)}{ends}")
    if not parts:
        return "No epoch could be included; the reasons are listed under “Exclusions”."
    name = f"{condition_name(result.reference)}: " if result.reference else ""
    text = f"{name}{', '.join(parts)} (95 % intervals); no two conditions are compared."
    return text[:1].upper() + text[1:]


def _p(p: float) -> str:
    text = p_value(p) if p >= LEAST_P else f"< {LEAST_P:.4f}"
    joined = text if text.startswith("<") else f"= {text}"
    return f"p {joined}".replace(" ", "\N{NO-BREAK SPACE}")


def _lower_first(c: Comparison) -> str:
    """Return the title of a measure as it is written within a sentence."""
    return within(c.measure.title)
