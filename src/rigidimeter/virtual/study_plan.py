"""From a design and a seed to the sessions of every day; nothing runs here.

Streams of their own keep one thing from moving another: day d draws from child (1, d) of the seed,
session i has the seed of child (2, i), the examiners draw from child (3).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date, timedelta

import numpy as np

from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.virtual.study_design import ConditionDesign, StudyDesign

_DAY, _SESSION, _EXAMINERS = 1, 2, 3


@dataclass(frozen=True)
class DayPlan:
    """One day in one condition: a session folder, and what the examiners say.

    Attributes
    ----------
    folder : str
        Name of the session folder.
    day : str
        The same for both conditions of one day.
    condition : str
    created_utc : str
        In the virtual calendar.
    note : str
        Order of the day and wash-in, in words.
    joint : JointDynamics
        Medians of the epochs of this session.
    settings : Settings
        Of the session, its seed and its protocol among them.
    ratings : mapping of str to float
        The score of each examiner.
    """

    folder: str
    day: str
    condition: str
    created_utc: str
    note: str
    joint: JointDynamics
    settings: Settings
    ratings: Mapping[str, float]


def plan_study(design: StudyDesign, seed: int) -> list[DayPlan]:
    """Return the sessions of a study in the order in which they are run.

    On days with several conditions the order alternates, the reference first on the first of them
    (Sec. 2.5).

    Raises
    ------
    UserError
        If the settings of the design do not hold together.
    ValueError
        If the seed is negative.
    """
    days = sorted({day for condition in design.conditions for day in condition.days})
    plans: list[DayPlan] = []
    turned = False
    for day in days:
        there = [condition for condition in design.conditions if day in condition.days]
        if len(there) > 1:
            there, turned = there[::-1] if turned else there, not turned
        factors = day_factors(design, seed, day)
        when = date.fromisoformat(design.first_date) + timedelta((day - 1) * design.days_apart)
        for place, condition in enumerate(there):
            joint = day_joint(design, condition, factors)
            prbs, sinusoids = (
                spread_evenly(total, len(condition.days))[condition.days.index(day)]
                for total in (condition.prbs_epochs, condition.sinusoid_epochs)
            )
            plans.append(
                DayPlan(
                    folder=f"sessions/day-{day}-{condition.name}",
                    day=str(day),
                    condition=condition.name,
                    # One after the other from nine in the morning.
                    created_utc=f"{when.isoformat()}T{9 + place:02d}:00:00+00:00",
                    note=_note(condition, there, place),
                    joint=joint,
                    settings=_settings(design, condition, joint, prbs, sinusoids, seed, len(plans)),
                    ratings={},
                )
            )
    scores = draw_ratings(design, [plan.joint for plan in plans], _rng(seed, _EXAMINERS))
    return [replace(plan, ratings=given) for plan, given in zip(plans, scores, strict=True)]


def spread_evenly(total: int, days: int) -> list[int]:
    """Return how many of `total` fall on each day: their sum is the total, they differ by one.

    >>> spread_evenly(23, 4)
    [5, 6, 6, 6]
    """
    return [(day + 1) * total // days - day * total // days for day in range(days)]


def day_joint(
    design: StudyDesign, condition: ConditionDesign, factors: Sequence[float]
) -> JointDynamics:
    """Return the medians of a session: those of its condition times the factors of the day."""
    J, B, K = factors
    return JointDynamics(
        J * design.inertia_kg_m2,
        B * condition.damping_nm_s_rad,
        K * condition.stiffness_nm_rad,
    )


def draw_ratings(
    design: StudyDesign, joints: Sequence[JointDynamics], rng: np.random.Generator
) -> list[dict[str, float]]:
    """Return the examiners' scores of each joint; see `study_design` for how they are made."""
    biases = design.examiner_sd * rng.standard_normal(len(design.examiners))
    lowest, highest = design.rating_scale
    found = []
    for joint in joints:
        noise = design.rating_noise_sd * rng.standard_normal(biases.size)
        felt = felt_rigidity(design, joint) + biases + noise
        steps = np.round((felt - lowest) / design.rating_step)
        scores = np.clip(lowest + design.rating_step * steps, lowest, highest)
        found.append(dict(zip(design.examiners, scores.tolist(), strict=True)))
    return found


def felt_rigidity(design: StudyDesign, joint: JointDynamics) -> float:
    """Return the score that a joint has without an examiner's offset, noise, steps and ends."""
    nominal = design.conditions[0]
    return design.rating_level + design.rating_gain * 0.5 * (
        math.log(joint.damping_nm_s_rad / nominal.damping_nm_s_rad)
        + math.log(joint.stiffness_nm_rad / nominal.stiffness_nm_rad)
    )


def day_factors(design: StudyDesign, seed: int, day: int) -> tuple[float, ...]:
    """Return by how much J, B and K of a day differ from their medians."""
    rng = _rng(seed, _DAY, day)
    return tuple(
        math.exp(math.sqrt(math.log1p((percent / 100.0) ** 2)) * rng.standard_normal())
        for percent in (
            design.day_inertia_cv_percent,
            design.day_damping_cv_percent,
            design.day_stiffness_cv_percent,
        )
    )


def _settings(
    design: StudyDesign,
    condition: ConditionDesign,
    joint: JointDynamics,
    prbs: int,
    sinusoids: int,
    seed: int,
    number: int,
) -> Settings:
    """Return the settings of one session."""
    state = np.random.SeedSequence(seed, spawn_key=(_SESSION, number)).generate_state(1)
    counts = {"prbs": prbs, "sinusoid": sinusoids}
    values = {
        **design.settings,
        "seed": int(state[0]),
        "subject": {
            condition.name: {
                "inertia_kg_m2": joint.inertia_kg_m2,
                "damping_nm_s_rad": joint.damping_nm_s_rad,
                "stiffness_nm_rad": joint.stiffness_nm_rad,
                "inertia_cv_percent": design.epoch_inertia_cv_percent,
                "damping_cv_percent": design.epoch_damping_cv_percent,
                "stiffness_cv_percent": design.epoch_stiffness_cv_percent,
                "voluntary_sd_nm": condition.voluntary_sd_nm,
            }
        },
        "protocol": {
            **design.settings.get("protocol", {}),
            "blocks": [
                {"task": task, "condition": condition.name, "epochs": count}
                for task, count in counts.items()
                if count
            ],
        },
    }
    return parse_settings(values, source=f"the virtual study {design.name}")


def _rng(seed: int, *key: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


def _note(condition: ConditionDesign, there: Sequence[ConditionDesign], place: int) -> str:
    """Say what came before on this day."""
    parts = []
    if place > 0:
        parts.append(f"after {there[place - 1].name}")
    elif len(there) > 1:
        parts.append(f"before {there[place + 1].name}")
    if condition.wash_in_min is not None:
        parts.append(f"{condition.wash_in_min:g} min after switching on")
    elif place > 0:
        parts.append("15 min after switching off")
    return "; ".join(parts)
