"""Whether a muscle follows the motion, as in a stretch reflex.

The envelope is correlated with the velocity in either direction and in both, up to `LONGEST_LAG_S`
before it. The largest correlation is held against those with the envelope shifted round by every
other time, but for shifts at which the motion repeats itself, as a periodic one does. It must also
be `LEAST_CORRELATION`: a reflex makes 0.8, two pushes in an epoch 0.1.

A subject who pushes moves the joint too. Where the perturbation was recorded, the motion is
therefore the part of the velocity that it causes, a linear filter found in the other half of the
epoch. Without it the motion must precede the muscle: the correlation is largest there.
"""

from __future__ import annotations

import numpy as np

from rigidimeter.analysis.estimation.signals import Array, motion_channels, velocity_at
from rigidimeter.core.records import Channel, Epoch

LONGEST_LAG_S = 0.25
CAUSED_WITHIN_S = 1.0
LEAST_SHIFT_S = 1.0
REPEATS = 0.5
"""Correlation of the motion with itself, from which on a shift is none."""

CHANCE = 0.01
LEAST_CORRELATION = 0.3


def follows_motion(one: Channel, epoch: Epoch) -> bool:
    """Return whether an envelope follows the motion of its epoch by more than chance.

    Parameters
    ----------
    one : Channel
        The envelope.
    epoch : Epoch
        With its motion as recorded.
    """
    motion = motion_channels(epoch)
    if not motion:
        return False
    start_s = max(float(c.time_s[0]) for c in (one, *motion))
    stop_s = min(float(c.time_s[-1]) for c in (one, *motion))
    inside = (one.time_s >= start_s) & (one.time_s <= stop_s)
    time_s, values = one.time_s[inside], one.values[inside]
    lags = round(LONGEST_LAG_S * one.mean_rate_hz)
    if time_s.size < 8 * lags:
        return False
    velocity = np.asarray(velocity_at(epoch, time_s))
    if not np.all(np.isfinite(velocity)):
        return False
    perturbation = epoch.channels.get("perturbation_nm")
    known = False
    if perturbation is not None and len(perturbation) > 1:
        known = bool(np.ptp(perturbation.values) > 0)
    if perturbation is not None and known:
        pushed = np.interp(time_s, perturbation.time_s, perturbation.values)
        velocity = caused(velocity, pushed, round(CAUSED_WITHIN_S * one.mean_rate_hz))
    up, down = np.maximum(velocity, 0.0), np.maximum(-velocity, 0.0)
    found = correlations(np.stack([up, down, up + down]), values)
    # The largest within the lags after each shift, shape (n,).
    after = np.max([np.roll(found, -lag, axis=1) for lag in range(lags + 1)], axis=(0, 1))
    if after[0] < LEAST_CORRELATION or (not known and np.max(found[:, -lags:]) > after[0]):
        return False
    itself = correlations(velocity[np.newaxis], velocity)[0]
    least = round(LEAST_SHIFT_S * one.mean_rate_hz)
    shifted = (after[least:-least])[np.abs(itself[least:-least]) < REPEATS]
    return bool((1 + np.count_nonzero(shifted >= after[0])) / (1 + shifted.size) <= CHANCE)


def caused(velocity_rad_s: Array, perturbation_nm: Array, taps: int) -> Array:
    """Return the velocity that a perturbation causes, each half by a filter of the other.

    So that nothing that the subject does is fitted by chance.
    """
    padded = np.concatenate([np.zeros(taps - 1), perturbation_nm - np.mean(perturbation_nm)])
    before = np.lib.stride_tricks.sliding_window_view(padded, taps)
    half = velocity_rad_s.size // 2
    parts = slice(None, half), slice(half, None)
    return np.concatenate(
        [
            before[own] @ np.linalg.lstsq(before[other], velocity_rad_s[other], rcond=1e-3)[0]
            for own, other in (parts, parts[::-1])
        ]
    )


def correlations(sides: Array, values: Array) -> Array:
    """Return correlation coefficients by the lag of the values, which goes round: shape (k, n)."""
    n = values.size
    one, other = (
        np.fft.rfft((x - x.mean(axis=-1, keepdims=True)) / (x.std(axis=-1, keepdims=True) + 1e-300))
        for x in (sides, values)
    )
    return np.asarray(np.fft.irfft(one.conj() * other, n)) / n
