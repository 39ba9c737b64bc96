"""The session of a plan that is next, in words and as it is begun: for the terminal and the page.

No sentence here names a condition to an examiner who is blinded.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import in_codes
from rigidimeter.core.settings import Settings, changed_settings, load_settings
from rigidimeter.core.study_files.day_plan import StudyPlan, read_plan
from rigidimeter.core.study_files.plan_progress import (
    DueBlock,
    RecordedBlock,
    due_block,
    named_block,
    recorded_blocks,
)
from rigidimeter.core.study_files.stimulation_log import STIMULATION_TABLE

_SESSIONS = 1
"""The stream of the plan's seed from which sessions draw theirs."""

PLAN_COLUMNS = ("day", "order", "condition", "task", "wait, min", "raters", "")


@dataclass(frozen=True)
class BegunSession:
    """A session of a plan as it is to be run now.

    Attributes
    ----------
    folder : Path
        New; its name does not give the condition away.
    settings : Settings
    about : mapping
        Of the manifest, with the place in the plan.
    source : Path
        The file of the settings.
    """

    folder: Path
    settings: Settings
    about: Mapping[str, Any]
    source: Path


def plan_of(folder: Path) -> StudyPlan:
    """Return the plan of a study folder.

    Raises
    ------
    UserError
        If it has none, or it cannot be read.
    """
    plan = read_plan(folder)
    if plan is None:
        raise UserError(
            f"{folder}: has no plan; draw one with rigidimeter study plan {folder} --subjects CODE"
        )
    return plan


def subject_of(plan: StudyPlan, subject: str) -> str:
    """Return the subject that was named, or the only one of the plan.

    Raises
    ------
    UserError
        If it is not in the plan, or the plan has several and none was named.
    """
    known = plan.about.subjects
    if not subject and len(known) == 1:
        return known[0]
    if subject not in known:
        what = f"--subject {subject}: is not in the plan" if subject else "name a --subject"
        raise UserError(f"{what}; the plan has {', '.join(known)}")
    return subject


def next_block(
    plan: StudyPlan,
    subject: str,
    named: tuple[str, int] | None = None,
    recorded: Sequence[RecordedBlock] | None = None,
) -> DueBlock | None:
    """Return the session of a subject that is due, or the one of this day and number.

    Parameters
    ----------
    plan : StudyPlan
    subject : str
    named : (str, int), optional
        One that was recorded before is run as a further part.
    recorded : sequence of RecordedBlock, optional
        What was recorded; read from the study folder by default.

    Returns
    -------
    DueBlock or None
        None if all were recorded, or the plan has no session of that name.
    """
    recorded = recorded_blocks(plan.folder) if recorded is None else recorded
    if named is None:
        return due_block(plan, recorded, subject)
    return named_block(plan, recorded, (subject, *named))


def begun_session(
    plan: StudyPlan,
    due: DueBlock,
    now: datetime,
    *,
    operator: str = "",
    note: str = "",
    speed: float = 1.0,
    reason: str = "",
) -> BegunSession:
    """Return a session of the plan as it is to be run now.

    Parameters
    ----------
    plan : StudyPlan
    due : DueBlock
    now : datetime
        When its first epoch may begin.
    operator, note : str
    speed : float
        Of the clock of the waits; above 1 in rehearsals alone.
    reason : str
        Why not to wait; not recorded where the wait is over.

    Raises
    ------
    UserError
        If its settings file cannot be read, or has epochs of another condition.
    """
    try:
        settings = _settings(plan, due)
    except UserError as error:
        raise UserError(*(in_codes(line, plan.about.codes) for line in error.lines)) from None
    block = due.block
    place = {
        "sha256": plan.sha256,
        **asdict(block),
        "stimulation": due.stimulation,
        **change_facts(due, now, speed),
        "clock_speed": speed,
        "wait_cut_short": "" if due.left_min(now, speed) == 0.0 else reason,
    }
    about = {
        "subject": block.subject,
        "operator": operator,
        "note": note,
        "day": block.day,
        "conditions": [block.condition],
        "plan": place,
        **({"blinded": True, "codes": plan.about.codes} if plan.blinded else {}),
    }
    return BegunSession(plan.folder / due.folder, settings, about, plan.folder / block.protocol)


def change_facts(due: DueBlock, now: datetime, speed: float = 1.0) -> dict[str, Any]:
    """Return when the stimulation was set for a session and the minutes since; None if unknown."""
    since = due.since_min(now, speed)
    change = due.change if since is not None else None
    return {
        "stimulation_changed_utc": change.changed_utc.isoformat() if change else None,
        "since_change_min": None if since is None else round(since, 2),
    }


def _settings(plan: StudyPlan, due: DueBlock) -> Settings:
    """Return the settings of a session of the plan, with a seed of its own."""
    source = plan.folder / due.block.protocol
    key = (_SESSIONS, plan.blocks.index(due.block), due.part)
    state = np.random.SeedSequence(plan.about.seed, spawn_key=key).generate_state(1)
    settings = changed_settings(load_settings(source), {"seed": int(state[0])}, str(source))
    conditions = {block.condition for block in settings.protocol.blocks}
    if conditions != {due.block.condition}:
        raise UserError(
            f"{source}: has epochs of {', '.join(sorted(conditions))}, and the plan has "
            f"{due.block.condition} in this session; correct one of them"
        )
    return settings


def plan_words(plan: StudyPlan) -> str:
    """Return how large a plan is and how it was drawn."""
    waits = sum(block.wait_min for block in plan.blocks) / 60.0
    return (
        f"{len(plan.blocks)} sessions on {plan.about.days} days, {waits:.0f} h of waits, order "
        f"{plan.about.order}, seed {plan.about.seed}"
    )


def plan_rows(
    plan: StudyPlan, subject: str, recorded: Sequence[RecordedBlock]
) -> list[tuple[str, ...]]:
    """Return the sessions of a subject as cells of a table, in the order of `PLAN_COLUMNS`."""
    done = {one.key for one in recorded if one.begun}
    return [
        (
            block.day,
            str(block.order),
            plan.shown(block.condition),
            block.task,
            f"{block.wait_min:g}",
            block.raters,
            "recorded" if block.key in done else "",
        )
        for block in plan.blocks
        if block.subject == subject
    ]


def due_words(plan: StudyPlan, due: DueBlock) -> str:
    """Return which session is due, with the code of its condition where examiners are blinded."""
    block, (number, of) = due.block, due.place
    part = f", part {due.part}" if due.part > 1 else ""
    raters = f", rated by {', '.join(block.raters.split())}" if block.raters else ""
    return (
        f"Session {number} of {of} of {block.subject}: day {block.day}, number {block.order}, "
        f"{plan.shown(block.condition)}{part}{raters}"
    )


def next_words(
    plan: StudyPlan, subject: str, recorded: Sequence[RecordedBlock] | None = None
) -> str:
    """Return which session of a subject is due now, or that all are recorded, and whose are left.

    Nothing of a subject that is not in the plan.
    """
    if subject not in plan.about.subjects:
        return ""
    recorded = recorded_blocks(plan.folder) if recorded is None else recorded
    due = next_block(plan, subject, None, recorded)
    if due is not None:
        return f"Next: {due_words(plan, due)}"
    left = [one for one in plan.about.subjects if next_block(plan, one, None, recorded)]
    if left:
        return f"All sessions of {subject} are recorded; some of {', '.join(left)} are left."
    return "All sessions of the plan are recorded."


def wait_words(due: DueBlock, now: datetime, speed: float = 1.0) -> str:
    """Return how long to wait, without the state of the stimulation and since when it is on."""
    left = due.left_min(now, speed)
    if due.wait_from is not None and due.wait_from.is_ahead_of(now):
        return (
            f"The wait of {due.block.wait_min:g} min has not begun: in {STIMULATION_TABLE} the "
            f"last change is at {due.wait_from.changed_utc:%Y-%m-%d %H:%M} UTC, which is still to "
            "come; correct the table"
        )
    if left is None and due.change is not None and due.change.stimulation != due.stimulation:
        return "The wait has not begun: the stimulation is not yet as this session needs it"
    if left is None:
        return (
            f"The wait of {due.block.wait_min:g} min has not begun: the stimulation was not set "
            "for this session, or nobody wrote down when"
        )
    if left > 0.0:
        return f"Wait {math.ceil(left)} min more, of {due.block.wait_min:g} min"
    return "No wait is left"
