"""The events of a session, appended as JSON lines, each with its checksum and the session's id."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import DOCUMENT_BYTES, json_line, parse_json, read_bytes
from rigidimeter.core.session.checksum import ZEROS, checksum_holds, with_checksum
from rigidimeter.core.session.sample_log import append_line

EVENT_TYPES: Mapping[str, Mapping[str, type | tuple[type, ...]]] = {
    "session_started": {"time_s": (int, float)},
    "epoch_started": {"epoch": int, "label": str, "task": str, "condition": str},
    "epoch_ended": {"epoch": int, "time_s": (int, float), "outcome": str, "reason": str},
    "session_ended": {"outcome": str, "reason": str},
}
"""What an event must hold to be read; others are kept and passed over."""


_BEGIN = b'{"checksum": "'


@dataclass(frozen=True)
class EventLog:
    """What a file of events holds.

    Attributes
    ----------
    events : list of dict
        Of all lines that are whole, without checksum and session.
    torn : bool
        Whether the last line breaks off; it is left out.
    damaged : tuple of int
        Numbers of the complete lines whose checksum does not hold; they are left out.
    session_ids : tuple of str
        That the lines name; an empty text where they name none, as in version 1.
    """

    events: list[dict[str, Any]]
    torn: bool
    damaged: tuple[int, ...]
    session_ids: tuple[str, ...]


def checked_line(line: bytes, session_id: str) -> bytes:
    """Return a line of JSON with its checksum and the session that it belongs to.

    Without an id the line stays as it is: the file was begun in version 1.
    """
    if not session_id:
        return line
    head = json_line({"checksum": ZEROS, "session_id": session_id}).removesuffix(b"}\n")
    return with_checksum(head + b", " + line.strip().removeprefix(b"{")) + b"\n"


def append_event(file: BinaryIO, event: Mapping[str, Any], session_id: str) -> None:
    """Write one event as one line, at once."""
    append_line(file, checked_line(json_line(event), session_id))


def read_events(path: Path) -> tuple[list[dict[str, Any]], bool]:
    """Return the events, and whether the last line is torn (then it is left out).

    Raises
    ------
    UserError
        As `scan_events`.
    """
    log = scan_events(read_bytes(path, DOCUMENT_BYTES), path)
    return log.events, log.torn


def scan_events(content: bytes, source: Path) -> EventLog:
    """Return what a file of events holds, and what is damaged in it.

    Raises
    ------
    UserError
        If a line without a checksum is not a JSON object, or an event lacks what it must hold.
    """
    *lines, last = content.split(b"\n")
    checked = any(line.startswith(_BEGIN) for line in lines)
    events: list[dict[str, Any]] = []
    damaged: list[int] = []
    ids: dict[str, None] = {}
    for number, line in enumerate(lines, start=1):
        if checked and not (line.startswith(_BEGIN) and checksum_holds(line)):
            damaged.append(number)
            continue
        try:
            event = parse_json(line, f"{source}: line {number}")
        except UserError:
            event = None
        if not isinstance(event, dict):
            raise UserError(f"{source}: line {number} is not a JSON object")
        if checked:
            event.pop("checksum")
        ids[str(event.pop("session_id", ""))] = None
        kind = event.get("event")
        for key, kinds in EVENT_TYPES.get(str(kind), {}).items():
            if not isinstance(event.get(key), kinds):
                raise UserError(f"{source}: line {number}, {kind}: {key} is missing or damaged")
        events.append(event)
    return EventLog(events, last != b"", tuple(damaged), tuple(ids))
