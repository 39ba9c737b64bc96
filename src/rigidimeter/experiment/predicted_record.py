"""What an epoch will leave in the file: the motion at the torque's stamps, and the torque's noise.

The torque is sampled at points in time, k/rate − latency, and an estimate holds each sample against
the motion at that point. For a torque slower than the loop this matters: the edge of a chip is an
acceleration of many times the torque rate, and its samples fold that into the band. The noise in
the samples has the autocovariance

    r(τ) = ∫ S(f) e^(2πifτ) df + σ² [τ = 0]

with S the density of the subject's own torque and σ² the variance of the sensor.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.fft import irfft, next_fast_len, rfftfreq
from scipy.interpolate import CubicSpline

from rigidimeter.dynamics import ClosedLoopMotion, sensor_density, subject_density
from rigidimeter.dynamics.velocity_drive import Array
from rigidimeter.records import readonly
from rigidimeter.settings import RigSettings, SubjectSettings

__all__ = ["Record", "expected_record", "noise_covariance", "noise_spectrum"]

_MEMORY = 10.0
"""After so many periods of its lowest frequency, or of 2 s for the tremor, the subject's torque has
forgotten itself."""

_ROUNDING = 1e-6
"""Of a sample: a stamp that is a rounding error late still counts."""


class Record(NamedTuple):
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


def expected_record(motion: ClosedLoopMotion, rig: RigSettings) -> Record:
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
    columns = (motion.acceleration_rad_s2, motion.velocity_rad_s, motion.angle_rad)
    at_stamps = CubicSpline(np.arange(ticks) / rig.tick_rate_hz, np.stack(columns), axis=1)
    return Record(rate_hz, np.asarray(at_stamps(stamps_s), dtype=np.float64))


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
        # So long that what comes round has died out.
        memory_s = max(_MEMORY / subject.voluntary_low_hz, 2.0 * _MEMORY)
        half_s = max(lag_s[-1], (lag_s[-1] + memory_s) / 2.0)
        half = next_fast_len(math.ceil(half_s * rig.tick_rate_hz) + 2, real=True)
        density = subject_density(
            subject, rfftfreq(2 * half, 1.0 / rig.tick_rate_hz), rig.tick_rate_hz
        )
        at_ticks = irfft(density, 2 * half)[: half + 1] * rig.tick_rate_hz
        covariance += CubicSpline(np.arange(half + 1) / rig.tick_rate_hz, at_ticks)(lag_s)
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
