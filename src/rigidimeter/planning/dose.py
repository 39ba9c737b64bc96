"""What one session may ask of a person: epochs, minutes of motion, arrivals at the position limit.

A count of what was done is a `Dose`. The limits are those of `[dose]`; a session that continues
another one begins with what that one did.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from rigidimeter.core.session import Protocol
from rigidimeter.core.settings import DoseSettings


class Dose(NamedTuple):
    """How many epochs were run, for how long the arm was moved, how often it came to its limit.

    `motion_s` counts epochs and returns, not the rests between them.
    """

    epochs: int = 0
    motion_s: float = 0.0
    arrivals: int = 0

    @classmethod
    def of_record(cls, facts: Mapping[str, Any]) -> Dose:
        """Return the dose that a record holds; what it does not hold, or not as a number, is 0."""

        def number(key: str) -> float:
            value = facts.get(key, 0)
            known = isinstance(value, int | float) and math.isfinite(value) and value > 0
            return float(value) if known else 0.0

        return cls(int(number("epochs")), number("motion_s"), int(number("arrivals")))


NO_DOSE = Dose()


def dose_words(limits: DoseSettings, dose: Dose) -> str:
    """Return the dose beside its limits.

    Examples
    --------
    >>> dose_words(DoseSettings(), Dose(12, 276.0, 1))
    '12 of 120 epochs, 4.6 of 60 min of motion, 1 of 30 arrivals at the position limit'
    """
    return (
        f"{dose.epochs} of {limits.epochs} epochs, {dose.motion_s / 60.0:.1f} of "
        f"{limits.motion_min:g} min of motion, {dose.arrivals} of {limits.arrivals} arrivals at "
        "the position limit"
    )


def dose_part(limits: DoseSettings, dose: Dose) -> float:
    """Return the dose as a part of the limit that it is nearest to: 1 at the limit."""
    return max(
        dose.epochs / limits.epochs,
        dose.motion_s / 60.0 / limits.motion_min,
        dose.arrivals / limits.arrivals,
    )


def dose_reached(limits: DoseSettings, dose: Dose, next_s: float) -> str:
    """Return why no further epoch may begin, `next_s` long with its return; empty if one may."""
    if dose.arrivals >= limits.arrivals:
        return (
            f"the arm came to its position limit {dose.arrivals} times, the most of one session "
            "(dose.arrivals)"
        )
    if dose.epochs >= limits.epochs:
        return f"{dose.epochs} epochs were run, the most of one session (dose.epochs)"
    if dose.motion_s + next_s > 60.0 * limits.motion_min:
        return (
            f"the arm was moved for {dose.motion_s / 60.0:.1f} min, and with another epoch for "
            f"more than {limits.motion_min:g} min, the most of one session (dose.motion_min)"
        )
    return ""


def dose_objection(limits: DoseSettings, protocol: Protocol) -> str:
    """Return why a protocol asks for more than the dose of one session; empty if it does not."""
    epochs = len(protocol.epochs)
    moved_s = sum(epoch.duration_s + protocol.return_s for epoch in protocol.epochs)
    remedy = "plan less, or raise it if the person responsible for the rig agrees"
    if epochs > limits.epochs:
        return (
            f"the protocol has {epochs} epochs, more than dose.epochs = {limits.epochs} of one "
            f"session; {remedy}"
        )
    if moved_s > 60.0 * limits.motion_min:
        return (
            f"the protocol moves the arm for {moved_s / 60.0:.1f} min, longer than "
            f"dose.motion_min = {limits.motion_min:g} min of one session; {remedy}"
        )
    return ""
