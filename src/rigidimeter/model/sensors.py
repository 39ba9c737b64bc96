"""Sensors with their own clock: rate, jitter, latency and resolution."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.settings import TorqueSensorSettings

SAME_TIME_S = 1e-9
"""Two times closer than this are the same: stamps are sums of rounded numbers."""

_BLOCK = 4096
_MAX_STEPS = 2.0**51
_ROUNDING_SUM = 1.5 * 2.0**52  # from half to twice this, the numbers are whole: a sum is rounded


def quantised(value: float, resolution: float) -> float:
    """Return the value rounded to the nearest step of `resolution`; 0 means no rounding.

    What is not finite stays what it is, for the guard to see, and so does what no sensor reaches.
    A half goes to the even neighbour, as with `round`; the sum takes a third of its time.
    """
    if resolution == 0.0:
        return value
    steps = value * (1.0 / resolution)
    if not abs(steps) < _MAX_STEPS:
        return value
    return ((steps + _ROUNDING_SUM) - _ROUNDING_SUM) * resolution


def moment(taken_s: float, now_s: float, interval_s: float) -> tuple[float, float]:
    """Return where in the interval that ends now a sample was taken.

    Returns
    -------
    elapsed_s : float
        Since the tick before; `interval_s` itself for a sample of this tick, 0 for one of the tick
        before.
    left : float
        The part of the interval between the sample and now, from 0 to 1.
    """
    if taken_s >= now_s - SAME_TIME_S:
        return interval_s, 0.0
    left = min((now_s - taken_s) / interval_s, 1.0)
    elapsed_s = taken_s - (now_s - interval_s)
    if elapsed_s <= SAME_TIME_S:
        return 0.0, left
    return elapsed_s, left


def between(now: float, before: float, left: float) -> float:
    """Return what went straight from `before` to `now`, with `left` of the way still to go."""
    return now - left * (now - before)


def sample_time_blocks_s(
    rate_hz: float, latency_s: float, jitter_s: float, rng: np.random.Generator
) -> Iterator[NDArray[np.float64]]:
    """Yield when a sensor samples, block after block, for ever.

    Sample k is taken at k/rate − latency + jitter_k, with jitter_k uniform between 0 and the given
    bound, and reaches the loop `latency_s` later. The first has no jitter and arrives at time zero:
    a loop starts once each sensor has delivered a sample.

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
        yield times
        first += _BLOCK


def sample_times_s(
    rate_hz: float, latency_s: float, jitter_s: float, rng: np.random.Generator
) -> Iterator[float]:
    """Yield the times of `sample_time_blocks_s` one by one."""
    for times_s in sample_time_blocks_s(rate_hz, latency_s, jitter_s, rng):
        yield from times_s.tolist()


def sensor_density(sensor: TorqueSensorSettings) -> float:
    """Return the two-sided density of the torque sensor's noise, in N²m²/Hz.

    White: (σ² + q²/12) / f_s with σ its noise, q its resolution and f_s its rate.
    """
    variance = sensor.noise_sd_nm**2 + sensor.resolution_nm**2 / 12.0
    return variance / sensor.rate_hz
