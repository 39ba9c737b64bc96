"""What is said of a plan of days: its sessions, the one that is due, and its wait."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rigidimeter.cli.output import echo
from rigidimeter.cli.terminal_tables import Table, show
from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.core.study_files import DueBlock, StudyPlan

_SHOWN = 12


def plan_of(folder: Path) -> StudyPlan:
    """Return the plan of a study folder.

    Raises
    ------
    UserError
        If it has none, or it cannot be read.
    """
    from rigidimeter.core.study_files import read_plan

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


def due_of(plan: StudyPlan, subject: str) -> DueBlock | None:
    """Return the session of a subject that is due; None if all were recorded."""
    from rigidimeter.core.study_files import due_block, recorded_blocks

    return due_block(plan, recorded_blocks(plan.folder), subject)


def due_words(plan: StudyPlan, due: DueBlock) -> str:
    """Return which session is due, with the code of its condition where examiners are blinded."""
    block, (number, of) = due.block, due.place
    part = f", part {due.part}" if due.part > 1 else ""
    raters = f", rated by {', '.join(block.raters.split())}" if block.raters else ""
    return (
        f"Session {number} of {of} of {block.subject}: day {block.day}, number {block.order}, "
        f"{plan.shown(block.condition)}{part}{raters}"
    )


def wait_words(due: DueBlock, now: datetime, speed: float = 1.0) -> str:
    """Return how long to wait, without the state of the stimulation and since when it is on."""
    left = due.left_min(now, speed)
    if left is None and due.change is not None and due.change.stimulation != due.stimulation:
        return "The wait has not begun: the stimulation is not yet as this session needs it"
    if left is None:
        return (
            f"The wait of {due.block.wait_min:g} min has not begun: the stimulation was not set "
            "for this session, or nobody wrote down when"
        )
    if left > 0.0:
        return f"Wait {left:.0f} min more, of {due.block.wait_min:g} min"
    return "No wait is left"


def show_plan(plan: StudyPlan) -> None:
    """Show the plan of each subject, what was recorded of it, and what is due."""
    from rigidimeter.core.study_files import recorded_blocks

    recorded = recorded_blocks(plan.folder)
    done = [one.key for one in recorded]
    waits = sum(block.wait_min for block in plan.blocks) / 60.0
    edited = " Edited after it was drawn." if plan.edited else ""
    show(
        [
            f"{plan.folder}: {len(plan.blocks)} sessions on {plan.about.days} days, "
            f"{waits:.0f} h of waits, order {plan.about.order}, seed {plan.about.seed}.{edited}",
            "",
        ]
    )
    for subject in plan.about.subjects:
        own = [block for block in plan.blocks if block.subject == subject]
        rows = [
            (
                block.day,
                str(block.order),
                plan.shown(block.condition),
                block.task,
                f"{block.wait_min:g}",
                block.raters,
                "recorded" if block.key in done else "",
            )
            for block in own
        ]
        first = next((k for k, row in enumerate(rows) if not row[-1]), 0)
        start = max(min(first - 2, len(rows) - _SHOWN), 0)
        shown = rows[start : start + _SHOWN]
        headings = ("day", "order", "condition", "task", "wait\nmin", "raters", "")
        more = len(rows) - len(shown)
        show([f"Subject {subject}", Table(headings, shown, "<<<<><<")])
        if more:
            echo(f"  {more} more in {plan.folder / 'plan.csv'}")
        due = due_of(plan, subject)
        echo(f"  {due_words(plan, due)}" if due else "  All sessions are recorded.")
    echo(f"Run the next one: rigidimeter run --next {plan.folder}")


def show_switches(plan: StudyPlan, subject: str) -> None:
    """Show what to set before each session of the day that is due, for who sets the stimulator."""
    due = due_of(plan, subject)
    if due is None:
        echo(f"{subject}: all sessions are recorded")
        return
    day = [b for b in plan.blocks if (b.subject, b.day) == (subject, due.block.day)]
    rows = [
        (
            str(block.order),
            block.condition,
            plan.about.stimulation_of(block.condition),
            f"{block.wait_min:g}",
        )
        for block in day
        if block.order >= due.block.order
    ]
    headings = ("order", "condition", "stimulation", "wait\nmin")
    show([f"Subject {subject}, day {due.block.day}", Table(headings, rows, "<<<>")])
    echo(wait_words(due, datetime.now(UTC)))
