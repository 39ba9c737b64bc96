"""What page and server say to each other over the socket.

What a page says is checked: anything else is refused with a sentence. What it gets are the facts of
the session as text to show, and samples as numbers to draw.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from rigidimeter.core.units import deg_from_rad
from rigidimeter.rig.acquisition import Command, State
from rigidimeter.rig.acquisition.processes import NOTE_BYTES
from rigidimeter.rig.console import AT_ONCE, TRACES, Facts, Level, Progress, Traces
from rigidimeter.rig.console.page.button_words import in_buttons

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

LEVELS = {Level.UNKNOWN: "off", Level.GOOD: "ok", Level.WATCH: "warn", Level.BAD: "bad"}
"""What the page calls the levels of an indicator; each has a colour there."""

ORDERS_IN = {
    State.IDLE: ("abort",),
    State.RUNNING: ("pause", "pause_now", "resume", "stop", "abort"),
    State.PAUSED: ("resume", "stop", "abort"),
    State.STOPPING: (),
    State.FAULTED: (),
}
"""Which orders mean something in which state."""

_DEGREES = ("angle_rad", "velocity_command_rad_s")


class RefusedMessage(ValueError):
    """A message that no page of this server sends."""


@dataclass(frozen=True)
class PageMessage:
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


def parse_message(text: str) -> PageMessage:
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
        message = json.loads(text)
    except (ValueError, RecursionError):
        raise RefusedMessage("a message is not JSON") from None
    kind = message.get("kind") if isinstance(message, dict) else None
    if kind not in KINDS:
        raise RefusedMessage("a message is of no known kind")
    if kind == "hello":
        return PageMessage(kind, page=_text(message, "page", 64), tab=_text(message, "tab", 64))
    if kind == "order":
        command = ORDERS.get(_text(message, "command", 20))
        if command is None:
            raise RefusedMessage(f"an order is one of {', '.join(ORDERS)}")
        return PageMessage(kind, command=command)
    if kind == "save":
        folder = _text(message, "folder", LONGEST_TEXT)
        if not folder.startswith(("/", "~/")):
            raise RefusedMessage("name the full path of a new folder, as in /media/disk/session")
        return PageMessage(kind, folder=folder)
    return PageMessage(kind, note=_note(message) if kind == "note" else None)


def _note(message: dict[str, Any]) -> dict[str, Any]:
    what = message.get("what")
    if what not in ("note", "mark", "rating"):
        raise RefusedMessage("a note is a note, a mark or a rating")
    note = {
        "what": what,
        "text": _text(message, "text", LONGEST_TEXT),
        "by": _text(message, "by", LONGEST_NAME),
    }
    if what == "rating":
        epoch, score = message.get("epoch"), message.get("score")
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


def _text(message: dict[str, Any], key: str, max_length: int) -> str:
    """Return a text without characters that no line of text holds."""
    value = message.get(key, "")
    if not isinstance(value, str):
        raise RefusedMessage(f"{key} must be text")
    value = value.strip()
    if len(value) > max_length:
        raise RefusedMessage(f"{key} has {len(value)} characters; {max_length} are possible")
    if not value.isprintable():
        raise RefusedMessage(f"{key} holds characters that cannot be shown, such as a line feed")
    return value


def session_state(facts: Facts, progress: Progress) -> dict[str, Any]:
    """Return what the page shows of a session that runs; `progress` tells what can be rated."""
    epoch = facts.epoch or facts.next_epoch
    words = {"epoch": "Epoch: time left", "rest": "Rest: time left"}
    again = ", again" if epoch is not None and epoch.again else ""
    place = f"{epoch.place} of {epoch.of}{again}" if epoch is not None else "all done"
    rated = progress.ended[-1] if progress.ended and not progress.running else None
    drawn = progress.current or (progress.to_run[0] if progress.to_run else None)
    return {
        "state": facts.state_words,
        "condition": epoch.condition if epoch is not None else "–",
        "epoch": place,
        "epoch_of": "Epoch" if facts.epoch is not None or epoch is None else "Next epoch",
        "countdown": duration(facts.countdown_s),
        "countdown_of": words.get(facts.countdown_words, facts.countdown_words or "Time left"),
        "counts": [
            *(
                f"{count.condition}: {count.good} done"
                f"{f', {count.bad} not good' if count.bad else ''}, {count.left} left"
                for count in facts.counts
            ),
            f"session: {duration(facts.session_left_s)} left",
        ],
        "live": [value.text for value in facts.live],
        "live_of": facts.live_words,
        "task": drawn.task if drawn is not None else "",
        "modelled": is_known(facts),
        "limits": [
            {
                "name": one.name,
                "sign": (Level.WATCH if one.near else Level.GOOD).sign,
                "text": one.text,
                "part": round(one.part, 3),
                "near": one.near,
            }
            for one in facts.distances
            if math.isfinite(one.part)
        ],
        "lamps": [
            {
                "level": LEVELS[indicator.level],
                "sign": indicator.level.sign,
                "text": f"{indicator.name}: {in_buttons(indicator.words)}",
            }
            for indicator in facts.indicators
        ],
        "alert": "\n".join(filter(None, (in_buttons(facts.stop_words), facts.emg_words))),
        "orders": [] if progress.outcome else list(ORDERS_IN[facts.state]),
        "rate": {"number": rated.number, "place": rated.place} if rated is not None else None,
    }


def duration(seconds: float) -> str:
    """Return a time that is left, rounded up.

    Examples
    --------
    >>> duration(12.2), duration(75.0)
    ('13 s', '1:15 min')
    """
    if not math.isfinite(seconds):
        return "–"
    left_s = math.ceil(max(seconds, 0.0))
    return f"{left_s} s" if left_s < 60 else f"{left_s // 60}:{left_s % 60:02d} min"


def is_known(facts: Facts) -> bool:
    """Whether J, B and K are shown, all of them, and so what they say of the torque."""
    return bool(facts.live) and all(value.settled for value in facts.live)


def points(traces: Traces, *, modelled: bool) -> bytes:
    """Return samples as little-endian float64, 15 numbers for each piece of time.

    The time in s; the least values of the traces, then the largest; then those of the piece's
    first sample: angle, torque, and the torque in the band of the live estimate, measured and
    modelled. Angles are in degrees. The modelled torque is NaN unless `modelled`.
    """
    columns = [traces.time_s]
    for values, names in ((traces.low, TRACES), (traces.high, TRACES), (traces.first, AT_ONCE)):
        columns += [
            (deg_from_rad(1.0) if name in _DEGREES else 1.0) * values[name] for name in names
        ]
    if not modelled:
        columns[-1] = np.full(traces.time_s.size, np.nan)
    return np.column_stack(columns).astype("<f8").tobytes()
