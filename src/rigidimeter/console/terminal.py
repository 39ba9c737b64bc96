"""The operator's view in a terminal: the full screen where there is one, else lines."""

from __future__ import annotations

import os
import termios
from contextlib import AbstractContextManager, nullcontext, suppress
from typing import IO, Protocol

from rigidimeter.acquisition.processes.session_memory import SessionMemory
from rigidimeter.console.line_view import LineView
from rigidimeter.console.screen_view import ScreenView
from rigidimeter.console.session_plan import SessionPlan
from rigidimeter.console.tty import Tty


class View(Protocol):
    """Called about 20 times a second; `remarks` are to be printed at the end."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """What other processes printed where this view covered it."""

    def __call__(self, shared: SessionMemory) -> None:
        """Look at keyboard and session once."""


def terminal_view(
    keyboard: IO[str] | None, screen: IO[str], plan: SessionPlan
) -> AbstractContextManager[View]:
    """Return the view for a keyboard and a screen.

    Parameters
    ----------
    keyboard : file or None
        None for nobody, who needs no full screen.
    screen : file
    plan : SessionPlan
    """
    same = (
        keyboard is not None
        and keyboard.isatty()
        and screen.isatty()
        and os.environ.get("TERM", "dumb") != "dumb"
    )
    if keyboard is not None and same:
        with suppress(OSError, termios.error):  # of a terminal that has no name here
            return ScreenView(Tty(keyboard.fileno(), screen.fileno()), plan)
    return nullcontext(LineView(keyboard, screen, plan))
