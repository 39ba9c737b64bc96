"""The emergency stop at the terminal from which the page was started: SPACE or e.

The page leads the session; whoever sits at this terminal can stop it all the same, also while it
starts, while the rig is checked, and when no page answers. Every other key does nothing here.
"""

from __future__ import annotations

import os
import termios
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import IO

from rigidimeter.rig.console.line_view import BELL
from rigidimeter.rig.console.terminal import Tty, clean, without_sequences

KEYS_HERE = "SPACE or e in this terminal: EMERGENCY STOP"
NO_KEYS = "No keys are read here (no terminal in the foreground): the emergency stop is on the page"


@contextmanager
def stop_keys(keyboard: IO[str] | None) -> Iterator[StopKeys]:
    """Give the stop keys of a terminal, which is given back as it was in the end.

    Parameters
    ----------
    keyboard : file or None
        If it is no terminal, or its keys go to other programs, no key is ever pressed.
    """
    tty = None
    with suppress(OSError, ValueError, termios.error):
        if keyboard is not None and keyboard.isatty() and _in_foreground(keyboard.fileno()):
            tty = Tty(keyboard.fileno(), keyboard.fileno())
    if tty is None:
        yield StopKeys(None)
        return
    with tty:
        yield StopKeys(tty)


class StopKeys:
    """Keys as they come; `pressed` is to be called often, and never waits.

    Parameters
    ----------
    tty : Tty or None
        Entered. None where there is no terminal.
    """

    def __init__(self, tty: Tty | None) -> None:
        self._tty = tty

    @property
    def help(self) -> str:
        """What to say of them once."""
        return KEYS_HERE if self._tty is not None else NO_KEYS

    def pressed(self) -> bool:
        """Return whether SPACE or e was pressed since the last call."""
        # One that was put into the background would be halted by the system as it reads.
        if self._tty is None or not _in_foreground(self._tty.keys):
            return False
        typed = self._tty.typed()
        if typed is None:
            self.say("the keyboard is gone: the emergency stop is on the page")
            self._tty = None
            return False
        text = without_sequences(typed.decode(errors="replace")).lower()
        if text and not set(text) & {" ", "e"}:
            self.say(f"{KEYS_HERE}; everything else is on the page")
        return " " in text or "e" in text

    def say(self, text: str) -> None:
        """Show a line on the terminal."""
        if self._tty is not None:
            self._tty.show(f"\r\x1b[K{clean(text)}\n".encode())

    def ring(self) -> None:
        """Ring the terminal's bell."""
        if self._tty is not None:
            self._tty.show(BELL.encode())


def _in_foreground(keys: int) -> bool:
    """Whether a terminal's keys come to this program; so they do where nothing shares it."""
    try:
        return os.tcgetpgrp(keys) == os.getpgrp()
    except OSError:  # not the terminal that controls this program
        return True
