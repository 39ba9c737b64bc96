"""Sensors with their own clock: rate, jitter, latency and resolution."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

__all__ = ["quantised", "sample_times_s"]

_BLOCK = 4096


def quantised(value: float, resolution: float) -> float:
    """Return the value rounded to the nearest step of `resolution`; 0 means no rounding."""
    if resolution == 0.0:
        return value
    return round(value / resolution) * resolution


def sample_times_s(
    rate_hz: float, latency_s: float, jitter_s: float, rng: np.random.Generator
) -> Iterator[float]:
    """Yield when a sensor samples, for ever.

    Sample k is taken at k/rate − latency + jitter_k, with jitter_k uniform between 0 and the given
    bound, and reaches the loop `latency_s` later. The first has no jitter and arrives at time zero:
    a loop starts when its sensors have spoken.

    Parameters
    ----------
    rate_hz, latency_s, jitter_s : float
    rng : numpy.random.Generator
        For the jitter.
    """
    first = 0
    while True:
        times = np.arange(first, first + _BLOCK) / rate_hz - latency_s
        if jitter_s > 0.0:
            jitter = rng.uniform(0.0, jitter_s, _BLOCK)
            jitter[: first == 0] = 0.0
            times += jitter
        yield from times.tolist()
        first += _BLOCK
