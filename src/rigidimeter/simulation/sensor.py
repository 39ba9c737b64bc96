"""Sensors with their own clock: rate, jitter, latency and resolution."""

from __future__ import annotations

import numpy as np

__all__ = ["SampleClock", "quantised"]


def quantised(value: float, resolution: float) -> float:
    """Return the value rounded to the nearest step of `resolution`; 0 means no rounding."""
    if resolution == 0.0:
        return value
    return round(value / resolution) * resolution


class SampleClock:
    """When a sensor samples, and when the sample reaches the loop.

    Sample k is taken at k/rate − latency + jitter_k, with jitter_k uniform between 0 and the given
    bound, and arrives `latency_s` later. The first sample arrives at time zero.

    Parameters
    ----------
    rate_hz, latency_s, jitter_s : float
    rng : numpy.random.Generator
        For the jitter.
    """

    def __init__(
        self, rate_hz: float, latency_s: float, jitter_s: float, rng: np.random.Generator
    ) -> None:
        self.rate_hz = rate_hz
        self.latency_s = latency_s
        self.jitter_s = jitter_s
        self._rng = rng
        self._index = 0
        self.next_s = -latency_s
        """When the next sample is taken."""

    def advance(self) -> None:
        """Schedule the sample after the one just taken."""
        self._index += 1
        self.next_s = self._index / self.rate_hz - self.latency_s
        if self.jitter_s > 0.0:
            self.next_s += self._rng.uniform(0.0, self.jitter_s)
