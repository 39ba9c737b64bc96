"""Which measure separates two conditions best, and whether its lead is beyond chance.

An effect leads where the adjusted p of its difference from another is below the level.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rigidimeter.study.compared import Comparison
from rigidimeter.study.results import StudyResult
from rigidimeter.study.tested import LEVEL

SAME = 1e-12


@dataclass(frozen=True)
class Leader:
    """The largest effect: of whom (several if equal), and over whom its lead is beyond chance.

    `ahead` is beyond chance, `level` is not, and of `unknown` there is no p.
    """

    first: tuple[Comparison, ...]
    size: float
    ahead: tuple[Comparison, ...] = ()
    level: tuple[Comparison, ...] = ()
    unknown: tuple[Comparison, ...] = ()


def leader(result: StudyResult) -> Leader | None:
    """Return the largest effect of a result; None where there are not two to compare."""
    sized = {c.measure.name: c for c in result.comparisons if c.effects is not None}
    if len(sized) < 2:
        return None
    sizes = {name: abs(c.effects.rank_biserial) for name, c in sized.items() if c.effects}
    largest = max(sizes.values())
    first = tuple(sized[name] for name, size in sizes.items() if size > largest - SAME)
    if len(first) > 1 or not result.differences:
        return Leader(first, largest)
    p = {frozenset((pair.first, pair.second)): pair.p_holm for pair in result.differences}
    sides: dict[str, list[Comparison]] = {"ahead": [], "level": [], "unknown": []}
    for name, c in sized.items():
        if c is not first[0]:
            one = p.get(frozenset((name, first[0].measure.name)), math.nan)
            sides["unknown" if math.isnan(one) else "ahead" if one < LEVEL else "level"].append(c)
    return Leader(first, largest, *(tuple(found) for found in sides.values()))
