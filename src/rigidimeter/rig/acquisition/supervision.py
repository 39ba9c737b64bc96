"""What reaches the loop from outside its process: causes to stop for, and an operator's orders."""

from __future__ import annotations

import math
from typing import Any, Protocol

from rigidimeter.core.session import Sample
from rigidimeter.rig.acquisition.run_states import NOTHING, Order
from rigidimeter.rig.guard import Cause


class Supervision(Protocol):
    """Asked at every tick, so it answers within a microsecond or two and never waits."""

    attended: bool
    """Whether an operator is there who can go on after a hold."""

    measured: float
    """What the last cause was found by: for how many seconds a process was silent or the computer
    suspended, or how many samples wait; NaN for other causes."""

    def cause(self, now_s: float) -> int:
        """Return a `rig.guard.Cause` to stop for, 0 if there is none.

        A console or a recorder that no longer answers, an emergency stop, a signal, a computer
        that was suspended.
        """

    def order(self) -> Order:
        """Return the next order that was not taken yet, `NOTHING` if there is none."""


class NoSupervision:
    """A session in one process, without an operator."""

    attended = False
    measured = math.nan

    def cause(self, now_s: float) -> int:
        """Return no cause."""
        return int(Cause.NONE)

    def order(self) -> Order:
        """Return no order."""
        return NOTHING


class Sink(Protocol):
    """Where samples and events go: a session folder, or the ring before it."""

    def sample(self, sample: Sample) -> None:
        """Take one tick."""

    def event(self, kind: str, **facts: Any) -> None:
        """Record something that happened: the session or an epoch began or ended, and what else."""

    def close(self, time_s: float, outcome: Any, reason: str) -> None:
        """Say that the session is over."""
