"""One tick: wait, read, filter, control, guard, write, record; and the ramp to rest at the end.

The loop sees the rig only through `device.base` and takes its clock as an argument. What is
recorded is what was sent after the guard.

A tick that comes late is not made up for: the ticks whose time has passed are left out, and what
is asked for in the next one goes on where the time is.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from rigidimeter.acquisition.clock import Clock
from rigidimeter.acquisition.run_states import Command, Order
from rigidimeter.acquisition.supervision import Alone, Outside
from rigidimeter.control import Biquad, BiquadState, biquad_step, butterworth_lowpass
from rigidimeter.devices.base import Reading, Rig
from rigidimeter.guard import (
    REACTIONS,
    Cause,
    Limited,
    Reaction,
    guard_limits,
    guard_state,
    guard_step,
    released,
)
from rigidimeter.recording.sample_log import Sample
from rigidimeter.settings import Settings

__all__ = ["REST", "Controller", "Passage", "Recorder", "Ticks"]

REST = -1
"""The epoch number of samples between epochs."""

SPARE_TICKS = 10
"""A ramp to rest may take so many ticks more than the speed and the acceleration limit say."""

POSITION_LIMITED, CUT = int(Limited.POSITION), int(Reaction.CUT)
STALLED = int(Cause.STALLED)

Recorder = Callable[[Sample], None]
Controller = Callable[[Reading, float, int], tuple[float, float, float]]
"""Takes reading, filtered torque and place; gives velocity, perturbation and target."""


class Passage(NamedTuple):
    """How a stretch of ticks went.

    `limit_time_s` is when the position limit first held the command back, NaN if it never did;
    `cause` is why the guard latched, `Cause.NONE` if it did not; `limited_ticks` is how many
    commands the guard changed, for whatever limit; `missed_ticks` how many were left out;
    `interrupted` whether an operator ended it.
    """

    limit_time_s: float
    cause: Cause
    limited_ticks: int
    missed_ticks: int = 0
    interrupted: bool = False


class Ticks:
    """Run ticks on a rig, with whatever controller, under one guard.

    Parameters
    ----------
    settings : Settings
    rig : Rig
        Enabled by whoever made it.
    clock : Clock
    record : callable
        Takes one `Sample` a tick.
    progress : callable
        Takes the session time, about once a second of it.
    outside : Outside
        Asked at every tick.
    ordered : callable
        Takes an order of the operator; returns whether the stretch that runs ends now.
    """

    def __init__(
        self,
        settings: Settings,
        rig: Rig,
        clock: Clock,
        record: Recorder,
        progress: Callable[[float], None] = lambda _: None,
        outside: Outside | None = None,
        ordered: Callable[[Order], bool] = lambda _: False,
    ) -> None:
        self._progress = progress
        self._rate_hz = settings.rig.tick_rate_hz
        self._interval_s = 1.0 / self._rate_hz
        self._second = round(self._rate_hz)
        self._rig = rig
        self._clock = clock
        self._record = record
        self._outside = outside or Alone()
        self._ordered = ordered
        cutoff_hz = settings.controller.torque_cutoff_hz
        self._lowpass: Biquad = butterworth_lowpass(cutoff_hz, self._rate_hz)
        self._filter = BiquadState()
        self._limits = guard_limits(settings)
        self._guard = guard_state(self._limits)
        self._missed_limit = settings.loop.missed_in_a_row
        self._stall_ticks = settings.loop.stall_s * self._rate_hz
        self._tick = 0
        self._elapsed = 1
        self._late_in_a_row = 0
        self._missed_ticks = 0
        self._limit_time_s = math.nan
        self._limited_ticks = 0
        self._angle_rad = 0.0

    @property
    def time_s(self) -> float:
        """When the next tick is due."""
        return self._tick / self._rate_hz

    @property
    def cause(self) -> Cause:
        """Why the guard latched."""
        return Cause(self._guard.cause)

    @property
    def reaction(self) -> Reaction:
        """What the guard's cause asks for."""
        return Reaction(self._guard.reaction)

    @property
    def at_rest(self) -> bool:
        """Whether the last command was zero."""
        return self._guard.velocity_rad_s == 0.0

    def release(self) -> None:
        """Forget the cause of a hold, from rest: the operator goes on.

        Raises
        ------
        ValueError
            If the guard has stopped the rig rather than held it, or is not at rest.
        """
        self._guard = released(self._guard)

    def begin(self) -> None:
        """Leave out the ticks that went by while the rig was enabled, which takes its time."""
        while (late := self._ticks_late()) > 0:
            self._rig.read(late)
            self._tick += late

    def _ticks_late(self) -> int:
        """Wait for the tick that is due, and return how many whole ticks late that is."""
        return math.floor(self._clock.wait_until(self.time_s) * self._rate_hz) - self._tick

    def stop(self) -> None:
        """Ramp the velocity to zero within the acceleration limit, however long that takes.

        A tick that fails, say because its sample cannot be recorded, does not end the ramp. It goes
        on without reading and recording, and the failure is raised after it.
        """

        def command(_: Reading, __: float, ___: int) -> tuple[float, float, float]:
            return 0.0, 0.0, math.nan

        try:
            # The guard takes as much off at every tick; some more for how floats are rounded.
            ticks = math.ceil(abs(self._guard.velocity_rad_s) / self._brake_rad_s)
            for _ in range(ticks + SPARE_TICKS):
                if self._guard.velocity_rad_s == 0.0:
                    return
                self._run_tick(REST, 0, command)
        except BaseException:
            self._ramp_unrecorded()
            raise

    @property
    def _brake_rad_s(self) -> float:
        return self._limits.acceleration_rad_s2 * self._interval_s

    def _ramp_unrecorded(self) -> None:
        """Only write: what else a tick does has failed."""
        # The ramp takes its time, however late the failure made it.
        self._tick += max(self._ticks_late(), 0)
        while (velocity := self._guard.velocity_rad_s) != 0.0:
            velocity = math.copysign(max(abs(velocity) - self._brake_rad_s, 0.0), velocity)
            self._guard = self._guard._replace(velocity_rad_s=velocity)
            self._clock.wait_until(self.time_s)
            self._rig.write(velocity)
            self._tick += 1

    def _run(self, epoch: int, n: int, command: Controller, latched: bool = False) -> Passage:
        """Run `n` ticks' time; a guard that latches ends it, unless it was latched from the start.

        `latched` allows that: the rig stands still, held.
        """
        self._limit_time_s = math.nan
        self._limited_ticks = self._missed_ticks = 0
        known = self._guard.reaction if latched else 0
        interrupted = False
        k = 0
        while k < n:
            k = self._run_tick(epoch, k, command, n - 1) + 1
            if self._guard.reaction > known:
                break
            order = self._outside.order()
            if order.command is not Command.NONE and self._ordered(order):
                interrupted = True
                break
            if self._tick % self._second == 0:
                self._progress(self.time_s)
        return Passage(
            self._limit_time_s,
            Cause(self._guard.cause),
            self._limited_ticks,
            self._missed_ticks,
            interrupted,
        )

    def _run_tick(self, epoch: int, k: int, command: Controller, last: int = 0) -> int:
        """Run one tick, and return the place it had: later than `k` if ticks were missed."""
        due_s = self._tick / self._rate_hz
        now_s = self._clock.wait_until(due_s)
        lateness_s = now_s - due_s
        late = 0
        if lateness_s >= self._interval_s:
            late = self._miss(int(lateness_s * self._rate_hz))
            k = min(k + self._elapsed - 1, last)
            due_s = self._tick / self._rate_hz
        else:
            self._elapsed, self._late_in_a_row = 1, 0
        reading = self._rig.read(self._elapsed)
        torque_nm, torque_s, angle, velocity, motion_s = reading[:5]
        if math.isfinite(torque_nm):  # a bad number must not enter the filter's memory
            self._filter, smooth_nm = biquad_step(self._lowpass, self._filter, torque_nm)
        else:
            smooth_nm = torque_nm
        request, perturbation_nm, target = command(reading, smooth_nm, k)
        outside = self._outside.cause(now_s)
        if outside == STALLED:  # the computer was suspended: its clock knows nothing of it
            late = STALLED
        if late == STALLED:
            # A drive with a watchdog has stopped by now, and a ramp down from the velocity before
            # would set the arm going again; one without brakes by its own ramp.
            self._guard = self._guard._replace(velocity_rad_s=0.0)
        was_cut = self._guard.reaction
        self._guard, allowed, limited = guard_step(
            self._limits,
            self._guard,
            request,
            torque_nm,
            angle,
            velocity,
            due_s - motion_s,
            due_s - torque_s,
            # A loop that stood still comes first: the drive's own watchdog follows from it.
            _graver(_graver(late, reading.cause), outside),
            self._elapsed,
        )
        if self._guard.reaction == CUT and was_cut != CUT:
            self._rig.disable()
        sent = self._rig.write(allowed)
        if limited:
            self._limited_ticks += 1
            if limited == POSITION_LIMITED and not self._limit_time_s <= due_s:
                self._limit_time_s = due_s
        if math.isfinite(angle):
            self._angle_rad = angle
        self._record(
            Sample(
                self._tick,
                now_s,
                lateness_s,
                epoch,
                perturbation_nm,
                torque_nm,
                torque_s,
                angle,
                velocity,
                motion_s,
                target,
                request,
                sent,
                limited,
                reading.torque_sequence,
                reading.torque_status,
                reading.motion_sequence,
                reading.motion_status,
                self._guard.cause,
            )
        )
        self._tick += 1
        return k

    def _miss(self, ticks: int) -> int:
        """Leave out the ticks whose time has passed; return a cause if they were too many."""
        self._tick += ticks
        self._elapsed = ticks + 1
        self._missed_ticks += ticks
        self._late_in_a_row += 1
        if ticks >= self._stall_ticks:
            return int(Cause.STALLED)
        if self._late_in_a_row >= self._missed_limit:
            return int(Cause.DEADLINES_MISSED)
        return int(Cause.NONE)


def _graver(cause: int, other: int) -> int:
    """Return the cause with the stronger reaction: an emergency stop is not masked by a fault."""
    return other if REACTIONS[other] > REACTIONS[cause] else cause
