"""Close a session that was killed, with the reason, losing nothing.

Only what cannot be read as a sample or an event is moved, from the end of its file to a new one
beside it. A session that is closed, or that a process still holds, is left alone, and so are links.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from rigidimeter.core.errors import UserError
from rigidimeter.core.session.arrow_stream import END_OF_STREAM
from rigidimeter.core.session.emg_log import EMG, read_emg
from rigidimeter.core.session.event_log import append_event
from rigidimeter.core.session.folder import (
    EVENTS,
    MANIFEST,
    SAMPLES,
    SessionFiles,
    locked,
    read_manifest,
    read_session_files,
)


@dataclass(frozen=True)
class Recovery:
    """What was found: how much came back, and what was closed.

    Attributes
    ----------
    already_closed : bool
        True for a session that needed nothing.
    n_samples : int
    last_time_s : float
    epochs_closed : tuple of str
        Their labels.
    torn_bytes : int
        Moved from the end of the samples.
    torn_files : tuple of str
        Names of the files beside the old ones that hold what was moved.
    damaged : tuple of str
        What is damaged within the files, which stays where it is.
    """

    already_closed: bool
    n_samples: int
    last_time_s: float
    epochs_closed: tuple[str, ...]
    torn_bytes: int
    torn_files: tuple[str, ...]
    damaged: tuple[str, ...]


def recover(
    folder: Path,
    reason: str = "the recording process ended without closing",
    *,
    force: bool = False,
) -> Recovery:
    """Close an interrupted session folder.

    The stream is ended after its last whole batch; bytes after it, if any, are moved to a new file
    `samples.torn`, and an incomplete last line of the events to `events.torn`. Open epochs end with
    `fail` and the reason, and so does the session. Running it again changes nothing.

    Parameters
    ----------
    folder : Path
    reason : str
    force : bool
        Also where the session was closed, or may have been.

    Raises
    ------
    UserError
        If the folder is no session folder, holds no samples, is a link or holds one, is still held
        by a process of the session, or was closed and is damaged at its end.
    """
    _refuse_links(folder)
    read_manifest(folder)
    if not (folder / SAMPLES).exists():
        raise UserError(f"{folder}: the session has no {SAMPLES}, so there is nothing to recover")
    (folder / EVENTS).touch()
    with locked(folder / EVENTS, "recover it once that has ended"):
        return close_files(folder, reason, force=force)


def close_files(folder: Path, reason: str, *, force: bool) -> Recovery:
    """Close a session folder as `recover` does, without asking who else holds it."""
    events_path = folder / EVENTS
    files = read_session_files(folder)
    samples, log = files.samples, files.log
    n = len(samples.columns["time_s"])
    last_time_s = float(samples.columns["time_s"][-1]) if n else 0.0
    # A file without even a schema, cut to nothing by an earlier recovery, needs no end.
    stream_ended = samples.stream.closed or (folder / SAMPLES).stat().st_size == 0
    damaged = tuple(f"{SAMPLES}: {lost}" for lost in samples.lost)
    emg = None
    try:
        emg = read_emg(folder)
    except UserError as error:  # torque and motion are closed all the same
        damaged += (str(error),)
    if emg and emg.damaged:
        damaged += (f"{EMG}: {emg.damaged} stretches",)
    damaged += tuple(f"{EVENTS}: line {number}" for number in log.damaged)
    if files.ended and stream_ended and not log.torn:
        return Recovery(True, n, last_time_s, (), 0, (), damaged)
    if not force:
        _refuse_closed(folder, files, stream_ended)
    torn_bytes = 0
    moved: list[str] = []
    if not stream_ended:
        stop = samples.stream.stop
        end = END_OF_STREAM if stop else b""  # without a schema there is no stream to end
        torn_bytes, name = _cut(folder / SAMPLES, stop, end)
        moved += name
    if emg and not emg.closed:
        bytes_moved, name = _cut(folder / EMG, emg.stop, END_OF_STREAM)
        torn_bytes += bytes_moved
        moved += name
    if log.torn:
        moved += _cut(events_path, events_path.read_bytes().rfind(b"\n") + 1, b"")[1]
    session_id = str(files.manifest.get("session_id", ""))
    started = {e["epoch"]: e["label"] for e in log.events if e.get("event") == "epoch_started"}
    ended = {e["epoch"] for e in log.events if e.get("event") == "epoch_ended"}
    open_epochs = {number: label for number, label in started.items() if number not in ended}
    with events_path.open("ab", buffering=0) as file:
        ending = {"time_s": last_time_s, "outcome": "fail", "reason": reason}
        if moved:
            said = {"event": "bytes_moved", "time_s": last_time_s, "files": moved, "reason": reason}
            append_event(file, said, session_id)
        for number in open_epochs:
            append_event(file, {"event": "epoch_ended", "epoch": number, **ending}, session_id)
        if not files.ended:
            append_event(file, {"event": "session_ended", **ending}, session_id)
        os.fsync(file.fileno())
    return Recovery(
        False, n, last_time_s, tuple(open_epochs.values()), torn_bytes, tuple(moved), damaged
    )


def _refuse_links(folder: Path) -> None:
    """Refuse what leads elsewhere: what is written here must stay here."""
    if folder.is_symlink():
        raise UserError(
            f"{folder}: is a link to {os.path.realpath(folder)}; recover that folder itself"
        )
    for name in (MANIFEST, SAMPLES, EVENTS, EMG):
        path = folder / name
        if path.is_symlink():
            raise UserError(
                f"{path}: is a link, and recovery changes no file outside of {folder}; put the "
                "file itself there"
            )
        if path.exists() and not stat.S_ISREG(path.lstat().st_mode):
            raise UserError(f"{path}: is not a regular file, so it is not part of a session")


def _refuse_closed(folder: Path, files: SessionFiles, stream_ended: bool) -> None:
    """Refuse a session that is closed, or was before it was damaged."""
    log, stream = files.log, files.samples.stream
    if files.ended:
        what = f"{SAMPLES} is damaged or cut after byte {stream.stop}"
        if stream_ended:
            what = f"{EVENTS} does not end with a complete line"
        raise UserError(
            f"{folder}: the session is closed ({files.ended['outcome']}), but {what}; nothing was "
            "changed, and what is complete can be read. `recover --force` moves what follows "
            "to a file beside it"
        )
    if log.damaged:
        raise UserError(
            f"{folder}: line {log.damaged[-1]} of {EVENTS} is damaged and may say how the session "
            "ended; nothing was changed. `recover --force` closes it as failed"
        )


def _cut(path: Path, length: int, end: bytes) -> tuple[int, Sequence[str]]:
    """Cut a file, keep what is cut off in a new one, and write an end; return its size and name."""
    content = path.read_bytes()
    torn = content[length:]
    kept: list[str] = []
    if torn:
        with _new_file(path.with_suffix(".torn")) as beside:
            beside.write(torn)
            beside.flush()
            os.fsync(beside.fileno())
            kept.append(Path(beside.name).name)
    descriptor = os.open(path, os.O_RDWR | os.O_NOFOLLOW)
    with os.fdopen(descriptor, "r+b") as file:
        file.truncate(length)
        file.seek(length)
        file.write(end)
        file.flush()
        os.fsync(file.fileno())
    return len(torn), kept


def _new_file(path: Path) -> BinaryIO:
    """Open a new file, numbered if there is one of that name: `samples.torn`, `samples-2.torn`."""
    number = 1
    while True:
        name = path.name if number == 1 else f"{path.stem}-{number}{path.suffix}"
        try:
            return path.with_name(name).open("xb")
        except FileExistsError:
            number += 1
