"""The EMG of the session for the operator: whether it comes, and the envelope of each muscle."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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


class EnvelopeReader:
    """Reads what came of the envelope since the last call.

    Parameters
    ----------
    status : SharedStatus
    muscles : int
    """

    def __init__(self, status: SharedStatus, muscles: int) -> None:
        self._status, self._columns, self._last_s = status, 1 + muscles, -math.inf

    def read(self) -> NDArray[np.float64]:
        """Return time in s and µV of each muscle, shape (n, 1 + muscles).

        A reader that comes later than after a second misses points.
        """
        points = np.frombuffer(self._status.envelope()).reshape(-1, self._columns)
        points = points[points[:, 0] > self._last_s]
        if len(points):
            self._last_s = float(points[-1, 0])
        return points
