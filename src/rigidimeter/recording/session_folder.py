"""The session folder: `manifest.json`, `samples.arrows`, `events.jsonl`.

The manifest is written before the first sample and never changes: settings, versions, seeds,
protocol, and the unit of every channel. What happened is in the events: each epoch starts, and ends
with success, abort or fail and a reason; so does the session. A folder without a
`session_ended` event was interrupted; `recover` closes it.
"""

from __future__ import annotations

import fcntl
import platform
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np
import pyarrow as pa
import scipy
from numpy.typing import NDArray

from rigidimeter.documents import json_text, read_json, replace_file, text_bytes
from rigidimeter.errors import UserError
from rigidimeter.recording.event_log import append_event
from rigidimeter.recording.sample_log import SAMPLE_UNITS, Sample, SampleLog, append_line
from rigidimeter.settings import Settings, dump_settings
from rigidimeter.version import __version__

MANIFEST, SAMPLES, EVENTS = "manifest.json", "samples.arrows", "events.jsonl"
SCHEMA = "rigidimeter.session/1"

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
    ) -> None:
        self.folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if any(folder.iterdir()):
                raise UserError(
                    f"{folder}: is not empty; a recording is never written over another, so name "
                    "a new folder"
                )
            manifest = {
                "schema": SCHEMA,
                "created_utc": datetime.now(UTC).isoformat(timespec="seconds"),
                "virtual": virtual,
                "versions": {
                    "rigidimeter": __version__,
                    "python": platform.python_version(),
                    "numpy": np.__version__,
                    "scipy": scipy.__version__,
                    "pyarrow": pa.__version__,
                },
                "seeds": dict(seeds),
                "settings": dump_settings(settings),
                "protocol": [dict(epoch) for epoch in protocol],
                "channel_units": dict(SAMPLE_UNITS),
            }
            if continues:
                manifest["continues"] = dict(continues)
            replace_file(folder / MANIFEST, text_bytes(json_text(manifest)))
            self._log = SampleLog(folder / SAMPLES, settings.rig.tick_rate_hz)
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
        append_line(self._events, line)

    def event(self, kind: str, **facts: Any) -> None:
        """Record something that happened; an epoch's samples are in the file before its end is."""
        if kind == "epoch_ended":
            self._log.flush()
        append_event(self._events, {"event": kind, **facts})

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


def lock(file: BinaryIO) -> bool:
    """Lock an event file until it is closed; return False if another process holds the lock.

    The lock ends with the process, also when it is killed.
    """
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # some network file systems have no locks: record all the same
        return True
    return True


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
    manifest = read_json(path)
    schema = manifest.get("schema") if isinstance(manifest, dict) else None
    if schema != SCHEMA:
        raise UserError(f"{path}: schema is {schema!r}; this version reads {SCHEMA!r}")
    for key, kind in MANIFEST_TYPES.items():
        if not isinstance(manifest.get(key), kind):
            raise UserError(f"{path}: {key} is missing or damaged; the manifest was changed")
    return dict(manifest)
