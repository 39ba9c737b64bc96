"""The events of a session, appended as JSON lines."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

from rigidimeter.documents import json_line
from rigidimeter.errors import UserError
from rigidimeter.recording.sample_log import append_line

EVENT_TYPES: Mapping[str, Mapping[str, type | tuple[type, ...]]] = {
    "session_started": {"time_s": (int, float)},
    "epoch_started": {"epoch": int, "label": str, "task": str, "condition": str},
    "epoch_ended": {"epoch": int, "time_s": (int, float), "outcome": str, "reason": str},
    "session_ended": {"outcome": str, "reason": str},
}
"""What an event must hold to be read; others are kept and passed over."""


def append_event(file: BinaryIO, event: Mapping[str, Any]) -> None:
    """Write one event as one line, at once."""
    append_line(file, json_line(event))


def read_events(path: Path) -> tuple[list[dict[str, Any]], bool]:
    """Return the events and whether the last line is torn (then it is left out).

    Raises
    ------
    UserError
        If a complete line is not a JSON object.
    """
    events: list[dict[str, Any]] = []
    lines = path.read_bytes().split(b"\n")
    for number, line in enumerate(lines[:-1], start=1):
        try:
            event = dict(json.loads(line))
        except (ValueError, TypeError):
            raise UserError(f"{path}: line {number} is not a JSON object") from None
        kind = event.get("event")
        for key, kinds in EVENT_TYPES.get(str(kind), {}).items():
            if not isinstance(event.get(key), kinds):
                raise UserError(f"{path}: line {number}, {kind}: {key} is missing or damaged")
        events.append(event)
    return events, lines[-1] != b""
