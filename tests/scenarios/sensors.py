"""From the motion at fine steps to what is recorded: samples, stamps, noise, rounding, losses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from tests.scenarios.motion import FINE_HZ

from rigidimeter.core.records import Channel

Array = NDArray[np.float64]
Steps = NDArray[np.int64]


@dataclass(frozen=True)
class Sensor:
    """One sensor.

    Attributes
    ----------
    rate_hz, latency_s, jitter_s : float
        When it samples: every 1 / rate, the latency before a tick, up to the jitter later.
    noise : float
        SD of white noise of each sample, in the unit of the channel.
    step, rate_step : float
        What it resolves, of the torque or the angle, and of the velocity.
    rate_lowpass_hz : float
        Of a causal Butterworth filter of second order on the velocity; 0 for none.
    rate_differenced : bool
        The velocity is the difference of the recorded angle to the sample before.
    late_s : float
        How much later than it was taken a sample is stamped.
    stamp_noise_s : float
        The largest error of a single stamp, either way.
    lost : float
        Share of the samples that are missing in the recording.
    """

    rate_hz: float = 1000.0
    latency_s: float = 0.001
    jitter_s: float = 0.0
    noise: float = 0.0
    step: float = 0.0
    rate_step: float = 0.0
    rate_lowpass_hz: float = 0.0
    rate_differenced: bool = False
    late_s: float = 0.0
    stamp_noise_s: float = 0.0
    lost: float = 0.0


def taken(sensor: Sensor, duration_s: float, rng: np.random.Generator) -> Steps:
    """Return the fine steps at which a sensor samples, from the beginning of the epoch."""
    count = int((duration_s + sensor.latency_s) * sensor.rate_hz)
    times_s = np.arange(count) / sensor.rate_hz - sensor.latency_s
    times_s += sensor.jitter_s * rng.random(count)
    steps = np.round(times_s * FINE_HZ).astype(np.int64)
    return steps[(steps >= 0) & (steps < round(duration_s * FINE_HZ))]


def newest(steps: Steps, sensor: Sensor, tick_rate_hz: float, ticks: int) -> Steps:
    """Return which sample is the newest that has arrived at each tick; −1 for none yet."""
    arrives = steps + round(sensor.latency_s * FINE_HZ)
    due = np.round(np.arange(ticks) * (FINE_HZ / tick_rate_hz)).astype(np.int64)
    return np.searchsorted(arrives, due, side="right") - 1


def recorded(
    name: str,
    values: Array,
    steps: Steps,
    sensor: Sensor,
    resolution: float,
    keep: NDArray[np.bool_],
    stamp_error_s: Array,
) -> Channel:
    """Return the samples as a channel.

    Parameters
    ----------
    name : str
    values : array, shape (n,)
        True values of the samples, noise included.
    steps : array of int, shape (n,)
    sensor : Sensor
    resolution : float
    keep : array of bool, shape (n,)
        Those that are not lost.
    stamp_error_s : array, shape (n,)
    """
    rounded = np.round(values / resolution) * resolution if resolution > 0 else values
    stamps_s = steps / FINE_HZ + sensor.late_s + stamp_error_s
    return Channel(name, stamps_s[keep], rounded[keep])


def kept(sensor: Sensor, count: int, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Draw which samples are not lost."""
    return np.asarray(rng.random(count) >= sensor.lost)


def stamp_errors_s(sensor: Sensor, count: int, rng: np.random.Generator) -> Array:
    """Draw the errors of single stamps, too small for any to change places."""
    most = min(sensor.stamp_noise_s, 0.49 / sensor.rate_hz)
    return np.asarray(rng.uniform(-most, most, count))
