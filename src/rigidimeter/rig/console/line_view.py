"""A line of status a second, and orders typed as words: where the output is no terminal.

It is called about twenty times a second by the process whose silence stops the loop, so it never
waits: not for a key, and not for a terminal that takes no output.
"""

from __future__ import annotations

import math
import os
import select
import time
from collections.abc import Callable
from typing import IO

from rigidimeter.rig.acquisition import Command, Order
from rigidimeter.rig.acquisition.processes import (
    Flag,
    ProcessCondition,
    Role,
    SessionMemory,
    SharedStatus,
)
from rigidimeter.rig.console.alarms import Alarm, Alarms
from rigidimeter.rig.console.indicators import Level
from rigidimeter.rig.console.observer import Observer
from rigidimeter.rig.console.orders import order_of, save_to
from rigidimeter.rig.console.session_facts import Facts
from rigidimeter.rig.console.session_progress import SessionPlan

HELP = (
    "p pause after this epoch, n pause now, r resume, s stop after this epoch, a abort, "
    "h halt (power off), e emergency stop, c silence cautions, set NAME VALUE, save to FOLDER (if "
    "the disk is full); each with Enter"
)
BELL = "\a"
SILENCE = "c"
"""What is typed to have no bell for cautions in this session, and again to have it."""


def status_line(facts: Facts) -> str:
    """Return what the operator reads, in one line, what matters most first."""
    limits = next(indicator for indicator in facts.indicators if indicator.name == "limits")
    watch = [indicator for indicator in facts.indicators if indicator.level >= Level.WATCH]
    parts = [
        f"{facts.time_s:8.1f} s",
        facts.epoch.text if facts.epoch is not None else facts.state_words,
    ]
    if facts.stop_words:
        parts.append(facts.stop_words)
    if watch:
        parts.append(" ".join(f"{indicator.level.sign} {indicator.name}" for indicator in watch))
    if limits.level > Level.UNKNOWN:
        parts.append(limits.words)
    if facts.countdown_words:
        parts.append(f"{facts.countdown_words}: {facts.countdown_s:.0f} s left")
    parts += [f"{facts.angle_deg:+6.1f} deg", f"{facts.torque_nm:+6.2f} N·m"]
    if math.isfinite(facts.drive_torque_nm):
        parts[-1] += f" (drive {facts.drive_torque_nm:+.2f})"
    known = [value.text for value in facts.live if value.settled]
    if known:
        parts.append(f"{facts.live_words}, live: {', '.join(known)}")
    parts += [
        f"{indicator.name}: {indicator.words}" for indicator in watch if indicator is not limits
    ]
    return " | ".join(parts)


class LineView:
    """Shows the status and posts orders.

    Parameters
    ----------
    keyboard : file or None
        Lines are read from it as they come; None for nobody.
    screen : file or None
        None where nothing is shown.
    plan : SessionPlan
    now : callable
        Monotonic seconds.
    """

    every_s = 1.0

    def __init__(
        self,
        keyboard: IO[str] | None,
        screen: IO[str] | None,
        plan: SessionPlan,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._keyboard, self._screen, self._now = keyboard, screen, now
        self._plan = plan
        self._observer: Observer | None = None
        self._shown_s = -math.inf
        self._typed = b""
        self._announced: tuple[str, ...] = ()
        self._alarms, self._silent = Alarms(now), False
        if keyboard is not None:
            self._say(HELP)

    def __call__(self, shared: SessionMemory) -> None:
        """Look at keyboard and session once."""
        status = shared.status
        self._listen(status)
        if self._observer is None:
            self._observer = Observer(self._plan, shared)
        facts = self._observer.facts_now()
        notes = [
            status.note(role)
            for role in (Role.RECORDER, Role.ESTIMATOR)
            if status.condition(role) is ProcessCondition.TROUBLE
        ]
        words = (facts.stop_words, *self._observer.cautions, facts.emg_words, *notes)
        texts = tuple(filter(None, words))
        for text in texts:
            if text not in self._announced:
                self._say(text)
        self._announced = texts
        alarm = self._alarms.heard(facts, self._observer.progress.outcome, self._observer.cautions)
        if alarm is Alarm.STOP or (alarm is Alarm.CAUTION and not self._silent):
            self._ring()
        if self._now() - self._shown_s >= self.every_s and self._show(facts):
            self._shown_s = self._now()

    def _listen(self, status: SharedStatus) -> None:
        if self._keyboard is None:
            return
        descriptor = self._keyboard.fileno()
        while select.select([descriptor], [], [], 0.0)[0]:
            read = os.read(descriptor, 1024)
            if not read:  # nobody can type any more, so nobody can stop the rig from here
                self._keyboard = None
                status.raise_flag(Flag.END_ASKED)
                self._say("the keyboard is gone: the rig stops")
                break  # but what was typed before it went still counts
            self._typed += read
        *lines, self._typed = self._typed.split(b"\n")
        for line in lines:
            self._obey(line.decode(errors="replace").strip(), status)

    def _obey(self, text: str, status: SharedStatus) -> None:
        if text[:1].lower() == "e":
            self._stop(status)
            return
        if text.lower() == SILENCE:
            self._silence()
            return
        if text.lower().startswith("save to "):
            self._say(save_to(text[len("save to ") :].strip(), status))
            return
        order = order_of(text)
        if order is None and text and not text.lower().startswith("set"):
            # Whoever types in a hurry means that something is wrong.
            order = Order(Command.PAUSE_NOW)
            self._say(f"{text!r} is no order: pausing now")
        if order is None:
            self._say(HELP)
            return
        self._post(order, status)

    def _stop(self, status: SharedStatus) -> None:
        status.raise_flag(Flag.EMERGENCY_STOP)
        self._say("emergency stop")

    def _silence(self) -> None:
        """Let cautions be heard no more, or again; stops always are."""
        self._silent = not self._silent
        self._say("cautions are silent in this session" if self._silent else "cautions are heard")

    def _post(self, order: Order, status: SharedStatus) -> None:
        try:
            status.post(order)
        except ValueError as error:
            self._say(str(error))
            return
        self._say(f"ordered: {order.command.name.lower().replace('_', ' ')}")

    def _line(self, facts: Facts) -> str:
        return f"cautions silent | {status_line(facts)}" if self._silent else status_line(facts)

    def _show(self, facts: Facts) -> bool:
        """Show the status; return whether there is one."""
        if math.isfinite(facts.angle_deg):
            self._say(self._line(facts))
        return math.isfinite(facts.angle_deg)

    def _ring(self) -> None:
        """Ring the bell of a terminal; a file has none."""
        if self._screen is not None and self._screen.isatty():
            self._write(BELL)

    def _say(self, text: str) -> None:
        self._write(f"{text}\n")

    def _write(self, text: str) -> None:
        if self._screen is not None and select.select([], [self._screen.fileno()], [], 0.0)[1]:
            self._screen.write(text)
            self._screen.flush()
