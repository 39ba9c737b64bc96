"""What is to be done before a subject is on the rig, each step with its state and its remedy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

StepState = Literal["done", "not done", "not needed", "optional"]

SIGNS = {"done": "✓", "not done": "✗", "not needed": "–", "optional": "–"}
"""What stands before the words of a state, so that its colour says nothing alone."""

LEVELS = {"done": "ok", "not done": "bad", "not needed": "off", "optional": "off"}
"""Of which colour it is, as the indicators."""


@dataclass(frozen=True)
class RigStep:
    """A step.

    Attributes
    ----------
    title : str
    state : {"done", "not done", "not needed", "optional"}
    found : str
        What is known of it, with its time.
    remedy : str
        Why it is not done, and what to do; of a required one, what `run` says as it refuses.
    action : {"", "check", "zero"}
        What the page can run for it.
    required : bool
        Whether no session starts without it.
    """

    title: str
    state: StepState
    found: str = ""
    remedy: str = ""
    action: Literal["", "check", "zero"] = ""
    required: bool = True


def start_refusal(steps: Sequence[RigStep]) -> str:
    """Return why no session can start, as `run` says it; empty if one can."""
    missing = (step.remedy for step in steps if step.required and step.state == "not done")
    return next(missing, "")
