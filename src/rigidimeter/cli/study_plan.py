"""`rigidimeter study plan` and `study stimulation`: the days of a study, and the waits in them."""

from __future__ import annotations

import random
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rigidimeter.cli.help_pages import OPTIONS, READ, HelpCommand, argument
from rigidimeter.cli.options import STUDY_SEED
from rigidimeter.cli.output import echo
from rigidimeter.cli.study import study
from rigidimeter.cli.terminal_tables import Table, show
from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.core.settings import Settings
    from rigidimeter.core.study_files import DueBlock, StudyPlan
    from rigidimeter.planning import StudyDays

_SHOWN = 12


@study.command("plan", cls=HelpCommand)
def plan_days(
    folder: Path = argument("STUDY", "Study folder; made if it is none."),
    subjects: str = OPTIONS.option("--subjects A,B", "Codes of the subjects.", ""),
    days: int = OPTIONS.option("--days N", "Days of each subject.", 8, min=1, max=1000),
    conditions: str = OPTIONS.option(
        "--conditions A,B", "Conditions, the reference first.", "OFF,DBS"
    ),
    stimulated: str = OPTIONS.option(
        "--stimulated B,C", "Conditions with stimulation on. Default: all but the first.", "*"
    ),
    days_of: list[str] | None = OPTIONS.option(
        "--days-of NAME=N", "On how many of the days a condition is recorded. Default: on all."
    ),
    sessions: int = OPTIONS.option(
        "--sessions N",
        "Sessions a day of each condition. Above 1 conditions alternate, at most two alike in a "
        "row.",
        1,
        min=1,
        max=6,
    ),
    order: str = OPTIONS.option(
        "--order balanced|drawn|A,B",
        "Order in a day. Balanced: the second of two days reverses the first; drawn: each day by "
        "itself; or one order for all days.",
        "balanced",
    ),
    wait_on_min: float = OPTIONS.option(
        "--wait-after-on MIN", "Wait after switching on.", 15.0, min=0.0, max=1440.0
    ),
    wait_off_min: float = OPTIONS.option(
        "--wait-after-off MIN",
        "Wait after switching off. Rigidity returns in 30 to 60 minutes; the paper waited 15.",
        60.0,
        min=0.0,
        max=1440.0,
    ),
    prbs_epochs: int = OPTIONS.option(
        "--prbs-epochs N", "PRBS epochs of a session.", 5, min=0, max=500
    ),
    sinusoid_epochs: int = OPTIONS.option(
        "--sinusoid-epochs N", "Sinusoidal epochs of a session.", 3, min=0, max=500
    ),
    raters: str = OPTIONS.option("--raters A,B", "Examiners who rate in each session.", ""),
    blinded: bool = OPTIONS.flag(
        "--blinded", "Show codes in place of conditions wherever an examiner may look."
    ),
    settings: Path | None = READ.option(
        "--settings FILE", "Settings that all sessions share. Default: those of the program."
    ),
    design: Path | None = READ.option(
        "--from-design FILE", "Take days and PRBS epochs from the JSON of design --detect."
    ),
    seed: int = STUDY_SEED,
) -> None:
    """Plan the days of a study, or show its plan.

    Writes plan.csv (a row for each session), plan.toml and a settings file for each condition. A
    plan may be edited; it is checked, and every session records its digest. Without --subjects the
    plan that is there is shown, with what was recorded of it.

    \b
    For example:
      rigidimeter study plan study --subjects S01 --days 9 --days-of DBS=4 --raters A,B,C
      rigidimeter study plan study
      rigidimeter run --next study
    """
    from rigidimeter.core.settings import load_settings
    from rigidimeter.core.study_files import PlanToml, is_study, read_plan, write_plan
    from rigidimeter.planning import StudyDays, draw_days

    there = read_plan(folder)
    if not subjects:
        if there is None:
            raise UserError(f"{folder}: has no plan yet; draw one with --subjects S01,S02")
        _show(there)
        return
    names = _names(conditions, "--conditions")
    base = load_settings(settings)
    if design is not None:
        days, prbs_epochs = days_of_design(design)
    given = () if order in ("balanced", "drawn") else tuple(_names(order, "--order"))
    spec = StudyDays(
        subjects=tuple(_names(subjects, "--subjects")),
        conditions=tuple(names),
        days=days,
        stimulated=tuple(names[1:] if stimulated == "*" else _names(stimulated, "--stimulated")),
        days_of=_days_of(days_of or []),
        sessions_a_day=sessions,
        order=given,
        balanced=order != "drawn",
        wait_after_on_min=wait_on_min,
        wait_after_off_min=wait_off_min,
        task=" ".join(
            name for name, n in (("prbs", prbs_epochs), ("sinusoid", sinusoid_epochs)) if n
        ),
        raters=tuple(_names(raters, "--raters")) if raters else (),
        blinded=blinded,
    )
    about = PlanToml(
        subjects=list(spec.subjects),
        days=spec.days,
        conditions=names,
        stimulated=list(spec.stimulated),
        order="given" if given else "balanced" if spec.balanced else "drawn",
        seed=seed,
        wait_after_on_min=wait_on_min,
        wait_after_off_min=wait_off_min,
        raters=list(spec.raters),
        codes=_codes(names, seed) if blinded else {},
    )
    protocols = {
        f"protocols/{name}.toml": _protocol(base, name, prbs_epochs, sinusoid_epochs)
        for name in names
    }
    blocks = draw_days(spec, seed)
    if not is_study(folder):
        _describe(folder, spec)
    written = write_plan(folder, about, blocks, protocols)
    _show(written)


@study.command("stimulation", cls=HelpCommand)
def stimulation(
    folder: Path = argument("STUDY", "Study folder with a plan."),
    state: str = argument("[STATE]", "on, off, or since when on the clock: `off since 10:42`.", ""),
    subject: str = OPTIONS.option("--subject CODE", "Whose, where the plan has several.", ""),
    by: str = OPTIONS.option("--by NAME", "Who switched.", ""),
) -> None:
    """Write down that the stimulation was switched, or list what to switch and when.

    For whoever sets the stimulator, who is not blinded. The wait before a session runs from the
    last change. Without a state the list of the day is shown, in conditions and not in codes.

    \b
    For example:
      rigidimeter study stimulation study
      rigidimeter study stimulation study on --by nurse
      rigidimeter study stimulation study "off since 10:42"
    """
    from rigidimeter.core.study_files import add_change, parse_change

    plan = plan_of(folder)
    subject = subject_of(plan, subject)
    if not state:
        _switch_list(plan, subject)
        return
    change = parse_change(state, subject, datetime.now(UTC), by)
    add_change(folder, change)
    local = change.changed_utc.astimezone()
    echo(f"{subject}: stimulation {change.stimulation} since {local:%H:%M}")
    due = due_of(plan, subject)
    if due is not None:
        echo(wait_words(due, datetime.now(UTC)))


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


def days_of_design(path: Path) -> tuple[int, int]:
    """Return the days and PRBS epochs a day that a design asks for.

    Raises
    ------
    UserError
        If the file is no design with a difference to detect.
    """
    from rigidimeter.core.files import read_json
    from rigidimeter.planning import DESIGN_SCHEMA

    document = read_json(path)
    if not isinstance(document, dict) or document.get("schema") != DESIGN_SCHEMA:
        raise UserError(f"{path}: is not the JSON of rigidimeter design --json")
    found = [one.get("planned") or {} for one in document.get("detection", [])]
    days = [one["days_needed_primary"] for one in found if one.get("days_needed_primary")]
    if not days:
        raise UserError(
            f"{path}: names no days; run design with --detect and a protocol that has epochs of "
            "two conditions"
        )
    return max(days), max(max(one["epochs_a_day"]) for one in found if one)


def _show(plan: StudyPlan) -> None:
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


def _switch_list(plan: StudyPlan, subject: str) -> None:
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


def _protocol(base: Settings, condition: str, prbs: int, sinusoid: int) -> str:
    """Return the settings file of the sessions of a condition."""
    from rigidimeter.core.files import toml_text
    from rigidimeter.core.settings import changed_settings

    counts = {"prbs": prbs, "sinusoid": sinusoid}
    blocks = [
        {"task": task, "condition": condition, "epochs": count}
        for task, count in counts.items()
        if count
    ]
    if not blocks:
        raise UserError("--prbs-epochs 0 and --sinusoid-epochs 0: a session needs an epoch")
    first = next(iter(base.subject.values())).model_dump(mode="json", exclude_unset=True)
    joints = {condition: first} if condition not in base.subject else {}
    made = changed_settings(
        base, {"subject": joints, "protocol": {"blocks": blocks}}, f"condition {condition}"
    )
    return toml_text(made.model_dump(mode="json", exclude_unset=True))


def _describe(folder: Path, spec: StudyDays) -> None:
    """Write `study.toml` and its empty tables for the conditions of the plan."""
    from rigidimeter.core.study_files import ConditionTable, write_new_study

    waits = dict.fromkeys(spec.stimulated, spec.wait_after_on_min)
    tables = {name: ConditionTable(wash_in_min=waits.get(name)) for name in spec.conditions}
    if len(tables) > 1:
        write_new_study(folder, planned=tables)


def _codes(conditions: Sequence[str], seed: int) -> dict[str, str]:
    from rigidimeter.core.session import drawn_codes

    return drawn_codes(conditions, random.Random(f"codes {seed}"))


def _names(text: str, option: str) -> list[str]:
    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names or len(set(names)) < len(names):
        raise UserError(f"{option} {text}: write different names with commas between, such as A,B")
    return names


def _days_of(texts: Sequence[str]) -> dict[str, int]:
    found = {}
    for text in texts:
        name, _, count = text.partition("=")
        if not count.strip().isdigit():
            raise UserError(f"--days-of {text}: write a condition and its days, such as DBS=4")
        found[name.strip()] = int(count)
    return found
