"""`rigidimeter study plan` and `study stimulation`: the days of a study, and the waits in them."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import typer

from rigidimeter.cli.help_pages import OPTIONS, READ, RUN, HelpCommand, argument
from rigidimeter.cli.output import echo
from rigidimeter.cli.plan_text import show_plan, show_switches
from rigidimeter.cli.progress import Meter
from rigidimeter.core.errors import UserError


def plan_days(
    folder: Path = argument("STUDY", "Study folder; made if it is none."),
    subjects: str = OPTIONS.option("--subjects A,B", "Codes of the subjects.", ""),
    days: int = OPTIONS.option("--days N", "Days of each subject.", 8),
    conditions: str = OPTIONS.further(
        "--conditions A,B", "Conditions, the reference first.", "OFF,DBS"
    ),
    stimulated: str = OPTIONS.further(
        "--stimulated B,C", "Conditions with stimulation on. Default: all but the first.", "*"
    ),
    days_of: list[str] | None = OPTIONS.further(
        "--days-of NAME=N", "On how many of the days a condition is recorded. Default: on all."
    ),
    sessions: int = OPTIONS.further(
        "--sessions N",
        "Sessions a day of each condition. Above 1 conditions alternate, at most two alike in a "
        "row.",
        1,
    ),
    order: str = OPTIONS.further(
        "--order balanced|drawn|A,B",
        "Order in a day. Balanced: the second of two days reverses the first; drawn: each day by "
        "itself; or one order for all days.",
        "balanced",
    ),
    wait_on_min: float = OPTIONS.further("--wait-after-on MIN", "Wait after switching on.", 15.0),
    wait_off_min: float = OPTIONS.option(
        "--wait-after-off MIN",
        "Wait after switching off. Rigidity returns in 30 to 60 minutes; the paper waited 15.",
        60.0,
    ),
    prbs_epochs: int = OPTIONS.option("--prbs-epochs N", "PRBS epochs of a session.", 5),
    sinusoid_epochs: int = OPTIONS.further(
        "--sinusoid-epochs N", "Sinusoidal epochs of a session.", 3
    ),
    rests: str = OPTIONS.further(
        "--rests S,S",
        "Rests between epochs (s); several are drawn from. Default: those of the settings.",
        "",
    ),
    raters: str = OPTIONS.further("--raters A,B", "Examiners who rate in each session.", ""),
    blinded: bool = OPTIONS.flag(
        "--blinded", "Show codes in place of conditions wherever an examiner may look."
    ),
    settings: Path | None = READ.option(
        "--settings FILE", "Settings that all sessions share. Default: those of the program."
    ),
    design: Path | None = READ.further(
        "--from-design FILE", "Take days and PRBS epochs from the JSON of design --detect."
    ),
    seed: int | None = RUN.option(
        "--seed N", "Seed of orders and codes. Default: 2023; with --blinded, one that is drawn."
    ),
) -> None:
    """Plan the days of a study, or show its plan.

    Writes plan.csv (a row for each session), plan.toml and a settings file for each condition. A
    plan may be edited; it is checked, and every session records its digest. Without --subjects the
    plan that is there is shown, with what was recorded of it.

    \b
    For example:
      rigidimeter study plan winter --subjects S01 --days 9 --days-of DBS=4
      rigidimeter study plan winter
      rigidimeter run --next winter
    """
    from rigidimeter.core.settings import load_settings
    from rigidimeter.core.study_files import read_plan
    from rigidimeter.planning import (
        PlanValues,
        days_of_design,
        draw_plan,
        plan_days_of,
        plan_names,
    )

    there = read_plan(folder)
    if not subjects:
        if there is None:
            raise UserError(f"{folder}: has no plan yet; draw one with --subjects S01,S02")
        show_plan(there)
        return
    base = load_settings(settings)
    if design is not None:
        days, prbs_epochs = days_of_design(design)
    values = PlanValues(
        subjects=plan_names(subjects, "subjects"),
        days=days,
        conditions=plan_names(conditions, "conditions"),
        stimulated=None if stimulated == "*" else plan_names(stimulated, "stimulated"),
        days_of=plan_days_of(days_of or []),
        sessions=sessions,
        order="balanced" if order == "balanced" else "drawn" if order == "drawn" else "given",
        given=() if order in ("balanced", "drawn") else plan_names(order, "order"),
        wait_after_on=wait_on_min,
        wait_after_off=wait_off_min,
        prbs_epochs=prbs_epochs,
        sinusoid_epochs=sinusoid_epochs,
        rests_s=_rests(rests),
        raters=plan_names(raters, "raters") if raters else (),
        blinded=blinded,
        seed=seed,
    )
    show_plan(draw_plan(values, base).write(folder))


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
      rigidimeter study stimulation winter
      rigidimeter study stimulation winter off
      rigidimeter study stimulation winter on --by nurse
    """
    from rigidimeter.core.study_files import (
        add_change,
        next_block,
        parse_change,
        plan_of,
        subject_of,
        wait_words,
    )

    plan = plan_of(folder)
    subject = subject_of(plan, subject)
    if not state:
        show_switches(plan, subject)
        return
    change = parse_change(state, subject, datetime.now(UTC), by)
    add_change(folder, change)
    local = change.changed_utc.astimezone()
    echo(f"{subject}: stimulation {change.stimulation} since {local:%H:%M}")
    due = next_block(plan, subject)
    if due is not None:
        echo(wait_words(due, datetime.now(UTC)))


def rehearse_plan(
    folder: Path = argument("STUDY", "Study folder with a plan."),
    wait_share: float = OPTIONS.option(
        "--wait-share X",
        "Share of each wait that passes, to see waits cut short.",
        1.0,
        min=0.0,
        max=1.0,
    ),
) -> None:
    """Carry out what is left of a plan on the virtual rig.

    No wait takes time: every day is a calendar day of a clock of its own, in the past.

    \b
    For example:
      rigidimeter study rehearse winter
      rigidimeter compare winter
    """
    from rigidimeter.core.study_files import plan_of
    from rigidimeter.virtual import rehearse

    plan = plan_of(folder)
    left = len(plan.blocks)
    # All of it before now, so that what is switched from now on is the last change.
    first_day = datetime.now(UTC) - timedelta(days=plan.about.days + 1)
    with Meter("rehearse", left) as meter:
        done: list[Path] = []

        def on_session(session: Path) -> None:
            done.append(session)
            meter.reach(len(done))

        rehearse(plan, first_day, wait_share=wait_share, on_session=on_session)
    echo(f"{len(done)} sessions of {folder} were recorded on the virtual rig")
    echo(f"Next: rigidimeter compare {folder}")


def add_plan_commands(study: typer.Typer) -> None:
    """Add the commands of this module to the group `study`."""
    study.command("plan", cls=HelpCommand)(plan_days)
    study.command("rehearse", cls=HelpCommand)(rehearse_plan)
    study.command("stimulation", cls=HelpCommand)(stimulation)


def _rests(text: str) -> tuple[float, ...]:
    from rigidimeter.planning import WrongValue

    try:
        return tuple(float(one) for one in text.split(",") if one.strip())
    except ValueError:
        raise WrongValue("rests", "write times in s, such as 10 or 10,20", text) from None
