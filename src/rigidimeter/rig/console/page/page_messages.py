"""What a page may say over its socket, checked: anything else is refused with a sentence."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Literal

from rigidimeter.rig.acquisition import Command
from rigidimeter.rig.acquisition.processes import NOTE_BYTES

LONGEST = 4096
"""Characters of a message."""

LONGEST_TEXT = 300
"""Characters of a note."""

LONGEST_NAME = 40

ORDERS = {
    "pause": Command.PAUSE,
    "pause_now": Command.PAUSE_NOW,
    "resume": Command.RESUME,
    "stop": Command.STOP,
    "abort": Command.ABORT,
}
"""What the buttons of the page order; the emergency stop is a message of its own."""

Kind = Literal["hello", "beat", "leave", "emergency", "order", "note", "save"]
KINDS = ("hello", "beat", "leave", "emergency", "order", "note", "save")


class RefusedMessage(ValueError):
    """A message that no page of this server sends."""


@dataclass(frozen=True)
class Message:
    """A message of a page.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    page, tab : str
        Of a hello: the secrets of the page and of its tab.
    command : Command
        Of an order.
    note : dict
        Of a note, what is to be recorded: `what` (note, mark or rating), `text`, `by`, and of a
        rating its `epoch` and `score`.
    folder : str
        Where to go on recording when the disk takes nothing.
    """

    kind: Kind
    page: str = ""
    tab: str = ""
    command: Command = Command.NONE
    note: dict[str, Any] | None = None
    folder: str = ""


def parse_message(text: str) -> Message:
    """Read a message of a page.

    Raises
    ------
    RefusedMessage
        If it is too long, no JSON object, of an unknown kind, or holds a value of another type.

    Examples
    --------
    >>> parse_message('{"kind": "order", "command": "pause"}').command
    <Command.PAUSE: 2>
    """
    if len(text) > LONGEST:
        raise RefusedMessage(f"a message has {len(text)} characters; {LONGEST} are possible")
    try:
        said = json.loads(text)
    except (ValueError, RecursionError):
        raise RefusedMessage("a message is not JSON") from None
    kind = said.get("kind") if isinstance(said, dict) else None
    if kind not in KINDS:
        raise RefusedMessage("a message is of no known kind")
    if kind == "hello":
        return Message(kind, page=_text(said, "page", 64), tab=_text(said, "tab", 64))
    if kind == "order":
        command = ORDERS.get(_text(said, "command", 20))
        if command is None:
            raise RefusedMessage(f"an order is one of {', '.join(ORDERS)}")
        return Message(kind, command=command)
    if kind == "save":
        folder = _text(said, "folder", LONGEST_TEXT)
        if not folder.startswith(("/", "~/")):
            raise RefusedMessage("name the whole path of a new folder, as in /media/disk/session")
        return Message(kind, folder=folder)
    return Message(kind, note=_note(said) if kind == "note" else None)


def _note(said: dict[str, Any]) -> dict[str, Any]:
    what = said.get("what")
    if what not in ("note", "mark", "rating"):
        raise RefusedMessage("a note is a note, a mark or a rating")
    note = {
        "what": what,
        "text": _text(said, "text", LONGEST_TEXT),
        "by": _text(said, "by", LONGEST_NAME),
    }
    if what == "rating":
        epoch, score = said.get("epoch"), said.get("score")
        if isinstance(epoch, bool) or not isinstance(epoch, int) or not 0 <= epoch < 100_000:
            raise RefusedMessage("a rating needs the number of its epoch")
        if isinstance(score, bool) or not isinstance(score, int | float):
            raise RefusedMessage("a rating needs a score")
        if not abs(score) <= 1000:
            raise RefusedMessage("a score must be a number between -1000 and 1000")
        if not note["by"]:
            raise RefusedMessage("a rating needs the examiner's name or code")
        note |= {"epoch": epoch, "score": float(score)}
    elif not note["text"]:
        raise RefusedMessage("a note needs a text")
    if len(json.dumps(note, ensure_ascii=False).encode()) > NOTE_BYTES - 16:
        raise RefusedMessage("the note is too long for one line of the record; write two")
    return note


def _text(said: dict[str, Any], key: str, most: int) -> str:
    """Return a text without characters that no line of text holds."""
    value = said.get(key, "")
    if not isinstance(value, str):
        raise RefusedMessage(f"{key} must be text")
    value = value.strip()
    if len(value) > most:
        raise RefusedMessage(f"{key} has {len(value)} characters; {most} are possible")
    if not value.isprintable():
        raise RefusedMessage(f"{key} holds characters that cannot be shown, such as a line feed")
    return value
