"""A terminal that shows a line in place and gives single keys, and nobody ever waits for it.

The output is opened anew, so that not waiting for it changes nothing for the other programs that
have the same terminal. A frame that the terminal takes only in part is finished before the next one
begins, so that no control sequence is torn; frames that come meanwhile are dropped.
"""

from __future__ import annotations

import os
import select
import termios
import time
import tty
from contextlib import suppress
from typing import IO

LEAVE = b"\x1b[0m\n"
LEAVE_S = 0.5
"""For so long it is tried to end the line on a terminal that takes no output."""


def discard_typed(keyboard: IO[str]) -> None:
    """Throw away what was typed and not read: it was meant for a session, not for a shell."""
    with suppress(OSError, termios.error):
        if keyboard.isatty():
            termios.tcflush(keyboard.fileno(), termios.TCIFLUSH)


class Tty:
    """The terminal of two descriptors, used with `with`.

    Parameters
    ----------
    keys, screen : int
        Descriptors of the same terminal.
    """

    def __init__(self, keys: int, screen: int) -> None:
        self._keys = keys
        self._screen = os.open(os.ttyname(screen), os.O_RDWR | os.O_NONBLOCK | os.O_NOCTTY)
        self._before = termios.tcgetattr(keys)
        self._pending = b""

    def __enter__(self) -> Tty:
        """Take keys one by one, unseen; Ctrl-C stays a signal."""
        tty.setcbreak(self._keys, termios.TCSANOW)
        return self

    def __exit__(self, *_: object) -> None:
        """Give the terminal back as it was; what was typed and not read goes to nobody."""
        try:
            # A sequence that was torn off ends with the next one.
            self._pending = LEAVE
            until_s = time.monotonic() + LEAVE_S
            while not self._flush() and time.monotonic() < until_s:
                select.select([], [self._screen], [], 0.05)
            with suppress(termios.error):
                if self._pending:  # what nobody takes would hold up who writes next
                    termios.tcflush(self._screen, termios.TCOFLUSH)
                termios.tcsetattr(self._keys, termios.TCSANOW, self._before)
                termios.tcflush(self._keys, termios.TCIFLUSH)
        finally:
            os.close(self._screen)

    def width(self) -> int:
        """Return the width in cells; 80 where the terminal does not say."""
        with suppress(OSError):
            return os.get_terminal_size(self._screen).columns or 80
        return 80

    def show(self, frame: bytes) -> None:
        """Show a frame; it is dropped while the one before is not out."""
        if self._flush():
            self._pending = frame
            self._flush()

    def typed(self) -> bytes | None:
        """Return the bytes that were typed since the last call, None if nobody can type more."""
        read = b""
        while select.select([self._keys], [], [], 0.0)[0]:
            try:
                part = os.read(self._keys, 1024)
            except OSError:
                return None
            if not part:
                return None
            read += part
        return read

    def _flush(self) -> bool:
        """Write what the terminal takes; return whether nothing is left."""
        try:
            while self._pending:
                self._pending = self._pending[os.write(self._screen, self._pending) :]
        except BlockingIOError:
            return False
        except OSError:  # the terminal is gone
            self._pending = b""
        return True
