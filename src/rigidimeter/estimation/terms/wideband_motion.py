"""Effort and motion, wide-band, before any term is computed.

Terms such as sign(v), θ³ or max(v, 0) bend the signal, so they must see it as it was. Only noise
far above the band of the fit is taken away first, by one zero-phase low-pass F on every signal
alike: the equation keeps its coefficients (see `estimation.bandlimited`). Derivatives are taken in
the frequency domain, where they are exact up to that low-pass:

    F(x^(k)) <-> (j 2 pi f)^k / (1 + (f / wide)^8) X(f)

The arrays carry no unit of their own. A joint has N·m and rad, an axis N and m, a circuit V.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft, signal

from rigidimeter.estimation.bandlimited import zero_phase_band
from rigidimeter.estimation.screening import USABLE_FRACTION_OF_RATE
from rigidimeter.estimation.signals import (
    Array,
    grid_rate_hz,
    kinematics,
    motion_channels,
    spline,
    uniform_grid,
)
from rigidimeter.records import Epoch

__all__ = ["Motion", "banded", "motion_from_epoch", "motion_from_position", "split"]

WIDE_OVER_BAND = 3.0
"""How far above the band the noise is cut before a term bends the signal."""


@dataclass(frozen=True)
class Motion:
    """Effort (torque, force, voltage) and motion on one uniform grid, wide-band.

    Attributes
    ----------
    effort, position, velocity, acceleration : arrays, shape (n,)
        Effort is what drives the motion: positive toward positive position.
    rate_hz : float
    """

    effort: Array
    position: Array
    velocity: Array
    acceleration: Array
    rate_hz: float

    @property
    def duration_s(self) -> float:
        """How long it lasts."""
        return self.effort.size / self.rate_hz


def motion_from_position(effort: Array, position: Array, rate_hz: float, wide_hz: float) -> Motion:
    """Differentiate a sampled position, and cut effort and motion alike at `wide_hz`.

    Parameters
    ----------
    effort, position : arrays, shape (n,)
    rate_hz : float
        Of both.
    wide_hz : float
        Where the low-pass has half its gain, well above the band of the fit; at or above half the
        rate nothing is cut.
    """
    return Motion(
        effort=_derivative(effort, 0, rate_hz, wide_hz),
        position=_derivative(position, 0, rate_hz, wide_hz),
        velocity=_derivative(position, 1, rate_hz, wide_hz),
        acceleration=_derivative(position, 2, rate_hz, wide_hz),
        rate_hz=rate_hz,
    )


def motion_from_epoch(epoch: Epoch, high_hz: float) -> Motion:
    """Bring the channels of an epoch onto one grid, for a band that ends at `high_hz`.

    A measured velocity is used where there is one.
    """
    used = [epoch.channels["torque_nm"], *motion_channels(epoch)]
    rate_hz = grid_rate_hz(used, high_hz)
    slowest = min(channel.rate_hz for channel in used)
    wide_hz = max(high_hz, min(WIDE_OVER_BAND * high_hz, USABLE_FRACTION_OF_RATE * slowest))
    time_s = uniform_grid(used, rate_hz)
    effort = spline(epoch.channels["torque_nm"])(time_s)
    if "velocity_rad_s" not in epoch.channels:
        position = spline(epoch.channels["angle_rad"])(time_s)
        return motion_from_position(effort, position, rate_hz, wide_hz)
    angle, velocity, acceleration = kinematics(epoch, time_s)
    return Motion(
        effort=_derivative(effort, 0, rate_hz, wide_hz),
        position=_derivative(angle, 0, rate_hz, wide_hz),
        velocity=_derivative(velocity, 0, rate_hz, wide_hz),
        acceleration=_derivative(acceleration, 0, rate_hz, wide_hz),
        rate_hz=rate_hz,
    )


def split(motion: Motion, fraction: float) -> tuple[Motion, Motion]:
    """Cut a motion into its first part and the rest."""
    cut = round(fraction * motion.effort.size)
    first, rest = (
        Motion(
            motion.effort[part],
            motion.position[part],
            motion.velocity[part],
            motion.acceleration[part],
            motion.rate_hz,
        )
        for part in (slice(0, cut), slice(cut, None))
    )
    return first, rest


def banded(values: Array, rate_hz: float, band_hz: tuple[float, float]) -> Array:
    """Band-limit without phase; a band from 0 Hz is a low-pass and keeps the mean.

    An upper edge at or above half the rate cuts nothing.
    """
    low, high = band_hz
    if high >= rate_hz / 2:
        raise ValueError(
            f"the band ends at {high:g} Hz; it must end below half of {rate_hz:g} samples/s"
        )
    if low > 0:
        return zero_phase_band(values, rate_hz, band_hz)
    lowpass = signal.butter(4, high, "lowpass", fs=rate_hz, output="sos")
    memory = min(values.size - 1, round(10 * rate_hz / high))
    passed = signal.sosfiltfilt(lowpass, values, padtype="even", padlen=memory)
    return np.asarray(passed, dtype=np.float64)


def _derivative(values: Array, order: int, rate_hz: float, wide_hz: float) -> Array:
    # The line between the ends is taken out and its derivative put back, and the rest continued by
    # its point reflection: position and velocity then have no step where the period closes.
    n = values.size
    if n < 2:
        raise ValueError(f"{n} sample(s) have no derivative")
    line = np.linspace(values[0], values[-1], n)
    slope = (values[-1] - values[0]) / (n - 1) * rate_hz
    rest = values - line
    whole = np.concatenate((rest, -rest[-2:0:-1]))
    frequency_hz = fft.rfftfreq(whole.size, 1.0 / rate_hz)
    gain = (2j * np.pi * frequency_hz) ** order
    if wide_hz < rate_hz / 2:
        gain = gain / (1.0 + (frequency_hz / wide_hz) ** 8)
    passed = fft.irfft(gain * fft.rfft(whole), whole.size)[:n]
    return np.asarray(passed + (line, np.full(n, slope), np.zeros(n))[order], dtype=np.float64)
