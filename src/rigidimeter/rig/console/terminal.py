"""The operator's view in a terminal: single keys where it has them, else lines."""

from __future__ import annotations

import os
import termios
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import IO

from rigidimeter.rig.console.key_view import KeyView
from rigidimeter.rig.console.line_view import LineView
from rigidimeter.rig.console.session_plan import SessionPlan
from rigidimeter.rig.console.tty import Tty

QUESTION = "question: "
"""With which a command begins a line that somebody must answer."""


@contextmanager
def terminal_view(
    keyboard: IO[str] | None, screen: IO[str], plan: SessionPlan
) -> Iterator[LineView]:
    """Give the view for a keyboard and a screen, to be called about 20 times a second.

    Parameters
    ----------
    keyboard : file or None
        None for nobody, who presses no keys.
    screen : file
    plan : SessionPlan
    """
    tty = None
    same = screen.isatty() and os.environ.get("TERM", "dumb") != "dumb"
    if keyboard is not None and keyboard.isatty() and same:
        with suppress(OSError, termios.error):  # of a terminal that has no name here
            tty = Tty(keyboard.fileno(), screen.fileno())
    if tty is None:
        yield LineView(keyboard, screen, plan)
        return
    with tty:
        yield KeyView(tty, plan)
