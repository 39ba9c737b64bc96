"""The session folders of a study, and what their manifests and events say: read in one place."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rigidimeter.core.session import EVENTS, is_session, read_events, read_manifest

SESSIONS = "sessions"
"""Below the study folder: where those of a plan lie."""


@dataclass(frozen=True)
class ScannedSession:
    """A session folder by its path below the study folder, with its manifest and its events."""

    path: str
    folder: Path
    manifest: Mapping[str, Any]
    events: Sequence[Mapping[str, Any]]

    @property
    def about(self) -> Mapping[str, Any]:
        """What was said of subject, condition and stimulation, and the place in the plan."""
        found: Mapping[str, Any] = self.manifest.get("about", {})
        return found

    def of(self, kind: str) -> list[Mapping[str, Any]]:
        """Return the events of a kind, in their order."""
        return [event for event in self.events if event["event"] == kind]


def session_folders(study: Path) -> list[Path]:
    """Return the session folders of a study folder and of its folder `sessions`, by name."""
    places = [place for place in (study, study / SESSIONS) if place.is_dir()]
    return sorted(path for place in places for path in place.iterdir() if is_session(path))


def scan_session(study: Path, folder: Path) -> ScannedSession:
    """Read what a session folder of a study says of itself.

    Raises
    ------
    UserError
        If its manifest or its events cannot be read.
    """
    events, _ = read_events(folder / EVENTS) if (folder / EVENTS).is_file() else ([], False)
    path = os.path.relpath(folder, study).replace(os.sep, "/")
    return ScannedSession(path, folder, read_manifest(folder), events)
