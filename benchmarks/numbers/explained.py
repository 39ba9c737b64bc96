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


LOOP = "a torque sensor slower than the loop is the mean over its phases (CHANGELOG)"
"""With the pure delay that was there before, J, B and K, their standard errors and the p of tests
by epochs agree to 1e-9, other numbers as the reasons below say."""
STREAM = "each column is resampled with random numbers of its own (CHANGELOG)"
"""With 300,000 resamples in place of 9,999 both ways agree, as two seeds of one way do."""
RANK = f"one pair of J changes order, U is 927 for 928: {LOOP}"
FFT = "rounding in the FFT of the loop, which holds to 2e-8 of the largest value"
"""The transfer functions are evaluated in another order. Bounds change by up to 1e-7 if the damping
of that FFT is 18.3 instead of 18."""
DRIVE = "the search for the drive, which the delay is counted from, ends within its tolerance"
"""At most 4e-9 of the drive's bandwidth and 2e-11 s of delay: each step rounds in another order."""
CANCELLED = "a difference of nearly equal numbers, which agree to 1e-10 themselves"
RATE = "filters take the sampling rate to 12 digits, without the rounding of time stamps"
"""Of 100.00000000000001 samples/s, say. With the exact rate they are equal to the bit."""
BETWEEN = (
    "the drive is chosen among several structures, and what is not known of it widens intervals"
)
"""The motion between samples of the default drive then differs by some 1e-5 of its size: J, B and K
by less than a tenth of a standard error. Delays are counted from that of the drive."""
ZERO = "a number that is zero but for rounding"

EXPLANATIONS = (
    Explanation("estimate", "*/delays/delay_s", 0.2, BETWEEN),
    Explanation("estimate", "*_low", 5e-3, BETWEEN),
    Explanation("estimate", "*_high", 5e-3, BETWEEN),
    Explanation("estimate", "paper-rates/*/condition_number", 3e-2, BETWEEN),
    Explanation("estimate", "*", 6e-3, BETWEEN),
    Explanation("methods", "*/delays/delay_s", 0.1, BETWEEN),
    Explanation("methods", "*", 6e-3, BETWEEN),
    Explanation("estimate", "paper-rates/delays/delay_s", 5e-3, LOOP),
    Explanation("estimate", "paper-rates/delays/delay_s_se", 1e-5, LOOP),
    Explanation("estimate", "paper-rates/*_bound", 4e-4, LOOP),
    Explanation("estimate", "paper-rates/*_se", 4e-4, LOOP),
    Explanation("estimate", "paper-rates/*", 1e-4, LOOP),
    Explanation("estimate", "*/delays/delay_s", 1e-7, DRIVE),
    Explanation("estimate", "compared/epochs/shift*", 3e-8, CANCELLED),
    Explanation("estimate", "elbow/*/r_squared", 1e-8, CANCELLED),
    Explanation("estimate", "elbow/*/vaf_percent", 1e-8, CANCELLED),
    Explanation("estimate", "days/*/stiffness_nm_rad_bound", 1e-8, FFT),
    Explanation("methods", "*/delays/delay_s", 1e-7, DRIVE),
    Explanation("methods", "ml/*/stiffness_nm_rad_*", 1e-8, FFT),
    Explanation("methods", "bandlimited/fits/inertia_kg_m2_low", 3e-8, CANCELLED),
    Explanation("study", "*/delays/delay_s", 1e-6, DRIVE),
    Explanation("study", "*/delays/delay_s_se", 3e-9, DRIVE),
    Explanation("study", "*/stiffness_nm_rad_bound", 1e-8, FFT),
    Explanation("study", "*/shift", 1e-8, CANCELLED),
    Explanation("study", "*/day_tests/*", 2e-8, CANCELLED),
    Explanation("study", "*/sensitivity/p_day", 1e-8, CANCELLED),
    Explanation("columns", "estimates/columns/shift*", 3e-8, CANCELLED),
    Explanation("columns", "*/columns/r_low", 0.5, STREAM),
    Explanation("columns", "*/columns/r_high", 0.5, STREAM),
    Explanation("columns", "*/columns/rank_biserial_*", 0.5, STREAM),
    Explanation("columns", "estimates/effect_differences/p", 0.2, STREAM),
    Explanation("terms", "relaxed/models/condition_number", 5e-9, RATE),
    Explanation("terms", "relaxed/parameters/*", 5e-8, RATE),
    Explanation("full", "estimates/delays/delay_s", 4e-2, LOOP),
    Explanation("full", "estimates/*_se", 2e-3, LOOP),
    Explanation("full", "estimates/*_bound", 3e-3, LOOP),
    Explanation("full", "estimates/pooled/condition_number", 1e-3, LOOP),
    Explanation("full", "estimates/*", 3e-4, LOOP),
    Explanation("full", "study/inertia_kg_m2", 2e-5, LOOP),
    Explanation("full", "study/days/*", 3e-4, LOOP),
    Explanation("full", "study/day_tests/*", 3e-3, LOOP),
    Explanation("full", "study/sensitivity/p_day", 2e-3, LOOP),
    Explanation("full", "study/epochs/of_*", 1e-4, LOOP),
    Explanation("full", "study/*/shift*", 5e-3, LOOP),
    Explanation("full", "study/*/[pruz] inertia_kg_m2*", 5e-2, RANK),
    Explanation("full", "study/epochs/[pz]_uncorrected inertia_kg_m2", 5e-2, RANK),
    Explanation("full", "study/effects/* inertia_kg_m2", 5e-2, RANK),
    Explanation("full", "study/effect_differences/* inertia_kg_m2 *", 0.4, RANK),
    Explanation("ledger", "checks/ours eq-6 00", 1.0, ZERO),
    Explanation("ledger", "checks/ours eq-7 00", 2e-5, LOOP),
    Explanation("ledger", "checks/ours sec-1-voluntary-iv 0[01]", 1e-8, FFT),
    Explanation("ledger", "checks/ours sec-3.4-mean 0[012]", 5e-4, LOOP),
)


def explanation(group: str, difference: Difference) -> Explanation | None:
    """Return why a number differs, or None if that is not known or it differs by more."""
    names = (difference.name, f"{difference.name} {difference.row}")
    for one in EXPLANATIONS:
        if one.group == group and any(fnmatchcase(name, one.name) for name in names):
            return one if difference.relative <= one.largest else None
    return None
