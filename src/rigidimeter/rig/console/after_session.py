"""What to do after a session, as commands that can be typed as they stand."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

_PLANNED = re.compile(r"-day-[^-]+-\d+$")
"""The folder of the first part of a session of a plan."""


def resume_command(folder: Path, rig: Path | str | None, out: Path | str) -> str:
    """Return the command that continues a session in a new folder."""
    rig_words = ["--rig", str(rig)] if rig is not None else []
    return shlex.join(
        ["rigidimeter", "run", "--resume", str(folder), *rig_words, "--out", str(out)]
    )


def next_steps(
    folder: Path,
    *,
    closed: bool,
    good: int,
    left: int,
    rig: Path | None,
    out: Path,
    blinded: bool = False,
) -> tuple[str, ...]:
    """Return what to do next, a command with its purpose on each line, the most pressing first.

    Parameters
    ----------
    folder : Path
        Of the session.
    closed : bool
        Whether it was closed with an outcome.
    good, left : int
        Epochs that ended with success, and those that are left to run.
    rig : Path or None
        The rig file; None for the virtual rig.
    out : Path
        A folder that does not exist yet, for what is left.
    blinded : bool
        Whether conditions stay hidden behind codes.
    """
    steps = []
    if not closed:
        steps.append((shlex.join(["rigidimeter", "recover", str(folder)]), "close the session"))
    if left:
        what = "the epoch that is left" if left == 1 else f"the {left} epochs that are left"
        steps.append((resume_command(folder, rig, out), f"run {what}"))
    if good:
        hide = ["--blinded"] if blinded else []
        report = folder.with_name(f"{folder.name}-report")
        steps += [
            (
                shlex.join(["rigidimeter", "estimate", str(folder), *hide]),
                "J, B and K of each epoch",
            ),
            (
                shlex.join(["rigidimeter", "report", str(folder), *hide, "--out", str(report)]),
                "a page with tables and figures",
            ),
        ]
    return tuple(f"{command}  # {purpose}" for command, purpose in steps)


def new_folder(folder: Path) -> Path:
    """Return a folder beside this one that does not exist: ``session-2`` after ``session``.

    The number at the end of a planned session's folder is its place in the day, not its part.
    """
    stem, _, number = folder.name.rpartition("-")
    if not (stem and number.isdigit()) or _PLANNED.search(folder.name):
        stem, number = folder.name, "1"
    count = int(number) + 1
    while (made := folder.with_name(f"{stem}-{count}")).exists():
        count += 1
    return made
