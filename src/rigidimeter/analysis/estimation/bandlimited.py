"""Signals of an epoch that all went through the same zero-phase band.

A linear time-invariant filter F commutes with Eq. 3:

    J F(θ'') + B F(θ') + K F(θ) = F(M)

so filtering *every* signal alike leaves J, B and K where they are, while filtering one of them does
not. Drift below the band and sensor noise above it are removed from both sides. The first and last
second are dropped after filtering: there the filter saw no neighbours. So is a second on each side
of what is left out (`analysis.estimation.stretches`).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import scipy

from rigidimeter.analysis.estimation.closedloop.between_samples import (
    driven_behind,
    torque_filter_of,
)
from rigidimeter.analysis.estimation.closedloop.epoch_motion import EpochMotion
from rigidimeter.analysis.estimation.signals import (
    Array,
    Signals,
    columns_at,
    grid_rate_hz,
    kinematics,
    motion_channels,
    uniform_grid,
    usable_hz,
    values_at,
)
from rigidimeter.analysis.estimation.stretches import sound
from rigidimeter.core.records import Epoch
from rigidimeter.core.settings import EstimationSettings
from rigidimeter.model import DriveModel

EDGE_SAMPLES = 10
"""Samples of the slowest channel dropped at each end before filtering.

The derivative of a spline is poor at its ends, and a filter with a long memory would carry that
error into the epoch.
"""


SHORT_MEMORY = 15
"""Samples over which a signal is continued for the low-pass."""


def band_hz(epoch: Epoch, settings: EstimationSettings) -> tuple[float, float]:
    """Return the band for an epoch.

    The upper edge is `band_high_hz` where the perturbation is known (from the session or from a
    recorded perturbation channel) and `band_high_unknown_hz` where it is not, and never above 0.4
    times the rate of the slowest channel used.
    """
    known = epoch.excitation_hz is not None or "perturbation_nm" in epoch.channels
    wanted = settings.band_high_hz if known else settings.band_high_unknown_hz
    return settings.band_low_hz, min(wanted, usable_hz(epoch))


def zero_phase_band(values: Array, rate_hz: float, band: tuple[float, float]) -> Array:
    """Band-pass without phase: Butterworth forwards and backwards.

    Second order at the lower edge and fourth at the upper, each applied twice. The two are
    separate filters because one band-pass over a ratio of 70 would be poorly conditioned.

    The signal is continued by its mirror image for as long as the lower edge remembers. A point
    reflection, scipy's default, would hang that memory on a single sample with its noise: at the
    paper's rates it tripled the scatter of K.

    Parameters
    ----------
    values : array, shape (n,) or (k, n)
    rate_hz : float
    band : (float, float)
    """
    n = values.shape[-1]
    if n <= SHORT_MEMORY:
        raise ValueError(f"{n} samples are too few for a filter; it needs {SHORT_MEMORY + 1}")
    low, high = band
    # To the digits that stamps are good for, so that epochs share their filters.
    lowpass, highpass = _filters(low, high, float(f"{rate_hz:.9g}"))
    smooth = _both_ways(lowpass, values - np.mean(values, axis=-1, keepdims=True), SHORT_MEMORY)
    return _both_ways(highpass, smooth, round(rate_hz / low))


_Filter = tuple[Array, Array]
"""Second-order sections, and their state after a constant of 1."""


@lru_cache(maxsize=16)
def _filters(low_hz: float, high_hz: float, rate_hz: float) -> tuple[_Filter, _Filter]:
    """Return low-pass and high-pass; to design them takes longer than to filter an epoch."""
    lowpass = scipy.signal.butter(4, high_hz, "lowpass", fs=rate_hz, output="sos")
    highpass = scipy.signal.butter(2, low_hz, "highpass", fs=rate_hz, output="sos")
    low, high = ((sos, scipy.signal.sosfilt_zi(sos)) for sos in (lowpass, highpass))
    return low, high


def _both_ways(through: _Filter, values: Array, memory: int) -> Array:
    """Filter forwards and backwards, as `scipy.signal.sosfiltfilt` does with even padding.

    That finds the state after a constant anew for each signal, which takes as long as to filter it.
    """
    sections, settled = through
    n = values.shape[-1]
    past = min(n - 1, memory)
    # The mirror image at each end.
    mirrored = values[..., past:0:-1], values, values[..., -2 : -past - 2 : -1]
    whole = np.concatenate(mirrored, axis=-1)
    settled = settled.reshape(-1, *(1,) * (values.ndim - 1), 2)
    for _ in range(2):
        passed, _ = scipy.signal.sosfilt(sections, whole, zi=settled * whole[..., :1])
        whole = np.ascontiguousarray(passed[..., ::-1])
    return whole[..., past : past + n]


def bandlimited_signals(
    epoch: Epoch, settings: EstimationSettings, drive: DriveModel | None = None
) -> Signals:
    """Return torque, acceleration, velocity and angle through the same band, edges trimmed.

    The motion is that at the torque's samples where the drive is known, as far as the command
    causes it.

    Parameters
    ----------
    epoch : Epoch
        With `torque_nm` and `velocity_rad_s` or `angle_rad`.
    settings : EstimationSettings
        For the band and the trimming.
    drive : DriveModel, optional
        That carried out `velocity_command_rad_s`.
    """
    torque = epoch.channels["torque_nm"]
    band = band_hz(epoch, settings)
    used = [torque, *motion_channels(epoch)]
    rate_hz = grid_rate_hz(used, band[1])
    full = uniform_grid(used, rate_hz)
    moving = EpochMotion(epoch, drive)
    motion = np.stack(kinematics(moving.beyond, full))
    if moving.driven_at is not None:
        # One spline of the three, at the stamps that they share.
        caused = driven_behind(moving.driven_at, torque_filter_of(settings), torque)
        motion += columns_at(torque, caused[::-1], full)
    edge = math.ceil(EDGE_SAMPLES * rate_hz / min(channel.rate_hz for channel in used))
    inner = slice(edge, full.size - edge)
    time_s = full[inner]
    trim = max(round(settings.trim_s * rate_hz) - edge, 0)
    keep = sound(epoch, time_s, settings.trim_s)
    keep[:trim] = keep[time_s.size - trim :] = False
    everything = np.stack([values_at(torque, time_s), *motion[:, inner]])
    torque_nm, angle, velocity, acceleration = zero_phase_band(everything, rate_hz, band)[:, keep]
    return Signals(time_s[keep], torque_nm, acceleration, velocity, angle, rate_hz, band)
