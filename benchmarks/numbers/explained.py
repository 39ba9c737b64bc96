"""Numbers that differ from those kept for a known reason, and by how much at most.

Anything that is not listed here, or differs by more, counts as different.
"""

from __future__ import annotations

import math
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


LOOP = "a torque sensor slower than the loop is the mean over its phases (CHANGELOG)"
"""With the pure delay that was there before, J, B and K, their standard errors and the p of tests
by epochs agree to 1e-9, other numbers as the reasons below say."""
RANK = f"one pair of J changes order, U is 927 for 928: {LOOP}"
FFT = "rounding in the FFT of the loop, which holds to 2e-8 of the largest value"
"""The transfer functions are evaluated in another order. Bounds change by up to 1e-7 if the damping
of that FFT is 18.3 instead of 18."""
DAYS = "the test by days is that of the means of the days, no mixed model (CHANGELOG)"
ZERO = "a number that is zero but for rounding"

EXPLANATIONS = (
    Explanation("full", "estimates/delays/delay_s", 4e-2, LOOP),
    Explanation("full", "estimates/*_se", 2e-3, LOOP),
    Explanation("full", "estimates/*_bound", 3e-3, LOOP),
    Explanation("full", "estimates/pooled/condition_number", 1e-3, LOOP),
    Explanation("full", "estimates/*", 3e-4, LOOP),
    Explanation("full", "study/inertia_kg_m2", 2e-5, LOOP),
    Explanation("full", "study/days/*", 3e-4, LOOP),
    Explanation("full", "study/day_tests/*", math.inf, DAYS),
    Explanation("full", "study/sensitivity/p_day", math.inf, DAYS),
    Explanation("full", "study/epochs/of_*", 1e-4, LOOP),
    Explanation("full", "study/*/shift*", 5e-3, LOOP),
    Explanation("full", "study/*/[pruz] inertia_kg_m2*", 5e-2, RANK),
    Explanation("full", "study/epochs/[pz]_uncorrected inertia_kg_m2", 5e-2, RANK),
    Explanation("full", "study/effects/* inertia_kg_m2", 5e-2, RANK),
    Explanation("full", "study/effect_differences/* inertia_kg_m2 *", 0.4, RANK),
    Explanation("ledger", "checks/ours eq-6 00", 1.0, ZERO),
    Explanation("ledger", "checks/ours sec-1-voluntary-iv 0[01]", 1e-8, FFT),
    Explanation("ledger", "checks/ours sec-3.4-mean-iv 0[012]", 5e-4, LOOP),
)


def explanation(group: str, difference: Difference) -> Explanation | None:
    """Return why a number differs, or None if that is not known or it differs by more."""
    names = (difference.name, f"{difference.name} {difference.row}")
    for one in EXPLANATIONS:
        if one.group == group and any(fnmatchcase(name, one.name) for name in names):
            return one if difference.relative <= one.largest else None
    return None
