"""Small made-up studies of several days, their numbers made by the statistics themselves."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigidimeter.records import Analysis, Channel, Epoch, Fit, Motion, Notice, Outcome, Score
from rigidimeter.settings import Settings
from rigidimeter.statistics import (
    TwoGroups,
    compare_effects,
    day_difference,
    difference,
    effect_sizes,
    fit_mixed,
    holm,
    ranksum,
    summarise,
    two_groups,
)
from rigidimeter.study import (
    MEASURES,
    Cohort,
    Condition,
    DayMedian,
    DayTest,
    Exclusion,
    MeasureEffect,
    RatingsFound,
    SensitivityRow,
    SessionEntry,
    Study,
    compare,
)

JOINT = {"inertia_kg_m2": 0.0045, "damping_nm_s_rad": 0.137, "stiffness_nm_rad": 1.75}
LOWER = {"inertia_kg_m2": 1.0, "damping_nm_s_rad": 0.84, "stiffness_nm_rad": 0.81}
SCATTER = {"inertia_kg_m2": 0.03, "damping_nm_s_rad": 0.09, "stiffness_nm_rad": 0.12}
LEFT_OUT = Outcome("excluded", "the arm touched the position limit")
RATING = ("rating", "Examiners' rating", "1")


def _channels(
    frequencies_hz: Sequence[float], size_rad: float, span_s: float
) -> dict[str, Channel]:
    """Return the motion that is a sum of sines, and the torque that Eq. 3 asks for it."""
    stamps = np.arange(0, span_s, 0.01)
    angle, velocity, acceleration = (np.zeros_like(stamps) for _ in range(3))
    for k, frequency in enumerate(frequencies_hz, start=1):
        omega, phase = 2 * np.pi * frequency, _phase(k)
        size = size_rad / len(frequencies_hz)
        angle += size * np.sin(omega * stamps + phase)
        velocity += size * omega * np.cos(omega * stamps + phase)
        acceleration -= size * omega**2 * np.sin(omega * stamps + phase)
    J, B, K = JOINT.values()
    values = {
        "torque_nm": J * acceleration + B * velocity + K * angle,
        "angle_rad": angle,
        "velocity_rad_s": velocity,
        "velocity_command_rad_s": velocity,
        "perturbation_nm": np.where(np.sin(7.3 * stamps) + np.sin(3.1 * stamps) > 0, 1.0, -1.0),
    }
    return {name: Channel(name, stamps, samples) for name, samples in values.items()}


def _phase(k: int) -> float:
    """Return phases that do not add up anywhere."""
    return 2.4 * k * k


PERTURBED = _channels((0.3, 0.9, 1.7, 3.1), 0.1, 7.0)
IMPOSED = _channels((1.0,), 0.35, 10.0)


@dataclass(frozen=True)
class Design:
    """What to make up: days by condition, epochs a day, how much lower the other condition is."""

    days: tuple[int, int] = (9, 4)
    epochs: tuple[int, int] = (9, 6)
    scores: tuple[int, int] = (10, 11)
    subjects: tuple[str, ...] = ("M1",)
    names: tuple[str, str] = ("OFF", "DBS")
    effect: float = 1.0
    day_scatter: float = 0.05
    examiners: tuple[str, ...] = ("A", "B", "C")
    seed: int = 2
    both_on_a_day: bool = False


def made_study(design: Design | None = None, **parts: object) -> Study:
    """Return a study with a cohort; `parts` replace fields of the cohort."""
    design = design or Design()
    rng = np.random.default_rng(design.seed)
    sessions = _sessions(design)
    fits: list[Fit] = []
    scores: list[Score] = []
    epochs: list[Epoch] = []
    for session in sessions:
        _fill(design, session, rng, fits, scores, epochs)
    analysis = Analysis("iv", tuple(fits), tuple(fits), JOINT["inertia_kg_m2"], tuple(scores))
    comparisons = compare(analysis, *design.names)
    samples = {
        measure.name: _groups(measure.results(analysis), measure.name, sessions, design.names)
        for measure in MEASURES
    }
    ratings = _ratings(design, sessions, rng)
    samples["rating"] = _rating_groups(ratings, design.names)
    named = {measure.name: (measure.title, measure.unit) for measure in MEASURES}
    named["rating"] = RATING[1:]
    effects = {name: effect_sizes(group, rng, resamples=199) for name, group in samples.items()}
    adjusted = holm([found.test.p for found in effects.values()])
    cohort = Cohort(
        conditions=(
            Condition(design.names[0], "stimulation off"),
            Condition(design.names[1], "stimulation on", 130.0, 0.32, "mA", 60.0, "C+ 1-", 15.0),
        ),
        sessions=sessions,
        blinded=False,
        days=tuple(_day_medians(analysis, sessions)),
        day_tests=tuple(
            _day_test(name, *named[name], group, design.names)
            for name, group in samples.items()
            if name != "rating"
        ),
        effects=tuple(
            MeasureEffect(name, *named[name], effects[name], p)
            for name, p in zip(effects, adjusted, strict=True)
        ),
        differences={
            (a, b): compare_effects(samples[a], samples[b], rng, paired=True, resamples=199)
            for a, b in itertools.combinations(samples, 2)
        },
        ratings=ratings,
        sensitivity=tuple(_sensitivity(samples, named, design.names)),
        exclusions=tuple(
            Exclusion(
                s.subject, s.day, s.condition, s.source, fit.epoch, "prbs", by, fit.outcome.reason
            )
            for s in sessions
            for fit in fits
            if fit.source == s.source and not fit.outcome.included
            for by in ["operator" if "moved" in fit.outcome.reason else "protocol"]
        ),
    )
    return Study(
        title="Elbow rigidity",
        settings=Settings(),
        epochs=tuple(epochs),
        analysis=analysis,
        comparisons=comparisons,
        notices=(Notice("warning", "one column was empty"),),
        provenance={"rigidimeter": "0"},
        cohort=replace(cohort, **parts),
    )


def _sessions(design: Design) -> tuple[SessionEntry, ...]:
    made: list[SessionEntry] = []
    for subject in design.subjects:
        order = [design.names[0]] * design.days[0]
        step = max(len(order) // max(design.days[1], 1), 1)
        for k in range(design.days[1]):
            order.insert(min(1 + k * (step + 1), len(order)), design.names[1])
        if design.both_on_a_day:
            order = [name for _ in range(max(design.days)) for name in design.names]
        for k, name in enumerate(order, start=1):
            day = str((k + 1) // 2 if design.both_on_a_day else k)
            path = f"sessions/{subject}-day-{k:02d}"
            made.append(SessionEntry(subject, day, name, name, path, f"/data/{path}"))
    return tuple(made)


def _fill(
    design: Design,
    session: SessionEntry,
    rng: np.random.Generator,
    fits: list[Fit],
    scores: list[Score],
    epochs: list[Epoch],
) -> None:
    side = design.names.index(session.condition)
    level = {
        name: value
        * (LOWER[name] ** design.effect if side else 1.0)
        * float(rng.lognormal(0, design.day_scatter))
        for name, value in JOINT.items()
    }
    for i in range(design.epochs[side]):
        joint = np.array([v * rng.lognormal(0, SCATTER[name]) for name, v in level.items()])
        outcome = Outcome()
        if i == 0 and session.day in {"1", "3"}:
            outcome = LEFT_OUT
        elif i == 1 and session.day == "2":
            outcome = Outcome("excluded", "the animal moved, seen by the operator")
        fits.append(
            Fit(
                session.source,
                f"p{i + 1:02d}",
                session.condition,
                "iv",
                outcome,
                value=joint,
                se=0.02 * joint,
                low=0.96 * joint,
                high=1.04 * joint,
                bound=0.015 * joint,
                r_squared=0.97,
                vaf_percent=97.0,
                condition_number=4.2,
                residual_sd_nm=0.02,
                n_samples=4501,
                band_hz=(0.15, 30.0),
            )
        )
        epochs.append(
            Epoch(
                session.source,
                f"p{i + 1:02d}",
                PERTURBED,
                session.condition,
                "prbs",
                excitation_hz=(0.15, 10.0),
                closed=outcome,
            )
        )
    for i in range(design.scores[side]):
        by = float(rng.lognormal(0, 0.12))
        size = (level["stiffness_nm_rad"] * 0.3 + level["damping_nm_s_rad"]) * by
        scores.append(
            Score(
                session.source,
                f"s{i + 1:02d}",
                session.condition,
                Outcome(),
                size,
                size / 2,
                8,
                1.0,
            )
        )
        epochs.append(
            Epoch(
                session.source,
                f"s{i + 1:02d}",
                IMPOSED,
                session.condition,
                "sinusoid",
                motion=Motion(1.0, 0.0, 10.0),
            )
        )


def _groups(
    results: Sequence[Fit | Score],
    name: str,
    sessions: Sequence[SessionEntry],
    names: tuple[str, str],
) -> TwoGroups:
    unit = {s.source: f"{s.subject}/{s.day}" for s in sessions}
    x, y = (
        [
            (float(getattr(r, name)), unit[r.source])
            for r in results
            if r.condition == condition and r.outcome.included
        ]
        for condition in names
    )
    return two_groups([v for v, _ in x], [v for v, _ in y], [u for _, u in x], [u for _, u in y])


def _day_test(
    name: str, title: str, unit: str, group: TwoGroups, names: tuple[str, str]
) -> DayTest:
    subjects = [[u.partition("/")[0] for u in units] for units in (group.x_units, group.y_units)]
    found = day_difference(
        group.x,
        group.y,
        group.x_units,
        group.y_units,
        x_subjects=subjects[0],
        y_subjects=subjects[1],
    )
    return DayTest(
        name,
        title,
        unit,
        *names,
        found.estimate,
        found.low,
        found.high,
        found.p,
        found.df,
        found.n_days_x,
        found.n_days_y,
        found.p_days,
        found.day_share,
        offsets=found.offsets,
    )


def _day_medians(analysis: Analysis, sessions: Sequence[SessionEntry]) -> list[DayMedian]:
    found = []
    for measure in MEASURES:
        for s in sessions:
            values = [
                float(getattr(r, measure.name))
                for r in measure.results(analysis)
                if r.source == s.source and r.outcome.included
            ]
            if values:
                m = summarise(values)
                found.append(
                    DayMedian(
                        measure.name, s.subject, s.day, s.condition, m.n, m.median, m.q1, m.q3
                    )
                )
    return found


def _ratings(
    design: Design, sessions: Sequence[SessionEntry], rng: np.random.Generator
) -> RatingsFound:
    bias = {e: b for e, b in zip(design.examiners, (0.35, -0.1, -0.3), strict=False)}
    rows = []
    for s in sessions:
        level = 1.9 - 0.5 * design.effect * (s.condition == design.names[1])
        for examiner in design.examiners:
            score = level + bias[examiner] + 0.3 * float(rng.standard_normal())
            rows.append(
                (
                    s.condition,
                    examiner,
                    s.subject,
                    s.day,
                    min(max(round(2 * score) / 2, 0.0), 3.0),
                )
            )
    return ratings_found(tuple(rows), design.names)


def ratings_found(
    rows: tuple[tuple[str, str, str, str, float], ...], names: tuple[str, str]
) -> RatingsFound:
    """Return the mixed model of ratings (condition, examiner, subject, day, score)."""
    fit = fit_mixed(
        [row[4] for row in rows], [row[0] for row in rows], {"examiner": [row[1] for row in rows]}
    )
    with_days = fit_mixed(
        [row[4] for row in rows],
        [row[0] for row in rows],
        {"examiner": [row[1] for row in rows], "day": [f"{row[2]}/{row[3]}" for row in rows]},
    )
    return RatingsFound(
        "ratings.csv",
        rows,
        fit,
        difference(fit, *names),
        *names,
        contrast_days=difference(with_days, *names),
    )


def _rating_groups(ratings: RatingsFound, names: tuple[str, str]) -> TwoGroups:
    rows = list(zip(ratings.rows, ratings.fit.corrected.tolist(), strict=True))
    x, y = ([(v, f"{r[2]}/{r[3]}") for r, v in rows if r[0] == name] for name in names)
    return two_groups([v for v, _ in x], [v for v, _ in y], [u for _, u in x], [u for _, u in y])


PULL = {
    ("published", "fixed"): 0.75,
    ("published", "free"): 0.7,
    ("bandlimited", "fixed"): 0.9,
    ("bandlimited", "free"): 0.88,
    ("iv", "fixed"): 1.0,
    ("iv", "free"): 1.0,
}


def _sensitivity(
    samples: dict[str, TwoGroups],
    named: dict[str, tuple[str, str]],
    names: tuple[str, str],
) -> list[SensitivityRow]:
    rows = []
    for name in JOINT:
        for (method, inertia), factor in PULL.items():
            if name == "inertia_kg_m2" and inertia == "fixed":
                continue
            group = samples[name]
            # Voluntary torque pulls the joint down, and here in the other condition alone.
            rows.append(sensitivity_row(name, *named[name], method, inertia, group, factor))
    return rows


def sensitivity_row(
    name: str,
    title: str,
    unit: str,
    method: str,
    inertia: str,
    group: TwoGroups,
    factor: float,
) -> SensitivityRow:
    """Return the conclusion with the other condition multiplied by a factor."""
    x, y = group.x, group.y * factor
    test = ranksum(x, y)
    p_day = day_difference(x, y, group.x_units, group.y_units).p
    return SensitivityRow(
        name,
        title,
        unit,
        method,
        inertia,  # type: ignore[arg-type]
        test.n_x,
        test.n_y,
        test.shift,
        test.shift_low,
        test.shift_high,
        test.p,
        test.r,
        p_day,
        method == "iv" and inertia == ("free" if name == "inertia_kg_m2" else "fixed"),
    )


def untested(study: Study, measure: str, remark: str) -> Study:
    """Return the study with one measure that days could not test."""
    assert study.cohort is not None
    nothing = dict.fromkeys(("estimate", "low", "high", "p", "df", "p_days", "day_share"), math.nan)
    tests = tuple(
        replace(t, **nothing, remark=remark) if t.measure == measure else t
        for t in study.cohort.day_tests
    )
    return replace(study, cohort=replace(study.cohort, day_tests=tests))
