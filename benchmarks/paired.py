"""Two pieces of work timed in turn, so that a noisy machine is noisy for both, and their row."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import NamedTuple

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
