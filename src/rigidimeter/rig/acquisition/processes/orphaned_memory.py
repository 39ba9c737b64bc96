"""What killed sessions left in shared memory: brought into their folders, and removed.

Whoever is last of a session's processes removes its memory. Where all were killed at once, or the
disk was full to the end, it stays, with what is in no file yet, until the computer is switched off.
The next `rigidimeter run` or `rigidimeter recover` finds it here.
"""

from __future__ import annotations

import math
import time
from contextlib import suppress
from pathlib import Path

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import read_manifest
from rigidimeter.rig.acquisition.processes.ring_recovery import recover_from_rings
from rigidimeter.rig.acquisition.processes.session_memory import PARTS, SessionMemory
from rigidimeter.rig.acquisition.processes.shared_memory import PREFIX, WHERE

MAKING_S = 10.0
"""A set that is not complete after that time was being made by a process that was killed."""

LEAVING_S = 1.0
"""For so long a process of a session that has ended may take to leave."""

KILLED = "all processes of the session were killed"


def complete_left(only: Path | None = None, reason: str = KILLED) -> list[str]:
    """Bring what killed sessions left in memory into their folders; return what to tell.

    Parameters
    ----------
    only : Path or None
        Leave what belongs to other folders where it is.
    reason : str
        With which their sessions end.

    Raises
    ------
    UserError
        If a process still records into the folder `only`, or what is in memory cannot be written
        there: closed without it, the record would have lost it.
    """
    messages: list[str] = []
    wanted = only.resolve() if only is not None else None
    for stem in sorted({path.name.rpartition("-")[0] for path in WHERE.glob(f"{PREFIX}*-*")}):
        names = (stem + PARTS[0], stem + PARTS[1], stem + PARTS[2])
        if not all((WHERE / name).exists() for name in names):
            _remove_unfinished(names)
            continue
        try:
            shared = SessionMemory.attach(names)
        except (ValueError, OSError):  # of another version, or of another user
            continue
        try:
            folder = shared.status.folder()
            mine = folder is not None and folder.resolve() == wanted
            if not _left(shared, LEAVING_S if mine else 0.0):
                if mine:
                    raise UserError(
                        f"{only}: is still being recorded; recover it once that has ended"
                    )
            elif folder is None or not shared.needed():  # a session has its folder before it begins
                shared.unlink()
            elif mine or wanted is None:
                line, done = _complete(shared, folder, reason)
                if mine and not done:
                    raise UserError(line)
                messages.append(line)
        finally:
            shared.close()
    return messages


def _left(shared: SessionMemory, wait_s: float) -> bool:
    """Whether no living process has the memory; one that is about to leave is waited for."""
    until_s = time.monotonic() + wait_s
    while not shared.status.memory.alone():
        if time.monotonic() >= until_s:
            return False
        time.sleep(0.02)
    return True


def _complete(shared: SessionMemory, folder: Path, reason: str) -> tuple[str, bool]:
    """Bring one session's memory into its folder and remove it; say so, and whether it was."""
    waiting = shared.samples.lag()
    try:
        rate_hz = float(read_manifest(folder)["settings"]["rig"]["tick_rate_hz"])
        found = recover_from_rings(folder, shared, reason, rate_hz)
    except (UserError, OSError, KeyError, TypeError, ValueError) as error:
        return (
            f"{folder}: {waiting} samples of this session wait in memory, but could not be "
            f"written ({error}); mend that and use `rigidimeter recover {folder}`, or remove "
            f"{shared.where()} and its two neighbours"
        ), False
    shared.unlink()
    return f"{folder}: {found.samples} samples that were only in memory were brought in", True


def _remove_unfinished(names: tuple[str, str, str]) -> None:
    """Remove the parts of a set that was never complete, unless it is being made now."""
    paths = [WHERE / name for name in names]
    with suppress(OSError):
        # Whoever made them may have removed them by now.
        made_s = max((path.stat().st_ctime for path in paths if path.exists()), default=math.inf)
        if time.time() - made_s > MAKING_S:
            for path in paths:
                path.unlink(missing_ok=True)
