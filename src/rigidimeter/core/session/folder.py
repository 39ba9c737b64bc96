"""The session folder: `manifest.json`, `samples.arrows`, `events.jsonl`.

The manifest is written before the first sample and never changes: settings, versions, seeds,
protocol, and the unit of every channel. Each file names the session that it belongs to, and has
checksums. What happened is in the events: each epoch starts, and ends
with success, abort or fail and a reason; so does the session. A folder without a
`session_ended` event was interrupted; `recover` closes it.
"""

from __future__ import annotations

import platform
import uuid
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np
import pyarrow as pa
import scipy
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import (
    DOCUMENT_BYTES,
    RECORDING_BYTES,
    ZEROS,
    checksum_holds,
    digest_hex,
    json_text,
    lock,
    parse_json,
    read_bytes,
    replace_file,
    text_bytes,
    with_checksum,
)
from rigidimeter.core.session.event_log import EventLog, append_event, checked_line, scan_events
from rigidimeter.core.session.sample_log import SAMPLE_UNITS, Sample, SampleLog, append_line
from rigidimeter.core.session.sample_reading import StoredSamples, scan_samples
from rigidimeter.core.settings import Settings, dump_settings
from rigidimeter.core.version import __version__

MANIFEST, SAMPLES, EVENTS = "manifest.json", "samples.arrows", "events.jsonl"
SESSION_SCHEMA = "rigidimeter.session/2"
SCHEMAS = ("rigidimeter.session/1", SESSION_SCHEMA)
"""Those that are read; version 1 has neither checksums nor the id of a session."""

MANIFEST_TYPES: Mapping[str, type] = {
    "created_utc": str,
    "virtual": bool,
    "versions": dict,
    "seeds": dict,
    "settings": dict,
    "protocol": list,
    "channel_units": dict,
}
"""What a manifest must hold to be read."""

Ending = Literal["success", "abort", "fail"]


class SessionWriter:
    """Create a session folder and write to it while the session runs.

    Parameters
    ----------
    folder : Path
        Must not hold a session already.
    settings : Settings
    protocol : sequence of mappings
        The planned epochs, stored as planned.
    seeds : mapping of str to int
    virtual : bool
        Whether the rig is simulated.
    continues : mapping
        The session that this one continues, if any.
    about : mapping
        What the operator said of subject, condition and stimulation, if anything.
    created_utc : str
        When the session took place, ISO 8601; now if empty.
    repeatable : bool
        Whether all that happens follows from settings, protocol and seeds, as on a simulated clock.
        Then so does the id, and the same session is the same samples, byte for byte.

    Raises
    ------
    UserError
        If the folder cannot be made or holds files already.
    """

    def __init__(
        self,
        folder: Path,
        settings: Settings,
        protocol: Sequence[Mapping[str, Any]],
        seeds: Mapping[str, int],
        *,
        virtual: bool,
        continues: Mapping[str, Any] | None = None,
        about: Mapping[str, Any] | None = None,
        created_utc: str = "",
        repeatable: bool = False,
    ) -> None:
        self.folder = folder
        planned = {
            "seeds": dict(seeds),
            "settings": dump_settings(settings),
            "protocol": [dict(epoch) for epoch in protocol],
        }
        self.session_id = (
            digest_hex(json_text(planned).encode()) if repeatable else uuid.uuid4().hex
        )[:16]
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if any(folder.iterdir()):
                raise UserError(
                    f"{folder}: is not empty; a recording is never written over another, so name "
                    "a new folder"
                )
            manifest = {
                "schema": SESSION_SCHEMA,
                "session_id": self.session_id,
                "created_utc": created_utc or datetime.now(UTC).isoformat(timespec="seconds"),
                "virtual": virtual,
                "versions": {
                    "rigidimeter": __version__,
                    "python": platform.python_version(),
                    "numpy": np.__version__,
                    "scipy": scipy.__version__,
                    "pyarrow": pa.__version__,
                },
                **planned,
                "channel_units": dict(SAMPLE_UNITS),
            }
            if continues:
                manifest["continues"] = dict(continues)
            if about:
                manifest["about"] = dict(about)
            text = text_bytes(json_text({"checksum": ZEROS, **manifest}))
            replace_file(folder / MANIFEST, with_checksum(text))
            self._log = SampleLog(folder / SAMPLES, settings.rig.tick_rate_hz, self.session_id)
            # Unbuffered: a line that the disk refused must not turn up later.
            self._events: BinaryIO = (folder / EVENTS).open("xb", buffering=0)
            lock(self._events)
        except OSError as error:
            reason = error.strerror or error
            raise UserError(f"{folder}: a session cannot be written there ({reason})") from None

    def sample(self, sample: Sample) -> None:
        """Record one tick."""
        self._log.append(sample)

    def columns(self, columns: Mapping[str, NDArray[Any]]) -> None:
        """Record many ticks at once, as columns; all or none are in the file then."""
        self._log.append_columns(columns)

    def line(self, line: bytes) -> None:
        """Record an event that is a line of JSON already."""
        append_line(self._events, checked_line(line, self.session_id))

    def event(self, kind: str, **facts: Any) -> None:
        """Record something that happened; an epoch's samples are in the file before its end is."""
        if kind == "epoch_ended":
            self._log.flush()
        append_event(self._events, {"event": kind, **facts}, self.session_id)

    def descriptors(self) -> tuple[int, int]:
        """Return the file descriptors of samples and events, to be put on the disk."""
        return self._log.fileno(), self._events.fileno()

    def close_files(self) -> None:
        """End the stream and close the files; for a session whose last event is written."""
        self._log.close()
        self._events.close()

    def close(self, time_s: float, outcome: Ending, reason: str) -> None:
        """Close the session with its outcome."""
        self._log.close()
        self.event("session_ended", time_s=time_s, outcome=outcome, reason=reason)
        self._events.close()


@contextmanager
def locked(events: Path, remedy: str) -> Iterator[None]:
    """Keep every other process from a session's events meanwhile.

    Raises
    ------
    UserError
        If one records the session; it ends with the remedy.
    """
    with events.open("rb") as file:
        if not lock(file):
            raise UserError(f"{events.parent}: is still being recorded; {remedy}")
        yield


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return the manifest of a session folder.

    Raises
    ------
    UserError
        If the folder is no session folder, or one that this version cannot read.
    """
    path = folder / MANIFEST
    if not path.exists():
        raise UserError(f"{folder}: is not a session folder, it has no {MANIFEST}")
    content = read_bytes(path, DOCUMENT_BYTES)
    manifest = parse_json(content, str(path))
    schema = manifest.get("schema") if isinstance(manifest, dict) else None
    if schema not in SCHEMAS:
        raise UserError(f"{path}: schema is {schema!r}; this version reads {' and '.join(SCHEMAS)}")
    for key, kind in MANIFEST_TYPES.items():
        if not isinstance(manifest.get(key), kind):
            raise UserError(f"{path}: {key} is missing or damaged; the manifest was changed")
    if not isinstance(manifest.get("continues", {}), dict):
        raise UserError(f"{path}: continues is damaged; it must be an object, or absent")
    if schema == SESSION_SCHEMA and not checksum_holds(content):
        raise UserError(
            f"{path}: is damaged or was changed since it was written (its checksum does not hold); "
            "put back a copy of it"
        )
    return dict(manifest)


def check_session(
    folder: Path, manifest: Mapping[str, Any], ids: Mapping[str, Sequence[str]]
) -> None:
    """Refuse files that belong to another session than the manifest.

    Parameters
    ----------
    folder : Path
    manifest : mapping
    ids : mapping of str to sequence of str
        By the name of a file, the sessions that it names; none for an empty file.

    Raises
    ------
    UserError
        If a file names another session, or more than one.
    """
    own = manifest.get("session_id", "")
    for name, found in ids.items():
        for other in found:
            if other != own:
                raise UserError(
                    f"{folder}: {name} belongs to {_session(other)}, but {MANIFEST} to "
                    f"{_session(own)}; put back the files of one session"
                )


def _session(session_id: str) -> str:
    return f"session {session_id}" if session_id else "a session without an id (version 1)"


@dataclass(frozen=True)
class SessionFiles:
    """What the files of a session hold."""

    manifest: Mapping[str, Any]
    samples: StoredSamples
    log: EventLog

    @property
    def ended(self) -> Mapping[str, Any] | None:
        """The event with which the session ended, None if it was interrupted."""
        found = (e for e in self.log.events if e.get("event") == "session_ended")
        return next(found, None)


def read_session_files(folder: Path, wanted: Collection[str] = Sample._fields) -> SessionFiles:
    """Read manifest, samples and events of a session.

    Parameters
    ----------
    folder : Path
    wanted : collection of str
        The columns of the samples to decode.

    Raises
    ------
    UserError
        If a file is missing or unreadable, or belongs to another session.
    """
    manifest = read_manifest(folder)
    for name in (SAMPLES, EVENTS):
        if not (folder / name).exists():
            raise UserError(f"{folder}: the session has no {name}")
    samples_path, events_path = folder / SAMPLES, folder / EVENTS
    samples = scan_samples(read_bytes(samples_path, RECORDING_BYTES), samples_path, wanted)
    log = scan_events(read_bytes(events_path, DOCUMENT_BYTES), events_path)
    check_session(folder, manifest, {SAMPLES: samples.session_ids, EVENTS: log.session_ids})
    return SessionFiles(manifest, samples, log)
