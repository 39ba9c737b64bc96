"""One tick: read, filter, control, guard, write, record.

The loop sees the rig only through `device.base` and takes its clock as an argument. What is
recorded is what was sent after the guard.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from rigidimeter.acquisition.clock import Clock
from rigidimeter.control import (
    Biquad,
    BiquadState,
    admittance,
    admittance_step,
    biquad_step,
    butterworth_lowpass,
    minimum_jerk,
    tracking_step,
)
from rigidimeter.device.base import Reading, Rig
from rigidimeter.guard import Cause, Limited, guard_limits, guard_state, guard_step
from rigidimeter.recording.log import Sample
from rigidimeter.settings import Settings

__all__ = ["REST", "ControlLoop", "Passage"]

REST = -1
"""The epoch number of samples between epochs."""

POSITION_LIMITED = int(Limited.POSITION)

Recorder = Callable[[Sample], None]


class Passage(NamedTuple):
    """How a stretch of ticks went.

    `limit_time_s` is when the position limit first held the command back, NaN if it never did;
    `cause` is why the guard latched, `Cause.NONE` if it did not; `limited_ticks` is how many
    commands the guard changed, for whatever limit.
    """

    limit_time_s: float
    cause: Cause
    limited_ticks: int


class ControlLoop:
    """Run stretches of ticks on a rig: the perturbed admittance, or following a position.

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
    """

    def __init__(
        self,
        settings: Settings,
        rig: Rig,
        clock: Clock,
        record: Recorder,
        progress: Callable[[float], None] = lambda _: None,
    ) -> None:
        self._progress = progress
        self._rate_hz = settings.rig.tick_rate_hz
        self._interval_s = 1.0 / self._rate_hz
        self._second = round(self._rate_hz)
        self._rig = rig
        self._clock = clock
        self._record = record
        controller = settings.controller
        self._admittance = admittance(
            controller.inertia_kg_m2, controller.damping_nm_s_rad, self._interval_s
        )
        self._tracking_gain = controller.tracking_gain_per_s
        self._lowpass: Biquad = butterworth_lowpass(controller.torque_cutoff_hz, self._rate_hz)
        self._filter = BiquadState()
        self._limits = guard_limits(settings)
        self._guard = guard_state(self._limits)
        self._tick = 0
        self._limit_time_s = math.nan
        self._limited_ticks = 0
        self._angle_rad = 0.0

    @property
    def time_s(self) -> float:
        """When the next tick is due."""
        return self._tick / self._rate_hz

    def perturb(self, epoch: int, perturbation_nm: Sequence[float]) -> Passage:
        """Let the subject move freely while the torque perturbation runs, one value a tick."""

        def command(_: Reading, torque_nm: float, k: int) -> tuple[float, float, float]:
            value = perturbation_nm[k]
            velocity = self._guard.velocity_rad_s
            return admittance_step(self._admittance, velocity, value, torque_nm), value, math.nan

        return self._run(epoch, len(perturbation_nm), command)

    def follow(
        self, epoch: int, angle_rad: Sequence[float], velocity_rad_s: Sequence[float]
    ) -> Passage:
        """Impose a position, one value a tick."""

        def command(reading: Reading, _: float, k: int) -> tuple[float, float, float]:
            target = angle_rad[k]
            # The reading is compared with where the target was when it was taken.
            then = angle_rad[max(k - self._age_ticks(reading), 0)]
            request = tracking_step(self._tracking_gain, then, velocity_rad_s[k], reading.angle_rad)
            return request, 0.0, target

        return self._run(epoch, len(angle_rad), command)

    def rest(self, duration_s: float, return_s: float) -> Passage:
        """Return to the initial position along the smoothest way, then hold it."""
        start_rad = self._angle_rad

        def command(reading: Reading, _: float, k: int) -> tuple[float, float, float]:
            target, velocity = minimum_jerk(start_rad, return_s, k * self._interval_s)
            before_s = max(k - self._age_ticks(reading), 0) * self._interval_s
            then, _ = minimum_jerk(start_rad, return_s, before_s)
            request = tracking_step(self._tracking_gain, then, velocity, reading.angle_rad)
            return request, 0.0, target

        return self._run(REST, round(duration_s * self._rate_hz), command)

    def stop(self) -> None:
        """Ramp the velocity to zero within the acceleration limit."""

        def command(_: Reading, __: float, ___: int) -> tuple[float, float, float]:
            return 0.0, 0.0, math.nan

        for _ in range(round(self._rate_hz)):
            if self._guard.velocity_rad_s == 0.0:
                return
            self._run_tick(REST, 0, command)

    def _age_ticks(self, reading: Reading) -> int:
        return round(self._tick - reading.motion_time_s * self._rate_hz)

    def _run(
        self,
        epoch: int,
        n: int,
        command: Callable[[Reading, float, int], tuple[float, float, float]],
    ) -> Passage:
        self._limit_time_s = math.nan
        self._limited_ticks = 0
        for k in range(n):
            self._run_tick(epoch, k, command)
            if self._guard.cause:
                break
            if self._tick % self._second == 0:
                self._progress(self.time_s)
        return Passage(self._limit_time_s, Cause(self._guard.cause), self._limited_ticks)

    def _run_tick(
        self,
        epoch: int,
        k: int,
        command: Callable[[Reading, float, int], tuple[float, float, float]],
    ) -> None:
        due_s = self._tick / self._rate_hz
        now_s = self._clock.wait_until(due_s)
        reading = self._rig.read()
        torque_nm, torque_s, angle, velocity, motion_s = reading
        if math.isfinite(torque_nm):  # a bad number must not enter the filter's memory
            self._filter, smooth_nm = biquad_step(self._lowpass, self._filter, torque_nm)
        else:
            smooth_nm = torque_nm
        request, perturbation_nm, target = command(reading, smooth_nm, k)
        self._guard, allowed, limited = guard_step(
            self._limits, self._guard, request, torque_nm, angle, velocity, due_s - motion_s
        )
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
                now_s - due_s,
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
            )
        )
        self._tick += 1
