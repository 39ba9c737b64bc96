"""One tick: wait, read, filter, control, guard, write, record; and stretches of ticks.

All that is remembered from one tick to the next is in a `ControlLoop`; the functions here take it
as their first argument. The loop sees the rig only through `devices.base` and takes its clock as an
argument. What is recorded is what was sent after the guard.

A late tick is not made up for. The ticks whose time has passed are left out, and the next one asks
for what is due at its own time. The controller then steps over the time that passed, but over at
most `LONGEST_STEP` ticks.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from rigidimeter.core.records import LATE_TICK
from rigidimeter.core.session import Sample
from rigidimeter.core.settings import LONGEST_STEP, Settings
from rigidimeter.model import (
    Admittance,
    Biquad,
    BiquadState,
    admittance,
    biquad_step,
    butterworth_lowpass,
)
from rigidimeter.rig.acquisition.clock import Clock
from rigidimeter.rig.acquisition.decision import STALLED, decide, late_cause, stronger
from rigidimeter.rig.acquisition.run_states import Command, Order, Phase
from rigidimeter.rig.acquisition.stop_report import Latched, StopReport, report_stop
from rigidimeter.rig.acquisition.supervision import NoSupervision, Supervision
from rigidimeter.rig.devices.base import Reading, Rig
from rigidimeter.rig.guard import (
    Cause,
    DriveModel,
    Limited,
    Reaction,
    consistency_limits,
    consistency_state,
    drive_torque_limits,
    drive_torque_state,
    drive_torque_step,
    guard_limits,
    guard_state,
    zeroed,
)

REST = -1
"""The epoch number of samples between epochs."""

POSITION_LIMITED, CUT = int(Limited.POSITION), int(Reaction.CUT)

Controller = Callable[[Reading, float, int], tuple[float, float, float]]
"""Takes reading, filtered torque and number of the tick in its stretch; returns velocity,
perturbation and target angle."""


class TickResult(NamedTuple):
    """How a stretch of ticks went.

    `limit_time_s` is when the position limit first held the command back, NaN if it never did.
    `cause` is why the guard latched, `Cause.NONE` if it did not. `limited_ticks` counts the
    commands that the guard changed, for whatever limit; `late_ticks` and `missed_ticks` are as
    `core.records.Ticks` has them. `interrupted` says whether an operator ended the stretch.
    """

    limit_time_s: float
    cause: Cause
    limited_ticks: int
    late_ticks: int
    missed_ticks: int
    interrupted: bool


class ControlLoop:
    """The state of a loop: the rig, the controller, the guard, and where the time is.

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
    supervision : Supervision
        Asked at every tick; by default nobody supervises.
    take_order : callable
        Takes an order of the operator; returns whether the stretch that runs ends now.
    latched : callable
        Takes what a stop or a hold says, and when the tick was at which the guard latched.
    drive_model : DriveModel, optional
        What commissioning found of the drive's side; without it the guard does not compare the
        torque sensor with the drive's own torque.
    """

    inertia_kg_m2: float
    damping_nm_s_rad: float
    admittances: list[Admittance]
    sample: Sample  # of the last tick

    def __init__(
        self,
        settings: Settings,
        rig: Rig,
        clock: Clock,
        record: Callable[[Sample], None],
        progress: Callable[[float], None] = lambda _: None,
        supervision: Supervision | None = None,
        take_order: Callable[[Order], bool] = lambda _: False,
        latched: Callable[[StopReport, float], None] = lambda _, __: None,
        drive_model: DriveModel | None = None,
    ) -> None:
        controller = settings.controller
        self.rig, self.clock, self.record = rig, clock, record
        self.progress, self.take_order, self.latched = progress, take_order, latched
        self.settings = settings
        self.supervision = supervision or NoSupervision()
        self.rate_hz = settings.rig.tick_rate_hz
        self.interval_s = 1.0 / self.rate_hz
        self.late_s = LATE_TICK * self.interval_s
        self.ticks_per_second = round(self.rate_hz)
        self.missed_limit = settings.loop.missed_in_a_row
        self.stall_ticks = settings.loop.stall_s * self.rate_hz
        self.tracking_gain_per_s = controller.tracking_gain_per_s
        self.lowpass: Biquad = butterworth_lowpass(controller.torque_cutoff_hz, self.rate_hz)
        self.limits, self.agreement = guard_limits(settings), consistency_limits(settings)
        self.torques = drive_torque_limits(settings, drive_model)
        self.perturbation_scale = 1.0
        set_admittance(self, controller.inertia_kg_m2, controller.damping_nm_s_rad)
        # What a tick changes.
        self.filtered = BiquadState()
        self.guard, self.consistency = guard_state(self.limits), consistency_state(self.agreement)
        self.compared = drive_torque_state(self.torques)
        self.tick = self.until_tick = 0
        self.elapsed_ticks = 1
        self.late_in_a_row = 0
        self.late_ticks = self.missed_ticks = 0
        self.limited_ticks = 0
        self.limit_time_s = math.nan
        self.arrivals_before, self.most_arrivals = 0, math.inf
        self.dose_reached = False
        self.angle_rad = 0.0
        self.phase = Phase.HOLD
        self.stop: StopReport | None = None

    @property
    def time_s(self) -> float:
        """When the next tick is due."""
        return self.tick / self.rate_hz

    @property
    def cause(self) -> Cause:
        """Why the guard latched."""
        return Cause(self.guard.cause)

    @property
    def why(self) -> str:
        """Why the guard latched, in words, with value, limit and remedy where they are known."""
        return self.stop.sentence if self.stop is not None else self.cause.sentence

    @property
    def reaction(self) -> Reaction:
        """What the guard's cause asks for."""
        return Reaction(self.guard.reaction)

    @property
    def arrivals(self) -> int:
        """How often the arm came to its position limit, in the session that is continued too."""
        return self.arrivals_before + self.guard.contact.arrivals

    @property
    def at_rest(self) -> bool:
        """Whether the last command was zero."""
        return self.guard.velocity_rad_s == 0.0

    @property
    def still(self) -> bool:
        """Whether the joint stands still, by what was commanded and by its angle.

        Zero has been commanded for longer than the longest ramp and the drive's settling, and the
        angle is within `guard.hold_limit_deg` of where it then was.
        """
        known, limits = self.consistency, self.limits
        ramp_s = limits.speed_rad_s / limits.acceleration_rad_s2
        near = abs(self.angle_rad - known.held_rad) <= self.agreement.hold_rad  # not so of a NaN
        return self.at_rest and known.still_s > ramp_s and near


def set_admittance(loop: ControlLoop, inertia_kg_m2: float, damping_nm_s_rad: float) -> None:
    """Use this admittance from the next tick on; the velocity, its only memory, stays as it is."""
    loop.inertia_kg_m2, loop.damping_nm_s_rad = inertia_kg_m2, damping_nm_s_rad
    # The steps over one tick, two, and so on.
    loop.admittances = [
        admittance(inertia_kg_m2, damping_nm_s_rad, ticks * loop.interval_s)
        for ticks in range(1, LONGEST_STEP + 1)
    ]


def zero_torque(loop: ControlLoop, bias_nm: float) -> None:
    """Subtract a bias from every torque from now on."""
    loop.rig.zero(bias_nm)
    loop.torques, loop.compared = zeroed(loop.torques, loop.compared, bias_nm)


def ticks_late(loop: ControlLoop) -> int:
    """Wait for the tick that is due, and return how many whole ticks late that is."""
    return math.floor(loop.clock.wait_until(loop.time_s) * loop.rate_hz) - loop.tick


def run_ticks(
    loop: ControlLoop, epoch: int, n: int, command: Controller, latched: bool = False
) -> TickResult:
    """Run for the time of `n` ticks, or until the guard latches or an operator ends it.

    An arm that has arrived at its position limit too often ends it too.

    Parameters
    ----------
    loop : ControlLoop
    epoch : int
        Its number, or `REST`.
    n : int
    command : callable
    latched : bool
        Also run where the guard has latched already: the rig stands still, held.
    """
    loop.limit_time_s = math.nan
    loop.limited_ticks = loop.late_ticks = loop.missed_ticks = 0
    known = loop.guard.reaction if latched else 0
    interrupted = False
    loop.until_tick = loop.tick + n
    k = 0
    while k < n:
        k = run_tick(loop, epoch, k, command, n - 1) + 1
        if loop.guard.reaction > known:
            if loop.stop is None:  # of several causes the first
                loop.stop = report_stop(latched_tick(loop, loop.sample))
                loop.latched(loop.stop, loop.sample.time_s)
            break
        if loop.dose_reached:
            interrupted = True
            break
        order = loop.supervision.order()
        if order.command is not Command.NONE and loop.take_order(order):
            interrupted = True
            break
        if loop.tick % loop.ticks_per_second == 0:
            loop.progress(loop.time_s)
    counts = loop.limited_ticks, loop.late_ticks, loop.missed_ticks
    return TickResult(loop.limit_time_s, loop.cause, *counts, interrupted)


def latched_tick(loop: ControlLoop, sample: Sample) -> Latched:
    """Return what the loop knows of its last tick."""
    return Latched(
        loop.settings,
        sample,
        loop.limits,
        loop.guard,
        loop.agreement,
        loop.consistency,
        loop.elapsed_ticks,
        loop.late_in_a_row,
        loop.supervision.measured,
        loop.torques,
        loop.compared,
    )


def run_tick(loop: ControlLoop, epoch: int, k: int, command: Controller, last: int = 0) -> int:
    """Run tick `k` of a stretch; return which it was, a later one if ticks were missed."""
    due_s = loop.tick / loop.rate_hz
    now_s = loop.clock.wait_until(due_s)
    lateness_s = now_s - due_s
    if lateness_s > loop.late_s:
        loop.late_ticks += 1
    late = 0  # a cause, if so many ticks were late
    if lateness_s >= loop.interval_s:
        late = _miss(loop, int(lateness_s * loop.rate_hz))
        k = min(k + loop.elapsed_ticks - 1, last)
        due_s = loop.tick / loop.rate_hz
    else:
        loop.elapsed_ticks, loop.late_in_a_row = 1, 0
    reading = loop.rig.read(loop.elapsed_ticks)
    torque_nm, torque_s, angle, velocity, motion_s = reading[:5]
    if math.isfinite(torque_nm):  # a bad number must not enter the filter's memory
        loop.filtered, smooth_nm = biquad_step(loop.lowpass, loop.filtered, torque_nm)
    else:
        smooth_nm = torque_nm
    request, perturbation_nm, target = command(reading, smooth_nm, k)
    from_outside = loop.supervision.cause(now_s)
    if from_outside == STALLED:  # the computer was suspended: its clock knows nothing of it
        late = STALLED
    # A loop that stood still comes first: the drive's own watchdog follows from it.
    reported = stronger(stronger(late, reading.cause), from_outside)
    was_cut = loop.guard.reaction
    loop.compared, apart = drive_torque_step(
        loop.torques,
        loop.compared,
        torque_nm,
        due_s - torque_s,
        angle,
        velocity,
        due_s - motion_s,
        reading.drive_torque_nm,
        due_s - reading.drive_torque_time_s,
        loop.elapsed_ticks,
    )
    loop.guard, loop.consistency, allowed, limited = decide(
        loop.limits,
        loop.agreement,
        loop.guard,
        loop.consistency,
        request,
        perturbation_nm,
        torque_nm,
        angle,
        velocity,
        due_s - motion_s,
        due_s - torque_s,
        reported,
        loop.elapsed_ticks,
        apart,
    )
    # The guard has counted this tick. Where one of the calls below fails, what follows is due at
    # the next tick: the velocity may change by one tick's worth only once a tick.
    tick = loop.tick
    loop.tick = tick + 1
    if loop.guard.reaction == CUT and was_cut != CUT:
        loop.rig.disable()
    sent = loop.rig.write(allowed)
    if sent != allowed and math.isfinite(sent):
        # A busy line, or a drive with coarse steps: the guard counts on from what is in force.
        loop.guard = loop.guard._replace(velocity_rad_s=sent)
    if limited:
        loop.limited_ticks += 1
        if limited == POSITION_LIMITED:
            _at_limit(loop, due_s)
    if math.isfinite(angle):
        loop.angle_rad = angle
    loop.sample = sample = Sample(
        tick,
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
        loop.guard.cause,
        reading.drive_torque_nm,
        reading.drive_torque_time_s,
        reported,
    )
    loop.record(sample)
    return k


def _at_limit(loop: ControlLoop, due_s: float) -> None:
    """Take note that the position limit held a command back."""
    if not loop.limit_time_s <= due_s:
        loop.limit_time_s = due_s
    loop.dose_reached = loop.arrivals >= loop.most_arrivals


def _miss(loop: ControlLoop, ticks: int) -> int:
    """Leave out the ticks whose time has passed; return a cause if they were too many."""
    loop.tick += ticks
    loop.elapsed_ticks = ticks + 1
    loop.missed_ticks += ticks
    loop.late_in_a_row += 1
    return late_cause(ticks, loop.late_in_a_row, loop.stall_ticks, loop.missed_limit)
