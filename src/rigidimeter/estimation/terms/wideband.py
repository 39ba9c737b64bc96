"""Torque and motion, wide-band, before any term is computed.

Terms such as sign(v), θ³ or max(v, 0) bend the signal, so they must see it as it was. Only noise
far above the band of the fit is taken away first, by one zero-phase low-pass F on every signal
alike: the equation keeps its coefficients (see `estimation.bandlimited`). Derivatives are taken in
the frequency domain, where they are exact up to that low-pass:

    F(x^(k)) <-> (j 2 pi f)^k / (1 + (f / wide)^8) X(f)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import fft, signal

from rigidimeter.estimation.bandlimited import zero_phase_band
from rigidimeter.estimation.signals import (
    Array,
    Signals,
    grid_rate_hz,
    kinematics,
    motion_channels,
    uniform_grid,
    values_at,
)
from rigidimeter.records import Epoch
from rigidimeter.settings import USABLE_FRACTION_OF_RATE

Complex = NDArray[np.complex128]

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
    angle, velocity, acceleration = _derivatives(angle_rad, (0, 1, 2), rate_hz, wide_hz)
    (torque,) = _derivatives(torque_nm, (0,), rate_hz, wide_hz)
    return Signals(
        time_s=np.arange(angle_rad.size) / rate_hz,
        torque_nm=torque,
        acceleration_rad_s2=acceleration,
        velocity_rad_s=velocity,
        angle_rad=angle,
        rate_hz=rate_hz,
        band_hz=(0.0, min(wide_hz, rate_hz / 2)),
    )


def wideband_signals(epoch: Epoch, high_hz: float) -> Signals:
    """Bring the channels of an epoch onto one grid, for a band that ends at `high_hz`.

    A measured velocity is used where there is one.
    """
    used = [epoch.channels["torque_nm"], *motion_channels(epoch)]
    rate_hz = grid_rate_hz(used, high_hz)
    slowest = min(channel.rate_hz for channel in used)
    wide_hz = max(high_hz, min(WIDE_OVER_BAND * high_hz, USABLE_FRACTION_OF_RATE * slowest))
    time_s = uniform_grid(used, rate_hz)
    if time_s.size > 2:
        time_s = time_s[: fft.prev_fast_len(time_s.size - 1) + 1]  # of the period below
    torque = values_at(epoch.channels["torque_nm"], time_s)
    if "velocity_rad_s" not in epoch.channels:
        angle = values_at(epoch.channels["angle_rad"], time_s)
        return wideband_from_angle(torque, angle, rate_hz, wide_hz)
    everything = np.stack([torque, *kinematics(epoch, time_s)])
    torque, angle, velocity, acceleration = _derivatives(everything, (0,), rate_hz, wide_hz)[0]
    return Signals(
        time_s=time_s,
        torque_nm=torque,
        acceleration_rad_s2=acceleration,
        velocity_rad_s=velocity,
        angle_rad=angle,
        rate_hz=rate_hz,
        band_hz=(0.0, min(wide_hz, rate_hz / 2)),
    )


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


def _derivatives(
    values: Array, orders: tuple[int, ...], rate_hz: float, wide_hz: float
) -> list[Array]:
    """Return derivatives of signals, shape (..., n), along their last axis."""
    # The line between the ends is taken out and its derivative put back, and the rest continued by
    # its point reflection: position and velocity then have no step where the period closes.
    n = values.shape[-1]
    if n < 2:
        raise ValueError(f"{n} sample(s) have no derivative")
    first, last = values[..., :1], values[..., -1:]
    line = first + (last - first) * np.linspace(0.0, 1.0, n)
    rest = values - line
    whole = np.concatenate((rest, -rest[..., -2:0:-1]), axis=-1)
    frequency_hz = fft.rfftfreq(whole.shape[-1], 1.0 / rate_hz)
    spectrum = fft.rfft(whole)
    if wide_hz < rate_hz / 2:
        fourth = ((frequency_hz / wide_hz) ** 2) ** 2
        spectrum *= 1.0 / (1.0 + fourth * fourth)
    back = (line, (last - first) * (rate_hz / (n - 1)), 0.0)
    return [
        np.asarray(fft.irfft(_differentiated(spectrum, order, frequency_hz), whole.shape[-1]))[
            ..., :n
        ]
        + back[order]
        for order in orders
    ]


def _differentiated(spectrum: Complex, order: int, frequency_hz: Array) -> Complex:
    return spectrum * (2j * np.pi * frequency_hz) ** order if order else spectrum
