"""The position perturbation for the impulse and work scores (Sec. 2.3).

    θ(t) = A w(t) sin(2π f t)
    θ'(t) = A (w(t) 2π f cos(2π f t) + w'(t) sin(2π f t))        0 ≤ t < motion

with w a raised cosine that rises from 0 to 1 over the taper, stays at 1, and falls back over the
last taper: w = (1 − cos(π t / taper)) / 2 while it rises. After the motion the angle is held at
zero for the rest of the epoch. The paper moves ±20 deg at 1.0 Hz for 10 s of a 20 s epoch and
drops the first and the last second; with a taper of 1 s the eight cycles that remain are pure.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from rigidimeter.experiment.tick_count import tick_count, tick_times_s
from rigidimeter.settings import SinusoidSettings
from rigidimeter.units import rad_from_deg

__all__ = ["sinusoid"]


def sinusoid(
    settings: SinusoidSettings, rate_hz: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the angle and velocity commanded in one epoch, one value a tick.

    The command starts and ends at rest at zero angle. Without a taper it starts at full speed, and
    ends at zero angle only if the motion holds a whole number of half cycles.

    Parameters
    ----------
    settings : SinusoidSettings
        Frequency, amplitude, durations and taper.
    rate_hz : float
        Ticks a second.

    Returns
    -------
    angle_rad, velocity_rad_s : array, shape (duration_s * rate_hz,)
        The velocity is the exact derivative of the angle, taper included, in rad/s.

    Raises
    ------
    ValueError
        If the rate is not greater than zero.
    """
    ticks = tick_count(settings.duration_s, rate_hz)
    moving = min(ticks, tick_count(settings.motion_s, rate_hz))
    amplitude_rad = rad_from_deg(settings.amplitude_deg)
    omega = 2.0 * math.pi * settings.frequency_hz
    time_s = tick_times_s(moving, rate_hz)
    weight, slope = _taper(time_s, settings.motion_s, settings.taper_s)
    sine, cosine = np.sin(omega * time_s), np.cos(omega * time_s)

    angle_rad = np.zeros(ticks)
    velocity_rad_s = np.zeros(ticks)
    angle_rad[:moving] = amplitude_rad * weight * sine
    velocity_rad_s[:moving] = amplitude_rad * (weight * omega * cosine + slope * sine)
    return angle_rad, velocity_rad_s


def _taper(
    time_s: NDArray[np.float64], motion_s: float, taper_s: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the weight w, from 0 to 1, and its derivative in 1/s."""
    if taper_s == 0.0:
        return np.ones_like(time_s), np.zeros_like(time_s)
    to_end_s = motion_s - time_s
    phase = np.pi * np.clip(np.minimum(time_s, to_end_s) / taper_s, 0.0, 1.0)
    slope = 0.5 * np.pi / taper_s * np.sin(phase)
    falling = time_s > to_end_s
    full = phase == np.pi
    return 0.5 * (1.0 - np.cos(phase)), np.where(full, 0.0, np.where(falling, -slope, slope))
