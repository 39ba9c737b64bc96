"""When the recorder did not end well: write what is still in the rings into its folder.

A ring keeps what the recorder had not written, and some of what it had. Which of the two a row is
the file itself says, by the last tick in a whole batch, so nothing is written twice and nothing
left out, wherever the recorder was killed. The samples are added to a copy of the file, which then
takes its place; a fault half-way leaves the old one as it was.

Whoever is left does it, once the recorder has ended or was ended (`complete`).
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import append_line, lock
from rigidimeter.core.session import (
    BATCH_S,
    EVENTS,
    SAMPLES,
    SampleLog,
    append_event,
    checked_line,
    close_files,
    read_events,
    read_manifest,
    scan_samples,
)
from rigidimeter.rig.acquisition.processes.recorder import Patience, RecordingPlan
from rigidimeter.rig.acquisition.processes.ring import ROW, EventRing, SampleRing
from rigidimeter.rig.acquisition.processes.session_memory import SessionMemory
from rigidimeter.rig.acquisition.processes.status_values import ProcessCondition, Role
from rigidimeter.rig.acquisition.processes.watchdog import WatchedProcess


@dataclass(frozen=True)
class Recovered:
    """What was brought from the rings into the folder; `missing_samples` found no room before."""

    samples: int
    events: int
    missing_samples: int


def recover_from_rings(
    folder: Path, shared: SessionMemory, reason: str, tick_rate_hz: float
) -> Recovered:
    """Complete a session folder from the rings, and close it.

    Call it when neither loop nor recorder writes any more. Doing it twice changes nothing.

    Parameters
    ----------
    folder : Path
    shared : SessionMemory
    reason : str
        Why it was necessary; an epoch or session that the loop did not close ends with it.
    tick_rate_hz : float
        Sets how many samples make a batch.

    Raises
    ------
    UserError
        If the folder holds no session, or somebody writes to it.
    OSError
        If the disk does not take it.
    """
    samples, events = shared.samples, shared.events
    session_id = str(read_manifest(folder).get("session_id", ""))
    path = folder / EVENTS
    with path.open("ab", buffering=0) as file:
        if not lock(file):
            raise UserError(f"{folder}: is still being recorded, so nothing was written to it")
        known, torn = read_events(path)
        if torn:  # it is still in the ring
            content = path.read_bytes()
            file.truncate(content.rfind(b"\n") + 1)
        was_closed = any(event.get("event") == "session_ended" for event in known)
        # Whoever closed it had brought all in first; what came after its end does not belong to it.
        added = 0 if was_closed else _samples(folder / SAMPLES, samples, tick_rate_hz, session_id)
        lines = [] if was_closed else _lines(path, events, session_id)
        if not was_closed:
            append_event(
                file,
                {
                    "event": "record_salvaged",
                    "samples": added,
                    "events": len(lines),
                    "missing_samples": samples.refused,
                    "reason": reason,
                },
                session_id,
            )
        for line in lines:
            append_line(file, line)
            events.recorded += 1
        os.fsync(file.fileno())
    close_files(folder, reason, force=True)
    return Recovered(added, len(lines), samples.refused)


def complete(
    shared: SessionMemory,
    recording: RecordingPlan,
    recorder: WatchedProcess,
    patience: Patience,
    follow: Callable[[], object],
) -> list[str]:
    """See the recorder to its end, and do its work if that is not a good one; return remarks.

    Parameters
    ----------
    shared : SessionMemory
    recording : RecordingPlan
    recorder : WatchedProcess
    patience : Patience
    follow : callable
        Called some twenty times a second meanwhile: the heart of whoever waits beats there.
    """
    remarks: list[str] = []
    status = shared.status
    since_s = time.monotonic()
    hung = False
    # One that has done its work no longer beats, and may take a while to leave.
    while (
        recorder.alive()
        and not hung
        and status.condition(Role.RECORDER) is not ProcessCondition.DONE
    ):
        follow()
        # A heart that beat before the wait began may have been silent for a good reason.
        silent_s = min(status.age_s(Role.RECORDER), time.monotonic() - since_s)
        hung = silent_s > patience.hung_s
        time.sleep(0.02)
    if hung:
        remarks.append(f"the recorder did not answer for {patience.hung_s:g} s and was ended")
        recorder.kill()
        until_s = time.monotonic() + 2.0
        while recorder.alive() and time.monotonic() < until_s:
            time.sleep(0.01)
    if status.condition(Role.RECORDER) is ProcessCondition.DONE:
        late = shared.samples.lag()
        if late:
            remarks.append(f"{late} samples came after the session was closed")
        return remarks
    note = status.note(Role.RECORDER)
    reason = note or ("the recorder hung" if hung else "the recorder was killed")
    folder = status.folder() or recording.folder
    try:
        recover_from_rings(folder, shared, reason, recording.settings.rig.tick_rate_hz)
    except (UserError, OSError) as error:
        remarks.append(f"{folder}: the session could not be completed ({error})")
        if shared.needed():
            remarks.append(
                f"{shared.samples.lag()} samples stay in memory ({shared.where()}) until the "
                f"computer is switched off: make room, then `rigidimeter recover {folder}`"
            )
    return remarks


def _samples(path: Path, ring: SampleRing, tick_rate_hz: float, session_id: str) -> int:
    """Add the rows that the file has not; return how many."""
    content = path.read_bytes() if path.is_file() else b""
    before = scan_samples(content, path)
    rows = ring.held_rows()
    if before.columns["tick"].size:
        rows = rows[rows["tick"] > before.columns["tick"][-1]]
    if rows.size:
        part = path.with_name(f"{path.name}.part")
        part.unlink(missing_ok=True)
        try:
            log = SampleLog(
                part,
                tick_rate_hz,
                session_id,
                before=content[: before.stream.stop],
                first_batch=before.next_batch,
            )
            _append(log, rows, tick_rate_hz)
            part.replace(path)
        except OSError:
            part.unlink(missing_ok=True)  # on a disk that is full it would take what room there is
            raise
    ring.recorded = ring.written
    return int(rows.size)


def _append(log: SampleLog, rows: NDArray[np.void], tick_rate_hz: float) -> None:
    """Write rows, and put them on the disk."""
    try:
        # Batches stay short: a reader may look at one at a time.
        batch = max(1, int(BATCH_S * tick_rate_hz))
        for first in range(0, rows.size, batch):
            some = rows[first : first + batch]
            log.append_columns({name: some[name] for name in ROW.names or ()})
        os.fsync(log.fileno())
    except OSError:
        os.ftruncate(log.fileno(), 0)  # so that it can be closed
        log.close()
        raise
    log.close()


def _lines(path: Path, ring: EventRing, session_id: str) -> list[bytes]:
    """Return the lines that the file has not.

    The cursor moves after each line, so only the first can be in the file already.
    """
    waiting = [
        checked_line(ring.get(number).line, session_id)
        for number in range(ring.recorded, ring.written)
    ]
    if waiting and waiting[0] in path.read_bytes().splitlines(keepends=True)[-4:]:
        ring.recorded += 1
        return waiting[1:]
    return waiting
