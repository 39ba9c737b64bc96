"""Whether the machine was quiet while something was timed: what other programs took of it."""

from __future__ import annotations

import os
import resource
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy

MOST_PERCENT = 5.0
"""Of the processors, for other programs on a machine that is called quiet."""


class Beside(NamedTuple):
    """What was beside one run.

    Attributes
    ----------
    others_percent : float
        What other programs took of all processors.
    reference_us : float
        p99 of the lateness of cyclictest; NaN without it.
    reference_late : int
        How often it woke up more than half a tick late.
    """

    others_percent: float
    reference_us: float = float("nan")
    reference_late: int = 0


class Others:
    """Measures what other programs take of the processors; ended children count as ours."""

    def __init__(self) -> None:
        self._began = self._now()

    def percent(self) -> float:
        """Return their share of all processors since the beginning, in %."""
        wall_s, busy_s, own_s = np.subtract(self._now(), self._began)
        return max(100.0 * float((busy_s - own_s) / (wall_s * (os.cpu_count() or 1))), 0.0)

    @staticmethod
    def _now() -> tuple[float, float, float]:
        with open("/proc/stat", encoding="ascii") as file:
            user, nice, system, _, _, irq, softirq, steal = map(int, file.readline().split()[1:9])
        busy_s = (user + nice + system + irq + softirq + steal) / os.sysconf("SC_CLK_TCK")
        own_s = 0.0
        for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN):
            used = resource.getrusage(who)
            own_s += used.ru_utime + used.ru_stime
        return time.monotonic(), busy_s, own_s


def quiet_words(found: Sequence[Beside]) -> str:
    """Return whether the machine was quiet in all runs, with what says so."""
    most = max(one.others_percent for one in found)
    late = sum(one.reference_late for one in found)
    quiet = most <= MOST_PERCENT and not late
    words = f"The machine was {'quiet' if quiet else 'not quiet'}: other programs took at most "
    words += f"{most:.0f} % of its processors in a run ({MOST_PERCENT:.0f} % is quiet), "
    if np.isnan([one.reference_us for one in found]).all():
        return words + "cyclictest is not installed."
    return words + f"cyclictest woke up {late} times more than half a tick late."


def ratio_words(ours: Sequence[float], theirs: Sequence[float]) -> str:
    """Return the geometric mean of the ratios of paired runs, with its 95 % interval.

    The interval is that of Student for the logarithms; one pair has none.
    """
    logs = np.log(np.divide(ours, theirs))
    mean = float(np.mean(logs))
    if logs.size < 2:
        return f"{np.exp(mean):.2f}"
    half = float(scipy.stats.t.ppf(0.975, logs.size - 1) * scipy.stats.sem(logs))
    return f"{np.exp(mean):.2f} ({np.exp(mean - half):.2f} to {np.exp(mean + half):.2f})"
