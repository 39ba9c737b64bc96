"""Spectral density of what stands in the way of an estimate: sensor noise and voluntary torque.

Two-sided, in N²m²/Hz: a density integrates over −f_s/2 to f_s/2 to the variance.

- The sensor: white, (σ² + q²/12) / f_s with σ its noise, q its resolution and f_s its rate.
- The subject's voluntary torque M_sub: Gaussian in a band, second-order Butterworth.
- The subject's tremor: a line of amplitude a at f_t whose phase wanders by D rad²/s, so that its
  variance a²/2 is spread over a Lorentzian of half-width D/(4π) Hz.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.signal import butter, sosfreqz

from rigidimeter.settings import SubjectSettings, TorqueSensorSettings

__all__ = ["TREMOR_PHASE_DIFFUSION_RAD2_S", "sensor_density", "subject_density"]

TREMOR_PHASE_DIFFUSION_RAD2_S = 1.0
"""As the virtual subject's tremor."""

_HIGHEST_OF_RATE = 0.45
"""The voluntary band ends at most here, as the virtual subject's does."""

_GRID = 1 << 17


def sensor_density(sensor: TorqueSensorSettings) -> float:
    """Return the two-sided density of the torque sensor's noise, in N²m²/Hz."""
    variance = sensor.noise_sd_nm**2 + sensor.resolution_nm**2 / 12.0
    return variance / sensor.rate_hz


def subject_density(
    subject: SubjectSettings, frequency_hz: ArrayLike, tick_rate_hz: float
) -> NDArray[np.float64]:
    """Return the two-sided density of voluntary torque and tremor, in N²m²/Hz.

    Parameters
    ----------
    subject : SubjectSettings
    frequency_hz : array, shape (m,)
        From 0 to half the tick rate.
    tick_rate_hz : float
    """
    frequency = np.asarray(frequency_hz, dtype=np.float64)
    density = np.zeros(frequency.shape)
    if subject.voluntary_sd_nm > 0.0:
        high_hz = min(subject.voluntary_high_hz, _HIGHEST_OF_RATE * tick_rate_hz)
        band = (subject.voluntary_low_hz, high_hz)
        power = _band_power(frequency, band, tick_rate_hz)
        variance = _mean_power(band, tick_rate_hz) * tick_rate_hz
        density += subject.voluntary_sd_nm**2 * power / variance
    if subject.tremor_amplitude_nm > 0.0:
        half_width = TREMOR_PHASE_DIFFUSION_RAD2_S / 2.0
        for centre_hz in (subject.tremor_frequency_hz, -subject.tremor_frequency_hz):
            away = 2.0 * np.pi * (frequency - centre_hz)
            line = 2.0 * half_width / (half_width**2 + away**2)
            density += subject.tremor_amplitude_nm**2 / 4.0 * line
    return density


def _band_power(
    frequency_hz: NDArray[np.float64], band_hz: tuple[float, float], tick_rate_hz: float
) -> NDArray[np.float64]:
    sos = butter(2, band_hz, "bandpass", fs=tick_rate_hz, output="sos")
    return np.asarray(np.abs(sosfreqz(sos, frequency_hz, fs=tick_rate_hz)[1]) ** 2)


@lru_cache(maxsize=64)
def _mean_power(band_hz: tuple[float, float], tick_rate_hz: float) -> float:
    """Return the variance with which white noise of unit variance leaves the band."""
    circle = (np.arange(_GRID) + 0.5) * tick_rate_hz / 2.0 / _GRID
    return float(np.mean(_band_power(circle, band_hz, tick_rate_hz)))
