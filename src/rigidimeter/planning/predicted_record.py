r"""What an epoch will leave in the file, and the spectral lines that `iv` will weigh.

The torque is sampled at points in time, k/rate − latency, and an estimate holds each sample against
the motion at that point. For a torque slower than the loop this matters: the edge of a chip is an
acceleration of many times the torque rate, and its samples fold that into the band. The noise in
the samples has the autocovariance

    r(τ) = ∫ S(f) e^(2πifτ) df + σ² [τ = 0]

with S the density of the subject's own torque and σ² the variance of the sensor.

`iv` multiplies the record by a window w with raised-cosine ends, takes its lines at ω_k = 2π k/T
and weighs each with the inverse of its noise. With Z_k the motion that the perturbation causes, and
torque noise ν of autocovariance r, the noise N_k of a line has the power

    S_k = Σ c(τ) r(τ) e^(−iω_k τ)      c(τ) = Σ w(t) w(t + τ)

which is the density of ν as the window smears it. Below a steep edge that is far more than the
density itself: under voluntary torque K is read below 0.3 Hz, and what stands in its way there has
leaked from above. The estimate is

    p = A⁻¹ Σ Re(Z_kᴴ Y_k)/S_k      A = Σ Re(Z_kᴴ Z_k)/S_k

and since Σ Re(Z_kᴴ N_k)/S_k = Σ h(t) ν(t) with h(t) = w(t) Σ Re(Z_k e^(iω_k t))/S_k, its covariance
is A⁻¹ Q A⁻¹, Q = Σ Σ h(t) hᵀ(t') r(t − t'): for noise of any colour, and although the window makes
neighbouring lines resemble each other. Were they independent it would be (2A)⁻¹.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.records import readonly
from rigidimeter.core.settings import (
    FEWEST_LINES,
    USABLE_FRACTION_OF_RATE,
    EstimationSettings,
    RigSettings,
    SubjectSettings,
)
from rigidimeter.model import Array, ClosedLoopMotion, sensor_density, subject_density

_MEMORY = 10.0
"""The autocovariance of the subject's torque has decayed after so many periods of its lowest
frequency, or of 2 s for the tremor."""

_ROUNDING = 1e-6
"""Of a sample: a stamp that is a rounding error late still counts."""


class PredictedRecord(NamedTuple):
    """One epoch as it will be read.

    Attributes
    ----------
    rate_hz : float
        Of the torque.
    motion : array, shape (3, n)
        Acceleration, velocity and angle that the perturbation causes, at the torque's stamps.
    """

    rate_hz: float
    motion: Array


def expected_record(motion: ClosedLoopMotion, rig: RigSettings) -> PredictedRecord:
    """Return the motion where torque and motion will both have been recorded.

    Parameters
    ----------
    motion : ClosedLoopMotion
        Of the whole epoch, at the ticks.
    rig : RigSettings
    """
    ticks, rate_hz, late_s = motion.angle_rad.size, rig.torque.rate_hz, rig.torque.stamp_latency_s
    last_s = (ticks - 1) / rig.tick_rate_hz
    until_s = min(
        math.floor((last_s - sensor.jitter_s) * sensor.rate_hz + _ROUNDING) / sensor.rate_hz
        - sensor.stamp_latency_s
        for sensor in (rig.torque, rig.motion)
    )
    first = math.ceil(late_s * rate_hz - _ROUNDING)
    last = max(math.floor((until_s + late_s) * rate_hz + _ROUNDING), first)
    stamps_s = np.arange(first, last + 1) / rate_hz - late_s
    at_stamps = scipy.interpolate.CubicSpline(
        np.arange(ticks) / rig.tick_rate_hz, np.stack(motion[1:]), axis=1
    )
    return PredictedRecord(rate_hz, np.asarray(at_stamps(stamps_s), dtype=np.float64))


@lru_cache(maxsize=16)
def noise_covariance(rig: RigSettings, subject: SubjectSettings, lags: int) -> Array:
    """Return the autocovariance of the noise in the samples of the torque, in N²m².

    Parameters
    ----------
    rig : RigSettings
        For the torque sensor and the tick rate.
    subject : SubjectSettings
        For voluntary torque and tremor.
    lags : int
        How many, from 0 on, in samples of the torque.
    """
    lag_s = np.arange(lags) / rig.torque.rate_hz
    covariance = np.zeros(lags)
    if subject.voluntary_sd_nm > 0.0 or subject.tremor_amplitude_nm > 0.0:
        # Long enough that the wrap-around has decayed.
        memory_s = max(_MEMORY / subject.voluntary_low_hz, 2.0 * _MEMORY)
        half_s = max(lag_s[-1], (lag_s[-1] + memory_s) / 2.0)
        half = scipy.fft.next_fast_len(math.ceil(half_s * rig.tick_rate_hz) + 2, real=True)
        density = subject_density(
            subject, scipy.fft.rfftfreq(2 * half, 1.0 / rig.tick_rate_hz), rig.tick_rate_hz
        )
        at_ticks = scipy.fft.irfft(density, 2 * half)[: half + 1] * rig.tick_rate_hz
        covariance += scipy.interpolate.CubicSpline(
            np.arange(half + 1) / rig.tick_rate_hz, at_ticks
        )(lag_s)
    covariance[0] += sensor_density(rig.torque) * rig.torque.rate_hz
    return readonly(covariance)


def noise_spectrum(rig: RigSettings, subject: SubjectSettings, frequency_hz: Array) -> Array:
    """Return the power of the noise in the samples of the torque, folded by sampling, in N²m².

    Parameters
    ----------
    rig : RigSettings
    subject : SubjectSettings
    frequency_hz : array, shape (m,)
        From 0 to half the torque rate.
    """
    rate_hz, half_hz = rig.torque.rate_hz, rig.tick_rate_hz / 2.0
    density = np.full(frequency_hz.shape, sensor_density(rig.torque))
    folds = math.ceil(half_hz / rate_hz)
    for fold in range(-folds, folds + 1):
        unfolded_hz = np.abs(frequency_hz + fold * rate_hz)
        inside = unfolded_hz < half_hz
        if np.any(inside):
            density[inside] += subject_density(subject, unfolded_hz[inside], rig.tick_rate_hz)
    return density * rate_hz


@dataclass(frozen=True)
class EpochLines:
    """Window and lines of one epoch.

    Attributes
    ----------
    rate_hz : float
        Of the torque.
    window : array, shape (n,)
        One value a sample of the torque; as many from the start as make a fast FFT.
    line : array of int, shape (m,)
        Which lines of the FFT are used.
    """

    rate_hz: float
    window: Array
    line: NDArray[np.intp]

    @property
    def band_hz(self) -> tuple[float, float]:
        """The first and the last line."""
        low, high = self.line[[0, -1]] * self.rate_hz / self.window.size
        return float(low), float(high)


def layout(record: PredictedRecord, estimation: EstimationSettings) -> EpochLines:
    """Return window and lines as the estimation lays them out where the drive is known.

    Parameters
    ----------
    record : PredictedRecord
    estimation : EstimationSettings
        Its `trim_s` is the length of a taper. The band is from `band_low_hz` to
        `band_high_closed_loop_hz`, or 0.4 times the torque rate; the line below it counts too.

    Raises
    ------
    UserError
        If the band holds too few lines.
    """
    low_hz = estimation.band_low_hz
    high_hz = min(estimation.band_high_closed_loop_hz, USABLE_FRACTION_OF_RATE * record.rate_hz)
    n = scipy.fft.prev_fast_len(record.motion.shape[1], real=True)
    length_s = n / record.rate_hz
    first = max(math.ceil(low_hz * length_s - _ROUNDING) - 1, 1)
    line = np.arange(first, math.floor(high_hz * length_s + _ROUNDING) + 1, dtype=np.intp)
    if line.size < FEWEST_LINES:
        raise UserError(
            f"the band {low_hz:g} to {high_hz:g} Hz holds {line.size} lines of an epoch of "
            f"{length_s:.3g} s; the fit needs at least {FEWEST_LINES}"
        )
    return EpochLines(record.rate_hz, _window(n, record.rate_hz, estimation.trim_s), line)


def weighted_products(
    record: PredictedRecord, rig: RigSettings, subject: SubjectSettings, lines: EpochLines
) -> tuple[Array, Array]:
    """Return A and Q, each of shape (3, 3).

    Parameters
    ----------
    record : PredictedRecord
    rig : RigSettings
        For the torque sensor; it or the subject must make some noise.
    subject : SubjectSettings
        For voluntary torque and tremor.
    lines : EpochLines
    """
    window, line, n = lines.window, lines.line, lines.window.size
    # Over twice the length nothing wraps around, and line k is bin 2k.
    covariance = noise_covariance(rig, subject, n + 1)
    covariance = np.concatenate([covariance, covariance[n - 1 : 0 : -1]])
    pairs = scipy.fft.irfft(np.abs(scipy.fft.rfft(window, 2 * n)) ** 2, 2 * n)
    power = scipy.fft.rfft(pairs * covariance).real[2 * line]
    motion = record.motion[:, :n]
    # A mean is not fitted: the estimation takes it out under the window.
    mean = np.sum(window**2 * motion, axis=1) / np.sum(window**2)
    Z = scipy.fft.rfft(window * (motion - mean[:, None]))[:, line]
    weighted = np.zeros((3, n // 2 + 1), dtype=np.complex128)
    weighted[:, line] = Z / power
    A = np.real(weighted[:, line] @ Z.conj().T)
    # irfft sums both signs of frequency over n: Re Σ of one sign is n/2 times that.
    h = window * scipy.fft.irfft(weighted, n) * (n / 2.0)
    Q = (
        h
        @ scipy.fft.irfft(scipy.fft.rfft(h, 2 * n) * scipy.fft.rfft(covariance).real, 2 * n)[
            :, :n
        ].T
    )
    return np.asarray(A), np.asarray(Q)


def _window(n: int, rate_hz: float, taper_s: float) -> Array:
    """Return a window whose ends rise and fall as (1 − cos(π t/taper))/2."""
    if taper_s == 0.0:
        return np.ones(n)
    centre_s = (np.arange(n) + 0.5) / rate_hz
    edge_s = np.minimum(centre_s, n / rate_hz - centre_s)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.minimum(edge_s / taper_s, 1.0)))
