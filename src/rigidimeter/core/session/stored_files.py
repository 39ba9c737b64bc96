"""The files of a session folder, each read once, and whether they belong together."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import DOCUMENT_BYTES, RECORDING_BYTES, read_bytes
from rigidimeter.core.session.event_log import EventLog, scan_events
from rigidimeter.core.session.folder import EVENTS, SAMPLES, check_session, read_manifest
from rigidimeter.core.session.sample_log import Sample
from rigidimeter.core.session.sample_reading import Samples, scan_samples


@dataclass(frozen=True)
class SessionFiles:
    """What the files of a session hold."""

    manifest: Mapping[str, Any]
    samples: Samples
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
