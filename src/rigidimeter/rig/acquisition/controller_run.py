"""How a run is led: its state, what the operator orders, and why it ends.

The operator's orders change the state; the guard's causes end the run or hold it. The outcome and
its reason are kept here. What is run, and in which order, is the session's.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from rigidimeter.core.session import Ending
from rigidimeter.core.settings import Settings
from rigidimeter.rig.acquisition.clock import Clock
from rigidimeter.rig.acquisition.control_modes import change_parameter
from rigidimeter.rig.acquisition.run_states import Command, Order, Phase, Run, State, after
from rigidimeter.rig.acquisition.stop_remedies import REMEDIES
from rigidimeter.rig.acquisition.stop_report import StopReport
from rigidimeter.rig.acquisition.supervision import NoSupervision, Sink, Supervision
from rigidimeter.rig.acquisition.tick import ControlLoop
from rigidimeter.rig.devices.base import Rig
from rigidimeter.rig.guard import Cause, DriveModel, Reaction


class ControllerRun:
    """The loop of a run, its state, and how it ended.

    Parameters
    ----------
    settings : Settings
    rig : Rig
    clock : Clock
    sink : Sink
    progress : callable
        Called with the session time, about once a second of it.
    supervision : Supervision or None
        Where orders and causes from other processes come from; nobody if not given.
    state_changed : callable
        Called whenever the run changes its state.
    drive_model : DriveModel, optional
        What commissioning found of the drive's side.

    Attributes
    ----------
    loop : ControlLoop
    run : Run
        The present state, and what is to come.
    open_epoch : int or None
        The number of the epoch that runs.
    outcome, reason, cause : Ending, str, Cause
        How the run ended; the reason is empty as long as nothing ended it.
    """

    def __init__(
        self,
        settings: Settings,
        rig: Rig,
        clock: Clock,
        sink: Sink,
        progress: Callable[[float], None],
        supervision: Supervision | None,
        state_changed: Callable[[Run], None],
        drive_model: DriveModel | None = None,
    ) -> None:
        self._controller = settings.controller
        self._rig, self._sink = rig, sink
        self._supervision = supervision or NoSupervision()
        self._state_changed = state_changed
        self.loop = ControlLoop(
            settings,
            rig,
            clock,
            sink.sample,
            progress,
            self._supervision,
            self._take_order,
            self._latched,
            drive_model,
        )
        self.run = Run()
        self.open_epoch: int | None = None
        self.outcome: Ending = "success"
        self.reason = ""
        self.cause = Cause.NONE

    def is_in(self, state: State) -> bool:
        """Whether the run is in a state."""
        return self.run.state is state

    def change_state(self, run: Run) -> None:
        """Take a new state, and say so if it differs from the old one."""
        if run != self.run:
            self.run = run
            self._state_changed(run)

    def come_to_end(self) -> None:
        """Say that the arm was brought to rest and no more ticks are due."""
        if not self.is_in(State.FAULTED):
            self.run = Run(State.STOPPING)
        self._state_changed(self.run)

    def begin(self, phase: Phase) -> None:
        """Say what is asked of the joint from the next tick on."""
        self.loop.phase = phase

    def _take_order(self, order: Order) -> bool:
        """Take an order; return whether the stretch that runs ends now."""
        facts: dict[str, Any] = {}
        if order.command is Command.NOTE:
            about = {"time_s": self.loop.time_s, "during_epoch": self.open_epoch}
            self._sink.event("note", **{**json.loads(order.name), **about})
            return False
        if order.command is Command.CHANGE:
            facts = change_parameter(self.loop, self._controller, order)
        self.change_state(after(self.run, order.command))
        self._sink.event(
            "order",
            time_s=self.loop.time_s,
            command=order.command.name.lower(),
            state=self.run.state.name.lower(),
            **facts,
        )
        if order.command is Command.HALT:
            self._rig.disable()
            cause = Cause.OPERATOR_HALT
            self.fail(cause, f"{cause.sentence}; {REMEDIES[cause]}")
        ends_rest = order.command is Command.STOP and self.open_epoch is None
        return self.run.at_once or ends_rest

    def _latched(self, stop: StopReport, time_s: float) -> None:
        """Record why the guard stopped or holds the rig, and since when."""
        self._sink.event("guard_latched", time_s=time_s, epoch=self.open_epoch, **stop.facts())

    def fail(self, cause: Cause, reason: str) -> None:
        """End with fail, a cause and a reason."""
        self.cause, self.outcome, self.reason = cause, "fail", reason

    def stopped_by_guard(self) -> bool:
        """Whether the guard stopped the rig; the reason is kept."""
        if self.loop.reaction <= Reaction.HOLD:
            return False
        cause = self.loop.cause
        self.fail(cause, f"the guard stopped the rig: {self.loop.why}")
        self.change_state(Run(State.FAULTED))
        return True

    def may_go_on(self) -> bool:
        """Whether the run may go on. Where the guard stopped it or holds it unattended, it ends.

        Where the guard holds the rig and an operator is there, the run pauses. A halt is the end,
        also of a hold.
        """
        if self.stopped_by_guard() or self.is_in(State.FAULTED):
            return False
        if self.loop.dose_reached:
            self.outcome = "fail"
            self.reason = (
                f"the arm came to its position limit {self.loop.arrivals} times, the most of one "
                "session (dose.arrivals)"
            )
            return False
        if self.loop.reaction is Reaction.NONE or self.is_in(State.STOPPING):
            return True
        if self._supervision.attended:
            self.change_state(Run(State.PAUSED, stop_next=self.run.stop_next))
            return True
        cause = self.loop.cause
        self.fail(
            cause, f"the guard held the rig and no operator was there to continue: {self.loop.why}"
        )
        return False

    def conclude(self, left: int) -> None:
        """Say how the session ended where nothing has said so yet, with so many epochs left."""
        if self.reason:
            return
        if self.is_in(State.STOPPING):
            what = "aborted" if self.run.aborted else "stopped"
            self.reason = f"{what} by the operator with {left} epochs left"
            self.outcome = "abort" if self.run.aborted else "success"
        elif left:
            self.outcome, self.reason = "fail", f"ended with {left} epochs left"
        elif self.loop.reaction is Reaction.HOLD:
            self.cause = self.loop.cause
            self.reason = f"the guard held the rig in the last epoch: {self.loop.why}"
