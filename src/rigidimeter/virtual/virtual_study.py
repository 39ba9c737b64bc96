"""A virtual study as a study folder: its sessions on the virtual rig, and its tables.

Every session has a seed of its own (`plan`), so it is the same whichever process runs it and
whenever; the whole folder is the same byte for byte for equal seeds. ``study.toml`` is written
last: a folder that has one is complete. What was written is removed when it is interrupted.
"""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from dataclasses import asdict, fields
from functools import partial
from pathlib import Path

from rigidimeter.core.errors import UserError
from rigidimeter.core.executor import each
from rigidimeter.core.files import csv_text, toml_text, write_text
from rigidimeter.core.settings import SinusoidSettings
from rigidimeter.core.study_files import STUDY_SCHEMA, PrimaryTable, write_study_dictionary
from rigidimeter.core.units import rad_from_deg
from rigidimeter.virtual.study_design import ConditionDesign, StudyDesign
from rigidimeter.virtual.study_plan import DayPlan, day_joint, felt_rigidity, plan_study
from rigidimeter.virtual.virtual_session import run_virtual_session, session_length_s


def study_length_s(plans: Sequence[DayPlan]) -> float:
    """Return how long all sessions last together, in s of the virtual clock."""
    return sum(session_length_s(plan.settings) for plan in plans)


def write_virtual_study(
    folder: Path,
    design: StudyDesign,
    seed: int,
    *,
    processes: int = 2,
    progress: Callable[[float], None] = lambda _: None,
    on_lost: Callable[[list[str]], None] = lambda _: None,
) -> list[DayPlan]:
    """Run every session of a virtual study and write its folder; return what was planned.

    Parameters
    ----------
    folder : Path
        Made if it does not exist; it must be empty.
    design : StudyDesign
    seed : int
        Of everything random.
    processes : int
        Sessions that run at a time, each in a process of its own; with 1, in this one.
    progress : callable
        Takes how much of `study_length_s` is done, in s.
    on_lost : callable
        Takes what ended before its sessions did, which others have run again.

    Raises
    ------
    UserError
        If the folder is not empty or cannot be written, or a session fails.
    """
    made = not folder.exists()
    if not made and not (folder.is_dir() and not any(folder.iterdir())):
        why = "is there already; a study is never written over,"
        if (folder / "sessions").is_dir() and not (folder / "study.toml").exists():
            why = "holds a study that was not finished: it has no study.toml; remove it or"
        raise UserError(f"{folder}: {why} name another")
    plans = plan_study(design, seed)
    done_s = 0.0
    run = partial(_run, folder=folder)
    try:
        with closing(
            each(run, plans, jobs=processes, on_death=_dead, on_lost=on_lost)
        ) as done:  # what runs ends before it is removed
            for plan, _ in done:
                done_s += session_length_s(plan.settings)
                progress(done_s)
    except (KeyboardInterrupt, SystemExit):
        # Half a study is of no use, and its sessions could be taken for all of them.
        shutil.rmtree(folder / "sessions", ignore_errors=True)
        if made:
            with suppress(OSError):
                folder.rmdir()
        raise
    _write_tables(folder, plans, design.subject)
    write_text(folder / "study.toml", _study_toml(design, seed))
    return plans


def _dead(plan: DayPlan) -> None:
    raise UserError(
        f"{plan.folder}: the process that ran this session ended twice, such as for want of "
        "memory; use fewer processes"
    )


def _run(plan: DayPlan, folder: Path) -> None:
    shutil.rmtree(folder / plan.folder, ignore_errors=True)  # of a process that ended
    result = run_virtual_session(plan.settings, folder / plan.folder, created_utc=plan.created_utc)
    if result.outcome == "abort":  # a session closes in order when it is interrupted
        raise KeyboardInterrupt
    if result.outcome != "success":
        raise UserError(
            f"{folder / plan.folder}: the session ended with {result.outcome}: {result.reason}"
        )


def _write_tables(folder: Path, plans: Sequence[DayPlan], subject: str) -> None:
    sessions = [(plan.folder, subject, plan.day, plan.condition, plan.note) for plan in plans]
    columns = ("path", "subject", "day", "condition", "note")
    write_text(folder / "sessions.csv", csv_text(columns, sessions))
    ratings = [
        (subject, plan.day, plan.condition, examiner, f"{score:g}")
        for plan in plans
        for examiner, score in plan.ratings.items()
    ]
    columns = ("subject", "day", "condition", "examiner", "score")
    write_text(folder / "ratings.csv", csv_text(columns, ratings))
    write_study_dictionary(folder)


def _study_toml(design: StudyDesign, seed: int) -> str:
    """Return the study's description; what it assumes stands in comments."""
    comments = [
        "# A virtual study: made by rigidimeter, of a subject that does not exist.",
        f"# Design {design.name}, seed {seed}. Its assumptions:",
        *(f"#   {name} = {value}" for name, value in _assumed(design)),
    ]
    described = {
        "schema": STUDY_SCHEMA,
        "title": design.title,
        "reference": design.conditions[0].name,
        "other": design.conditions[-1].name,
        "sessions": "sessions.csv",
        "ratings": "ratings.csv",
        "conditions": {one.name: _stimulation(one) for one in design.conditions},
        "simulated": {
            one.name: {name: float(f"{x:.6g}") for name, x in _medians(design, one).items()}
            for one in design.conditions
        },
        "rating": {"scale": design.rating_scale, "step": design.rating_step},
        "primary": PrimaryTable().model_dump(),
    }
    return "\n".join([*comments, "", toml_text(described)])


def _medians(design: StudyDesign, condition: ConditionDesign) -> dict[str, float]:
    """Return what each measure of a condition is at its median joint.

    Of a movement A sin ωt with impedance Z = K − J ω² + i B ω the impulse of a cycle is 4 A |Z|/ω
    and its work π B ω A².
    """
    joint = day_joint(design, condition, (1.0, 1.0, 1.0))
    J, B, K = joint.parameters
    sinusoid = SinusoidSettings.model_validate(design.settings.get("sinusoid", {}))
    amplitude_rad = rad_from_deg(sinusoid.amplitude_deg)
    omega = 2.0 * math.pi * sinusoid.frequency_hz
    return {
        **asdict(joint),
        "impulse_nm_s": 4.0 * amplitude_rad * math.hypot(K - J * omega**2, B * omega) / omega,
        "work_j": math.pi * B * omega * amplitude_rad**2,
        "rating": felt_rigidity(design, joint),
    }


def _assumed(design: StudyDesign) -> list[tuple[str, object]]:
    apart = ("name", "title", "subject", "conditions", "settings", "first_date", "inertia_kg_m2")
    found: list[tuple[str, object]] = [
        (field.name, getattr(design, field.name))
        for field in fields(design)
        if field.name not in apart
    ]
    return found + [
        (f"{condition.name}.voluntary_sd_nm", condition.voluntary_sd_nm)
        for condition in design.conditions
    ]


def _stimulation(condition: ConditionDesign) -> dict[str, object]:
    names = ("title", "frequency_hz", "amplitude_ma", "pulse_width_us", "wash_in_min")
    found = {name: getattr(condition, name) for name in names}
    return {**found, "electrodes": condition.electrodes or None}
