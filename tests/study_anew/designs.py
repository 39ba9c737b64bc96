"""Random studies, unbalanced in every way, as the room that is replaced concludes on them.

One to four subjects have one to six days with one condition or both, and one to five epochs each;
epochs are excluded, fail or carry findings, inertias differ, examiners rate one condition alone,
groups respond differently, a third condition is there, primary measures are a sequence.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from tests.study_anew.old_cohorts import (
    JOINT,
    PULL,
    day_tests,
    fit_ratings,
    ratings_comparison,
    ratings_days,
    sensitivity_row,
    with_days,
)
from tests.study_anew.old_cohorts import Rating as OldRating

from rigidimeter.analysis.statistics import fit_mixed, holm, two_groups
from rigidimeter.analysis.study import (
    RATING,
    Comparison,
    Condition,
    LeftOut,
    Primary,
    RatingsFound,
    SessionEntry,
    StudyResult,
    compare_analysis,
    compare_measures,
)
from rigidimeter.core.files import TextTable
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Analysis, Fit, Outcome, Score
from rigidimeter.core.study_files import PrimaryTable

NAMES = ("OFF", "DBS", "LOW")
FINDINGS = (
    *("tremor", "voluntary_torque", "lack_of_fit", "varying_with_time", "active_movement"),
    *("between_samples", "missing_term", "emg_activity"),
)


@dataclass(frozen=True)
class Made:
    """What a study is made of."""

    analysis: Analysis
    sessions: tuple[SessionEntry, ...]
    ratings: RatingsFound | None


def random_study(seed: int, *, known_days: bool = True) -> StudyResult:
    """Return a study with everything that it concludes from.

    Parameters
    ----------
    seed : int
    known_days : bool
        Otherwise recordings stand in the place of days, and there are no ratings.
    """
    rng = np.random.default_rng(seed)
    made = _made(rng)
    further = ["LOW"] if any(one.condition == "LOW" for one in made.sessions) else []
    result = compare_analysis(made.analysis, "OFF", "DBS", resamples=0, further=further)
    primary = Primary(_declared(rng))
    conditions = (Condition("OFF"), Condition("DBS", "on", 130.0, 0.32, "mA", 60.0))
    if rng.random() < 0.3:
        simulated = {name: 0.8 * value for name, value in JOINT.items()}
        conditions = (
            replace(conditions[0], simulated=JOINT),
            replace(conditions[1], simulated=simulated),
        )
    parts: dict[str, Any] = {"primary": primary, "conditions": conditions}
    if not known_days:
        return replace(result, **parts)
    placed = [_placed(c, made.sessions) for c in result.comparisons]
    ready = {}
    if made.ratings is not None:
        rated = ratings_comparison(made.ratings)
        placed.append(_of_groups(rated, made.sessions))
        ready = {RATING.name: ratings_days(made.ratings)}
    placed, _ = compare_measures(placed, resamples=0)
    more = [_placed(c, made.sessions) for c in result.further]
    if made.ratings is not None and further:
        counts = [row.condition for row in made.ratings.rows].count("LOW")
        if counts and counts + [row.condition for row in made.ratings.rows].count("OFF") >= 3:
            more.append(_further_ratings(made))
    adjusted = holm([c.test.p if c.test else np.nan for c in (*placed, *more)])
    every = [replace(c, p_holm=p) for c, p in zip((*placed, *more), adjusted, strict=True)]
    tested = day_tests(every, ready, primary)
    left_out = ()
    if not any(one.condition == "DBS" for one in made.sessions):
        left_out = (LeftOut("lost", "S1", "1", "DBS", "lost: it is damaged"),)
    return replace(
        result,
        comparisons=tested[: len(placed)],
        further=tested[len(placed) :],
        sessions=made.sessions,
        ratings=made.ratings,
        sensitivity=tuple(_by_methods(tested[: len(placed)], rng)),
        left_out=left_out,
        deviations=tuple(_deviations(made.sessions, rng)),
        **parts,
    )


def _deviations(sessions: tuple[SessionEntry, ...], rng: np.random.Generator) -> Iterator[Any]:
    """Yield that some sessions were not as planned, in half of the studies."""
    often = 0.3 if rng.random() < 0.5 else 0.0
    for one in sessions:
        if rng.random() < often:
            kind = str(rng.choice(["short wait", "cut short"]))
            where = {"subject": one.subject, "day": one.day, "order": 1, "path": one.path}
            yield SimpleNamespace(condition=one.condition, kind=kind, detail="", **where)


def _declared(rng: np.random.Generator) -> PrimaryTable:
    if rng.random() < 0.5:
        return PrimaryTable()
    every = ["stiffness_nm_rad", "damping_nm_s_rad", "work_j", "impulse_nm_s", "rating"]
    chosen = [str(one) for one in rng.permutation(every)[: rng.integers(1, 4)]]
    rule = "sequence" if rng.random() < 0.6 else "holm"
    percent = float(rng.choice([10.0, 20.0, 60.0]))
    return PrimaryTable(measures=chosen, rule=rule, difference_percent=percent)


def _made(rng: np.random.Generator) -> Made:
    names = NAMES if rng.random() < 0.3 else NAMES[:2]
    groups = rng.random() < 0.3
    effect = float(rng.choice([0.0, 0.003, 0.1, 0.3, -0.3, 0.6]))
    heavier = float(rng.choice([1.0, 1.0, 1.0, 1.0, 1.2, 57.0]))
    scatter = float(rng.choice([0.001, 0.01, 0.05, 0.2]))
    dated = rng.random() < 0.3
    in_order = rng.random() < 0.1
    sessions: list[SessionEntry] = []
    fits: list[Fit] = []
    scores: list[Score] = []
    for subject in range(1, rng.integers(2, 6)):
        group = "patients" if subject % 2 else "controls"
        responds = 0.0 if groups and group == "controls" else effect
        for day in range(1, rng.integers(2, 10)):
            of_day = 1 + scatter * rng.standard_normal()
            here = [name for name in names if rng.random() < 0.75]
            if in_order:
                here = ["OFF"] if day < 4 else ["DBS"]
            for name in here:
                label = f"2026-01-{day:02d}" if dated else str(day)
                source = f"s{subject}/{day}-{name}"
                sessions.append(
                    SessionEntry(
                        f"S{subject}", label, name, name, source, source, group if groups else ""
                    )
                )
                level = np.array([*JOINT.values()]) * [1.0, of_day, of_day]
                if name != "OFF":
                    level *= [heavier, 1 - responds, 1 - responds]
                for epoch in range(rng.integers(1, 6)):
                    fits.append(_fit(rng, sessions[-1], f"p{epoch}", level, scatter))
                    size = level[2] * (1 + scatter * rng.standard_normal())
                    scores.append(
                        Score(source, f"s{epoch}", name, _outcome(rng), size, size / 2, 8, 1.0)
                    )
    if rng.random() < 0.4:
        often = rng.random() < 0.5
        fits = [_flagged(fit, rng, often) for fit in fits]
    pooled = tuple(_pooled(fits, name, rng) for name in names) if rng.random() < 0.25 else ()
    kept = tuple(scores) if rng.random() < 0.5 else ()
    analysis = Analysis("iv", tuple(fits), tuple(fits), 0.0045, kept, pooled)
    return Made(analysis, tuple(sessions), _ratings(rng, sessions))


def _outcome(rng: np.random.Generator) -> Outcome:
    return Outcome("excluded", "moved") if rng.random() < 0.08 else Outcome()


def _fit(
    rng: np.random.Generator, session: SessionEntry, label: str, level: Any, scatter: float
) -> Fit:
    joint = level * (1 + [0.2, 1.0, 1.0] * rng.standard_normal(3) * scatter)
    se = 0.01 * np.abs(joint) * rng.uniform(0.5, 2.0)
    return Fit(
        *(session.source, label, session.condition, "iv", _outcome(rng)),
        value=joint,
        se=se,
        low=joint - 2 * se,
        high=joint + 2 * se,
    )


def _flagged(fit: Fit, rng: np.random.Generator, often: bool) -> Fit:
    more = 0.6 if often and fit.condition == "DBS" else 0.05
    found = [
        Finding(str(name), "note" if rng.random() < 0.3 else "caution", 2.0, 1.0)
        for name in rng.permutation(FINDINGS)[:2]
        if rng.random() < more
    ]
    return replace(fit, findings=tuple(found))


def _pooled(fits: list[Fit], condition: str, rng: np.random.Generator) -> Fit:
    own = [fit.value for fit in fits if fit.condition == condition]
    joint = np.mean(own, axis=0) if own else np.full(3, np.nan)
    name = str(rng.choice(["loop_bias", "missing_term", "tremor", "between_samples"]))
    level = "caution" if rng.random() < 0.7 else "note"
    findings = (Finding(name, level, float(rng.uniform(10, 300)), 50.0),)
    return Fit(
        *("pooled", "pooled", condition, "iv", Outcome()),
        value=joint,
        se=0.01 * joint,
        low=0.98 * joint,
        high=1.02 * joint,
        findings=findings if rng.random() < 0.7 else (),
    )


def _ratings(rng: np.random.Generator, sessions: list[SessionEntry]) -> RatingsFound | None:
    if rng.random() < 0.3:
        return None
    lower = float(rng.choice([0.0, 0.5, 1.0]))
    alone = rng.random() < 0.3
    rows = []
    for one in sessions:
        for k, examiner in enumerate("ABC"):
            if rng.random() < 0.2 or (alone and examiner == "C" and one.condition != "DBS"):
                continue
            level = 2.0 - lower * (one.condition == "DBS") + (0.3, 0.0, -0.4)[k]
            score = round(2 * (level + 0.3 * rng.standard_normal())) / 2
            rows.append(
                OldRating(len(rows) + 2, one.condition, score, examiner, one.subject, one.day)
            )
    counts = [sum(row.condition == name for row in rows) for name in ("OFF", "DBS")]
    if min(counts) == 0 or sum(counts) < 3:
        return None
    random = ("examiner", "subject") if len({row.subject for row in rows}) > 1 else ("examiner",)
    try:
        found = fit_ratings("ratings.csv", rows, random, ("OFF", "DBS"))
    except (ValueError, ArithmeticError):
        return None
    return with_days(found, _by_day(rows, random))


def _by_day(rows: list[OldRating], random: tuple[str, ...]) -> Any:
    visits = {(row.subject, row.day, row.condition) for row in rows}
    if len(visits) in (len(rows), len({row.condition for row in rows})):
        return None
    several = len(random) > 1
    days = [f"{row.subject}/{row.day}" if several else row.day for row in rows]
    labels = {"examiner": [row.examiner for row in rows]}
    if several:
        labels["subject"] = [row.subject for row in rows]
    labels["day"] = days
    if len(visits) > len({(row.subject, row.day) for row in rows}):
        labels["day/condition"] = [
            f"{day}/{row.condition}" for day, row in zip(days, rows, strict=True)
        ]
    try:
        return fit_mixed([row.score for row in rows], [row.condition for row in rows], labels)
    except (ValueError, ArithmeticError):
        return None


def _placed(c: Comparison, sessions: tuple[SessionEntry, ...]) -> Comparison:
    """Return a comparison with subject, day and group of each value."""
    of = {one.source: one for one in sessions}
    own = tuple(
        replace(
            o,
            subject=of[o.source].subject,
            day=of[o.source].day,
            group=of[o.source].group,
            unit=f"{of[o.source].subject}/{of[o.source].day}",
        )
        for o in c.observations
    )
    return replace(c, observations=own)


def _of_groups(c: Comparison, sessions: tuple[SessionEntry, ...]) -> Comparison:
    of = {one.subject: one.group for one in sessions}
    return replace(c, observations=tuple(replace(o, group=of[o.subject]) for o in c.observations))


def _further_ratings(made: Made) -> Comparison:
    """Return the comparison of the ratings in the third condition, with its test by days."""
    assert made.ratings is not None
    rows = list(made.ratings.rows)
    found = replace(made.ratings, other="LOW")
    fit = _by_day(rows, tuple(made.ratings.fit.offsets))
    days = ratings_days(with_days(found, fit))
    tested, _ = compare_measures([ratings_comparison(found)], resamples=0)
    return replace(_of_groups(tested[0], made.sessions), days=days)


def _by_methods(comparisons: tuple[Comparison, ...], rng: np.random.Generator) -> Iterator[Any]:
    if rng.random() < 0.5:
        return
    for c in comparisons:
        if c.measure.name in JOINT and c.test is not None:
            x, y = (c.of(name) for name in c.pair)
            group = two_groups(
                [o.value for o in x], [o.value for o in y], [o.unit for o in x], [o.unit for o in y]
            )
            for (method, inertia), factor in PULL.items():
                try:
                    yield sensitivity_row(c.measure, method, inertia, group, factor)
                except ValueError:  # one day
                    continue


def random_table(seed: int) -> tuple[pd.DataFrame, dict[str, Any]]:
    """Return a table as a laboratory may have it, and how it is to be compared.

    Some have subjects, days, groups, sessions or outcomes, cells that are missing or negative, or
    are too small or wrong, so that there is nothing to compare.
    """
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 40))
    names = ["ON", "OFF", "half"][: rng.integers(2, 4)]
    table = pd.DataFrame({"state": rng.choice(names, n)})
    shift = 0.5 * (table["state"] != "OFF") * rng.choice([0.0, 1.0, 4.0])
    for name in ("k", "b")[: rng.integers(1, 3)]:
        table[name] = np.round(3.0 - shift + rng.standard_normal(n), int(rng.choice([1, 6])))
        if rng.random() < 0.5:
            table[name] = table[name].abs() + 0.1
        table.loc[rng.random(n) < rng.choice([0.0, 0.1]), name] = np.nan
    values = list(table.columns[1:])
    if rng.random() < 0.5:
        table["Subject"] = rng.choice(["R1", "R2", "R3", "R4"][: rng.integers(1, 5)], n)
    if rng.random() < 0.5:
        table["day"] = rng.integers(1, 7, n).astype(str)
        if rng.random() < 0.1:
            table.loc[0, "day"] = ""
        elif rng.random() < 0.1:
            table.loc[0, "day"] = "0" + table.loc[0, "day"]
    if rng.random() < 0.2:
        table["group"] = rng.choice(["patients", "controls"], n)
    if rng.random() < 0.2:
        table["visit"] = rng.choice(["first", "second"], n)
    if rng.random() < 0.2:
        table["outcome"] = rng.choice(["included", "included", "failed"], n)
    table["box"] = rng.integers(1, 9, n).astype(str)
    options: dict[str, Any] = {"value": values, "by": "state"}
    for name, choices in (
        ("session", [None, None, "box"]),
        ("group", [None] * 4 + ["patients"]),
        ("other", [None, None, "ON"]),
        ("reference", [*[None] * 5, "OFF", "OFF", "gone"]),
    ):
        options[name] = choices[rng.integers(len(choices))]
    return table, options


def random_ratings(seed: int) -> tuple[TextTable, dict[str, str], dict[str, Any]]:
    """Return a table of ratings, what it calls its columns, and how it is to be modelled.

    Some have one examiner, one day or none, several subjects, scores that are missing, between
    steps or outside the scale, or options that are wrong.
    """
    rng = np.random.default_rng(seed)
    n = int(rng.choice([2, 4, 9, 16, 30]))
    names = ["ON", "OFF", "half"][: rng.choice([1, 2, 2, 2, 3])]
    cells = {"state": rng.choice(names, n)}
    scores = rng.integers(0, 6, n) / 2 + (rng.random(n) < rng.choice([0.0, 0.1])) * 0.2
    cells["score"] = np.where(rng.random(n) < rng.choice([0.0, 0.0, 0.1]), "", scores.astype(str))
    if rng.random() < 0.9:
        cells["examiner"] = rng.choice(["A", "B", "C", "D"][: rng.integers(1, 5)], n)
    if rng.random() < 0.4:
        cells["subject"] = rng.choice(["R1", "R2", "R3"][: rng.integers(1, 4)], n)
    if rng.random() < 0.7:
        days = ["1", "2", "3", "4"][: rng.integers(1, 5)]
        cells["day"] = rng.choice(days, n)
        if rng.random() < 0.3:
            cells["day"] = cells["state"]  # each condition on a day of its own
    columns = {name: name for name in ("score", "examiner", "subject", "day")}
    kinds = [None, None, None, ["examiner"], ["examiner", "subject"], ["subject/day"], ["day"]]
    kinds += [["examiner", "day/condition"], ["rater"]]
    options: dict[str, Any] = {
        "random": kinds[rng.integers(len(kinds))],
        "scale": [(0.0, 3.0), (0.0, 3.0), (0.0, 2.0), (3.0, 0.0)][rng.choice([0, 0, 1, 2, 3])],
        "step": float(rng.choice([0.5, 0.5, 0.0])),
        "pair": [None, None, None, ("ON", "OFF"), ("ON", "ON"), ("ON", "gone")][rng.integers(6)],
    }
    texts = {name: tuple(map(str, column)) for name, column in cells.items()}
    table = TextTable("ratings.csv", texts, tuple(range(2, n + 2)))
    return table, {"condition": "state", **columns}, options
