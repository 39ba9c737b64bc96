"""The loop's side of the shared memory: where it writes, and what it looks at every tick."""

from __future__ import annotations

import math
import time
from functools import partial
from os import getppid
from time import monotonic_ns
from typing import Any

from rigidimeter.core.records import LATE_TICK
from rigidimeter.core.session import Ending, Sample
from rigidimeter.rig.acquisition import Command, ControlLoop, Order, Run, State
from rigidimeter.rig.acquisition.processes.session_memory import SessionMemory
from rigidimeter.rig.acquisition.processes.shared_status import Nanoseconds
from rigidimeter.rig.acquisition.processes.status_values import (
    PAUSE_NEXT,
    STOP_NEXT,
    LoopStatus,
    ProcessCondition,
    Role,
)
from rigidimeter.rig.guard import Cause

CLOCK_BOOTTIME = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
"""Goes on while the computer is suspended, where the system has such a clock."""

SHOWN_S = 0.02
"""How often the loop shows itself."""

_NONE = int(Cause.NONE)
_EMERGENCY_STOP, _SIGNAL = int(Cause.EMERGENCY_STOP), int(Cause.SIGNAL)
_STALLED = int(Cause.STALLED)
_CONSOLE_LOST, _RECORDER_LOST = int(Cause.CONSOLE_LOST), int(Cause.RECORDER_LOST)
_RECORD_OVERFLOW = int(Cause.RECORD_OVERFLOW)


class RingSink:
    """Takes samples and events as a `SessionWriter` does, never waits, and touches no file.

    Parameters
    ----------
    shared : SessionMemory
        The loop's heart beats there with every sample, and its status is shown now and then.
    tick_rate_hz : float
        Late and missed ticks are counted by it.
    """

    def __init__(self, shared: SessionMemory, tick_rate_hz: float) -> None:
        self._samples, self._events, self._status = shared.samples, shared.events, shared.status
        self._push = shared.samples.push
        self._words = shared.status.memory.words
        self._heart = shared.status.places()[-1]
        self._rate_hz = tick_rate_hz
        self._late = self._missed = 0
        self._state, self._pending = State.IDLE, 0
        self._loop: ControlLoop | None = None
        self._begun = False
        self._show_s = -math.inf
        self.closed = False
        self.last_time_s = 0.0

    def sample(self, sample: Sample) -> None:
        """Record one tick."""
        self._push(sample)
        self.last_time_s = time_s = sample.time_s
        self._words[self._heart] = monotonic_ns()
        late_ticks = sample.lateness_s * self._rate_hz
        if late_ticks > LATE_TICK:
            self._late += 1
            self._missed += int(late_ticks)
        if time_s >= self._show_s:
            self._show_s = time_s + SHOWN_S
            self._show(sample)

    def _show(self, sample: Sample) -> None:
        if not self._begun:
            self._begun = True
            self._status.set_condition(Role.LOOP, ProcessCondition.RUNNING)
        loop = self._loop
        still = loop is not None and self._state is State.PAUSED and loop.still
        self._status.show_loop(
            LoopStatus(
                state=self._state,
                tick=sample.tick,
                epoch=sample.epoch,
                cause=sample.cause,
                late_ticks=self._late,
                missed_ticks=self._missed,
                pending=self._pending,
                time_s=sample.time_s,
                angle_rad=sample.angle_rad,
                velocity_rad_s=sample.velocity_rad_s,
                torque_nm=sample.torque_nm,
                perturbation_nm=sample.perturbation_nm,
                velocity_command_rad_s=sample.velocity_command_rad_s,
                until_s=math.nan if loop is None else loop.until_tick / loop.rate_hz,
                energy_j=math.nan if loop is None else loop.guard.energy_j,
                phase=0 if loop is None else loop.phase,
                still=int(still),
            )
        )

    def watch(self, loop: ControlLoop) -> None:
        """Show of this loop, from now on, what no sample says."""
        self._loop = loop

    def state_changed(self, run: Run) -> None:
        """Take the state of the run, to be shown with the next sample."""
        self._state = run.state
        self._pending = PAUSE_NEXT * run.pause_next + STOP_NEXT * run.stop_next
        self._show_s = -math.inf
        # A session that ends still moves the arm until it is at rest, unless its power is cut now.
        if run.state in (State.STOPPING, State.FAULTED):
            cut = run.state is State.FAULTED and run.at_once
            if cut or self._loop is None or self._loop.at_rest:
                self._stopping()

    def event(self, kind: str, **facts: Any) -> None:
        """Record something that happened.

        Raises
        ------
        ValueError
            If it is too long for a slot of the ring, or not what JSON can say.
        """
        self._events.push(self._samples.written, {"event": kind, **facts})

    def _stopping(self) -> None:
        """Say that no more ticks are due: what follows may take longer than a tick may."""
        self._status.beat(Role.LOOP)
        self._status.set_condition(Role.LOOP, ProcessCondition.STOPPING)

    def close(self, time_s: float, outcome: Ending, reason: str) -> None:
        """Close the session with its outcome; only the first time counts."""
        if self.closed:
            return
        self.closed = True
        self._stopping()
        self.event("session_ended", time_s=time_s, outcome=outcome, reason=reason)


boot_ns: Nanoseconds = partial(time.clock_gettime_ns, CLOCK_BOOTTIME)


class SharedSupervision:
    """Answers the loop every tick: is there a cause to stop, is there an order.

    CLOCK_MONOTONIC stands still while the computer is suspended, so no heartbeat ages and no tick
    is late afterwards. CLOCK_BOOTTIME goes on: what it is ahead grows by the time of the suspension
    and by nothing else. A loop that was away so long has stood still, whatever its own clock says.

    Parameters
    ----------
    shared : SessionMemory
    console_lost_s : float
        An older heartbeat of the console is a cause to stop: a dead-man's switch.
    recorder_lost_s : float
        The same for the recorder. It may be long: what is not in the file stays in the ring.
    max_lag : int
        More samples than that waiting for the recorder are a cause to stop: it lives, but the disk
        takes nothing, or too little. Half of what the ring holds if not given.
    stall_s : float
        A suspension of more than that is a cause to stop, and stays one.
    attended : bool
        Whether an operator is there who can go on after a hold.
    console_pid : int
        The console, where it is the parent of this process: one that was killed is lost at once,
        before its heartbeat is old. 0 where it is not.
    now_ns, boot_ns : callable
        CLOCK_MONOTONIC and CLOCK_BOOTTIME in nanoseconds.
    """

    def __init__(
        self,
        shared: SessionMemory,
        *,
        console_lost_s: float = 0.5,
        recorder_lost_s: float = 2.0,
        max_lag: int | None = None,
        stall_s: float = 0.1,
        attended: bool = True,
        console_pid: int = 0,
        now_ns: Nanoseconds = time.monotonic_ns,
        boot_ns: Nanoseconds = boot_ns,
    ) -> None:
        self.attended = attended
        self.measured = math.nan
        self._console_pid = console_pid
        self._aborted = False
        self._status, self._samples = shared.status, shared.samples
        self._console_ns = round(1e9 * console_lost_s)
        self._recorder_ns = round(1e9 * recorder_lost_s)
        self._max_lag = shared.samples.capacity // 2 if max_lag is None else max_lag
        self._now_ns, self._boot_ns = now_ns, boot_ns
        # The clock that goes on is read first: what goes by between the two readings makes the
        # difference smaller, and so never looks like a suspension.
        awake_ns = max(boot_ns() - now_ns() for _ in range(3))
        self._suspended_ns = awake_ns + round(1e9 * stall_s)
        self._stall_s = stall_s
        self._words = shared.status.memory.words
        self._places = shared.status.places()

    def cause(self, now_s: float) -> int:
        """Return a `rig.guard.Cause` to stop for, 0 if there is none."""
        words = self._words
        emergency, ended, _, console, recorder, _ = self._places
        if words[emergency]:
            return _EMERGENCY_STOP
        boot_ns = self._boot_ns()
        now_ns = self._now_ns()
        if boot_ns - now_ns > self._suspended_ns:
            self.measured = 1e-9 * (boot_ns - now_ns - self._suspended_ns) + self._stall_s
            return _STALLED
        if words[ended]:
            return _SIGNAL
        if now_ns - words[console] > self._console_ns:
            self.measured = 1e-9 * (now_ns - words[console])
            return _CONSOLE_LOST
        if self._console_pid and getppid() != self._console_pid:
            self.measured = math.nan  # it was killed: its silence is short
            return _CONSOLE_LOST
        if now_ns - words[recorder] > self._recorder_ns:
            self.measured = 1e-9 * (now_ns - words[recorder])
            return _RECORDER_LOST
        if self._samples.lag() > self._max_lag:
            self.measured = float(self._samples.lag())
            return _RECORD_OVERFLOW
        return _NONE

    def order(self) -> Order:
        """Return the next order that was not taken yet, `NOTHING` if there is none."""
        if self._words[self._places[2]] and not self._aborted:
            self._aborted = True
            return Order(Command.ABORT)
        return self._status.take()
