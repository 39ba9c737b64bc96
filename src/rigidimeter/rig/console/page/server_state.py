"""What the server of the page and the session beside it know of each other, and of the operator.

The session is seen through by the program's first thread, as in a terminal; the server has a thread
of its own. They share this state. Each attribute is written by one of the two.

Whether an operator is there, and at which of several pages, is their `Presence`. The page that has
control beats about twenty times a second, by a script of its own, so a page that is closed, frozen,
or cut off is silent. The time of its last beat is the console's heartbeat in the shared status,
which the loop looks at every tick: the server cannot beat for a page.

There is one exception. A page that says that it goes away, because it is reloaded, closed or no
longer in front, has its session paused: the arm is held still. As long as the loop shows that the
joint stands still, by its angle and by what was commanded, and that only an order sets it going,
and for `AWAY_S` at most, the page may come back. Then its silence counts again, and the loop ends
the session. Only the same tab may come back meanwhile; any other page can only look.
"""

from __future__ import annotations

import queue
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings
from rigidimeter.core.study_files import PLAN_FILE
from rigidimeter.rig.acquisition.processes import Flag, SessionMemory
from rigidimeter.rig.console import SessionPlan

AWAY_S = 20.0
"""For so long a page that said that it goes may be away from a paused session."""

SETTLES_S = 0.3
"""So long after it said so the loop may take to show that the arm stands still."""

SILENT_S = 0.45
"""A page that was silent for so long is lost: with the ramp to rest it is less than 0.5 s."""

_NS = 1_000_000_000


@dataclass
class Presence:
    """The page in control; each attribute is written by the server's thread alone.

    Attributes
    ----------
    page : str
        The secret of the page that has control; empty if none has.
    tab : str
        The browser's tab in which it was last, which may take control again after a reload.
    beat_ns : int
        When it was last heard of, on CLOCK_MONOTONIC.
    left_ns : int
        When it said that it goes; 0 while it is there.
    """

    page: str = ""
    tab: str = ""
    beat_ns: int = 0
    left_ns: int = 0

    def arrive(self, page: str, tab: str, now_ns: int, *, session: bool) -> bool:
        """Let a page in; return whether it has control.

        Parameters
        ----------
        page, tab : str
            Secrets of the page and of the tab.
        now_ns : int
        session : bool
            Whether a session runs: then only the tab that had control takes it again.
        """
        comes_back = tab == self.tab and (not self.page or self.left_ns > 0)
        free = self.lost(now_ns) or (not self.page and not session)
        if comes_back or free:
            self.page, self.tab = page, tab
            self.beat_ns, self.left_ns = now_ns, 0
        return self.page == page

    def has_control(self, page: str) -> bool:
        """Whether a page may act."""
        return bool(page) and page == self.page

    def beat(self, page: str, now_ns: int) -> None:
        """Take a beat of a page; of one that looks, nothing."""
        if self.has_control(page):
            self.beat_ns, self.left_ns = now_ns, 0

    def leave(self, page: str, now_ns: int) -> bool:
        """Take the word of a page that it goes; return whether it had control."""
        if not self.has_control(page):
            return False
        self.left_ns = now_ns
        return True

    def gone(self, page: str) -> None:
        """Take note that the connection to a page is closed."""
        if self.has_control(page):
            self.page = ""

    def seen_ns(self, now_ns: int, *, still: bool, began_ns: int = 0) -> int:
        """Return the heartbeat of the operator.

        Parameters
        ----------
        now_ns : int
        still : bool
            Whether the loop shows that the arm is held still.
        began_ns : int
            When the loop showed its first tick, if it has: the arm may settle from then on.
        """
        if self.left_ns:
            settles = now_ns - max(self.left_ns, began_ns) < SETTLES_S * _NS
            if now_ns - self.left_ns < AWAY_S * _NS and (still or settles):
                return now_ns
        return self.beat_ns

    def lost(self, now_ns: int) -> bool:
        """Whether the page that had control may no longer come back."""
        until_ns = self.left_ns + AWAY_S * _NS if self.left_ns else self.beat_ns + SILENT_S * _NS
        return now_ns > until_ns


@dataclass(frozen=True)
class StartRequest:
    """What the operator wants to run: a new session, or the rest of one.

    Attributes
    ----------
    folder : str
        Name of the new session's folder.
    settings : Settings or None
        None where a session is continued.
    about : dict
        What was said of subject, operator, condition and stimulation, and whether the page names
        conditions by codes alone (`blinded`).
    resume : str
        Name of the folder of the session to be continued; empty for none.
    epoch : int or None
        Of that session, the one epoch to be run again; None for all that are left.
    left : tuple of int
        The planned epochs that are left, by number; empty for those that this session lacks.
    source : Path or None
        The file of the settings, where it is not that of the form.
    begin_anyway : str
        Why a session of a plan is continued before its wait is over.
    """

    folder: str
    settings: Settings | None = None
    about: Mapping[str, Any] = field(default_factory=dict)
    resume: str = ""
    epoch: int | None = None
    left: tuple[int, ...] = ()
    source: Path | None = None
    begin_anyway: str = ""


@dataclass(frozen=True)
class RunningSession:
    """A session as the server sees it: its names in shared memory, its plan, its folder."""

    number: int
    names: tuple[str, str, str]
    plan: SessionPlan
    folder: Path


@dataclass(frozen=True)
class FinishedSession:
    """How the last session ended, and what is said of it."""

    number: int
    folder: Path
    outcome: str
    sentences: tuple[str, ...]


@dataclass(frozen=True)
class Place:
    """Where this console works: rig, folder of its sessions, settings that a form begins with.

    `clock_speed` is that of the clock of planned waits: above 1 in rehearsals alone.
    """

    root: Path
    settings: Settings
    settings_name: str
    rig: Path | None = None
    one_session: str = ""
    settings_path: Path | None = None
    clock_speed: float = 1.0

    @property
    def planned(self) -> bool:
        """Whether its sessions are those of a plan."""
        return not self.one_session and (self.root / PLAN_FILE).exists()

    @property
    def protocols(self) -> Path:
        """The folder whose protocol files can be chosen."""
        return self.settings_path.parent if self.settings_path is not None else Path.cwd()


class ServerState:
    """Requests to the session's thread, and the session to the server's.

    Parameters
    ----------
    place : Place
    now_ns : callable
        CLOCK_MONOTONIC in nanoseconds.
    """

    def __init__(self, place: Place, now_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self.place = place
        self.presence = Presence()
        self.running: RunningSession | None = None
        self.finished: FinishedSession | None = None
        self.starting = ""
        self.checking = ""
        self.check_stopped = False
        self.stop_pressed = False
        self.ending = False
        self._now_ns = now_ns
        self._requests: queue.SimpleQueue[StartRequest] = queue.SimpleQueue()
        self._still, self._began_ns = True, 0
        self._count = 0

    # For the server

    @property
    def in_session(self) -> bool:
        """Whether a session runs or is about to."""
        return bool(self.starting) or self.running is not None

    @property
    def busy(self) -> bool:
        """Whether something has the rig: a session, or a check of it."""
        return self.in_session or bool(self.checking)

    def begin_check(self, what: str) -> bool:
        """Take the rig for a check; return False if something else has it."""
        if self.busy:
            return False
        self.checking, self.check_stopped = what, False
        return True

    def stop_check(self) -> None:
        """Stop the check of the rig, if one runs."""
        self.check_stopped = True

    def press_stop(self) -> bool:
        """Take the emergency stop, whoever presses it; return whether there is what it stops.

        It ends a check of the rig. A session sees it as its process looks next, or as it starts.
        """
        self.stop_check()
        self.stop_pressed = self.in_session
        return self.busy

    def end_check(self) -> None:
        """Give the rig back."""
        self.checking = ""

    def ask(self, request: StartRequest) -> bool:
        """Ask for a session; return False if something else has the rig."""
        if self.busy:
            return False
        self.starting, self.stop_pressed = request.folder, False
        self._requests.put(request)
        return True

    # For the session's thread

    def next_request(self, listen: Callable[[], None]) -> StartRequest:
        """Wait for the operator, and listen meanwhile; a signal ends the wait."""
        while True:
            listen()
            try:
                return self._requests.get(timeout=0.05)
            except queue.Empty:
                continue

    def refuse_stopped(self) -> None:
        """Refuse a session whose start the emergency stop has ended.

        Raises
        ------
        UserError
        """
        if self.stop_pressed:
            raise UserError("the emergency stop was pressed while the session started")

    def console(self, plan: SessionPlan, folder: Path) -> Callable[[SessionMemory], None]:
        """Return what `supervise` calls about 20 times a second."""
        self._count += 1
        self._still, self._began_ns = True, 0

        def follow(shared: SessionMemory) -> None:
            if self.stop_pressed:
                shared.status.raise_flag(Flag.EMERGENCY_STOP)
            loop = shared.status.loop()
            begun = loop is not None and loop.tick >= 0
            if begun and not self._began_ns:
                self._began_ns = self._now_ns()
            # Before its first tick the loop moves nothing.
            self._still = loop is not None and (not begun or loop.still != 0)
            if self.running is None:
                self.running = RunningSession(self._count, shared.names, plan, folder)

        return follow

    def operator_seen_ns(self) -> int:
        """Return the operator's heartbeat: when the page in control was last heard of."""
        return self.presence.seen_ns(self._now_ns(), still=self._still, began_ns=self._began_ns)

    def over(self, folder: Path, outcome: str, sentences: tuple[str, ...]) -> None:
        """Say how the session ended."""
        self.finished = FinishedSession(self._count, folder, outcome, sentences)
        self.running = None
        self.stop_pressed = False
        self.starting = ""
