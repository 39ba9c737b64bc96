"""Single torque samples that no joint explains: a wild one differs from those around it.

Of the five newest samples m₁ … m₅ the middle one, m₃, is wild where

    |m₃ − median(m₁ … m₅)| > 5 d   and   > half the torque limit,

with d the mean of that difference over the last `MEMORY` samples that were not wild; of the first
`FEW` none is. A slope, a
step and two samples alike leave the median where the middle one is, so that only what goes and
comes back within two samples differs: a zero in a torque, a flipped bit. Three within a second hold
the rig. A sample counts once, by its stamp; one that is no number is left out, `watch` names it.

A step only adds, multiplies, divides and compares.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rigidimeter.rig.guard.causes import Cause

TIMES_USUAL = 5.0
THREE_S = 1.0
MEMORY = 200.0
"""In samples: 0.2 s at 1 kHz, 2 s at 100 Hz."""

FEW = 20.0
"""Of fewer samples it is not known what is usual. A run zeroes the sensor meanwhile."""

_SAME_STAMP_S = 1e-6


class WildState(NamedTuple):
    """What is remembered of the torque samples.

    `first_nm` to `fifth_nm` are the newest, the fifth last (NaN before there were five), `age_s`
    is the age of the fifth. `usual_nm` is d, the mean of `averaged` samples. `last_s` and
    `before_s` are how long ago the last two wild ones were found, `counted` is the number of all.
    """

    first_nm: float = math.nan
    second_nm: float = math.nan
    third_nm: float = math.nan
    fourth_nm: float = math.nan
    fifth_nm: float = math.nan
    age_s: float = math.inf
    usual_nm: float = 0.0
    averaged: float = 0.0
    last_s: float = math.inf
    before_s: float = math.inf
    counted: int = 0


def wild_step(
    state: WildState, wild_nm: float, torque_nm: float, torque_age_s: float, elapsed_s: float
) -> tuple[WildState, int]:
    """Look at one tick's torque; return the state after it and a `Cause`, 0 if nothing is found.

    Parameters
    ----------
    state : WildState
    wild_nm : float
        Half the torque limit.
    torque_nm, torque_age_s : float
        The newest sample and how long ago it was taken.
    elapsed_s : float
        Since the step before.
    """
    a, b, c, d, e, age_s, usual, averaged, last_s, before_s, counted = state
    age_s, last_s, before_s = age_s + elapsed_s, last_s + elapsed_s, before_s + elapsed_s
    cause = int(Cause.NONE)
    one_sum = torque_nm + torque_age_s
    if one_sum - one_sum == 0.0 and torque_age_s < age_s - _SAME_STAMP_S:
        a, b, c, d, e, age_s = b, c, d, e, torque_nm, torque_age_s
        difference = abs(c - median(a, b, c, d, e))
        if averaged >= FEW and difference > TIMES_USUAL * usual and difference > wild_nm:
            counted += 1
            if before_s <= THREE_S:
                cause, last_s, before_s = int(Cause.TORQUE_WILD), math.inf, math.inf
            else:
                last_s, before_s = 0.0, last_s
        elif difference >= 0.0:  # not so before there are five
            averaged = min(averaged + 1.0, MEMORY)
            usual += (difference - usual) / averaged
    after = WildState(a, b, c, d, e, age_s, usual, averaged, last_s, before_s, counted)
    return after, cause


def median(a: float, b: float, c: float, d: float, e: float) -> float:
    """Return the median of five numbers; no number if one of them is none.

    >>> median(3.0, 1.0, 5.0, 2.0, 4.0)
    3.0
    """
    low, high = max(min(a, b), min(c, d)), min(max(a, b), max(c, d))
    middle = max(min(low, high), min(max(low, high), e))
    return middle + 0.0 * (a + b + c + d + e)
