"""Two pieces of work timed in turn, so that a noisy machine is noisy for both, and their row."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

REPEATS = 5


class Row(NamedTuple):
    """One comparison: what of what, ours and the reference in the unit (times in ms)."""

    name: str
    ours: float
    reference: float
    unit: str = "ms"

    def __str__(self) -> str:
        ratio = self.ours / self.reference
        return (
            f"| {self.name} | {self.ours:.3g} {self.unit} | {self.reference:.3g} {self.unit} "
            f"| {ratio:.3g} |"
        )


def in_ms(name: str, times_s: tuple[float, float]) -> Row:
    """Return the row of two times in s."""
    return Row(name, 1e3 * times_s[0], 1e3 * times_s[1])


def paired(
    ours: Callable[[], object],
    reference: Callable[[], object],
    repeats: int = REPEATS,
    clock: Callable[[], float] = time.perf_counter,
) -> tuple[float, float]:
    """Return the median time of ours and of the reference, taken in turn, after a warm-up."""
    times: tuple[list[float], list[float]] = ([], [])
    for repeat in range(repeats + 1):
        for which, work in enumerate((ours, reference)):
            start = clock()
            work()
            if repeat:
                times[which].append(clock() - start)
    return statistics.median(times[0]), statistics.median(times[1])


@cache
def _regression() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    columns = np.random.default_rng(0).standard_normal((20_000, 3))
    return columns, columns @ np.array([0.0045, 0.137, 1.75])


def regression_s(repeats: int = 9) -> float:
    """Return the median CPU time of numpy.linalg.lstsq on 20,000 × 3, a unit of a processor.

    Of one thread: set OPENBLAS_NUM_THREADS=1.
    """
    times_s = []
    for _ in range(repeats):
        begun_s = time.process_time()
        np.linalg.lstsq(*_regression())
        times_s.append(time.process_time() - begun_s)
    return statistics.median(times_s)


def cpu_in_regressions(work: Callable[[], object]) -> float:
    """Return the CPU time of some work in that unit, measured before and after."""
    before_s, begun_s = regression_s(), time.process_time()
    work()
    took_s = time.process_time() - begun_s
    return 2 * took_s / (before_s + regression_s())
