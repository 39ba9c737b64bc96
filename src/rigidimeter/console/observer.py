"""Reads what the processes of a session share, and returns the facts; it holds up nobody."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from rigidimeter.acquisition.processes.ring import ROW, SampleReader
from rigidimeter.acquisition.processes.session_memory import SessionMemory
from rigidimeter.acquisition.processes.status_values import LiveEstimate, LoopStatus, Role
from rigidimeter.console.facts import Facts, facts
from rigidimeter.console.lamps import RecorderState
from rigidimeter.console.recent_samples import RECENT_S, recent_samples
from rigidimeter.console.session_plan import SessionPlan
from rigidimeter.console.session_progress import Progress, progress_after, progress_at_start

MOST_ESTIMATES = 4000
"""Live estimates that are remembered, which come ten times a second: more than five minutes."""


class Observer:
    """Follows one session from its beginning; `look` may be called as often as one likes.

    Parameters
    ----------
    plan : SessionPlan
    shared : SessionMemory
        Only read. Any number of observers may follow a session.
    """

    def __init__(self, plan: SessionPlan, shared: SessionMemory) -> None:
        self._plan, self._shared = plan, shared
        self._samples = SampleReader(shared.samples, max(0, shared.samples.written - 1))
        self._events = 0
        self._rows: NDArray[np.void] = np.empty(0, ROW)
        self._history: deque[LiveEstimate] = deque(maxlen=MOST_ESTIMATES)
        self._loop = LoopStatus()
        self.progress: Progress = progress_at_start(plan.epochs)

    def look(self) -> Facts:
        """Return the facts now."""
        self._read_events()
        rate_hz = self._plan.settings.rig.tick_rate_hz
        rows, _ = self._samples.read(most=round(RECENT_S * rate_hz))
        rows = np.concatenate((self._rows, rows))
        if rows.size:
            rows = rows[rows["time_s"] > rows["time_s"][-1] - RECENT_S]
        self._rows = rows
        live = self._shared.status.live()
        if live is not None and (not self._history or live.tick != self._history[-1].tick):
            if self._history and live.epoch != self._history[-1].epoch:
                self._history.clear()
            self._history.append(live)
        self._loop = self._shared.status.loop() or self._loop
        return facts(
            self._plan,
            self.progress,
            self._loop,
            self._history,
            recent_samples(rows),
            self._recorder(),
        )

    def _recorder(self) -> RecorderState:
        status, samples = self._shared.status, self._shared.samples
        recorded = samples.recorded
        return RecorderState(
            status.condition(Role.RECORDER),
            status.note(Role.RECORDER),
            status.age_s(Role.RECORDER),
            samples.written - recorded,
            max(0, recorded - status.synced_samples),
            status.free_bytes,
        )

    def _read_events(self) -> None:
        """Take what was said since the last call; an event that was written over is passed over."""
        events = self._shared.events
        written = events.written
        first = max(self._events, written - events.capacity // 2)
        for number in range(first, written):
            self.progress = progress_after(self.progress, events.get(number).facts)
        self._events = written
