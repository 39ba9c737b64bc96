"""What a study folder shows, in sentences that go no further than its numbers.

A difference is "shown" where the day-aware p, adjusted by Holm's method for the number of measures,
is below one less the confidence. An effect leads where the p of its difference from another,
adjusted for all pairs, is. A conclusion depends on the method where methods do not agree on whether
there is a difference, or on its sign.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from rigidimeter.reporting.numbers import interval, number, p_value
from rigidimeter.reporting.test_tables import day_holm, pair_holm, sorted_rows, tests_by_days
from rigidimeter.study import Cohort, MeasureEffect, SensitivityRow

__all__ = ["LEAST_SQUARES", "cohort_verdict", "method_dependence", "series"]

LEVEL = 0.05
SAME = 1e-12
LEAST_SQUARES = ("published", "bandlimited")
"""Voluntary torque in the loop pulls these away from the joint."""


def series(items: Sequence[str]) -> str:
    """Return ``a``, ``a and b`` or ``a, b and c``."""
    return " and ".join([", ".join(items[:-1]), items[-1]] if len(items) > 1 else items)


def lower_first(title: str) -> str:
    """Return a title as it stands within a sentence."""
    return title[:1].lower() + title[1:]


def cohort_verdict(cohort: Cohort) -> str:
    """Return what days show, and which effect leads; empty where no two conditions were tested."""
    sentences = [*_shown(cohort), *_leader(cohort)]
    if not sentences:
        return ""
    prefix = "Virtual data. " if cohort.virtual else ""
    prefix += "Blinded: conditions are codes. " if cohort.blinded else ""
    return prefix + " ".join(sentences)


def _shown(cohort: Cohort) -> list[str]:
    every = tests_by_days(cohort)
    tests = [test for test in every if not math.isnan(test.p)]
    adjusted = day_holm(cohort)
    if not tests:
        remarks = list(dict.fromkeys(test.remark for test in every if test.remark))
        return [f"Days could not be compared: {'; '.join(remarks)}."] if remarks else []
    groups: dict[str, list[str]] = {"lower": [], "higher": [], "nothing": []}
    for test in tests:
        p = adjusted[test.measure]
        shown = p < 1 - test.confidence
        side = ("lower" if test.estimate > 0 else "higher") if shown else "nothing"
        groups[side].append(f"{lower_first(test.title)} ({_p(p)})")
    reference, other = tests[0].reference, tests[0].other
    parts = [
        f"{other} is {side} than {reference} in {series(groups[side])}"
        for side in ("lower", "higher")
        if groups[side]
    ]
    nothing = f"no difference is shown in {series(groups['nothing'])}" if groups["nothing"] else ""
    text = "; ".join([*parts, *([nothing] if nothing else [])])
    how = _corrected(len(tests))
    sentence = f"When days count{how}, {text}."
    missing = [lower_first(t.title) for t in every if math.isnan(t.p)]
    return [sentence] + ([f"Not tested by days: {series(missing)}."] if missing else [])


def _corrected(count: int) -> str:
    return f" (p by Holm for {count} measures)" if count > 1 else ""


def _leader(cohort: Cohort) -> list[str]:
    effects = list(cohort.effects)
    if len(effects) < 2:
        return []
    largest = max(_size(effect) for effect in effects)
    first = [effect for effect in effects if _size(effect) > largest - SAME]
    titles = series([lower_first(effect.title) for effect in first])
    numbers = f"rank-biserial correlation {number(largest, 2)}"
    if len(first) == 1:
        numbers += f", r\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}{number(first[0].effects.r, 2)}"
    sentence = f"The largest effect is that of {titles} ({numbers})"
    if len(first) > 1:
        return [f"{sentence}: they are equal."]
    if not cohort.differences:
        return [f"{sentence}."]
    ahead, level, untold = _lead(cohort, first[0], effects)
    parts = [f"its lead is beyond chance over {series(ahead)}"] if ahead else []
    if level and not ahead:
        over = "any other" if len(effects) > 2 and not untold else series(level)
        parts.append(f"its lead over {over} is not beyond chance")
    elif level:
        parts[0] += f", not over {series(level)}"
    if untold:
        parts.append(f"how sure its lead over {series(untold)} is, is not known")
    return [f"{'; '.join([sentence, *parts])}."]


def _size(effect: MeasureEffect) -> float:
    return abs(effect.effects.rank_biserial)


def _lead(
    cohort: Cohort, first: MeasureEffect, effects: Sequence[MeasureEffect]
) -> tuple[list[str], list[str], list[str]]:
    """Return over whom the lead is beyond chance, over whom it is not, and where p is unknown."""
    adjusted = pair_holm(cohort)
    ahead: list[str] = []
    level: list[str] = []
    untold: list[str] = []
    for effect in effects:
        if effect is first:
            continue
        a, b = (first.measure, effect.measure), (effect.measure, first.measure)
        p = adjusted.get(a, adjusted.get(b, math.nan))
        place = untold if math.isnan(p) else ahead if p < LEVEL else level
        place.append(lower_first(effect.title))
    return ahead, level, untold


def method_dependence(cohort: Cohort) -> tuple[str, ...]:
    """Return a sentence or two for each measure: whether its conclusion depends on the method."""
    by_measure: dict[str, list[SensitivityRow]] = {}
    for row in sorted_rows(cohort.sensitivity):
        by_measure.setdefault(row.measure, []).append(row)
    pairs = [(test.reference, test.other) for test in tests_by_days(cohort)]
    pair = pairs[0] if pairs else ("the reference", "the other")
    return tuple(
        _dependence(rows, *pair)
        for rows in by_measure.values()
        if len({(row.method, row.inertia) for row in rows}) > 1
    )


def _said(row: SensitivityRow) -> int:
    """Return 1 or −1 where the row shows a difference of that sign, else 0."""
    p = row.p if math.isnan(row.p_day) else row.p_day
    return int(math.copysign(1, row.shift)) if p < LEVEL and row.shift else 0


def _dependence(rows: Sequence[SensitivityRow], reference: str, other: str) -> str:
    title = rows[0].title
    groups: dict[int, list[SensitivityRow]] = {}
    for row in rows:
        groups.setdefault(_said(row), []).append(row)
    if set(groups) == {0}:
        return f"{title}: no method shows a difference."
    if len(groups) == 1:
        return f"{title}: every method shows the difference. {_sizes(rows)}".rstrip()
    if {1, -1} <= set(groups):
        text = (
            f"{title}: the sign depends on the method: {_names(groups[1], rows)} "
            f"{_verb(groups[1], 'show')} {other} lower than {reference}, "
            f"{_names(groups[-1], rows)} higher"
        )
        return text + (f"; {_names(groups[0], rows)} neither." if 0 in groups else ".")
    shown, absent = groups[next(sign for sign in groups if sign)], groups[0]
    text = (
        f"{title}: the difference that {_names(shown, rows)} {_verb(shown, 'show')} is not "
        f"shown by {_names(absent, rows)}."
    )
    return f"{text} {_why(shown, absent)}".rstrip()


def _verb(rows: Sequence[SensitivityRow], verb: str) -> str:
    return verb if len({row.method for row in rows}) > 1 else f"{verb}s"


def _names(rows: Sequence[SensitivityRow], among: Sequence[SensitivityRow]) -> str:
    """Return methods, with J fixed or free where only one of both is meant."""
    held: dict[str, list[str]] = {}
    for row in rows:
        held.setdefault(row.method, []).append(row.inertia)
    told = []
    for method, ways in held.items():
        of_it = {row.inertia for row in among if row.method == method}
        told.append(f"“{method}”" + (f" (J {ways[0]})" if len(ways) < len(of_it) else ""))
    return series(told)


def _sizes(rows: Sequence[SensitivityRow]) -> str:
    """Say so where the size of a shift lies outside the interval of the one that is used."""
    chosen = next((row for row in rows if row.chosen), None)
    if chosen is None:
        return ""
    outside = [row for row in rows if not chosen.shift_low <= row.shift <= chosen.shift_high]
    if not outside:
        return ""
    far = max(outside, key=lambda row: abs(row.shift - chosen.shift))
    return (
        f"Its size depends on it: {number(far.shift, 3)} {far.unit} by {_names([far], rows)}, "
        f"outside the interval of “{chosen.method}”, {number(chosen.shift, 3)} "
        f"{interval(chosen.shift_low, chosen.shift_high, 3)}."
    )


def _why(shown: Sequence[SensitivityRow], absent: Sequence[SensitivityRow]) -> str:
    """Tell torque of the subject's own from mere lack of precision, where the intervals can.

    Such torque pulls all of least squares, so what one of its methods shows and another does not
    has another reason.
    """
    every = [*shown, *absent]
    instrumental = [row for row in absent if row.method not in LEAST_SQUARES]
    least = [row for row in shown if row.method in LEAST_SQUARES]
    unmoved = [row for row in absent if row.method in LEAST_SQUARES]
    if not instrumental and not least:
        return (
            "Torque of the subject’s own pulls least squares, and can hide a difference as well "
            "as make one."
        )
    if not instrumental or not least:
        return _alike(every) or _sizes(every)
    one = next((row for row in instrumental if row.chosen), instrumental[0])
    inside = [row for row in least if one.shift_low <= row.shift <= one.shift_high]
    ends = interval(one.shift_low, one.shift_high, 3)
    if inside:
        return (
            f"The interval of “{one.method}” {ends} holds the shift of {_names(inside, every)} "
            "too: a lack of precision could be the reason."
        )
    text = f"The interval of “{one.method}” {ends} leaves that shift out."
    if {row.method for row in unmoved} - {row.method for row in least}:
        return (
            f"{text} Voluntary torque would pull {_names(unmoved, every)} too, so it is not the "
            "likely reason."
        )
    return (
        f"{text} Voluntary torque would do this: it pulls least squares and not the instrumental "
        "estimate."
    )


def _alike(rows: Sequence[SensitivityRow]) -> str:
    """Say so where every shift lies in the interval of the one that is used."""
    one = next((row for row in rows if row.chosen), None)
    if one is None or not all(one.shift_low <= row.shift <= one.shift_high for row in rows):
        return ""
    return (
        f"All shifts lie in the interval of “{one.method}”, "
        f"{interval(one.shift_low, one.shift_high, 3)}: they differ in p more than in size."
    )


def _p(p: float) -> str:
    text = p_value(p)
    joined = text if text.startswith("<") else f"= {text}"
    return f"p {joined}".replace(" ", "\N{NO-BREAK SPACE}")
