"""Small made-up studies of several days, their numbers made by the statistics themselves."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigidimeter.analysis.report import Shown
from rigidimeter.analysis.study import (
    SCORE,
    Compared,
    Condition,
    Exclusion,
    Ratings,
    SessionEntry,
    Study,
    as_rows,
    conclude_study,
    corrected,
    estimate_rows,
    ratings_of,
    together,
)
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


def made_study(design: Design | None = None, **parts: object) -> Shown:
    """Return what a page shows of a study folder; `parts` replace fields of the study."""
    design = design or Design()
    rng = np.random.default_rng(design.seed)
    sessions = _sessions(design)
    fits: list[Fit] = []
    scores: list[Score] = []
    epochs: list[Epoch] = []
    for session in sessions:
        _fill(design, session, rng, fits, scores, epochs)
    analysis = Analysis("iv", tuple(fits), tuple(fits), JOINT["inertia_kg_m2"], tuple(scores))
    conditions = (
        Condition(design.names[0], "stimulation off"),
        Condition(design.names[1], "stimulation on", 130.0, 0.32, "mA", 60.0, "C+ 1-", 15.0),
    )
    by_source = {session.source: session for session in sessions}
    analyses = {"iv": analysis} | {
        method: _pulled(analysis, method, design.names[1])
        for method in ("published", "bandlimited")
    }
    ratings = _ratings(design, sessions, rng)
    study = Study(
        together([estimate_rows(analyses, by_source, epochs, conditions), corrected(ratings)]),
        *design.names,
        title="Elbow rigidity",
        conditions=conditions,
        sessions=sessions,
        exclusions=tuple(_exclusions(sessions, fits)),
        notices=(Notice("warning", "one column was empty"),),
        ratings=ratings,
        analysis=analysis,
    )
    return Shown(
        conclude_study(replace(study, **parts), resamples=199),
        tuple(epochs),
        title="Elbow rigidity",
        provenance={"rigidimeter": "0"},
    )


def of_study(shown: Shown, **parts: object) -> Shown:
    """Return the same conclusions on a study some of whose fields are others."""
    return of_result(shown, study=replace(shown.study, **parts))


def of_result(shown: Shown, **parts: object) -> Shown:
    """Return the same study with other conclusions."""
    return replace(shown, result=replace(shown.result, **parts))


def altered(shown: Shown, change: Callable[[Compared], Compared]) -> Shown:
    """Return the study with every comparison changed."""
    return of_result(shown, comparisons=tuple(map(change, shown.result.comparisons)))


def bare(shown: Shown) -> Shown:
    """Return a study without ratings, other methods, exclusions and differences of effects."""
    rows = shown.study.rows[shown.study.rows["measure"] != "rating"]
    study = replace(shown.study, rows=rows, ratings=None, exclusions=())
    of_fits = replace(conclude_study(study, resamples=0), methods=())
    return replace(shown, result=of_fits)


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


def _exclusions(sessions: Sequence[SessionEntry], fits: Iterable[Fit]) -> Iterable[Exclusion]:
    by_source = {session.source: session for session in sessions}
    for fit in fits:
        if not fit.outcome.included:
            s, reason = by_source[fit.source], fit.outcome.reason
            by = "operator" if "moved" in reason else "protocol"
            who = (s.subject, s.day, s.condition, s.source)
            yield Exclusion(*who, fit.epoch, "prbs", by, reason)


PULL = {
    "published": (0.7, 0.75),
    "bandlimited": (0.88, 0.9),
}
"""How far voluntary torque pulls the joint down by other methods, with J free and held."""


def _pulled(analysis: Analysis, method: str, condition: str) -> Analysis:
    """Return the estimates of another method, in one condition multiplied by a factor."""
    free, held = (
        tuple(
            replace(fit, method=method, value=fit.value * factor ** (fit.condition == condition))
            for fit in fits
        )
        for fits, factor in zip((analysis.fits, analysis.fixed_inertia), PULL[method], strict=True)
    )
    return replace(analysis, method=method, fits=free, fixed_inertia=held)


def _ratings(design: Design, sessions: Sequence[SessionEntry], rng: np.random.Generator) -> Ratings:
    bias = {e: b for e, b in zip(design.examiners, (0.35, -0.1, -0.3), strict=False)}
    rows = []
    for s in sessions:
        level = 1.9 - 0.5 * design.effect * (s.condition == design.names[1])
        for examiner in design.examiners:
            score = level + bias[examiner] + 0.3 * float(rng.standard_normal())
            rows.append((s.condition, examiner, s.subject, s.day, _rounded(score)))
    return made_ratings(rows)


def _rounded(score: float) -> float:
    return min(max(round(2 * score) / 2, 0.0), 3.0)


def made_ratings(rows: Iterable[tuple[str, str, str, str, float]]) -> Ratings:
    """Return the mixed models of ratings (condition, examiner, subject, day, score)."""
    names = ("condition", "rater", "subject", "day", "value")
    scores = as_rows(
        dict(zip(names, row, strict=True))
        | {"epoch": f"line {line}", "measure": SCORE, "chosen": False}
        for line, row in enumerate(rows, start=2)
    )
    return ratings_of("ratings.csv", scores, ["examiner"])
