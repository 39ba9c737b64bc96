"""Reads what the processes of a session share, and returns the facts; it holds up nobody."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from rigidimeter.rig.acquisition.processes import (
    ROW,
    LiveEstimate,
    LoopStatus,
    Role,
    SampleReader,
    SessionMemory,
)
from rigidimeter.rig.console.emg_state import EmgState
from rigidimeter.rig.console.indicators import RECENT_S, RecorderState, recent_samples
from rigidimeter.rig.console.live_parameters import caution, settling_s
from rigidimeter.rig.console.session_facts import Facts, facts
from rigidimeter.rig.console.session_progress import (
    Progress,
    SessionPlan,
    progress_after,
    progress_at_start,
)

TICKS_SHOW = 5.0
"""Ticks at least so many times as fast as the drive show an inertia as it is, to a tenth."""

MAX_ESTIMATES = 4000
"""Live estimates that are remembered, which come ten times a second: more than five minutes."""


class Observer:
    """Follows one session from its beginning; `facts_now` may be called as often as one likes.

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
        self._history: deque[LiveEstimate] = deque(maxlen=MAX_ESTIMATES)
        self._loop = LoopStatus()
        self._perturbed: dict[int, LiveEstimate] = {}
        self._cautions: dict[int, str] = {}
        self.progress: Progress = progress_at_start(plan.epochs)

    def facts_now(self) -> Facts:
        """Return the facts now."""
        self._read_events()
        rate_hz = self._plan.settings.rig.tick_rate_hz
        rows, _ = self._samples.read(max_rows=round(RECENT_S * rate_hz))
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
            self._caution(),
            EmgState.of(self._shared.status) if self._plan.settings.emg.channels else None,
        )

    @property
    def cautions(self) -> tuple[str, ...]:
        """What is wrong with the torque of each epoch that has ended."""
        return tuple(filter(None, self._cautions.values()))

    def _caution(self) -> str:
        """Return what is wrong with the torque of the last epoch that ended, by its estimate."""
        settings, now = self._plan.settings, self._history[-1] if self._history else LiveEstimate()
        ended = [one for one in self.progress.ended if one.number == now.epoch]
        long_enough = now.time_s - now.since_s >= settling_s(settings.online)
        if ended and ended[-1].task == "prbs" and long_enough:
            self._cautions.pop(now.epoch, None)  # one that has a caution is no measure for others
            before = [self._perturbed[number] for number, why in self._cautions.items() if not why]
            rig, margins = settings.rig, settings.margins
            inertia = settings.subject[ended[-1].condition].inertia_kg_m2
            arms = margins.joint_factor_low * inertia, margins.joint_factor_high * inertia
            shown = rig.tick_rate_hz >= TICKS_SHOW * rig.drive_bandwidth_hz
            alone = self.progress.alone_kg_m2 if shown else 0.0
            words = caution(now, before, arms, alone)
            self._perturbed[now.epoch] = now
            self._cautions[now.epoch] = f"epoch {ended[-1].place}: {words}" if words else ""
        return next(reversed(self._cautions.values()), "")

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
