"""Whether the EMG of the session comes, in words for the operator."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rigidimeter.rig.acquisition.processes import ProcessCondition, Role, SharedStatus
from rigidimeter.rig.console.indicators import Indicator, Level

SILENT_S = 2.0
"""A process of the EMG that was not heard of for longer does not answer."""


@dataclass(frozen=True)
class EmgState:
    """What is known of the process of the EMG.

    Attributes
    ----------
    condition : ProcessCondition
    note : str
        Since when EMG is missing, or why it ended.
    age_s : float
        Since its last heartbeat.
    """

    condition: ProcessCondition = ProcessCondition.ABSENT
    note: str = ""
    age_s: float = math.inf

    @classmethod
    def of(cls, status: SharedStatus) -> EmgState:
        """Return the state as the process shows it."""
        return cls(status.condition(Role.EMG), status.note(Role.EMG), status.age_s(Role.EMG))

    @property
    def indicator(self) -> Indicator:
        """Its lamp. EMG that is missing never stops a session, so the worst asks for attention."""
        if self.condition in (ProcessCondition.ABSENT, ProcessCondition.STARTING):
            return Indicator("EMG", Level.UNKNOWN, "starts")
        if self.condition is ProcessCondition.FAILED:
            return Indicator("EMG", Level.WATCH, self.note)
        if self.condition is ProcessCondition.DONE:
            return Indicator("EMG", Level.GOOD, "all is in the file")
        if self.age_s > SILENT_S:
            return Indicator("EMG", Level.WATCH, "its process does not answer")
        if self.condition is ProcessCondition.TROUBLE:
            return Indicator("EMG", Level.WATCH, self.note)
        return Indicator("EMG", Level.GOOD, "is recorded")
