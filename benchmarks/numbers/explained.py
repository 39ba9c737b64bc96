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


EXPLANATIONS: tuple[Explanation, ...] = ()


def explanation(group: str, difference: Difference) -> Explanation | None:
    """Return why a number differs, or None if that is not known or it differs by more."""
    names = (difference.name, f"{difference.name} {difference.row}")
    for one in EXPLANATIONS:
        if one.group == group and any(fnmatchcase(name, one.name) for name in names):
            return one if difference.relative <= one.largest else None
    return None
