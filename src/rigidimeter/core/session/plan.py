"""What a session is to do: its epochs in order, each with the rest after it."""

from __future__ import annotations

import collections
from dataclasses import dataclass

from rigidimeter.core.records import Task


@dataclass(frozen=True)
class PlannedEpoch:
    """One perturbation and the rest after it.

    Attributes
    ----------
    number : int
        Place in the session, from 1.
    label : str
        The number as text, the epoch's name in the recording.
    task : {"prbs", "sinusoid"}
        Which perturbation.
    condition : str
        For example ``OFF`` or ``DBS``.
    duration_s, rest_s : float
        Of the epoch, and of the rest after it.
    """

    number: int
    label: str
    task: Task
    condition: str
    duration_s: float
    rest_s: float


@dataclass(frozen=True)
class Protocol:
    """The epochs of a session in order, and the seed from which the rests came."""

    seed: int
    epochs: tuple[PlannedEpoch, ...]

    @property
    def total_s(self) -> float:
        """How long the session takes, the last rest included, in s."""
        return sum(epoch.duration_s + epoch.rest_s for epoch in self.epochs)

    @property
    def counts(self) -> dict[tuple[Task, str], int]:
        """How many epochs there are of each task and condition, in order of first appearance."""
        return dict(collections.Counter((epoch.task, epoch.condition) for epoch in self.epochs))
