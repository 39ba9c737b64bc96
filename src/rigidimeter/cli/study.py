"""`rigidimeter study` and `rigidimeter demo`: make a study folder, or add sessions to one."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from rigidimeter.cli.help_pages import OPTIONS, WRITE, HelpCommand, HelpGroup, argument
from rigidimeter.cli.options import NEW_STUDY, STUDY_SEED
from rigidimeter.cli.output import echo
from rigidimeter.cli.progress import Meter
from rigidimeter.cli.reading_options import plain_recordings
from rigidimeter.cli.report import write_page
from rigidimeter.cli.terminal_tables import show
from rigidimeter.core.errors import UserError, refused

if TYPE_CHECKING:
    from rigidimeter.virtual import DayPlan, StudyDesign

study = typer.Typer(
    name="study",
    no_args_is_help=True,
    rich_markup_mode=None,
    cls=HelpGroup,
    help="Make a study folder: empty, of recorded sessions, or virtual.",
)

STUDY = argument("STUDY", "Study folder.")
SESSION = argument("SESSION", "Session or recording, as in sessions.csv.")
EPOCH = argument("EPOCH", "Label of the epoch, as estimate shows it.")
REASON = OPTIONS.option("--reason TEXT", "Why.", ...)
BY = OPTIONS.option("--by NAME", "Your name.", ...)


@study.command(cls=HelpCommand)
def new(
    folder: Path = argument("DIR", "New folder."),
    title: str = OPTIONS.option("--title TEXT", "Title of the study.", ""),
) -> None:
    """Make an empty study folder: study.toml and its tables.

    The tables have comments and no rows. Write a row in sessions.csv for each session folder or
    recording, then run compare and report.

    \b
    For example:
      rigidimeter study new study --title "Elbow, winter"
    """
    from rigidimeter.core.study_files import write_new_study

    write_new_study(folder, title)
    echo(f"{folder}: write your sessions into {folder / 'sessions.csv'}")


@study.command(cls=HelpCommand)
def add(
    folder: Path = argument("STUDY", "Study folder; made if it is none."),
    sessions: list[Path] | None = argument(
        "[SESSION]...",
        "Session folders in it. Default: all in it and in its folder sessions that sessions.csv "
        "does not name.",
        None,
    ),
    subject: str = OPTIONS.option("--subject CODE", "Subject of sessions that do not say it.", ""),
) -> None:
    """Add recorded sessions to a study folder.

    Subject, day, conditions, stimulation and ratings are added; `console` does so after each
    session. What was written or changed by hand stays as it is: a study.toml that was edited must
    have the conditions of a session, and a session whose row is made a comment (#) is not added
    again.

    \b
    For example:
      rigidimeter simulate --out study/monday
      rigidimeter study add study study/monday --subject S01
    """
    from rigidimeter.core.study_files import extend_study

    refused: list[str] = []
    said = extend_study(folder, sessions or None, subject=subject, refused=refused)
    for line in said or ([] if refused else [f"{folder}: nothing is new"]):
        echo(line)
    if refused:
        raise UserError(*refused)


@study.command(cls=HelpCommand)
def exclude(
    folder: Path = STUDY,
    path: str = SESSION,
    epoch: str = EPOCH,
    reason: str = REASON,
    by: str = BY,
) -> None:
    """Leave an epoch out of a study, with a reason and a name.

    A row is added to exclusions.csv; the samples stay as they are. The report shows the epoch, the
    reason and the name.

    \b
    For example:
      rigidimeter study exclude demo-study day-1-OFF 2 --reason cough --by Kim
      rigidimeter compare demo-study
    """
    from rigidimeter.core.study_files import exclude_epoch, row_path

    exclude_epoch(folder, row_path(folder, path, epoch), epoch, reason, by)
    echo(f"epoch {epoch} of {path} is left out; study include includes it again")


@study.command(cls=HelpCommand)
def include(
    folder: Path = STUDY,
    path: str = SESSION,
    epoch: str = EPOCH,
    reason: str = REASON,
    by: str = BY,
) -> None:
    """Include an epoch again that was left out, with a reason and a name.

    Its row in exclusions.csv becomes a comment with the date, the reason and the name.

    \b
    For example:
      rigidimeter study include demo-study day-1-OFF 2 --reason none --by Kim
    """
    from rigidimeter.core.study_files import include_epoch, row_path

    include_epoch(folder, row_path(folder, path, epoch), epoch, reason, by)
    echo(f"epoch {epoch} of {path} is included again")


@study.command(cls=HelpCommand)
def simulate(
    out: Path = NEW_STUDY,
    seed: int = STUDY_SEED,
    design: str = OPTIONS.option(
        "--design paper|pushing|null",
        "What differs between conditions. Paper: as in the paper; pushing: equal joints, and a "
        "subject who pushes; null: nothing.",
        "paper",
    ),
    processes: int = OPTIONS.option(
        "--processes N", "Sessions to simulate in parallel.", 2, min=1, max=64
    ),
) -> None:
    """Make a virtual study: nine days, with ratings.

    Every epoch runs through the same loop, guard and recorder as on hardware. The counts are those
    of the paper's Table 1. Equal seeds give equal files, whatever the number of processes.

    \b
    For example:
      rigidimeter study simulate --out virtual
      rigidimeter compare virtual
      rigidimeter study simulate --out pushing --design pushing --seed 7
    """
    from rigidimeter.virtual import DESIGNS

    if design not in DESIGNS:
        raise UserError(f"--design {design}: there is no such design; known: {', '.join(DESIGNS)}")
    chosen = DESIGNS[design]
    plans = _simulated(out, chosen, seed, processes)
    echo(f"{chosen.title}, seed {seed}: {len(plans)} sessions on the virtual rig")
    for condition in chosen.conditions:
        ratings = sum(len(plan.ratings) for plan in plans if plan.condition == condition.name)
        echo(
            f"  {condition.name}: {condition.prbs_epochs} PRBS and {condition.sinusoid_epochs} "
            f"sinusoidal epochs, {ratings} ratings"
        )
    echo(f"{out}: read it with: rigidimeter compare {out}")


def demo(
    out: Path = WRITE.option("--out DIR", "New folder for the study.", Path("demo-study")),
    days: int = OPTIONS.option("--days N", "Days, each with OFF and DBS.", 8, min=2, max=100),
    prbs_epochs: int = OPTIONS.option(
        "--prbs-epochs N", "PRBS epochs for each condition and day.", 5, min=1, max=500
    ),
    sinusoid_epochs: int = OPTIONS.option(
        "--sinusoid-epochs N", "Sinusoidal epochs for each condition and day.", 3, min=1, max=500
    ),
    seed: int = STUDY_SEED,
) -> None:
    """Make a virtual study, compare its conditions, write its report.

    Each day has PRBS and sinusoidal epochs of 10 s in OFF and DBS on the virtual rig, 80 and 48 in
    all, and ratings. The same as study simulate, compare and report, for a smaller study. What was
    simulated is shown beside what was found. The PRBS epochs of the first session are also in
    elbow.csv, to read as a recording of another laboratory. An earlier demo in the same folder is
    moved aside, not overwritten.

    \b
    For example:
      rigidimeter demo
      rigidimeter demo --out small --days 3 --prbs-epochs 3
    """
    from rigidimeter.cli.comparison_text import comparison_blocks
    from rigidimeter.cli.study_inputs import analyse_study_folder
    from rigidimeter.virtual import SHORT_EPOCH_S, short_design

    start_s = time.monotonic()
    _move_aside(out)
    echo(
        f"A virtual subject on {days} days, OFF and DBS: {2 * days * prbs_epochs} PRBS and "
        f"{2 * days * sinusoid_epochs} sinusoidal epochs of {SHORT_EPOCH_S:g} s"
    )
    _simulated(out, short_design(days, prbs_epochs, sinusoid_epochs), seed)
    _write_plain_table(out / "sessions" / "day-1-OFF", out / "elbow.csv")
    shown, analysed = analyse_study_folder(out, plain_recordings(out))
    try:
        page = write_page(shown, out / "report", [out])
        show(["", *comparison_blocks(shown), ""])
        echo(f"Done in {time.monotonic() - start_s:.0f} s. Open {page.resolve()}")
        echo(
            f"Next: rigidimeter compare {out} --full; rigidimeter inspect {out / 'elbow.csv'}; "
            f"rigidimeter estimate {out / 'sessions' / 'day-1-OFF'}"
        )
    finally:
        status = analysed.say()
    raise typer.Exit(status)


def _simulated(out: Path, design: StudyDesign, seed: int, processes: int = 2) -> list[DayPlan]:
    """Write a virtual study with progress; return its sessions."""
    from rigidimeter.virtual import plan_study, study_length_s, write_virtual_study

    lost: list[str] = []
    with Meter("simulate", study_length_s(plan_study(design, seed))) as meter:
        plans = write_virtual_study(
            out, design, seed, processes=processes, progress=meter.reach, on_lost=lost.extend
        )
    for name in lost:
        echo(f"warning: ended before the work did: {name}; others have run its sessions", err=True)
    return plans


def _write_plain_table(session: Path, path: Path) -> None:
    """Write the PRBS epochs of a session as a table that says nothing of where it came from."""
    import numpy as np

    from rigidimeter.analysis.reading import read

    rows = []
    for epoch in read(session).epochs:
        if epoch.task != "prbs":
            continue
        command = epoch.channels["perturbation_nm"]
        time_s = command.time_s[:-1]  # the last of the sensors' samples is before its last
        torque_nm, angle_rad = (
            np.interp(time_s, epoch.channels[name].time_s, epoch.channels[name].values)
            for name in ("torque_nm", "angle_rad")
        )
        trial = np.full(time_s.size, float(epoch.label))
        columns = time_s, torque_nm, np.degrees(angle_rad), command.values[:-1], trial
        rows.append(np.column_stack(columns))
    head = "time [s],torque [Nm],angle [deg],PRBS command [Nm],trial"
    forms = ("%.4f", "%.4f", "%.5f", "%.4g", "%d")
    np.savetxt(path, np.vstack(rows), forms, ",", header=head, comments="")


def _move_aside(out: Path) -> None:
    """Give an earlier study another name, so that nothing is written over."""
    if not out.exists() or (out.is_dir() and not any(out.iterdir())):
        return
    if not (out / "sessions").is_dir():
        raise UserError(f"--out {out}: is there already and is no earlier demo; name a new folder")
    number = 1
    while (aside := out.with_name(f"{out.name}-{number}")).exists():
        number += 1
    with refused(out, "cannot be moved aside"):
        out.rename(aside)
    echo(f"{out} was there already and is now {aside}")
