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
from rigidimeter.reporting.test_tables import compared_pair, day_holm, mean_interval, tests_by_days
from rigidimeter.statistics import RankSum, Summary, summarise
from rigidimeter.study import Cohort, DayTest, MeasureEffect, Study

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


def cohort_view(study: Study, unlisted: int) -> CohortView | None:
    """Return the view of a study folder; None for plain recordings.

    `unlisted` is how many recorded epochs neither count nor are listed as left out.
    """
    cohort = study.cohort
    if cohort is None:
        return None
    rows = _rows(study, cohort)
    tests = [c.test for c in study.comparisons if c.test is not None]
    tests += [effect.effects.test for effect in cohort.effects]
    return CohortView(
        facts=tuple(_facts(study, cohort)),
        pair=compared_pair(study),
        confidence=_percent(test.confidence for test in tests),
        day_confidence=_percent(test.confidence for test in cohort.day_tests),
        rows=rows,
        unbounded=any(row.epochs.get("interval", "").endswith("†") for row in rows),
        newcombe=tuple(e.title for e in cohort.effects if e.effects.method == "Newcombe"),
        dependence=method_dependence(cohort),
        means=tuple(_means(cohort)),
        rating_notes=cohort.ratings.notices if cohort.ratings is not None else (),
        unlisted=unlisted,
        methods=methods_prose(study, cohort),
        virtual=cohort.virtual,
        blinded=cohort.blinded,
        offsets=next((test.model for test in cohort.day_tests if test.model), "each day"),
        own_inertia=cohort.several,
        changes=cohort.changes,
    )


def _percent(confidences: Iterable[float]) -> str:
    return " and ".join(dict.fromkeys(f"{100 * each:g} %" for each in confidences)) or "95 %"


def _facts(study: Study, cohort: Cohort) -> list[tuple[str, str]]:
    subjects = list(dict.fromkeys(s.subject for s in cohort.sessions))
    days = {(s.subject, s.day) for s in cohort.sessions}
    each = {
        c.name: {(s.subject, s.day) for s in cohort.sessions if s.condition == c.name}
        for c in cohort.conditions
    }
    both = sum(len(own) for own in each.values()) - len(days)
    split = series([f"{len(own)} in {condition_name(name)}" for name, own in each.items()])
    named = f": {', '.join(subjects)}" if any(subjects) and len(subjects) <= 24 else ""
    return [
        ("Subjects", f"{len(subjects)}{named}"),
        ("Days", f"{len(days)}: {split}" + (f", {both} in both" if both > 0 else "")),
        ("Sessions", f"{len(cohort.sessions)}, with {len(study.epochs)} epochs"),
        (
            "Blinding",
            "conditions are codes: no key was given, and nothing here depends on one"
            if cohort.blinded
            else "conditions stand by their names",
        ),
        (
            "Data",
            "virtual: every session comes from the virtual rig"
            if cohort.virtual
            else "recorded" + (", partly virtual" if any(e.virtual for e in study.epochs) else ""),
        ),
    ]


def _rows(study: Study, cohort: Cohort) -> tuple[Row, ...]:
    effects = {effect.measure: effect for effect in cohort.effects}
    by_days = {test.measure: test for test in tests_by_days(cohort)}
    adjusted = day_holm(cohort)
    rows = []
    shown = set()
    for c in study.comparisons:
        if not c.paired:
            continue
        shown.add(c.measure)
        sides = [_side(c.summaries[name], c.excluded[name]) for name in (c.reference, c.other)]
        holm = effects[c.measure].p_holm if c.measure in effects else math.nan
        day = by_days.get(c.measure)
        rows.append(
            _row(c.title, c.unit, sides, c.test, holm, c.remark, day, adjusted.get(c.measure))
        )
    others: dict[str, MeasureEffect | DayTest] = {**effects, **by_days}
    for measure, one in others.items():
        if measure in shown:
            continue
        sides = _rating_sides(cohort) if measure == "rating" else [_side(None)] * 2
        test = effects[measure].effects.test if measure in effects else None
        holm = effects[measure].p_holm if measure in effects else math.nan
        day = by_days.get(measure)
        rows.append(_row(one.title, one.unit, sides, test, holm, "", day, adjusted.get(measure)))
    return tuple(rows)


def _row(
    title: str,
    unit: str,
    sides: list[Side],
    test: RankSum | None,
    p_holm: float,
    remark: str,
    day: DayTest | None,
    day_p_holm: float | None,
) -> Row:
    epochs: dict[str, str] = {}
    if test is not None:
        dagger = "" if test.shift_bounded else " †"
        epochs = {
            "shift": number(test.shift, 3),
            "interval": interval(test.shift_low, test.shift_high, 3) + dagger,
            "z": number(test.z, 3),
            "p": p_value(test.p),
            "p_holm": p_value(p_holm),
            "r": f"{test.r:.2f}".replace("-", "−"),
        }
    days: dict[str, str] = {}
    if day is not None and not math.isnan(day.estimate):
        days = {
            "estimate": number(day.estimate, 3),
            "interval": interval(day.low, day.high, 3),
            "days": f"{day.days_reference} and {day.days_other} days, df {number(day.df, 3)}",
            "p": p_value(day.p),
            "p_holm": p_value(math.nan if day_p_holm is None else day_p_holm),
            "p_days": p_value(day.p_days),
            "share": "–" if math.isnan(day.day_share) else f"{100 * day.day_share:.0f} %",
        }
    day_remark = "no test by days" if day is None else day.remark
    return Row(title, unit, (sides[0], sides[1]), epochs, remark, days, day_remark)


def _side(summary: Summary | None, excluded: int | None = None) -> Side:
    if summary is None:
        return Side("–", "", "–", "")
    quartiles = interval(summary.q1, summary.q3, 3) if summary.n else ""
    out = "" if excluded is None else f"{excluded}"
    return Side(f"{summary.n}", out, number(summary.median, 3), quartiles)


def _rating_sides(cohort: Cohort) -> list[Side]:
    """Return the corrected scores of each condition."""
    found = cohort.ratings
    if found is None:
        return [_side(None)] * 2
    pairs = list(zip(found.rows, found.fit.corrected.tolist(), strict=True))
    return [
        _side(summarise([value for row, value in pairs if row[0] == name]))
        for name in (found.reference, found.other)
    ]


def _means(cohort: Cohort) -> list[str]:
    if cohort.ratings is None:
        return []
    found = []
    for name in cohort.ratings.fit.conditions:
        mean, low, high = mean_interval(cohort.ratings, name)
        found.append(f"{condition_name(name)} {number(mean, 3)} {interval(low, high, 3)}")
    return found
