"""Close a session that was killed, with the reason, losing nothing."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from rigidimeter.errors import UserError
from rigidimeter.recording.event_log import append_event, read_events
from rigidimeter.recording.sample_log import END_OF_STREAM, read_samples, stream_extent
from rigidimeter.recording.session_folder import EVENTS, SAMPLES, lock, read_manifest


@dataclass(frozen=True)
class Recovery:
    """What was found: how much came back, and what was closed.

    `already_closed` is true for a session that needed nothing.
    """

    already_closed: bool
    n_samples: int
    last_time_s: float
    epochs_closed: tuple[str, ...]
    torn_bytes: int


def recover(folder: Path, reason: str = "the recording process ended without closing") -> Recovery:
    """Close an interrupted session folder.

    The stream is cut after its last complete batch and ended; the bytes cut off, if any, are kept
    beside it in `samples.torn`. Open epochs end with `fail` and the reason, and so does the
    session. Running it again changes nothing.

    Raises
    ------
    UserError
        If the folder is no session folder, holds no sample stream, or is still being recorded.
    """
    read_manifest(folder)
    samples_path, events_path = folder / SAMPLES, folder / EVENTS
    if not samples_path.is_file():
        raise UserError(f"{folder}: the session has no {SAMPLES}, so there is nothing to recover")
    if not events_path.is_file():
        events_path.touch()
    with events_path.open("r+b") as events_file:
        if not lock(events_file):
            raise UserError(f"{folder}: is still being recorded; recover it once that has ended")
        return _close(samples_path, events_path, reason)


def _close(samples_path: Path, events_path: Path, reason: str) -> Recovery:
    events, torn_event = read_events(events_path)
    length, stream_closed = stream_extent(samples_path)
    samples = read_samples(samples_path)
    n = len(samples["time_s"])
    last_time_s = float(samples["time_s"][-1]) if n else 0.0
    started = {e["epoch"]: e["label"] for e in events if e.get("event") == "epoch_started"}
    ended = {e["epoch"] for e in events if e.get("event") == "epoch_ended"}
    open_epochs = [(number, label) for number, label in started.items() if number not in ended]
    # A file without even a schema, cut to nothing by an earlier recovery, needs no end.
    stream_closed = stream_closed or samples_path.stat().st_size == 0
    if any(e.get("event") == "session_ended" for e in events) and stream_closed and not torn_event:
        return Recovery(True, n, last_time_s, (), 0)
    torn = 0 if stream_closed else _end_stream(samples_path, length)
    if torn_event:
        _drop_torn_line(events_path)
    with events_path.open("ab", buffering=0) as file:
        ending = {"time_s": last_time_s, "outcome": "fail", "reason": reason}
        for number, _ in open_epochs:
            append_event(file, {"event": "epoch_ended", "epoch": number, **ending})
        if not any(e.get("event") == "session_ended" for e in events):
            append_event(file, {"event": "session_ended", **ending})
    return Recovery(False, n, last_time_s, tuple(label for _, label in open_epochs), torn)


def _end_stream(path: Path, length: int) -> int:
    """Cut the stream at `length`, keep what is cut off, and write the end; return its size."""
    content = path.read_bytes()
    torn = content[length:]
    if torn:
        path.with_name("samples.torn").write_bytes(torn)
    with path.open("r+b") as file:
        file.truncate(length)
        file.seek(length)
        if length:  # without a schema there is no stream to end
            file.write(END_OF_STREAM)
        file.flush()
        os.fsync(file.fileno())
    return len(torn)


def _drop_torn_line(path: Path) -> None:
    content = path.read_bytes()
    cut = content.rfind(b"\n") + 1
    path.with_name("events.torn").write_bytes(content[cut:])
    with path.open("r+b") as file:
        file.truncate(cut)
