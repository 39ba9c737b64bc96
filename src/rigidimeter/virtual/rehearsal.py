"""A plan of days carried out on the virtual rig, on a clock on which no wait takes time."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

from rigidimeter.core.errors import UserError
from rigidimeter.core.study_files import (
    StimulationChange,
    StudyPlan,
    add_change,
    begun_session,
    due_block,
    extend_study,
    recorded_blocks,
)
from rigidimeter.virtual.virtual_session import run_virtual_session

_NINE = 9
"""When a day begins, in hours."""


def rehearse(
    plan: StudyPlan,
    first_day: datetime,
    *,
    wait_share: float = 1.0,
    on_session: Callable[[Path], None] = lambda _: None,
) -> list[Path]:
    """Record every session that is left of a plan on the virtual rig, and add it to the study.

    Each day of the plan is a calendar day after the one before. The stimulation is switched where
    the plan needs it, and what the sessions record of it is that clock.

    Parameters
    ----------
    plan : StudyPlan
    first_day : datetime
        With its zone; its time of day is not used.
    wait_share : float
        How much of each wait is kept, to see what becomes of one that is cut short.
    on_session : callable
        Takes the folder of each session that was recorded.

    Returns
    -------
    list of Path

    Raises
    ------
    UserError
        If a settings file or the study cannot be used, or a session does not end well.
    """
    morning = datetime(first_day.year, first_day.month, first_day.day, _NINE, tzinfo=UTC)
    days = list(dict.fromkeys(block.day for block in plan.blocks))
    folders = []
    for subject in plan.about.subjects:
        now, today = morning, ""
        while due := due_block(plan, recorded_blocks(plan.folder), subject):
            block = due.block
            if block.day != today:
                today, now = block.day, morning + timedelta(days=days.index(block.day))
            if due.left_min(now) is None:
                add_change(plan.folder, StimulationChange(subject, now, due.stimulation, "virtual"))
                due = due_block(plan, recorded_blocks(plan.folder), subject) or due
            now += timedelta(minutes=wait_share * (due.left_min(now) or 0.0))
            reason = "rehearsed with shorter waits"
            begun = begun_session(plan, due, now, operator="virtual", reason=reason)
            folder = begun.folder
            done = run_virtual_session(
                begun.settings, folder, created_utc=now.isoformat(), about=begun.about
            )
            if done.outcome != "success":
                raise UserError(f"{folder}: the session ended with {done.outcome}: {done.reason}")
            extend_study(plan.folder, [folder])
            now += timedelta(minutes=5)
            folders.append(folder)
            on_session(folder)
    return folders
