"""Run a protocol on a rig and write it down as it happens."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import Ending, PlannedEpoch, Protocol
from rigidimeter.core.settings import Settings
from rigidimeter.planning import NO_DOSE, Dose, dose_reached, prbs_nm, sinusoid
from rigidimeter.rig.acquisition.clock import Clock
from rigidimeter.rig.acquisition.control_modes import (
    follow,
    go_back,
    hold,
    perturb,
    release,
    rest,
    return_duration_s,
    return_speed_rad_s,
    skip_passed_ticks,
)
from rigidimeter.rig.acquisition.controller_run import ControllerRun
from rigidimeter.rig.acquisition.range_of_motion import keep_within, motion_beyond
from rigidimeter.rig.acquisition.run_states import (
    Command,
    Phase,
    Run,
    State,
    after,
    epoch_over,
)
from rigidimeter.rig.acquisition.session_end import end_session
from rigidimeter.rig.acquisition.supervision import Sink, Supervision
from rigidimeter.rig.acquisition.tick import ControlLoop, zero_torque
from rigidimeter.rig.acquisition.zeroing import bias_and_noise, motion_objection
from rigidimeter.rig.devices.base import Reading, Rig
from rigidimeter.rig.guard import Cause, DriveModel, Reaction, why_ended

BeforeEpoch = Callable[[PlannedEpoch], Mapping[str, Any]]

POLL_S = 0.1
"""A paused run looks so often whether it may go on."""


@dataclass(frozen=True)
class SessionResult:
    """How a session ended, and how many epochs ended with success."""

    outcome: Ending
    reason: str
    epochs_run: int
    epochs_good: int
    cause: Cause


@dataclass
class _Session:
    """What is left to run, on what, and how it goes.

    What an epoch imposes is computed before the first tick: it would make a tick late.
    """

    settings: Settings
    rig: Rig
    sink: Sink
    run: ControllerRun
    queue: deque[PlannedEpoch]
    next_number: int
    before_epoch: BeforeEpoch
    perturbation_nm: list[float]
    angle_rad: list[float]
    velocity_rad_s: list[float]
    dose: Dose
    epochs_run: int = 0
    epochs_good: int = 0

    def dose_with_arrivals(self) -> Dose:
        """Return the dose so far; what the session before did is in it."""
        return self.dose._replace(arrivals=self.run.loop.arrivals)


def run_session(
    protocol: Protocol,
    settings: Settings,
    rig: Rig,
    clock: Clock,
    sink: Sink,
    *,
    before_epoch: BeforeEpoch = lambda _: {},
    progress: Callable[[float], None] = lambda _: None,
    supervision: Supervision | None = None,
    zero_first: bool = False,
    dose_before: Dose = NO_DOSE,
    state_changed: Callable[[Run], None] = lambda _: None,
    watch: Callable[[ControlLoop], None] = lambda _: None,
    range_rad: tuple[float, float] | None = None,
    drive_model: DriveModel | None = None,
) -> SessionResult:
    """Run every epoch of a protocol with its rest.

    However it ends, the velocity is ramped to zero, the rig disabled, and each open epoch and the
    session closed with a reason.

    Parameters
    ----------
    protocol : Protocol
    settings : Settings
    rig : Rig
        Connected and configured.
    clock : Clock
    sink : Sink
        Closed on return.
    before_epoch : callable
        Called while the arm rests, before each epoch; what it returns is stored with the epoch.
    progress : callable
        Called with the session time, about once a second of it.
    supervision : Supervision
        Where orders and causes from other processes come from; nobody if not given.
    zero_first : bool
        Whether to zero the torque sensor, and check its noise, before the first epoch.
    dose_before : Dose
        Of the session that this one continues.
    state_changed : callable
        Called whenever the run changes its state.
    watch : callable
        Called once with the loop, before its first tick; whoever shows it may look at it.
    range_rad : tuple of float, optional
        The range of motion of the person, on the drive's own scale.
    drive_model : DriveModel, optional
        What commissioning found of the drive's side; without it the guard does not compare the
        torque sensor with the drive's own torque. The session records it.
    """
    run = ControllerRun(
        settings, rig, clock, sink, progress, supervision, state_changed, drive_model
    )
    watch(run.loop)
    queue, rate_hz = deque(protocol.epochs), settings.rig.tick_rate_hz
    angle_rad, velocity_rad_s = sinusoid(settings.sinusoid, rate_hz)
    session = _Session(
        settings,
        rig,
        sink,
        run,
        queue,
        max((epoch.number for epoch in protocol.epochs), default=0) + 1,
        before_epoch,
        prbs_nm(settings.prbs, rate_hz).tolist(),
        angle_rad.tolist(),
        velocity_rad_s.tolist(),
        dose_before,
    )
    run.loop.arrivals_before = dose_before.arrivals
    run.loop.most_arrivals = settings.dose.arrivals
    sink.event("session_started", time_s=0.0)
    if drive_model is not None:
        sink.event("drive_model", **drive_model._asdict())
    try:
        run.change_state(after(run.run, Command.START))
        rig.enable()
        # A device may take long to come up. The clock is not set back for that: it is the drivers'
        # clock too, and their heartbeats would cease meanwhile.
        skip_passed_ticks(run.loop)
        ends_rad = keep_within(run.loop, range_rad, rig.origin_rad)
        if zero_first:
            enabled = {"time_s": run.loop.time_s, "origin_rad": rig.origin_rad}
            sink.event("rig_enabled", **enabled, range_rad=ends_rad)
        why = motion_beyond(run.loop, settings, (angle_rad, velocity_rad_s)) if ends_rad else ""
        if why:
            run.outcome, run.reason = "fail", why
        elif not zero_first or _zero_sensor(session):
            _run_epochs(session)
        run.conclude(len(queue))
    except KeyboardInterrupt:
        run.outcome, run.reason = "abort", "interrupted by the operator"
    except Exception as error:
        plain = isinstance(error, UserError)
        reason = str(error) if plain else f"{type(error).__name__}: {error}"
        run.outcome, run.reason = "fail", reason
        raise
    finally:
        end_session(run, rig, sink)
    return SessionResult(
        run.outcome, run.reason, session.epochs_run, session.epochs_good, run.cause
    )


def _run_epochs(session: _Session) -> None:
    """Run what is in the queue, pausing where asked."""
    run = session.run
    while session.queue and _ready_for_epoch(session):
        if _dose_is_reached(session):
            return
        planned = session.queue.popleft()
        _run_epoch(session, planned)
        run.change_state(epoch_over(run.run))
        if not run.may_go_on() or (session.queue and _dose_is_reached(session)):
            return
        if run.is_in(State.RUNNING):
            if not _go_back(session):
                return
            # A pause on the way back leaves the rest out: the run goes back again, and then on.
            if run.is_in(State.RUNNING) and not run.run.stop_next:
                run.begin(Phase.REST)
                rest(run.loop, planned.rest_s, return_speed_rad_s(session.settings))
                if not run.may_go_on():
                    return


def _dose_is_reached(session: _Session) -> bool:
    """End the session where the next epoch would go beyond the dose; return whether that is so."""
    next_s = session.queue[0].duration_s + session.settings.protocol.return_s
    why = dose_reached(session.settings.dose, session.dose_with_arrivals(), next_s)
    if why:
        session.run.reason = f"{why}; {len(session.queue)} epochs are left"
    return bool(why)


def _ready_for_epoch(session: _Session) -> bool:
    """Wait out a pause and return to where epochs begin; return whether the session goes on.

    A paused arm is held still where it is. It is led back once the operator has resumed.
    """
    run = session.run
    run.change_state(epoch_over(run.run))
    while run.is_in(State.PAUSED):
        while run.is_in(State.PAUSED):
            if not _stand_by(run):
                return False
        if not _go_back(session):
            return False
        run.change_state(epoch_over(run.run))
    return run.is_in(State.RUNNING)


def _go_back(session: _Session) -> bool:
    """Let the arm come to rest and lead it back; return whether the session goes on.

    A pause or a stop that comes meanwhile ends the way back, and the next one begins anew.
    """
    run, loop, protocol = session.run, session.run.loop, session.settings.protocol
    while run.is_in(State.RUNNING) and not loop.still:
        if not _stand_by(run):
            return False
    if not run.is_in(State.RUNNING):
        return run.may_go_on()
    if loop.reaction is Reaction.HOLD:  # no release without one: the guard would forget arrivals
        release(loop)
    if not run.run.stop_next:
        speed_rad_s = return_speed_rad_s(session.settings)
        duration_s = return_duration_s(loop.angle_rad, protocol.return_s, speed_rad_s)
        session.sink.event(
            "return_started",
            time_s=loop.time_s,
            from_rad=loop.angle_rad,
            duration_s=duration_s,
        )
        run.begin(Phase.RETURN)
        began_s = loop.time_s
        go_back(loop, duration_s, speed_rad_s)
        _moved(session, began_s)
    return run.may_go_on()


def _moved(session: _Session, since_s: float) -> None:
    motion_s = session.dose.motion_s + session.run.loop.time_s - since_s
    session.dose = session.dose._replace(motion_s=motion_s)


def _stand_by(run: ControllerRun) -> bool:
    """Stand still for a moment; return whether the run goes on.

    A hold that comes meanwhile pauses it again: what was ordered before it does not end it.
    """
    before = run.loop.reaction
    run.begin(Phase.HOLD)
    hold(run.loop, POLL_S)
    return run.loop.reaction is before or run.may_go_on()


def _run_epoch(session: _Session, planned: PlannedEpoch) -> None:
    """Run one epoch and close it."""
    sink, run = session.sink, session.run
    facts = session.before_epoch(planned)
    sink.event(
        "epoch_started",
        epoch=planned.number,
        label=planned.label,
        task=planned.task,
        condition=planned.condition,
        time_s=run.loop.time_s,
        planned_s=planned.duration_s,
        **facts,
    )
    run.open_epoch = planned.number
    run.begin(Phase.EPOCH)
    began_s = run.loop.time_s
    if planned.task == "prbs":
        ticks = perturb(run.loop, planned.number, session.perturbation_nm)
    else:
        ticks = follow(run.loop, planned.number, session.angle_rad, session.velocity_rad_s)
    why = why_ended(run.loop.limits, ticks.cause, ticks.limit_time_s)
    ending: Ending = "fail" if why else "success"
    if ticks.interrupted and not why:
        ending, why = "abort", "ended by the operator"
    _moved(session, began_s)
    session.dose = session.dose._replace(epochs=session.dose.epochs + 1)
    again = _repetition(session, planned, ending)
    sink.event(
        "epoch_ended",
        epoch=planned.number,
        time_s=run.loop.time_s,
        outcome=ending,
        reason=why,
        limited_ticks=ticks.limited_ticks,
        late_ticks=ticks.late_ticks,
        missed_ticks=ticks.missed_ticks,
        counts={**session.rig.counts, "torque_wild": run.loop.consistency.wild.counted},
        dose=session.dose_with_arrivals()._asdict(),
        **({"again_as": again.number} if again is not None else {}),
    )
    run.open_epoch = None
    session.epochs_run += 1
    session.epochs_good += ending == "success"


def _repetition(session: _Session, planned: PlannedEpoch, ending: Ending) -> PlannedEpoch | None:
    """Put the repetition of an epoch into the queue, if it is to be repeated, and return it."""
    if planned.label.endswith("r"):  # a repetition is not repeated
        return None
    again = replace(planned, number=session.next_number, label=f"{planned.label}r")
    if ending == "abort":
        session.queue.appendleft(again)
    elif ending == "fail" and session.settings.protocol.repeat_limited:
        session.queue.append(again)
    else:
        return None
    session.next_number += 1
    return again


def _zero_sensor(session: _Session) -> bool:
    """Zero the torque sensor while the joint stands still; return whether all is well.

    What was heard before a hold or an order is thrown away: a zero is made from the full time or
    not at all.
    """
    limits, run = session.settings.zeroing, session.run
    while True:
        readings: list[Reading] = []
        run.begin(Phase.ZEROING)
        ticks = hold(run.loop, limits.duration_s, readings.append)
        if not run.may_go_on():
            return False
        if ticks.cause is Cause.NONE and not ticks.interrupted:
            break
        if not _ready_for_epoch(session):
            return False
    bias_nm, noise_sd_nm, why = bias_and_noise(readings, limits)
    why = why or motion_objection(readings, session.settings)
    session.sink.event(
        "sensor_zeroed",
        time_s=run.loop.time_s,
        bias_nm=bias_nm if math.isfinite(bias_nm) else None,
        noise_sd_nm=noise_sd_nm if math.isfinite(noise_sd_nm) else None,
        refused=why,
    )
    if why:
        run.outcome, run.reason = "fail", why
        return False
    zero_torque(session.run.loop, bias_nm)
    return True
