"""What the page says names its buttons, where a terminal names commands."""

from __future__ import annotations

import re
from collections.abc import Sequence

from rigidimeter.rig.console.page.sessions_found import FoundSession

_MAX_TEXTS = 3

_BUTTONS = (
    (re.compile(r"`rigidimeter run --resume[^`]*`"), "“Run what is left” under After"),
    (re.compile(r"`rigidimeter recover[^`]*`"), "“Recover” under After"),
    (re.compile(r"lead the arm [^;]*--lead-range[^;]*; on the page enter"), "enter"),
    (re.compile(r"order `save to FOLDER`"), "name another folder under “Save to another folder”"),
)


def in_buttons(text: str) -> str:
    """Return a sentence in which a button stands for each command that the page has one for.

    Examples
    --------
    >>> in_buttons("continue the session with `rigidimeter run --resume`")
    'continue the session with “Run what is left” under After'
    """
    for command, button in _BUTTONS:
        text = command.sub(button, text)
    return text


def next_buttons(*, closed: bool, good: int, left: int) -> str:
    """Return what to do on the page after a session, the most pressing first.

    Parameters
    ----------
    closed : bool
        Whether it was closed with an outcome.
    good, left : int
        Epochs that ended with success, and those that are left to run.
    """
    steps = [] if closed else ["“Recover” closes the session"]
    if closed and left:
        epochs = "the epoch that is" if left == 1 else f"the {left} epochs that are"
        steps.append(f"“Run what is left” runs {epochs} left, in a new folder")
    if good:
        steps += [
            "“Show” draws an epoch; “Repeat” runs one again, and “Leave out” takes one out of all "
            "results",
            "“Report of the study” makes the page with J, B and K in each condition",
        ]
    return f"Next, under After: {'; '.join(steps)}." if steps else ""


def unfinished_words(sessions: Sequence[FoundSession]) -> str:
    """Return which sessions were interrupted or have epochs left, and what to do about it."""
    texts = []
    for one in (each for each in sessions if each.unfinished):
        done = f"{one.name}: {one.good} of {one.planned} epochs are good"
        button = "“Run what is left”" if one.outcome else "it was interrupted; “Recover”"
        texts.append(f"{done}, {button} under After.")
    more = f" {len(texts) - _MAX_TEXTS} more are unfinished." if len(texts) > _MAX_TEXTS else ""
    return " ".join(texts[:_MAX_TEXTS]) + more
