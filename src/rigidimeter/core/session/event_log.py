"""The events of a session, appended as JSON lines, each with its checksum and the session's id.

Other programs have them as markers. A marker is a list of words with `/` between them, as
MNE-Python selects events: ``epoch_start/3/prbs/DBS``, ``epoch_end/3/success``, ``limit/speed``,
``stop/emergency_stop``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import (
    DOCUMENT_BYTES,
    FIELD,
    ZEROS,
    append_line,
    checksum_holds,
    json_line,
    parse_json,
    read_bytes,
    with_checksum,
)

EVENT_TYPES: Mapping[str, Mapping[str, type | tuple[type, ...]]] = {
    "session_started": {"time_s": (int, float)},
    "epoch_started": {"epoch": int, "label": str, "task": str, "condition": str},
    "epoch_ended": {"epoch": int, "time_s": (int, float), "outcome": str, "reason": str},
    "session_ended": {"outcome": str, "reason": str},
}
"""What an event must hold to be read; others are kept and passed over."""

_BEGIN = b"{" + FIELD

_WORDS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "session_started": ("session_start", ()),
    "epoch_started": ("epoch_start", ("label", "task", "condition")),
    "epoch_ended": ("epoch_end", ("epoch", "outcome")),
    "session_ended": ("session_end", ("outcome",)),
    "order": ("order", ("command",)),
}
"""By the kind of an event: the marker's first word, and the facts that follow it."""

_LIMITS = ("none", "acceleration", "speed", "position", "latched")


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


def marker_of(event: Mapping[str, Any]) -> str:
    """Return an event as a marker; one of another kind is named by its kind.

    Examples
    --------
    >>> marker_of({"event": "epoch_started", "label": "3", "task": "prbs", "condition": "DBS"})
    'epoch_start/3/prbs/DBS'
    """
    kind = str(event.get("event", ""))
    first, names = _WORDS.get(kind, (kind, ()))
    words = (str(event.get(name, "")).replace("/", " ") for name in names)
    return "/".join([first, *words])


def sample_markers(
    limited: NDArray[Any], cause: NDArray[Any], before: tuple[int, int], causes: Mapping[int, str]
) -> list[tuple[int, str]]:
    """Return where the guard began to limit and why it stopped, as rows and markers.

    Parameters
    ----------
    limited, cause : array of int, shape (n,)
        Columns of the samples.
    before : (int, int)
        Both in the sample before these.
    causes : mapping of int to str
        The names of the causes.
    """
    found: list[tuple[int, str]] = []
    for column, last, kind in ((limited, before[0], "limit"), (cause, before[1], "stop")):
        changed = np.flatnonzero(np.diff(column.astype(int), prepend=last))
        for row in changed.tolist():
            value = int(column[row])
            if value:
                named = dict(enumerate(_LIMITS)) if kind == "limit" else causes
                found.append((row, f"{kind}/{named.get(value, value)}"))
    return sorted(found, key=lambda each: each[0])
