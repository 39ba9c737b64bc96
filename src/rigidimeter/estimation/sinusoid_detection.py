"""Find the sinusoid in a recording that does not say what was imposed."""

from __future__ import annotations

import numpy as np
from scipy import optimize, signal

from rigidimeter.estimation.signals import (
    Array,
    grid_rate_hz,
    kinematics,
    motion_channels,
    uniform_grid,
)
from rigidimeter.records import Epoch, Motion

__all__ = ["find_motion", "single_frequency_share"]

LOWEST_HZ, HIGHEST_HZ = 0.25, 10.0
"""Where the frequency of an imposed sinusoid is looked for: slower motion is drift."""


def find_motion(epoch: Epoch) -> Motion:
    """Return the imposed sinusoid: as recorded, else as found in the angle.

    The frequency is the one whose sinusoid explains most of the moving part; the motion starts and
    stops where the envelope passes half its typical height.

    Raises
    ------
    ValueError
        If the epoch does not move at all.
    """
    if epoch.motion is not None:
        return epoch.motion
    time_s, angle = _angle(epoch)
    peak_hz, _ = _spectral_peak(time_s, angle)
    rate_hz = 1.0 / float(time_s[1] - time_s[0])
    around = signal.butter(
        2, [0.5 * peak_hz, min(2 * peak_hz, 0.45 * rate_hz)], "bandpass", fs=rate_hz, output="sos"
    )
    envelope = np.abs(signal.hilbert(signal.sosfiltfilt(around, angle)))
    moving = np.flatnonzero(envelope > 0.5 * np.quantile(envelope, 0.9))
    first, last = int(moving[0]), int(moving[-1])
    t, x = time_s[first : last + 1], angle[first : last + 1]

    def unexplained(frequency_hz: float) -> float:
        phase = 2 * np.pi * frequency_hz * (t - t[0])
        basis = np.column_stack([np.sin(phase), np.cos(phase), np.ones_like(phase), phase])
        return float(np.sum((x - basis @ np.linalg.lstsq(basis, x, rcond=None)[0]) ** 2))

    width = 1.0 / float(t[-1] - t[0])
    best = optimize.minimize_scalar(
        unexplained, bounds=(max(peak_hz - width, 0.01), peak_hz + width), method="bounded"
    )
    return Motion(float(best.x), float(t[0]), float(t[-1] - t[0]))


def single_frequency_share(epoch: Epoch) -> float:
    """Return the share of the angle's variance within a quarter octave of its strongest line.

    Close to 1 for an imposed sinusoid, well below for a perturbation with many frequencies.
    """
    time_s, angle = _angle(epoch)
    if time_s.size < 16 or not np.any(angle):
        return 0.0
    return _spectral_peak(time_s, angle)[1]


def _angle(epoch: Epoch) -> tuple[Array, Array]:
    used = motion_channels(epoch)
    time_s = uniform_grid(used, grid_rate_hz(used, HIGHEST_HZ / 2))
    angle, _, _ = kinematics(epoch, time_s)
    return time_s, np.asarray(signal.detrend(angle), dtype=np.float64)


def _spectral_peak(time_s: Array, angle: Array) -> tuple[float, float]:
    """Return the frequency of the strongest line and its share of the power."""
    rate_hz = 1.0 / float(time_s[1] - time_s[0])
    frequency_hz, power = signal.periodogram(angle, rate_hz, window="hann", nfft=4 * angle.size)
    inside = (frequency_hz >= LOWEST_HZ) & (frequency_hz <= HIGHEST_HZ)
    if not np.any(power[inside] > 0):
        raise ValueError("the joint does not move")
    peak_hz = float(frequency_hz[inside][np.argmax(power[inside])])
    resolution_hz = 2.0 / float(time_s[-1] - time_s[0])
    near = np.abs(frequency_hz - peak_hz) <= max(0.19 * peak_hz, resolution_hz)
    return peak_hz, float(power[near].sum() / power.sum())
