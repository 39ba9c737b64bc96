"""How a run is led: its state, what the operator orders, and why it ends.

The operator's orders change the state, the guard's causes end the run or hold it. What comes of it,
an outcome with a reason, is kept here; what is run is the session's.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rigidimeter.acquisition.changes import Parameters
from rigidimeter.acquisition.clock import Clock
from rigidimeter.acquisition.control_modes import ControlLoop
from rigidimeter.acquisition.run_states import Command, Order, Run, State, after
from rigidimeter.acquisition.supervision import Alone, Outside, Sink
from rigidimeter.devices.base import Rig
from rigidimeter.experiment import PlannedEpoch
from rigidimeter.guard import Cause, Reaction
from rigidimeter.recording.session_folder import Ending
from rigidimeter.settings import Settings

__all__ = ["Conduct"]


class Conduct:
    """The loop of a run, and who leads it.

    Parameters
    ----------
    settings : Settings
    rig : Rig
    clock : Clock
    writer : Sink
    progress : callable
        Called with the session time, about once a second of it.
    outside : Outside
        Where orders and causes from other processes come from; nobody if not given.
    state_changed : callable
        Called whenever the run changes its state.
    """

    def __init__(
        self,
        settings: Settings,
        rig: Rig,
        clock: Clock,
        writer: Sink,
        progress: Callable[[float], None],
        outside: Outside | None,
        state_changed: Callable[[Run], None],
    ) -> None:
        self._settings = settings
        self._rig = rig
        self._writer = writer
        self._outside = outside or Alone()
        self._state_changed = state_changed
        self._loop = ControlLoop(
            settings, rig, clock, writer.sample, progress, self._outside, self._obey
        )
        self._parameters = Parameters(settings.controller)
        self._state = Run()
        self._current: PlannedEpoch | None = None
        self._outcome: Ending = "success"
        self._reason = ""
        self._cause = Cause.NONE

    def _in(self, state: State) -> bool:
        return self._state.state is state

    def _become(self, run: Run) -> None:
        if run != self._state:
            self._state = run
            self._state_changed(run)

    def _obey(self, order: Order) -> bool:
        """Take an order; return whether the stretch that runs ends now."""
        facts: dict[str, Any] = {}
        if order.command is Command.CHANGE:
            facts = self._parameters.change(order, self._loop)
        before = self._state
        self._become(after(before, order.command))
        self._writer.event(
            "order",
            time_s=self._loop.time_s,
            command=order.command.name.lower(),
            state=self._state.state.name.lower(),
            **facts,
        )
        if order.command is Command.HALT:
            self._rig.disable()
            self._cause, self._outcome = Cause.OPERATOR_HALT, "fail"
            self._reason = Cause.OPERATOR_HALT.sentence
        ends_rest = order.command is Command.STOP and self._current is None
        return self._state.at_once or ends_rest

    def _failed(self) -> bool:
        """Whether the guard stopped the rig; the reason is kept."""
        if self._loop.reaction <= Reaction.HOLD:
            return False
        self._cause = self._loop.cause
        self._outcome = "fail"
        self._reason = f"the guard stopped the rig: {self._cause.sentence}"
        self._become(Run(State.FAULTED))
        return True

    def _held(self) -> bool:
        """If the guard holds the rig, pause; without an operator that is the end."""
        if self._loop.reaction is Reaction.NONE:
            return True
        if self._state.state is State.STOPPING:
            return True
        if self._outside.attended:
            self._become(Run(State.PAUSED, stop_next=self._state.stop_next))
            return True
        self._cause = self._loop.cause
        self._outcome = "fail"
        self._reason = (
            f"the guard held the rig and nobody was there to go on: {self._cause.sentence}"
        )
        return False

    def _conclude(self, left: int) -> None:
        """Say how the session ended where nothing has said so yet, with so many epochs left."""
        if self._reason:
            return
        if self._state.state is State.STOPPING:
            what = "aborted" if self._state.aborted else "stopped"
            self._reason = f"{what} by the operator with {left} epochs left"
            self._outcome = "abort" if self._state.aborted else "success"
        elif left:
            self._outcome, self._reason = "fail", f"ended with {left} epochs left"
        elif self._loop.reaction is Reaction.HOLD:
            self._cause = self._loop.cause
            self._reason = f"the guard held the rig in the last epoch: {self._cause.sentence}"
