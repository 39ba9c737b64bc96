"""Torque and motion, wide-band, before any term is computed.

Terms such as sign(v), θ³ or max(v, 0) bend the signal, so they must see it as it was. Only noise
far above the band of the fit is taken away first, by one zero-phase low-pass F on every signal
alike: the equation keeps its coefficients (see `bandlimited`). Derivatives are taken in
the frequency domain, where they are exact up to that low-pass:

    F(x^(k)) <-> (j 2 pi f)^k / (1 + (f / wide)^8) X(f)

The line between the ends is taken out and its derivative put back, and the rest continued by its
point reflection: position and velocity then have no step where the period closes. What is continued
so is a sum of sines, b_k sin(π k i / (n − 1)), so that a sine and a cosine transform suffice.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import scipy

from rigidimeter.analysis.estimation.bandlimited import zero_phase_band
from rigidimeter.analysis.estimation.signals import (
    Array,
    Signals,
    grid_rate_hz,
    kinematics,
    motion_channels,
    uniform_grid,
    usable_hz,
    values_at,
)
from rigidimeter.core.records import Epoch

WIDE_OVER_BAND = 3.0
"""How far above the band the noise is cut before a term bends the signal."""


def wideband_from_angle(
    torque_nm: Array, angle_rad: Array, rate_hz: float, wide_hz: float
) -> Signals:
    """Differentiate a sampled angle, and cut torque and motion alike at `wide_hz`.

    Parameters
    ----------
    torque_nm, angle_rad : arrays, shape (n,)
    rate_hz : float
        Of both.
    wide_hz : float
        Where the low-pass has half its gain, well above the band of the fit; at or above half the
        rate nothing is cut.
    """
    torque, rest = _Sines(torque_nm, rate_hz, wide_hz).value(), _Sines(angle_rad, rate_hz, wide_hz)
    angle, velocity, acceleration = rest.value(), rest.slope(), rest.curvature()
    time_s, band_hz = np.arange(angle_rad.size) / rate_hz, (0.0, min(wide_hz, rate_hz / 2))
    return Signals(time_s, torque, acceleration, velocity, angle, rate_hz, band_hz)


def wideband_signals(epoch: Epoch, high_hz: float) -> Signals:
    """Bring the channels of an epoch onto one grid, for a band that ends at `high_hz`.

    A measured velocity is used where there is one.
    """
    used = [epoch.channels["torque_nm"], *motion_channels(epoch)]
    rate_hz = grid_rate_hz(used, high_hz)
    wide_hz = max(high_hz, min(WIDE_OVER_BAND * high_hz, usable_hz(epoch)))
    time_s = uniform_grid(used, rate_hz)
    if time_s.size > 2:
        time_s = time_s[: scipy.fft.prev_fast_len(time_s.size - 1) + 1]  # of the period below
    torque = values_at(epoch.channels["torque_nm"], time_s)
    if "velocity_rad_s" not in epoch.channels:
        angle = values_at(epoch.channels["angle_rad"], time_s)
        made = wideband_from_angle(torque, angle, rate_hz, wide_hz)
        return replace(made, time_s=time_s)
    everything = np.stack([torque, *kinematics(epoch, time_s)])
    torque, angle, velocity, acceleration = _Sines(everything, rate_hz, wide_hz).value()
    band_hz = 0.0, min(wide_hz, rate_hz / 2)
    return Signals(time_s, torque, acceleration, velocity, angle, rate_hz, band_hz)


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
    lowpass = scipy.signal.butter(4, high, "lowpass", fs=rate_hz, output="sos")
    memory = min(values.size - 1, round(10 * rate_hz / high))
    passed = scipy.signal.sosfiltfilt(lowpass, values, padtype="even", padlen=memory)
    return np.asarray(passed, dtype=np.float64)


class _Sines:
    """Signals, shape (..., n), as a line and sines, low-passed."""

    def __init__(self, values: Array, rate_hz: float, wide_hz: float) -> None:
        n = values.shape[-1]
        if n < 2:
            raise ValueError(f"{n} sample(s) have no derivative")
        first, self._rise = values[..., :1], values[..., -1:] - values[..., :1]
        self._line = first + self._rise * np.linspace(0.0, 1.0, n)
        self._rise_per_s = self._rise * (rate_hz / (n - 1))
        lowpass, self._omega = _sine_lines(n, float(f"{rate_hz:.12g}"), wide_hz)
        # Of two samples nothing but the line is left.
        inner = (values - self._line)[..., 1:-1]
        self._sines = scipy.fft.dst(inner, 1) * lowpass if n > 2 else inner

    def value(self) -> Array:
        """Return the signals."""
        return self._sum(self._sines, self._line)

    def slope(self) -> Array:
        """Return their first derivative."""
        n = self._line.shape[-1]
        ends = [(0, 0)] * (self._line.ndim - 1) + [(1, 1)]
        cosines = np.pad(self._sines * self._omega, ends)
        return np.asarray(scipy.fft.dct(cosines, 1) / (2 * (n - 1)) + self._rise_per_s)

    def curvature(self) -> Array:
        """Return their second derivative."""
        return self._sum(-self._sines * self._omega**2, np.zeros_like(self._line))

    def _sum(self, sines: Array, beside: Array) -> Array:
        found = beside.copy()
        if sines.shape[-1]:
            found[..., 1:-1] += scipy.fft.idst(sines, 1)
        return found


@lru_cache(maxsize=4)
def _sine_lines(n: int, rate_hz: float, wide_hz: float) -> tuple[Array, Array]:
    """Return gain and angular frequency of the sines, which epochs of one length share."""
    frequency_hz = np.arange(1, n - 1) * (rate_hz / (2 * (n - 1)))
    fourth = ((frequency_hz / wide_hz) ** 2) ** 2
    passed = 1.0 / (1.0 + fourth * fourth) if wide_hz < rate_hz / 2 else np.ones(n - 2)
    lines = passed, np.asarray(2 * np.pi * frequency_hz, dtype=np.float64)
    for one in lines:
        one.setflags(write=False)
    return lines
