"""What a study folder shows, in sentences that go no further than its numbers."""

from __future__ import annotations

from collections.abc import Sequence

from rigidimeter.reporting.measures import lower_first
from rigidimeter.reporting.numbers import interval, number, p_value
from rigidimeter.study import (
    Comparison,
    Dependence,
    SensitivityRow,
    StudyResult,
    dependences,
    leader,
    verdict,
)

__all__ = ["method_dependence", "series", "study_verdict"]


def series(items: Sequence[str]) -> str:
    """Return ``a``, ``a and b`` or ``a, b and c``."""
    return " and ".join([", ".join(items[:-1]), items[-1]] if len(items) > 1 else items)


def study_verdict(study: StudyResult) -> str:
    """Return what days show, and which effect leads; empty where no two conditions were tested."""
    sentences = [*_shown(study), *_leader(study)]
    if not sentences:
        return ""
    prefix = "Virtual data. " if study.virtual else ""
    prefix += "Blinded: conditions are codes. " if study.blinded else ""
    return prefix + " ".join(sentences)


def _titles(comparisons: Sequence[Comparison]) -> str:
    return series([lower_first(c.measure.title) for c in comparisons])


def _shown(study: StudyResult) -> list[str]:
    found = verdict(study)
    if found is None or found.basis != "days":
        return []
    if not found.tested:
        remarks = list(dict.fromkeys(c.days.remark for c in found.untested if c.days))
        told = [remark for remark in remarks if remark]
        return [f"Days could not be compared: {'; '.join(told)}."] if told else []
    parts = [
        f"{study.other} is {side} than {study.reference} in {_with_p(members)}"
        for side, members in (("lower", found.lower), ("higher", found.higher))
        if members
    ]
    if found.undecided:
        parts.append(f"no difference is shown in {_with_p(found.undecided)}")
    how = f" (p by Holm for {found.tested} measures)" if found.tested > 1 else ""
    sentence = f"When days count{how}, {'; '.join(parts)}."
    untested = [f"Not tested by days: {_titles(found.untested)}."] if found.untested else []
    return [sentence, *untested]


def _with_p(comparisons: Sequence[Comparison]) -> str:
    return series([f"{lower_first(c.measure.title)} ({_p(c.days_p_holm)})" for c in comparisons])


def _leader(study: StudyResult) -> list[str]:
    found = leader(study)
    if found is None:
        return []
    effects = found.first[0].effects
    numbers = f"rank-biserial correlation {number(found.size, 2)}"
    if len(found.first) == 1 and effects is not None:
        numbers += f", r\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}{number(effects.r, 2)}"
    sentence = f"The largest effect is that of {_titles(found.first)} ({numbers})"
    if len(found.first) > 1:
        return [f"{sentence}: they are equal."]
    parts = []
    if found.ahead:
        parts = [f"its lead is beyond chance over {_titles(found.ahead)}"]
        if found.level:
            parts[0] += f", not over {_titles(found.level)}"
    elif found.level:
        every = len(found.level) > 1 and not found.unknown
        over = "any other" if every else _titles(found.level)
        parts = [f"its lead over {over} is not beyond chance"]
    if found.unknown:
        parts.append(f"how sure its lead over {_titles(found.unknown)} is, is not known")
    return [f"{'; '.join([sentence, *parts])}."]


def method_dependence(study: StudyResult) -> tuple[str, ...]:
    """Return a sentence or two for each measure: whether its conclusion depends on the method."""
    pair = (study.reference or "the reference", study.other or "the other")
    return tuple(_dependence(found, *pair) for found in dependences(study))


def _dependence(found: Dependence, reference: str, other: str) -> str:
    title, rows = found.rows[0].measure.title, found.rows
    if not found.lower and not found.higher:
        return f"{title}: no method shows a difference."
    if found.lower and found.higher:
        text = (
            f"{title}: the sign depends on the method: {_names(found.lower, rows)} "
            f"{_verb(found.lower, 'show')} {other} lower than {reference}, "
            f"{_names(found.higher, rows)} higher"
        )
        return text + (f"; {_names(found.none, rows)} neither." if found.none else ".")
    if not found.none:
        return f"{title}: every method shows the difference. {_why(found)}".rstrip()
    shown = found.lower or found.higher
    text = (
        f"{title}: the difference that {_names(shown, rows)} {_verb(shown, 'show')} is not "
        f"shown by {_names(found.none, rows)}."
    )
    return f"{text} {_why(found)}".rstrip()


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


def _why(found: Dependence) -> str:
    """Return what may explain the disagreement."""
    if found.reason == "least squares alone":
        return (
            "The subject’s own torque biases least squares, and can hide a difference as well as "
            "make one."
        )
    standard = found.standard
    if standard is None:
        return ""
    ends = interval(standard.shift_low, standard.shift_high, 3)
    names = _names(found.about, found.rows)
    if found.reason == "size":
        far = found.about[0]
        return (
            f"Its size depends on it: {number(far.shift, 3)} {far.measure.unit} by {names}, "
            f"outside the interval of “{standard.method}”, {number(standard.shift, 3)} {ends}."
        )
    if found.reason == "alike":
        return (
            f"All shifts lie in the interval of “{standard.method}”, {ends}: they differ in p more "
            "than in size."
        )
    if found.reason == "imprecise":
        return (
            f"The interval of “{standard.method}” {ends} holds the shift of {names} too: a lack of "
            "precision could be the reason."
        )
    text = f"The interval of “{standard.method}” {ends} does not hold that shift."
    if found.reason == "not voluntary":
        return f"{text} Voluntary torque would bias {names} too, so it is not the likely reason."
    return (
        f"{text} Voluntary torque would do this: it biases least squares and not the instrumental "
        "estimate."
    )


def _p(p: float) -> str:
    text = p_value(p)
    joined = text if text.startswith("<") else f"= {text}"
    return f"p {joined}".replace(" ", "\N{NO-BREAK SPACE}")
