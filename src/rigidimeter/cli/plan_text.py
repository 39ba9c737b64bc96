"""A plan of days as tables: its sessions, and what to switch before each."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING

from rigidimeter.cli.output import echo
from rigidimeter.cli.terminal_tables import Table, show

if TYPE_CHECKING:
    from rigidimeter.core.study_files import StudyPlan

_SHOWN = 12


def show_plan(plan: StudyPlan) -> None:
    """Show the plan of each subject, what was recorded of it, and what is due."""
    from rigidimeter.core.study_files import (
        PLAN_COLUMNS,
        next_block,
        next_words,
        plan_rows,
        plan_words,
        recorded_blocks,
    )

    edited = " Edited after it was drawn." if plan.edited else ""
    show([f"{plan.folder}: {plan_words(plan)}.{edited}", ""])
    recorded = recorded_blocks(plan.folder)
    headings = tuple(name.replace(", ", "\n") for name in PLAN_COLUMNS)
    for subject in plan.about.subjects:
        rows = plan_rows(plan, subject, recorded)
        first = next((k for k, row in enumerate(rows) if not row[-1]), 0)
        start = max(min(first - 2, len(rows) - _SHOWN), 0)
        shown = rows[start : start + _SHOWN]
        more = len(rows) - len(shown)
        show([f"Subject {subject}", Table(headings, shown, "<<<<><<")])
        if more:
            echo(f"  {more} more in {plan.folder / 'plan.csv'}")
        echo(f"  {next_words(plan, subject, recorded)}")
    if any(next_block(plan, one, None, recorded) for one in plan.about.subjects):
        echo(f"Run the next one: rigidimeter run --next {plan.folder}")


def show_switches(plan: StudyPlan, subject: str) -> None:
    """Show what to set before each session of the day that is due, for who sets the stimulator."""
    from rigidimeter.core.study_files import next_block, wait_words

    due = next_block(plan, subject)
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
