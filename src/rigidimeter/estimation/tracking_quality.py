"""How well an estimate follows a parameter that changes.

    bias = mean(p̂ − p)      random error = SD(p̂ − p)      VAF = 100 (1 − var(p̂ − p) / var p)

and, for a step, the time from 10 to 90 % of it. An estimate that forgets exponentially with the
time τ follows a step as 1 − exp(−t/τ), in τ ln 9 = 2.2 τ.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rigidimeter.estimation.signals import Array

__all__ = ["Tracking", "tracking"]


class Tracking(NamedTuple):
    """Bias and random error in the parameter's unit, VAF in %, rise time in s.

    VAF is NaN where the truth does not change, the rise time where it does not change in one step
    or the estimate does not get there.
    """

    vaf_percent: float
    bias: float
    random_error: float
    rise_time_s: float


def tracking(time_s: Array, estimate: Array, truth: Array) -> Tracking:
    """Return how an estimate follows the truth.

    Parameters
    ----------
    time_s : array, shape (n,)
    estimate, truth : arrays, shape (n,)
        Of one parameter, finite; leave out what was estimated before it was determined.
    """
    error = np.asarray(estimate) - np.asarray(truth)
    variance = float(np.var(truth))
    vaf = 100.0 * (1.0 - float(np.var(error)) / variance) if variance > 0 else math.nan
    return Tracking(
        vaf, float(np.mean(error)), float(np.std(error)), _rise_time_s(time_s, estimate, truth)
    )


def _rise_time_s(time_s: Array, estimate: Array, truth: Array) -> float:
    changes = np.flatnonzero(np.diff(truth) != 0)
    if changes.size != 1:
        return math.nan
    after = int(changes[0]) + 1
    before, step = float(truth[after - 1]), float(truth[after] - truth[after - 1])
    done = (np.asarray(estimate)[after:] - before) / step
    low, high = np.flatnonzero(done >= 0.1), np.flatnonzero(done >= 0.9)
    if not (low.size and high.size):
        return math.nan
    return float(time_s[after + high[0]] - time_s[after + low[0]])
