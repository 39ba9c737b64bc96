"""A study folder as its page shows it: facts of the study, and the rows of its main table."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from rigidimeter.reporting.conclusions import method_dependence, series
from rigidimeter.reporting.measures import condition_name
from rigidimeter.reporting.numbers import interval, number, p_value
from rigidimeter.reporting.prose import methods_prose
from rigidimeter.reporting.references import Prose
from rigidimeter.study import Comparison, StudyResult, result_tables

__all__ = ["CohortView", "Row", "Side", "cohort_view"]


@dataclass(frozen=True)
class Side:
    """One condition of a measure: how many values, its median and its quartiles."""

    n: str
    excluded: str
    median: str
    quartiles: str


@dataclass(frozen=True)
class Row:
    """One measure: epochs counted at the left, days at the right; a remark where there is no test.

    Numbers are as the page prints them.
    """

    title: str
    unit: str
    sides: tuple[Side, Side]
    epochs: Mapping[str, str]
    remark: str
    days: Mapping[str, str]
    day_remark: str


@dataclass(frozen=True)
class CohortView:
    """What the template needs; `pair` is empty where no two conditions were compared."""

    facts: tuple[tuple[str, str], ...]
    pair: tuple[str, str] | None
    confidence: str
    day_confidence: str
    rows: tuple[Row, ...]
    unbounded: bool
    newcombe: tuple[str, ...]
    dependence: tuple[str, ...]
    means: tuple[str, ...]
    rating_notes: tuple[str, ...]
    unlisted: int
    methods: Prose
    virtual: bool
    blinded: bool
    offsets: str
    own_inertia: bool
    changes: tuple[str, ...]


def cohort_view(study: StudyResult) -> CohortView | None:
    """Return the view of a study folder; None for plain recordings."""
    if not study.sessions:
        return None
    tests = [c.test for c in study.comparisons if c.test is not None]
    days = [c.days for c in study.comparisons if c.days is not None]
    return CohortView(
        facts=tuple(_facts(study)),
        pair=(study.reference, study.other) if study.other else None,
        confidence=_percent(test.confidence for test in tests),
        day_confidence=_percent(test.confidence for test in days),
        rows=tuple(_row(c) for c in study.comparisons if c.paired),
        unbounded=any(not test.shift_bounded for test in tests),
        newcombe=tuple(
            c.measure.title
            for c in study.comparisons
            if c.effects is not None and c.effects.method == "Newcombe"
        ),
        dependence=method_dependence(study),
        means=tuple(_means(study)),
        rating_notes=study.ratings.notices if study.ratings is not None else (),
        unlisted=sum(row["unlisted"] for row in result_tables(study)["account"]),
        methods=methods_prose(study),
        virtual=study.virtual,
        blinded=study.blinded,
        offsets=next((test.model for test in days if test.model), "each day"),
        own_inertia=study.several_subjects,
        changes=study.changes,
    )


def _percent(confidences: Iterable[float]) -> str:
    return " and ".join(dict.fromkeys(f"{100 * each:g} %" for each in confidences)) or "95 %"


def _facts(study: StudyResult) -> list[tuple[str, str]]:
    subjects = list(dict.fromkeys(s.subject for s in study.sessions))
    days = {(s.subject, s.day) for s in study.sessions}
    each = {
        c.name: {(s.subject, s.day) for s in study.sessions if s.condition == c.name}
        for c in study.conditions
    }
    both = sum(len(own) for own in each.values()) - len(days)
    split = series([f"{len(own)} in {condition_name(name)}" for name, own in each.items()])
    named = f": {', '.join(subjects)}" if any(subjects) and len(subjects) <= 24 else ""
    return [
        ("Subjects", f"{len(subjects)}{named}"),
        ("Days", f"{len(days)}: {split}" + (f", {both} in both" if both > 0 else "")),
        ("Sessions", f"{len(study.sessions)}, with {len(study.epochs)} epochs"),
        (
            "Blinding",
            "conditions are codes: no key was given, and nothing here depends on one"
            if study.blinded
            else "conditions stand by their names",
        ),
        (
            "Data",
            "virtual: every session comes from the virtual rig"
            if study.virtual
            else "recorded" + (", partly virtual" if any(e.virtual for e in study.epochs) else ""),
        ),
    ]


def _row(c: Comparison) -> Row:
    epochs: dict[str, str] = {}
    test = c.test
    if test is not None:
        dagger = "" if test.shift_bounded else " †"
        epochs = {
            "shift": number(test.shift, 3),
            "interval": interval(test.shift_low, test.shift_high, 3) + dagger,
            "z": number(test.z, 3),
            "p": p_value(test.p),
            "p_holm": p_value(c.p_holm),
            "r": f"{test.r:.2f}".replace("-", "−"),
        }
    days: dict[str, str] = {}
    day = c.days
    if day is not None and not math.isnan(day.estimate):
        days = {
            "estimate": number(day.estimate, 3),
            "interval": interval(day.low, day.high, 3),
            "days": f"{day.n_days_x} and {day.n_days_y} days, df {number(day.df, 3)}",
            "p": p_value(day.p),
            "p_holm": p_value(c.days_p_holm),
            "p_days": p_value(day.p_days),
            "share": "–" if math.isnan(day.day_share) else f"{100 * day.day_share:.0f} %",
        }
    remark = "no test by days" if day is None else day.remark
    sides = (_side(c, c.reference), _side(c, c.other))
    return Row(c.measure.title, c.measure.unit, sides, epochs, c.remark, days, remark)


def _side(c: Comparison, condition: str) -> Side:
    summary = c.summaries[condition]
    quartiles = interval(summary.q1, summary.q3, 3) if summary.n else ""
    excluded = "" if c.measure.origin == "ratings" else f"{c.excluded[condition]}"
    return Side(f"{summary.n}", excluded, number(summary.median, 3), quartiles)


def _means(study: StudyResult) -> list[str]:
    found = study.ratings.means if study.ratings is not None else ()
    return [
        f"{condition_name(m.condition)} {number(m.mean, 3)} {interval(m.low, m.high, 3)}"
        for m in found
    ]
