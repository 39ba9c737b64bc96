"""Numbers that differ from those kept for a known reason, and by how much at most.

Anything that is not listed here, or differs by more, counts as different.
"""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import NamedTuple

from benchmarks.numbers.difference import Difference

__all__ = ["EXPLANATIONS", "Explanation", "explanation"]


class Explanation(NamedTuple):
    """Why some numbers of a group differ.

    Attributes
    ----------
    group : str
    name : str
        Pattern of the name of the number, or of its name and row; `*` stands for anything.
    largest : float
        Relative difference up to which the reason holds.
    reason : str
    """

    group: str
    name: str
    largest: float
    reason: str


FFT = "rounding in the FFT of the loop, which holds to 2e-8 of the largest value"
"""The transfer functions are evaluated in another order. Bounds change by up to 1e-7 if the damping
of that FFT is 18.3 instead of 18."""
DELAY = "the error of a delay is over the slope of what a move of the torque leaves"
"""Between coarse samples a move takes a third of itself away, so the error is three times larger;
on dense ones it is 0.8 to 1.3 times what it was."""
ZERO = "a number that is zero but for rounding"

EXPLANATIONS = (
    *(
        Explanation(group, "*delays/delay_s_se", 0.8, DELAY)
        for group in ("estimate", "methods", "study", "full")
    ),
    *(
        Explanation("study", f"estimates/{fits}/*_{end}", 5e-5, DELAY)
        for fits in ("fits", "fixed")
        for end in ("low", "high")
    ),
    Explanation("ledger", "checks/ours eq-6 00", 1.0, ZERO),
    Explanation("ledger", "checks/ours sec-1-voluntary-iv 0[01]", 1e-8, FFT),
)


def explanation(group: str, difference: Difference) -> Explanation | None:
    """Return why a number differs, or None if that is not known or it differs by more."""
    names = (difference.name, f"{difference.name} {difference.row}")
    for one in EXPLANATIONS:
        if one.group == group and any(fnmatchcase(name, one.name) for name in names):
            return one if difference.relative <= one.largest else None
    return None
