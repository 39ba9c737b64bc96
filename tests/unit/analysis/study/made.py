"""Small made-up studies of several days: their estimates are drawn, the rest is the room's."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rigidimeter.analysis.study import (
    SCORE,
    Compared,
    Condition,
    OfMethod,
    SessionEntry,
    Study,
    as_rows,
    conclude,
    corrected,
    day_tests,
    estimate_rows,
    ratings_of,
    together,
)
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Analysis, Fit, Outcome, Score

JOINT = np.array([0.0045, 0.137, 1.75])
"""J, B and K of a relaxed forearm, in kg·m², N·m·s/rad and N·m/rad."""
LOWER = np.array([1.0, 0.84, 0.81])
SCATTER = np.array([0.03, 0.09, 0.12])
NAMES = ("OFF", "DBS")
CONDITIONS = (Condition("OFF", "off"), Condition("DBS", "on", 130.0, 0.32, "mA", 60.0))
LEFT_OUT = Outcome("excluded", "the arm touched the position limit")
PULL = {"published": (0.7, 0.75), "bandlimited": (0.88, 0.9)}
"""What other methods find of DBS, with J free and held: voluntary torque pulls the joint down."""

Change = Callable[[Any], Any]


class Design(NamedTuple):
    """What to make up: days by condition, epochs a day, how much lower the other condition is."""

    days: tuple[int, int] = (5, 4)
    epochs: int = 5
    scores: int = 4
    subjects: tuple[str, ...] = ("M1",)
    effect: float = 1.0
    day_scatter: float = 0.05
    both_on_a_day: bool = False


SMALL = Design()


def nothing(_: Any) -> None:
    """Return nothing: what is changed so is not there."""


def same(one: Any) -> Any:
    return one


def made(
    design: Design = SMALL,
    *,
    fit: Change = same,
    score: Change = same,
    entry: Change = same,
    pooled: Sequence[Fit] = (),
    rated: bool = True,
    days_known: bool = True,
    other: str = "DBS",
    **parts: Any,
) -> Study:
    """Return a study; each fit, score and session may be changed, `parts` replace its fields."""
    rng = np.random.default_rng(2)
    sessions = _sessions(design)
    fits: list[Fit] = []
    scores: list[Score] = []
    for session in sessions:
        _fill(design, session, rng, fits, scores)
    fits, scores = [*filter(None, map(fit, fits))], [*filter(None, map(score, scores))]
    analyses = {"iv": _analysis(fits, tuple(scores), tuple(pooled))}
    for method, factors in PULL.items():
        analyses[method] = _analysis([_pulled(one, factors[0]) for one in fits])
        held = tuple(_pulled(one, factors[1]) for one in fits)
        analyses[method] = replace(analyses[method], fixed_inertia=held)
    entries = {one.source: entry(one) for one in sessions}
    rows = [estimate_rows(analyses, entries if days_known else None, (), CONDITIONS)]
    ratings = None
    if rated and days_known:
        ratings = ratings_of("ratings.csv", _scores(design, sessions, rng), ["examiner"])
        rows.append(corrected(ratings))
    given: dict[str, Any] = {
        "title": "Elbow rigidity",
        "conditions": CONDITIONS,
        "sessions": tuple(entries.values()) if days_known else (),
        "analysis": analyses["iv"],
        "ratings": ratings,
    }
    return Study(together(rows), "OFF", other, **given | parts)


def _analysis(fits: Sequence[Fit], scores=(), pooled=()) -> Analysis:
    return Analysis("iv", tuple(fits), tuple(fits), float(JOINT[0]), scores, pooled)


def _pulled(fit: Fit, factor: float) -> Fit:
    return replace(fit, value=fit.value * (factor if in_dbs(fit) else 1.0))


def _sessions(design: Design) -> list[SessionEntry]:
    found = []
    for subject in design.subjects:
        order = ["OFF"] * design.days[0]
        step = max(len(order) // max(design.days[1], 1), 1)
        for k in range(design.days[1]):
            order.insert(min(1 + k * (step + 1), len(order)), "DBS")
        if design.both_on_a_day:
            order = [name for _ in range(max(design.days)) for name in NAMES]
        for k, name in enumerate(order, start=1):
            day = str((k + 1) // 2 if design.both_on_a_day else k)
            path = f"sessions/{subject}-day-{k:02d}"
            found.append(SessionEntry(subject, day, name, name, path, path))
    return found


def _fill(design: Design, session: SessionEntry, rng, fits: list[Fit], scores: list[Score]) -> None:
    where, name = session.source, session.condition
    level = JOINT * (LOWER**design.effect if name == "DBS" else 1.0)
    level *= rng.lognormal(0, [design.day_scatter] * 3)
    for i in range(design.epochs):
        joint = level * rng.lognormal(0, SCATTER)
        out = (i == 0 and session.day in {"1", "3"}) or (i == 1 and session.day == "2")
        outcome = LEFT_OUT if out else Outcome()
        ends = {"se": 0.02 * joint, "low": 0.96 * joint, "high": 1.04 * joint}
        fits.append(Fit(where, f"p{i + 1:02d}", name, "iv", outcome, joint, **ends))
    for i in range(design.scores):
        size = (level[2] * 0.3 + level[1]) * float(rng.lognormal(0, 0.12))
        scores.append(Score(where, f"s{i + 1:02d}", name, Outcome(), size, size / 2, 8, 1.0))


def _scores(design: Design, sessions: Sequence[SessionEntry], rng):
    """Return ratings in steps of a half, of three examiners who differ."""
    records = []
    for session in sessions:
        level = 1.9 - 0.5 * design.effect * (session.condition == "DBS")
        for examiner, bias in (("A", 0.35), ("B", -0.1), ("C", -0.3)):
            value = round(2 * (level + bias + 0.3 * float(rng.standard_normal()))) / 2
            given = session.condition, examiner, session.subject, session.day
            records.append((*given, min(max(value, 0.0), 3.0)))
    return score_rows(records)


def score_rows(records: Sequence[tuple[str, str, str, str, float]]):
    """Return ratings (condition, examiner, subject, day, score) as rows."""
    columns = ("condition", "rater", "subject", "day", "value")
    return as_rows(
        dict(zip(columns, record, strict=True))
        | {"measure": SCORE, "chosen": False, "epoch": f"line {line}"}
        for line, record in enumerate(records, start=2)
    )


def first(one: Any) -> Any:
    """Return what is of the first recording of each condition."""
    return one if one.source in ("sessions/M1-day-01", "sessions/M1-day-02") else None


def in_dbs(one: Fit | Score) -> bool:
    return one.condition == "DBS"


def doubted(name: str, where: Callable[[Fit], bool] = in_dbs, level: Any = "caution") -> Change:
    """Return the change that puts a finding on the fits for which `where` is true."""
    finding = Finding(name, level, 2.0, 1.0)
    return lambda one: replace(one, findings=(finding,)) if where(one) else one


def alike(of_dbs: Sequence[float], spread: float = 0.01) -> Change:
    """Return the change to the same joint in every epoch, but for a spread and factors of DBS."""

    def change(one: Fit) -> Fit:
        value = JOINT * (1.0 + spread * (int(one.epoch[1:]) % 3))
        return replace(one, value=value * np.array(of_dbs) if in_dbs(one) else value)

    return change


def concluded(study: Study, methods: Sequence[OfMethod] = ()) -> dict[str, Compared]:
    """Return what is concluded of the main pair, by measure."""
    found = conclude(study, day_tests(study), methods)
    return {one.measure.name: one for one in found if one.other == study.other}
