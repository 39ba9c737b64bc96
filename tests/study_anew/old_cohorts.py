"""Small made-up studies of several days, their numbers made by the statistics themselves."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigidimeter.analysis.statistics import (
    TwoGroups,
    day_difference,
    fit_mixed,
    holm,
    ranksum,
    two_groups,
)
from rigidimeter.analysis.study import (
    RATING,
    Comparison,
    Condition,
    Exclusion,
    Measure,
    RatingsFound,
    SensitivityRow,
    SessionEntry,
    StudyResult,
    compare_measures,
)
from rigidimeter.analysis.study.comparison import day_tests, gathered, no_days
from rigidimeter.analysis.study.rating_table import Rating
from rigidimeter.analysis.study.ratings_found import fit_ratings, with_days
from rigidimeter.analysis.study.ratings_model import ratings_comparison, ratings_days
from rigidimeter.core.records import Analysis, Channel, Epoch, Fit, Motion, Notice, Outcome, Score

JOINT = {"inertia_kg_m2": 0.0045, "damping_nm_s_rad": 0.137, "stiffness_nm_rad": 1.75}
LOWER = {"inertia_kg_m2": 1.0, "damping_nm_s_rad": 0.84, "stiffness_nm_rad": 0.81}
SCATTER = {"inertia_kg_m2": 0.03, "damping_nm_s_rad": 0.09, "stiffness_nm_rad": 0.12}
LEFT_OUT = Outcome("excluded", "the arm touched the position limit")


def _channels(
    frequencies_hz: Sequence[float], size_rad: float, span_s: float
) -> dict[str, Channel]:
    """Return the motion that is a sum of sines, and the torque that Eq. 3 asks for it.

    Without the command: the drive would be identified from it anew for each page, which takes long.
    """
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


def made_study(design: Design | None = None, **parts: object) -> StudyResult:
    """Return the result of a study folder; `parts` replace its fields."""
    design = design or Design()
    rng = np.random.default_rng(design.seed)
    sessions = _sessions(design)
    fits: list[Fit] = []
    scores: list[Score] = []
    epochs: list[Epoch] = []
    for session in sessions:
        _fill(design, session, rng, fits, scores, epochs)
    analysis = Analysis("iv", tuple(fits), tuple(fits), JOINT["inertia_kg_m2"], tuple(scores))
    by_source = {session.source: session for session in sessions}
    ratings = _ratings(design, sessions, rng)
    comparisons = (*gathered(analysis, design.names, by_source), ratings_comparison(ratings))
    comparisons, differences = compare_measures(comparisons, resamples=199)
    comparisons = day_tests(comparisons, ready={RATING.name: ratings_days(ratings)})
    result = StudyResult(
        title="Elbow rigidity",
        reference=design.names[0],
        other=design.names[1],
        comparisons=comparisons,
        differences=differences,
        notices=(Notice("warning", "one column was empty"),),
        resamples=199,
        analysis=analysis,
        epochs=tuple(epochs),
        provenance={"rigidimeter": "0"},
        conditions=(
            Condition(design.names[0], "stimulation off"),
            Condition(design.names[1], "stimulation on", 130.0, 0.32, "mA", 60.0, "C+ 1-", 15.0),
        ),
        sessions=sessions,
        ratings=ratings,
        sensitivity=tuple(_sensitivity(comparisons)),
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
    return replace(result, **parts)


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
                angle_rms_rad=0.04,
                angle_range_rad=0.2,
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


def _ratings(
    design: Design, sessions: Sequence[SessionEntry], rng: np.random.Generator
) -> RatingsFound:
    bias = {e: b for e, b in zip(design.examiners, (0.35, -0.1, -0.3), strict=False)}
    rows = []
    for s in sessions:
        level = 1.9 - 0.5 * design.effect * (s.condition == design.names[1])
        for examiner in design.examiners:
            score = level + bias[examiner] + 0.3 * float(rng.standard_normal())
            rows.append((s.condition, examiner, s.subject, s.day, _rounded(score)))
    return ratings_found(tuple(rows), design.names)


def _rounded(score: float) -> float:
    return min(max(round(2 * score) / 2, 0.0), 3.0)


def ratings_found(
    rows: tuple[tuple[str, str, str, str, float], ...], names: tuple[str, str]
) -> RatingsFound:
    """Return the mixed model of ratings (condition, examiner, subject, day, score)."""
    ratings = [
        Rating(line, condition, score, examiner, subject, day)
        for line, (condition, examiner, subject, day, score) in enumerate(rows, start=2)
    ]
    by_day = fit_mixed(
        [r.score for r in ratings],
        [r.condition for r in ratings],
        {
            "examiner": [r.examiner for r in ratings],
            "day": [f"{r.subject}/{r.day}" for r in ratings],
        },
    )
    found = fit_ratings("ratings.csv", ratings, ["examiner"], names)
    return with_days(found, by_day)


PULL = {
    ("published", "fixed"): 0.75,
    ("published", "free"): 0.7,
    ("bandlimited", "fixed"): 0.9,
    ("bandlimited", "free"): 0.88,
    ("iv", "fixed"): 1.0,
    ("iv", "free"): 1.0,
}


def _sensitivity(comparisons: Sequence[Comparison]) -> list[SensitivityRow]:
    """Let voluntary torque pull the joint down, and here in the other condition alone."""
    rows = []
    for c in comparisons:
        if c.measure.name not in JOINT:
            continue
        x, y = (c.of(name) for name in c.pair)
        group = two_groups(
            [o.value for o in x], [o.value for o in y], [o.unit for o in x], [o.unit for o in y]
        )
        for (method, inertia), factor in PULL.items():
            if c.measure.name != "inertia_kg_m2" or inertia != "fixed":
                rows.append(sensitivity_row(c.measure, method, inertia, group, factor))
    return rows


def sensitivity_row(
    measure: Measure, method: str, inertia: str, group: TwoGroups, factor: float
) -> SensitivityRow:
    """Return the conclusion with the other condition multiplied by a factor."""
    x, y = group.x, group.y * factor
    test = ranksum(x, y)
    p_day = day_difference(x, y, group.x_units, group.y_units).p
    return SensitivityRow(
        measure,
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
        method == "iv" and inertia == "free",
    )


def altered(study: StudyResult, change: Callable[[Comparison], Comparison]) -> StudyResult:
    """Return the study with every comparison changed, its tests by days adjusted anew."""
    changed = [change(c) for c in study.comparisons]
    adjusted = holm([c.days.p if c.days is not None else math.nan for c in changed])
    return replace(
        study,
        comparisons=tuple(
            replace(c, days_p_holm=p) for c, p in zip(changed, adjusted, strict=True)
        ),
    )


def untested(study: StudyResult, measure: str, remark: str) -> StudyResult:
    """Return the study with one measure that days could not test."""

    def change(c: Comparison) -> Comparison:
        if c.measure.name != measure or c.days is None:
            return c
        return replace(c, days=no_days(c.days.n_days_x, c.days.n_days_y, remark))

    return altered(study, change)
