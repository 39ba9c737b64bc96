"""What is known of a session before it begins: settings, epochs, what conditions are called."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from rigidimeter.core.session import PlannedEpoch
from rigidimeter.core.settings import Settings


@dataclass(frozen=True)
class SessionPlan:
    """What the console knows of the session that it shows.

    Attributes
    ----------
    settings : Settings
    epochs : tuple of PlannedEpoch
        Those that this run is to do, in order.
    done_before : int
        How many epochs were done in the session that this one continues.
    codes : mapping of str to str
        What the operator reads in place of a condition's name; empty where nobody is blinded.
    virtual : bool
        Whether the rig is the virtual one.
    """

    settings: Settings
    epochs: tuple[PlannedEpoch, ...]
    done_before: int = 0
    codes: Mapping[str, str] = field(default_factory=dict)
    virtual: bool = False

    @property
    def total(self) -> int:
        """How many epochs the whole session has, repetitions aside.

        One that was continued more than once knows it from the numbers, which epochs keep.
        """
        numbers = [epoch.number for epoch in self.epochs]
        return max(self.done_before + len(self.epochs), *numbers, 0)

    def shown(self, condition: str) -> str:
        """Return what the operator may read of a condition.

        A condition without a code is not named where others have one.
        """
        return self.codes.get(condition, "(blinded)") if self.codes else condition
