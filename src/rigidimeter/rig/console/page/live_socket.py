"""The socket between the server and each open page: beats and orders in, samples and state out.

What a page says is acted upon as it comes. What it is told waits in a short queue of its own: a
page that is slow misses samples, and nothing waits for it.
"""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect

from rigidimeter.core.files import json_line
from rigidimeter.rig.acquisition import Command, Order
from rigidimeter.rig.acquisition.processes import Flag, ProcessCondition, Role, SessionMemory
from rigidimeter.rig.console import (
    Alarm,
    Alarms,
    BandTorque,
    EnvelopeReader,
    Observer,
    TraceReader,
    save_to,
)
from rigidimeter.rig.console.page.page_messages import (
    PageMessage,
    RefusedMessage,
    is_known,
    parse_message,
    points,
    session_state,
)
from rigidimeter.rig.console.page.server_state import RunningSession, ServerState
from rigidimeter.rig.console.page.sessions_found import off_scale

FRAME_S = 1 / 30
"""How often samples are sent."""

POINTS_PER_S = 125.0
"""Pieces of time in a second; of each the page draws two points."""

STATE_FRAMES = 3
"""Every so many frames the state is sent."""

MAX_WAITING = 30
"""Frames that wait for a slow page; older ones are dropped."""

MAX_PAGES = 8
MAX_KNOWN = 1000
"""Pages that were sent and may open a socket; the oldest are forgotten."""

MAX_NOTES = 20
"""Notes that wait for the loop to take them."""

_HELLO_S = 5.0
_NOTE = '{"kind":"note"'
"""How the page begins a note. Each has one answer while a session runs: whether it was taken."""


@dataclass(eq=False)
class OpenPage:
    """A page with its socket, and what waits to be sent to it."""

    socket: WebSocket
    secret: str
    waiting: deque[bytes | str] = field(default_factory=lambda: deque(maxlen=MAX_WAITING))
    wake: asyncio.Event = field(default_factory=asyncio.Event)

    def send(self, frame: bytes | str) -> None:
        """Send a frame soon; of those that wait too long the oldest is dropped."""
        self.waiting.append(frame)
        self.wake.set()


class _Attached:
    """A running session as the server's thread has it."""

    def __init__(self, running: RunningSession) -> None:
        self.running = running
        self.memory = SessionMemory.attach(running.names)
        settings = running.plan.settings
        rate_hz = settings.rig.tick_rate_hz
        self._band = BandTorque(settings.online, rate_hz)
        self._traces = TraceReader(self.memory.samples, rate_hz, POINTS_PER_S, band=self._band)
        self._known_since_s = math.nan
        emg = settings.emg
        self._muscles = emg.muscles if emg.channels else []
        self._envelope = EnvelopeReader(self.memory.status, len(self._muscles))
        self._observer = Observer(running.plan, self.memory)
        self._alarms = Alarms()
        self.heard, self.stopped = Alarm.NONE, False
        self.notes: deque[str] = deque()

    def samples(self) -> bytes:
        traces = self._traces.read()
        return points(traces, modelled=self._band.since_s == self._known_since_s)

    def state(self) -> dict[str, Any]:
        live = self.memory.status.live()
        facts = self._observer.facts_now()
        # Of the epoch in which J, B and K are known, and of no other.
        self._known_since_s = live.since_s if live is not None and is_known(facts) else math.nan
        progress = self._observer.progress
        self.heard = self._alarms.heard(facts, progress.outcome, self._observer.cautions)
        self.stopped = self._alarms.stopped
        full = self.memory.status.condition(Role.RECORDER) is ProcessCondition.TROUBLE
        state = session_state(facts, progress)
        if self._muscles:
            points = self._envelope.read().round(3).tolist()
            state["emg"] = {"muscles": self._muscles, "points": points}
        return state | {
            "number": self.running.number,
            "save": full,
            "raters": list(self.running.plan.raters),
        }

    def post_notes(self) -> None:
        while self.notes and self.memory.status.post_note(self.notes[0]) is not None:
            self.notes.popleft()


class LiveSockets:
    """All open pages.

    Parameters
    ----------
    state : ServerState
    """

    def __init__(self, state: ServerState) -> None:
        self._state = state
        self._pages: set[OpenPage] = set()
        self._attached: _Attached | None = None
        self._known: deque[str] = deque(maxlen=MAX_KNOWN)
        self._alarms = {"stop": 0, "caution": 0}
        self._end_heard = False
        self._ended = state.finished

    def admit(self, secret: str) -> None:
        """Let a page come that was just sent; the secret is its own."""
        self._known.append(secret)

    async def serve(self, socket: WebSocket) -> None:
        """Serve one page until it is gone."""
        await socket.accept()
        try:
            hello = parse_message(await asyncio.wait_for(socket.receive_text(), _HELLO_S))
        except (RefusedMessage, TimeoutError, WebSocketDisconnect, KeyError):
            await _close(socket)
            return
        if hello.kind != "hello" or hello.page not in self._known or len(self._pages) >= MAX_PAGES:
            await _close(socket)
            return
        page = OpenPage(socket, hello.page)
        presence, now_ns = self._state.presence, time.monotonic_ns()
        presence.arrive(page.secret, hello.tab, now_ns, session=self._state.busy)
        self._pages.add(page)
        sender = asyncio.create_task(_send(page))
        try:
            while True:
                self._hear(page, await socket.receive_text())
        except (WebSocketDisconnect, KeyError):  # it is gone, or sent bytes
            pass
        finally:
            self._pages.discard(page)
            presence.gone(page.secret)
            sender.cancel()

    def _hear(self, page: OpenPage, text: str) -> None:
        try:
            self._obey(page, parse_message(text))
        except (RefusedMessage, ValueError) as error:
            is_note = text.startswith(_NOTE)
            page.send(_refused(str(error)) if is_note else json.dumps({"say": str(error)}))

    def _obey(self, page: OpenPage, message: PageMessage) -> None:
        """Do what a page in control says; a page that watches may press the emergency stop."""
        presence, now_ns = self._state.presence, time.monotonic_ns()
        if message.kind == "beat":
            presence.beat(page.secret, now_ns)
            if self._attached is not None and presence.has_control(page.secret):
                # At once, and not when the session's thread looks next.
                self._attached.memory.status.beat(Role.CONSOLE, now_ns)
            return
        if message.kind == "hello":
            return
        attached = self._attached
        if message.kind == "emergency":  # of any page: a stop must work for all who see it
            self._state.press_stop()
            if attached is not None:
                attached.memory.status.raise_flag(Flag.EMERGENCY_STOP)
            return
        if not presence.has_control(page.secret):
            why = "this page watches: another one has control"
            page.send(_refused(why) if message.kind == "note" else json.dumps({"say": why}))
            return
        if message.kind == "leave":
            presence.leave(page.secret, now_ns)
            self._state.stop_check()
        if attached is None:
            return
        status = attached.memory.status
        if message.kind == "leave":
            status.post(Order(Command.PAUSE_NOW))
        elif message.kind == "order":
            status.post(Order(message.command))
        elif message.kind == "save":
            page.send(json.dumps({"say": save_to(message.folder, status)}))
        elif message.note is not None:
            if len(attached.notes) < MAX_NOTES:
                attached.notes.append(json_line(message.note).decode())
                attached.post_notes()
                score = message.note.get("score")
                warning = "" if score is None else off_scale(self._state.place, score)
                page.send(json.dumps({"noted": True} | ({"say": warning} if warning else {})))
            else:
                page.send(_refused("the loop takes no notes now; send it again later"))

    async def pump(self) -> None:
        """Send samples and state to every page, for ever."""
        count, due_s = 0, time.monotonic()
        while True:
            due_s = max(due_s + FRAME_S, time.monotonic())
            await asyncio.sleep(due_s - time.monotonic())
            count += 1
            self._follow()
            attached = self._attached
            if attached is not None:
                attached.post_notes()
                samples = attached.samples()
                if samples:
                    for page in self._pages:
                        page.send(samples)
            if count % STATE_FRAMES == 0:
                self._send_state()

    def _follow(self) -> None:
        """Attach to a session that began, let go of one that ended."""
        running, attached = self._state.running, self._attached
        if attached is not None and attached.running is not running:
            attached.memory.leave()
            self._attached = None
        if running is not None and self._attached is None:
            with suppress(FileNotFoundError):  # it ended meanwhile
                self._attached = _Attached(running)

    def _send_state(self) -> None:
        state, attached = self._state, self._attached
        shown: dict[str, Any] = {
            "starting": state.starting,
            "checking": state.checking,
            "session": None,
            "finished": None,
            "alarms": self._alarms,
        }
        if attached is not None:
            shown["session"] = attached.state()
            self._count(attached.heard)
            self._end_heard = attached.stopped
        elif state.finished is not None and not state.in_session:
            finished = state.finished
            shown["finished"] = {
                "number": finished.number,
                "folder": finished.folder.name,
                "outcome": finished.outcome,
                "sentences": list(finished.sentences),
            }
            if finished is not self._ended:
                self._ended = finished
                if finished.outcome != "success" and not self._end_heard:
                    self._count(Alarm.STOP)
                self._end_heard = False
        for page in self._pages:
            control = state.presence.has_control(page.secret)
            page.send(json.dumps({"state": shown, "control": control}))

    def _count(self, heard: Alarm) -> None:
        """Count what a page is to have heard."""
        self._alarms["stop"] += heard is Alarm.STOP
        self._alarms["caution"] += heard is Alarm.CAUTION


def _refused(why: str) -> str:
    return json.dumps({"noted": False, "say": why})


async def _send(page: OpenPage) -> None:
    while True:
        await page.wake.wait()
        page.wake.clear()
        while page.waiting:
            frame = page.waiting.popleft()
            with suppress(WebSocketDisconnect, RuntimeError):
                if isinstance(frame, bytes):
                    await page.socket.send_bytes(frame)
                else:
                    await page.socket.send_text(frame)


async def _close(socket: WebSocket) -> None:
    with suppress(WebSocketDisconnect, RuntimeError):
        await socket.close(1008)
