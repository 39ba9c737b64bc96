"""A multisine in place of the PRBS: equal lines in the wanted band and nothing outside it.

    p(t) = a Σ_k cos(2π k t / T + φ_k),    wanted_low ≤ k/T ≤ wanted_high

A binary sequence has the most power for its peak (crest factor 1), but a quarter of it lies outside
the wanted band. A multisine wastes none, and pays with its crest factor, peak over root mean
square. Schroeder's phases keep that below 1.9 where random phases give 3 to 4; clipping the signal
and taking the phases of what is left, again and again, brings it down to about 1.5.

References
----------
M. R. Schroeder, "Synthesis of low-peak-factor signals", IEEE Trans. Inf. Theory 16, 1970.
E. van der Ouderaa, J. Schoukens and J. Renneboog, "Peak factor minimization using a time-frequency
domain swapping algorithm", IEEE Trans. Instrum. Meas. 37, 1988.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.records import readonly
from rigidimeter.core.settings import Settings
from rigidimeter.planning.perturbations import tick_count, tick_times_s
from rigidimeter.planning.precision import PredictedPrecision, predicted_precision

_POINTS_PER_CYCLE = 16
_CLIP_AT = 0.9
"""Each step clips at this part of the peak, and at ever more of it."""

_STREAM = 20
"""Separates the random phases from all other random numbers of the same seed."""


def crest_factor(torque_nm: NDArray[np.float64]) -> float:
    """Return peak over root mean square; 1 for two levels, √2 for a sine."""
    return float(np.max(np.abs(torque_nm)) / np.sqrt(np.mean(torque_nm**2)))


def multisine_phases_rad(
    first: int, last: int, steps: int, rng: np.random.Generator | None = None
) -> NDArray[np.float64]:
    """Return the phases of lines `first` to `last`, of low crest factor.

    Parameters
    ----------
    first, last : int
        Multiples of 1/T, at least 1, both included.
    steps : int
        How often to clip; the best phases met are kept.
    rng : numpy.random.Generator, optional
        Start from random phases; without it from Schroeder's.

    Returns
    -------
    array, shape (last - first + 1,)
    """
    order = np.arange(last - first + 1)
    if rng is None:
        phases = -np.pi * order * (order + 1) / order.size
    else:
        phases = rng.uniform(0.0, 2.0 * np.pi, order.size)
    points = scipy.fft.next_fast_len(_POINTS_PER_CYCLE * last, real=True)
    lines = slice(first, last + 1)

    def signal(of: NDArray[np.float64]) -> NDArray[np.float64]:
        spectrum = np.zeros(points // 2 + 1, dtype=np.complex128)
        spectrum[lines] = np.exp(1j * of)
        return np.asarray(scipy.fft.irfft(spectrum, points), dtype=np.float64)

    best, lowest = phases, crest_factor(signal(phases))
    for step in range(steps):
        wave = signal(phases)
        peak = float(np.max(np.abs(wave))) * (_CLIP_AT + (1.0 - _CLIP_AT) * step / steps)
        phases = np.angle(scipy.fft.rfft(np.clip(wave, -peak, peak))[lines])
        crest = crest_factor(signal(phases))
        if crest < lowest:
            best, lowest = phases, crest
    return best


def multisine_nm(settings: Settings) -> NDArray[np.float64]:
    """Return the multisine of one epoch, one value a tick.

    It has the duration and the peak of the PRBS, and lines in its wanted band. What remains of a
    mean over the duration is taken off.

    Parameters
    ----------
    settings : Settings
        `multisine`, `prbs` and the tick rate; the seed for random phases.

    Returns
    -------
    array, shape (duration_s * rate_hz,)
        In N·m; the largest magnitude is `prbs.amplitude_nm`.

    Raises
    ------
    UserError
        If the band holds no line, or the period is longer than the epoch.
    """
    prbs, own, rate_hz = settings.prbs, settings.multisine, settings.rig.tick_rate_hz
    period_s = own.period_s or prbs.duration_s
    if period_s > prbs.duration_s:
        raise UserError(
            f"multisine.period_s = {period_s:g} s is longer than prbs.duration_s = "
            f"{prbs.duration_s:g} s: its lines would run together; make it at most that"
        )
    high_hz = min(prbs.wanted_high_hz, 0.45 * rate_hz)
    first = max(1, math.ceil(prbs.wanted_low_hz * period_s - 1e-9))
    last = math.floor(high_hz * period_s + 1e-9)
    if last < first:
        raise UserError(
            f"multisine.period_s = {period_s:g} s puts no line into the wanted band "
            f"{prbs.wanted_low_hz:g} to {high_hz:g} Hz; make it longer"
        )
    rng = np.random.default_rng([settings.seed, _STREAM]) if own.phases == "random" else None
    phases = multisine_phases_rad(first, last, own.crest_steps, rng)
    time_s = tick_times_s(tick_count(prbs.duration_s, rate_hz), rate_hz)
    torque = np.zeros(time_s.size)
    for k, phase in enumerate(phases, start=first):
        torque += np.cos(2.0 * np.pi * k / period_s * time_s + phase)
    torque -= np.mean(torque)
    return np.asarray(torque * (prbs.amplitude_nm / np.max(np.abs(torque))))


@dataclass(frozen=True)
class MultisineComparison:
    """A multisine beside the PRBS.

    `errors` holds, by condition and by what is held equal, the standard errors of J, B and K by
    `iv`: of the PRBS itself (``prbs``), and of the multisine as it is, with the PRBS's peak torque,
    and scaled so that the angle has the PRBS's standard deviation, or its peak.
    """

    torque_nm: NDArray[np.float64]
    crest_factor: float
    errors: dict[str, dict[str, tuple[float, float, float]]]


def compare_multisine(
    settings: Settings,
    perturbation_nm: NDArray[np.float64],
    of_prbs: Mapping[str, PredictedPrecision],
) -> MultisineComparison:
    """Return the multisine and its standard errors beside those of the PRBS in each condition.

    Raises
    ------
    UserError
        As `multisine_nm` and `predicted_precision`.
    """
    torque = multisine_nm(settings)
    errors: dict[str, dict[str, tuple[float, float, float]]] = {}
    for name, ours in of_prbs.items():
        its = predicted_precision(torque, settings, settings.subject[name])
        scales = {
            "same_peak_torque": float(np.max(np.abs(perturbation_nm)) / np.max(np.abs(torque))),
            "same_angle_sd": ours.angle_sd_rad / its.angle_sd_rad,
            "same_peak_angle": ours.peak_angle_rad / its.peak_angle_rad,
        }
        errors[name] = {"prbs": ours.iv.free}
        for what, scale in scales.items():
            J, B, K = (error / scale for error in its.iv.free)
            errors[name][what] = (J, B, K)
    return MultisineComparison(readonly(torque), crest_factor(torque), errors)
