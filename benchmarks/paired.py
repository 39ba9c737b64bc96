"""Two pieces of work timed in turn, so that a noisy machine is noisy for both."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

REPEATS = 5


def paired(
    ours: Callable[[], object], reference: Callable[[], object], repeats: int = REPEATS
) -> tuple[float, float]:
    """Return the median time of ours and of the reference, taken in turn, after a warm-up."""
    times: tuple[list[float], list[float]] = ([], [])
    for repeat in range(repeats + 1):
        for which, work in enumerate((ours, reference)):
            start = time.perf_counter()
            work()
            if repeat:
                times[which].append(time.perf_counter() - start)
    return statistics.median(times[0]), statistics.median(times[1])
