"""The full screen of the operator: facts, and orders by single keys.

What stops never asks. Only what sets the arm going asks for the key a second time: resume, in a
pause. Whoever presses a key that means nothing, means that something is wrong: the session pauses.
What takes more than a key is typed after a colon; nothing else is an order meanwhile but Ctrl-C.
"""

from __future__ import annotations

import re
import time
from collections import deque
from collections.abc import Callable
from types import TracebackType

from rigidimeter.acquisition.processes.session_memory import SessionMemory
from rigidimeter.acquisition.processes.shared_status import SharedStatus
from rigidimeter.acquisition.processes.status_values import Flag
from rigidimeter.acquisition.run_states import Command, Order, State
from rigidimeter.console.facts import Facts
from rigidimeter.console.observer import Observer
from rigidimeter.console.orders import KEYS, post_typed
from rigidimeter.console.screen_text import painted, screen_lines
from rigidimeter.console.session_plan import SessionPlan
from rigidimeter.console.tty import Tty

EVERY_S = 0.2
AGAIN_S = 5.0
"""For so long a key that asks for itself again waits."""

TYPING_S = 15.0
"""After so long without a key, keys are orders again."""

_SEQUENCE = re.compile(r"\x1b[\[O][0-?]*[ -/]*[@-~]?")
"""Arrows, function keys, a mouse wheel: no order, and no sign of a hurry."""


class ScreenView:
    """Shows the facts and posts orders; to be used with `with`, and called often.

    Parameters
    ----------
    tty : Tty
    plan : SessionPlan
    now : callable
        Monotonic seconds.
    """

    def __init__(
        self, tty: Tty, plan: SessionPlan, now: Callable[[], float] = time.monotonic
    ) -> None:
        self._tty, self._plan, self._now = tty, plan, now
        self._observer: Observer | None = None
        self._facts: Facts | None = None
        self._shown_s = -1e9
        self._size = (0, 0)
        self._messages: deque[str] = deque(maxlen=20)
        self._prompt: str | None = None
        self._key_s = self._asked_s = -1e9
        self._there = True

    def __enter__(self) -> ScreenView:
        self._tty.enter()
        return self

    def __exit__(
        self, _: type[BaseException] | None, __: BaseException | None, ___: TracebackType | None
    ) -> None:
        self._tty.leave()

    @property
    def remarks(self) -> tuple[str, ...]:
        """What other processes printed where this screen covered it."""
        return self._observer.remarks if self._observer is not None else ()

    @property
    def messages(self) -> tuple[str, ...]:
        """What was said to the operator, the newest last."""
        return tuple(self._messages)

    def __call__(self, shared: SessionMemory) -> None:
        """Look at keyboard and session once."""
        self._listen(shared.status)
        if self._observer is None:
            self._observer = Observer(self._plan, shared)
        now_s, size = self._now(), self._tty.size()
        if now_s - self._shown_s < EVERY_S and size == self._size:
            return
        self._shown_s, self._size = now_s, size
        self._facts = self._observer.look()
        folder = shared.status.folder()
        rig = "virtual rig" if self._plan.virtual else "rig"
        title = f"{rig}, into {folder}" if folder is not None else rig
        lines = screen_lines(self._facts, title, self.messages, self._prompt, *size)
        self._tty.show(painted(lines, size[0]))

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
        text = _SEQUENCE.sub("", typed.decode(errors="replace"))
        if text:
            self._key_s = self._now()
        for key in text:
            if self._prompt is not None:
                self._type(key, status)
            else:
                self._obey(key, status)

    def _type(self, key: str, status: SharedStatus) -> None:
        """Take a key of what is typed after a colon."""
        assert self._prompt is not None
        if key in "\r\n":
            line, self._prompt = self._prompt.strip(), None
            if line:
                self._say(post_typed(line, status))
        elif key == "\x1b":
            self._prompt = None
        elif key in "\x7f\b":
            self._prompt = self._prompt[:-1]
        elif key.isprintable():
            self._prompt += key

    def _obey(self, key: str, status: SharedStatus) -> None:
        """Do what a key orders."""
        key = key.lower()
        if key in " e":
            status.raise_flag(Flag.EMERGENCY_STOP)
            self._say("emergency stop")
            return
        if key == ":":
            self._prompt = ""
            return
        if key in "\r\n":  # who is used to Enter after a letter
            return
        command = KEYS.get(key, Command.PAUSE_NOW)
        if key not in KEYS:
            self._say(f"{key!r} is no order: pausing now")
        if command is Command.RESUME and self._must_ask():
            return
        self._asked_s = -1e9
        try:
            status.post(Order(command))
        except ValueError as error:
            self._say(str(error))
            return
        self._say(f"ordered: {command.name.lower().replace('_', ' ')}")

    def _must_ask(self) -> bool:
        """Whether a resume is to be asked for again: in a pause it sets the arm going."""
        running = self._facts is not None and self._facts.state is State.RUNNING
        if running or self._now() - self._asked_s <= AGAIN_S:
            return False
        self._asked_s = self._now()
        self._say("press r again within 5 s: the arm will move")
        return True

    def _say(self, text: str) -> None:
        self._messages.append(text)
        self._shown_s = -1e9  # with the next frame, which comes at once
