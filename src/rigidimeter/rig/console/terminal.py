"""The operator's view in a terminal: a line of status in place and single keys, else lines.

What stops never asks. Only what sets the arm going asks for the key a second time: resume, in a
pause. Whoever presses a key that means nothing, means that something is wrong: the session pauses.
What takes more than a key is typed after a colon; then the space bar stops at once if nothing is
typed yet or it is pressed twice, and so does an e that would begin the text.

Nobody ever waits for the terminal. The output is opened anew, so that not waiting for it changes
nothing for the other programs that have the same terminal. A frame that the terminal takes only in
part is finished before the next one begins, so that no control sequence is torn; frames that come
meanwhile are dropped.
"""

from __future__ import annotations

import math
import os
import re
import select
import termios
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import IO

from rich.cells import cell_len, set_cell_size

from rigidimeter.rig.acquisition import Command, Order, State
from rigidimeter.rig.acquisition.processes import Flag, SharedStatus
from rigidimeter.rig.console.line_view import BELL, SILENCE, LineView
from rigidimeter.rig.console.orders import KEYS, post_typed
from rigidimeter.rig.console.session_facts import Facts
from rigidimeter.rig.console.session_progress import SessionPlan

QUESTION = "question: "
"""With which a command begins a line that somebody must answer."""

BEAT = "beat"
"""The line by which a program that leads a command says that somebody is there."""

BEAT_S = 0.05
"""So often it says so."""

LEAVE = b"\x1b[0m\n"
LEAVE_S = 0.5
"""For so long it is tried to end the line on a terminal that takes no output."""

KEYS_HELP = (
    "SPACE or e: EMERGENCY STOP, h: halt (power off), other keys: pause now; p pause after this "
    "epoch, n pause now, r resume, s stop after this epoch, a abort, c silence cautions, : set, "
    "note, save to"
)
AGAIN_S = 5.0
"""For so long a key that asks for itself again waits."""

REPEAT_S = 0.15
"""A key that comes again so soon may be held down: it does not answer what it was asked."""

TYPING_S = 15.0
"""After so long without a key, keys are orders again."""

_SEQUENCE = re.compile(r"\x1b[\[O][0-?]*[ -/]*[@-~]?")
"""Arrows, function keys, a mouse wheel: no order, and no sign of a hurry."""


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
        self.keys = keys
        self._screen = os.open(os.ttyname(screen), os.O_RDWR | os.O_NONBLOCK | os.O_NOCTTY)
        self._before = termios.tcgetattr(keys)
        self._pending = b""

    def __enter__(self) -> Tty:
        """Take keys one by one, unseen; Ctrl-C stays a signal."""
        tty.setcbreak(self.keys, termios.TCSANOW)
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
                termios.tcsetattr(self.keys, termios.TCSANOW, self._before)
                termios.tcflush(self.keys, termios.TCIFLUSH)
        finally:
            os.close(self._screen)

    def width(self) -> int:
        """Return the width in cells; 80 where the terminal does not say."""
        with suppress(OSError):
            return os.get_terminal_size(self._screen).columns or 80
        return 80

    def show(self, frame: bytes) -> bool:
        """Show a frame; it is dropped, and False returned, while the one before is not out."""
        if not self._flush():
            return False
        self._pending = frame
        self._flush()
        return True

    def typed(self) -> bytes | None:
        """Return the bytes that were typed since the last call, None if nobody can type more."""
        read = b""
        while select.select([self.keys], [], [], 0.0)[0]:
            try:
                part = os.read(self.keys, 1024)
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


class KeyView(LineView):
    """Shows the status and posts orders; to be called often, while `tty` is entered.

    Parameters
    ----------
    tty : Tty
    plan : SessionPlan
    now : callable
        Monotonic seconds.
    """

    every_s = 0.2

    def __init__(
        self, tty: Tty, plan: SessionPlan, now: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__(None, None, plan, now)
        self._tty = tty
        self._prompt: str | None = None
        self._key_s = self._asked_s = self._resume_s = -1e9
        self._there, self._bell_due = True, False
        self._say(KEYS_HELP)

    def _listen(self, status: SharedStatus) -> None:
        if not self._there:
            return
        if self._prompt is not None and self._now() - self._key_s > TYPING_S:
            self._prompt = None
        typed = self._tty.typed()
        if typed is None:  # nobody can type any more, so nobody can stop the rig from here
            self._there = False
            status.raise_flag(Flag.END_ASKED)
            self._say("the keyboard is gone: the rig stops")
            return
        text = without_sequences(typed.decode(errors="replace"))
        if text:
            self._key_s = self._now()
            self._shown_s = -1e9  # what is typed is shown at once
        for key in text:
            if self._prompt is not None:
                self._type(key, status)
            else:
                self._press(key.lower(), status)

    def _type(self, key: str, status: SharedStatus) -> None:
        """Take a key of what is typed after a colon."""
        assert self._prompt is not None
        stops = key in " eE" if not self._prompt else key == " " == self._prompt[-1]
        if stops:
            self._prompt = None
            self._press(" ", status)
        elif key in "\r\n":
            line, self._prompt = self._prompt.strip(), None
            if line:
                self._say(post_typed(line, status))
        elif key == "\x1b":
            self._prompt = None
        elif key in "\x7f\b":
            self._prompt = self._prompt[:-1]
        elif key.isprintable():
            self._prompt += key

    def _press(self, key: str, status: SharedStatus) -> None:
        """Do what a key orders."""
        if key in " e":
            self._stop(status)
            return
        if key == ":":
            self._prompt = ""
            return
        if key in "\r\n":  # who is used to Enter after a letter
            return
        if key == SILENCE:
            self._silence()
            return
        if key not in KEYS:
            self._say(f"{key!r} is no order: pausing now")
        command = KEYS.get(key, Command.PAUSE_NOW)
        if command is Command.RESUME and self._must_ask(status):
            return
        self._asked_s = -1e9
        self._post(Order(command), status)

    def _must_ask(self, status: SharedStatus) -> bool:
        """Whether a resume is to be asked for again: it sets the arm going unless a run goes on.

        By what the loop shows now, not by what was on the screen: a hold may have come since.
        """
        loop = status.loop()
        goes_on = loop is not None and loop.tick >= 0 and loop.state == State.RUNNING
        now_s = self._now()
        held_down, self._resume_s = now_s - self._resume_s < REPEAT_S, now_s
        asked = now_s - self._asked_s <= AGAIN_S
        if goes_on or (asked and not held_down):
            return False
        self._asked_s = now_s
        if not asked:
            self._say("press r again within 5 s: the arm will move")
        return True

    def _show(self, facts: Facts) -> bool:
        begun = math.isfinite(facts.angle_deg)
        line = self._line(facts).strip() if begun else facts.state_words
        if self._prompt is not None:
            line = f": {self._prompt}_   Enter does it, Esc leaves, SPACE SPACE: EMERGENCY STOP"
        line, cells = clean(line), max(self._tty.width() - 1, 1)  # the last column may wrap
        if cell_len(line) > cells:
            line = set_cell_size(line, cells - 1) + "…"
        bell = BELL if self._bell_due else ""
        if self._tty.show(f"{bell}\r\x1b[K{line}".encode()):
            self._bell_due = False
        return True

    def _ring(self) -> None:
        self._bell_due = True
        self._shown_s = -1e9

    def _say(self, text: str) -> None:
        self._tty.show(f"\r\x1b[K{clean(text)}\n".encode())
        self._shown_s = -1e9  # the line of status follows at once


def without_sequences(text: str) -> str:
    """Return what was typed without arrows, function keys and the like."""
    return _SEQUENCE.sub("", text)


def clean(text: str) -> str:
    """Return a text without characters that would steer the terminal."""
    return "".join(c if c.isprintable() else "?" for c in text)
