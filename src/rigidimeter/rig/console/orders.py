"""What an operator types, as orders to the loop."""

from __future__ import annotations

import json
from pathlib import Path

from rigidimeter.rig.acquisition import Command, Order
from rigidimeter.rig.acquisition.processes import ProcessCondition, Role, SharedStatus

KEYS = {
    "p": Command.PAUSE,
    "n": Command.PAUSE_NOW,
    "r": Command.RESUME,
    "s": Command.STOP,
    "a": Command.ABORT,
    "h": Command.HALT,
}
"""What is typed: pause after the epoch, pause now, resume, stop, abort, halt."""


def order_of(text: str) -> Order | None:
    """Return the order that was typed; None if it is none.

    ``set damping_nm_s_rad 2.0`` changes a parameter; its bounds are the loop's to judge.
    """
    words = text.split()
    if not words:
        return None
    if words[0].lower() == "set" and len(words) == 3:
        try:
            return Order(Command.CHANGE, words[1], float(words[2]))
        except ValueError:
            return None
    typed = " ".join(words).lower()
    if typed == "stop":  # in a hurry one types the word: it ends what moves, now
        return Order(Command.ABORT)
    by_name = {command.name.lower().replace("_", " "): command for command in KEYS.values()}
    command = (KEYS | by_name).get(typed)
    return Order(command) if command is not None else None


def post_typed(text: str, status: SharedStatus) -> str:
    """Do what a line says that is more than a key; return what to tell the operator.

    ``set NAME VALUE``, ``save to FOLDER``, ``note TEXT``.
    """
    words = text.split(maxsplit=1)
    name, rest = (words[0].lower(), words[1:]) if words else ("", [])
    if name == "note" and rest:
        try:
            number = status.post_note(json.dumps({"what": "note", "text": rest[0], "by": ""}))
        except ValueError as error:
            return str(error)
        return "noted" if number is not None else "the note before is not taken yet; try again"
    if text.lower().startswith("save to "):
        return save_to(text[len("save to ") :].strip(), status)
    order = order_of(text) if name == "set" else None
    if order is None:
        return f"{text!r} is neither `set NAME VALUE`, `note TEXT` nor `save to FOLDER`"
    try:
        status.post(order)
    except ValueError as error:
        return str(error)
    return f"ordered: {text}"


def save_to(name: str, status: SharedStatus) -> str:
    """Ask the recorder for another folder, if it can write nothing to the one it has."""
    if status.condition(Role.RECORDER) is not ProcessCondition.TROUBLE:
        return "the recorder can write: another folder is for when it cannot"
    folder = Path(name).expanduser()
    try:
        status.ask_folder(folder)
    except ValueError as error:
        return str(error)
    return f"ordered: save to {folder}"
