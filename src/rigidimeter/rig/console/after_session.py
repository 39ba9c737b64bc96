"""What to do after a session, as commands that can be typed as they stand."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rigidimeter.core.session import codes_of


def resume_command(folder: Path, rig: Path | str | None, about: Mapping[str, Any]) -> str:
    """Return the command that continues a session in a new folder.

    That of a session of a plan is in the plan: the command need not name it.
    """
    words = ["rigidimeter", "run", "--resume", str(folder)]
    words += ["--rig", str(rig)] if rig is not None else []
    words += [] if about.get("plan") else ["--out", str(_new_folder(folder))]
    return shlex.join(words)


def next_steps(
    folder: Path,
    *,
    closed: bool,
    good: int,
    left: int,
    rig: Path | None,
    about: Mapping[str, Any],
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
    about : mapping
        Of its manifest: conditions that have codes there stay hidden behind them.
    """
    steps = []
    if not closed:
        steps.append((shlex.join(["rigidimeter", "recover", str(folder)]), "close the session"))
    if left:
        what = "the epoch that is left" if left == 1 else f"the {left} epochs that are left"
        steps.append((resume_command(folder, rig, about), f"run {what}"))
    if good:
        hide = ["--blinded"] if codes_of(about) else []
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


def _new_folder(folder: Path) -> Path:
    """Return a folder beside this one that does not exist: ``session-2`` after ``session``."""
    stem, _, number = folder.name.rpartition("-")
    if not (stem and number.isdigit()):
        stem, number = folder.name, "1"
    count = int(number) + 1
    while (made := folder.with_name(f"{stem}-{count}")).exists():
        count += 1
    return made
