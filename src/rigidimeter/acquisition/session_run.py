"""Run a protocol on a rig and write it down as it happens."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from rigidimeter.acquisition.clock import Clock
from rigidimeter.acquisition.control_modes import Passage
from rigidimeter.acquisition.controller_run import Conduct
from rigidimeter.acquisition.run_states import Command, Run, State, after, epoch_over
from rigidimeter.acquisition.supervision import Outside, Sink
from rigidimeter.acquisition.zeroing import Zeroing
from rigidimeter.devices.base import Rig
from rigidimeter.errors import UserError
from rigidimeter.experiment import PlannedEpoch, Protocol, prbs_nm, sinusoid
from rigidimeter.guard import Cause, Reaction, why_ended
from rigidimeter.recording.session_folder import Ending
from rigidimeter.settings import Settings

__all__ = ["SessionResult", "run_session"]

BeforeEpoch = Callable[[PlannedEpoch], Mapping[str, Any]]
Progress = Callable[[float], None]

LOOK_S = 0.1
"""A paused run looks so often whether it may go on."""

BRAKE_S = 0.1
"""For so long a drive that left its state brakes by its own ramp before its power goes."""


@dataclass(frozen=True)
class SessionResult:
    """How a session ended, and how many epochs ended with success."""

    outcome: Ending
    reason: str
    epochs_run: int
    epochs_good: int
    cause: Cause = Cause.NONE


def run_session(
    protocol: Protocol,
    settings: Settings,
    rig: Rig,
    clock: Clock,
    writer: Sink,
    *,
    before_epoch: BeforeEpoch = lambda _: {},
    progress: Progress = lambda _: None,
    outside: Outside | None = None,
    zero_first: bool = False,
    state_changed: Callable[[Run], None] = lambda _: None,
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
    writer : Sink
        Closed on return.
    before_epoch : callable
        Called while the arm rests, before each epoch; what it returns is stored with the epoch.
    progress : callable
        Called with the session time, about once a second of it.
    outside : Outside
        Where orders and causes from other processes come from; nobody if not given.
    zero_first : bool
        Whether to zero the torque sensor, and check its noise, before the first epoch.
    state_changed : callable
        Called whenever the run changes its state.
    """
    session = _Session(
        protocol, settings, rig, clock, writer, before_epoch, progress, outside, state_changed
    )
    return session.run(zero_first)


class _Session(Conduct):
    """One run; see `run_session`."""

    def __init__(
        self,
        protocol: Protocol,
        settings: Settings,
        rig: Rig,
        clock: Clock,
        writer: Sink,
        before_epoch: BeforeEpoch,
        progress: Progress,
        outside: Outside | None,
        state_changed: Callable[[Run], None],
    ) -> None:
        super().__init__(settings, rig, clock, writer, progress, outside, state_changed)
        self._before_epoch = before_epoch
        self._perturbation = prbs_nm(settings.prbs, settings.rig.tick_rate_hz).tolist()
        self._angle, self._velocity = (
            values.tolist() for values in sinusoid(settings.sinusoid, settings.rig.tick_rate_hz)
        )
        self._queue = deque(protocol.epochs)
        self._next_number = max((epoch.number for epoch in protocol.epochs), default=0) + 1
        self._epochs_run = self._epochs_good = 0

    def run(self, zero_first: bool) -> SessionResult:
        """Run all epochs, whatever comes."""
        self._writer.session_started()
        try:
            self._become(after(self._state, Command.START))
            self._rig.enable()
            # A device may take long to come up. The clock is not set back for that: it is the
            # drivers' clock too, and their heartbeats would cease meanwhile.
            self._loop.begin()
            if zero_first:
                origin_rad = self._rig.origin_rad
                self._writer.event("rig_enabled", time_s=self._loop.time_s, origin_rad=origin_rad)
            if not zero_first or self._zero():
                self._epochs()
            self._conclude(len(self._queue))
        except KeyboardInterrupt:
            self._outcome, self._reason = "abort", "interrupted by the operator"
        except Exception as error:
            self._cause = self._cause or Cause.SOFTWARE
            plain = isinstance(error, UserError)
            self._reason = str(error) if plain else f"{type(error).__name__}: {error}"
            self._outcome = "fail"
            raise
        finally:
            self._close()
        return SessionResult(
            self._outcome, self._reason, self._epochs_run, self._epochs_good, self._cause
        )

    def _epochs(self) -> None:
        """Run what is in the queue, pausing where asked."""
        while self._queue and self._ready():
            planned = self._queue.popleft()
            self._epoch(planned)
            self._become(epoch_over(self._state))
            if self._failed() or not self._held():
                return
            if self._state.state is State.RUNNING:
                self._loop.rest(planned.rest_s, self._settings.protocol.return_s)
                if self._failed() or not self._held():
                    return

    def _ready(self) -> bool:
        """Wait out a pause and return to where epochs begin; return whether the session goes on."""
        return_s = self._settings.protocol.return_s
        self._become(epoch_over(self._state))
        while self._in(State.PAUSED):
            if self._loop.reaction is Reaction.NONE:
                self._loop.rest(return_s, return_s)
            while self._in(State.PAUSED) and not self._failed():
                self._loop.hold(LOOK_S)
            if self._in(State.RUNNING):
                while not self._loop.at_rest and not self._failed():
                    self._loop.hold(LOOK_S)
                self._loop.release()
                # A whole way back, whatever was ordered before it: an epoch begins at its place.
                self._loop.rest(return_s, return_s)
            if self._failed() or not self._held():
                return False
            self._become(epoch_over(self._state))
        return self._in(State.RUNNING)

    def _epoch(self, planned: PlannedEpoch) -> Passage:
        """Run one epoch and close it."""
        loop, facts = self._loop, self._before_epoch(planned)
        self._writer.epoch_started(
            planned.number,
            planned.label,
            planned.task,
            planned.condition,
            loop.time_s,
            planned_s=planned.duration_s,
            **facts,
        )
        self._current = planned
        if planned.task == "prbs":
            passage = loop.perturb(planned.number, self._perturbation)
        else:
            passage = loop.follow(planned.number, self._angle, self._velocity)
        why = why_ended(self._settings, passage.cause, passage.limit_time_s)
        ending: Ending = "fail" if why else "success"
        if passage.interrupted and not why:
            ending, why = "abort", "ended by the operator"
        self._writer.epoch_ended(
            planned.number,
            loop.time_s,
            ending,
            why,
            limited_ticks=passage.limited_ticks,
            missed_ticks=passage.missed_ticks,
            counts=dict(self._rig.counts),
        )
        self._current = None
        self._epochs_run += 1
        self._epochs_good += ending == "success"
        if ending == "abort":
            self._again(planned, self._queue.appendleft)
        elif ending == "fail" and self._settings.protocol.repeat_limited:
            self._again(planned, self._queue.append)
        return passage

    def _again(self, planned: PlannedEpoch, put: Callable[[PlannedEpoch], None]) -> None:
        """Plan an epoch once more under a number of its own; a repetition is not repeated."""
        if planned.label.endswith("r"):
            return
        put(replace(planned, number=self._next_number, label=f"{planned.label}r"))
        self._next_number += 1

    def _zero(self) -> bool:
        """Zero the torque sensor while the joint stands still; return whether all is well.

        What was heard before a hold or an order is thrown away: a zero is made from the whole time
        or not at all.
        """
        limits = self._settings.zeroing
        while True:
            zeroing = Zeroing(limits)
            passage = self._loop.hold(limits.duration_s, zeroing.hear)
            if self._failed() or not self._held():
                return False
            if passage.cause is Cause.NONE and not passage.interrupted:
                break
            if not self._ready():
                return False
        bias_nm, noise_sd_nm, why = zeroing.result()
        self._writer.event(
            "sensor_zeroed",
            time_s=self._loop.time_s,
            bias_nm=bias_nm if math.isfinite(bias_nm) else None,
            noise_sd_nm=noise_sd_nm if math.isfinite(noise_sd_nm) else None,
            refused=why,
        )
        if why:
            self._outcome, self._reason = "fail", why
            return False
        self._rig.zero(bias_nm)
        return True

    def _close(self) -> None:
        """Stop, disable, close: every step is tried even when one before it fails."""
        try:
            self._loop.stop()
        finally:
            if self._state.state is not State.FAULTED:
                self._become(Run(State.STOPPING))
            try:
                self._stop_and_disable()
            finally:
                time_s = self._loop.time_s
                if self._current is not None:
                    number = self._current.number
                    self._writer.epoch_ended(number, time_s, self._outcome, self._reason)
                self._writer.close(time_s, self._outcome, self._reason)

    def _stop_and_disable(self) -> None:
        """Take the power away; a drive that no longer obeys brakes by its own ramp first."""
        try:
            if self._loop.cause in (Cause.DRIVE_LOST, Cause.DRIVE_STATE):
                self._rig.stop()
            if self._loop.cause is Cause.DRIVE_STATE:  # it answers: let it come to rest
                self._loop.hold(BRAKE_S)
        finally:
            self._rig.disable()
