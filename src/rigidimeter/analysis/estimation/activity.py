"""When a muscle was active, from its EMG alone; such stretches are left out, as any stretch is.

The EMG is confined to 20 to 450 Hz, or to 0.45 of its rate, and rectified; its low-pass at 6 Hz, in
both directions, is the envelope. Rest is the quietest fifth of the envelope over the recording: its
upper end is the baseline. A burst begins where the envelope passes `emg_baseline_factor` times
that, reaches to where it falls to half that excess, and lasts `min_burst_s` at least; bursts that
are closer are one. No notch is used: hum raises the baseline and is no burst.

What is chosen by torque or motion biases B and K. For the same reason bursts that follow motion,
as in a stretch reflex, stay in: without them the joint would be another one. The envelope is
correlated with the velocity in either direction and in both, up to `LONGEST_LAG_S` before it. The
largest correlation is held against those with the envelope shifted round by every other time, but
for shifts at which the motion repeats itself. It must also be `LEAST_CORRELATION`: a reflex makes
0.8, two pushes in an epoch 0.1. Who pushes moves the joint too. Where the perturbation was
recorded, the motion is therefore the part of the velocity that it causes, a linear filter found in
the other half of the epoch. Without it the motion must precede the muscle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy

from rigidimeter.analysis.estimation.signals import velocity_at
from rigidimeter.analysis.estimation.stretches import Array, leaving_out, motion_channels, moves
from rigidimeter.core.records import EMG_CHANNELS, ActiveStretch, Activity, Channel, Epoch, LeftOut
from rigidimeter.core.settings import DiagnosticsSettings, Settings
from rigidimeter.model import ENVELOPE_RATE_HZ, emg_band_hz, emg_filters, envelope_step

CHECK = "emg_activity"

BASELINE_QUANTILE = 0.2

TORQUE_OUTLASTS_S = 0.2
"""A muscle still pulls when its EMG is over; so much is left out after a burst too."""

LONGEST_LAG_S = 0.25
CAUSED_WITHIN_S = 1.0
LEAST_SHIFT_S = 1.0
REPEATS = 0.5
"""Correlation of the motion with itself, from which on a shift is none."""

CHANCE = 0.01
LEAST_CORRELATION = 0.3

Spans = list[tuple[float, float]]


def activities(
    recorded: Sequence[Epoch], screened: Sequence[Epoch], settings: Settings
) -> list[tuple[Epoch, Activity | None]]:
    """Return epochs without their active stretches, and what the EMG shows.

    Rest and the largest envelope of a muscle are those of its recording.

    Parameters
    ----------
    recorded : sequence of Epoch
        As they were recorded.
    screened : sequence of Epoch
        The same, without the stretches in which a sensor did not measure.
    settings : Settings
    """
    envelopes = [envelopes_of(epoch) for epoch in recorded]
    muscles: dict[tuple[str, str], list[Array]] = {}
    for epoch, own in zip(recorded, envelopes, strict=True):
        for name, one in own.items():
            muscles.setdefault((epoch.source, name), []).append(one.values)
    whole = {muscle: np.concatenate(values) for muscle, values in muscles.items()}
    rest_v = {muscle: float(np.quantile(v, BASELINE_QUANTILE)) for muscle, v in whole.items()}
    found: list[tuple[Epoch, Activity | None]] = []
    for epoch, without, own in zip(recorded, screened, envelopes, strict=True):
        if not own:
            found.append((without, None))
            continue
        stretches: list[ActiveStretch] = []
        for name, one in own.items():
            spans = bursts(one, rest_v[epoch.source, name], settings.diagnostics)
            locked = bool(spans) and follows_motion(one, epoch)
            stretches += [ActiveStretch(*span, name, locked) for span in spans]
        stretches.sort()
        alone = [
            (one.start_s, one.stop_s + TORQUE_OUTLASTS_S) for one in stretches if not one.locked
        ]
        wanted = [LeftOut(*span, "a muscle was active", CHECK) for span in joined(alone)]
        wanted = wanted if settings.estimation.leave_out_active else []
        left, kept = leaving_out(without, wanted, settings)
        length_s = max(float(one.time_s[-1] - one.time_s[0]) for one in own.values())
        active_s = joined([one[:2] for one in stretches])
        out_s = [one[:2] for one in left.left_out if one.check == CHECK]
        active, out = (100.0 * sum(b - a for a, b in one) / length_s for one in (active_s, out_s))
        largest = [float(np.max(whole[epoch.source, name])) for name in own]
        shared = cocontraction_percent([*own.values()], largest)
        found.append((left, Activity(tuple(stretches), active, min(out, 100.0), shared, kept)))
    return found


def envelopes_of(epoch: Epoch) -> dict[str, Channel]:
    """Return the envelope in V of each muscle that has one, at `ENVELOPE_RATE_HZ` or so."""
    found = {}
    for emg in (epoch.channels[name] for name in EMG_CHANNELS if name in epoch.channels):
        rate_hz = emg.mean_rate_hz
        if len(emg) <= ENVELOPE_RATE_HZ or not np.diff(emg_band_hz(rate_hz)) > 0:
            continue
        raw = np.where(np.isfinite(emg.values), emg.values, 0.0)
        band, low = emg_filters(rate_hz)
        rectified = np.abs(scipy.signal.sosfiltfilt(band, raw))
        values = np.maximum(scipy.signal.sosfiltfilt(low, rectified), 0.0)
        step = envelope_step(rate_hz)
        found[emg.name] = Channel(emg.name, emg.time_s[::step], values[::step])
    return found


def bursts(one: Channel, rest_v: float, settings: DiagnosticsSettings) -> Spans:
    """Return from when to when a muscle was active, in s.

    Parameters
    ----------
    one : Channel
        The envelope.
    rest_v : float
        The baseline; without one, as of a dead channel, there is no burst.
    settings : DiagnosticsSettings
    """
    if not rest_v > 0.0:
        return []
    factor = settings.emg_baseline_factor
    above = one.values > 0.5 * (1.0 + factor) * rest_v
    edges = np.flatnonzero(np.diff(above, prepend=False, append=False))
    found: Spans = []
    for first, after in edges.reshape(-1, 2):
        if np.max(one.values[first:after]) <= factor * rest_v:
            continue
        start_s, stop_s = float(one.time_s[first]), float(one.time_s[after - 1])
        if found and start_s - found[-1][1] < settings.min_burst_s:
            start_s = found.pop()[0]
        found.append((start_s, stop_s))
    return [span for span in found if span[1] - span[0] >= settings.min_burst_s]


def joined(spans: Spans) -> Spans:
    """Return spans in the order of time, those that overlap as one."""
    found: Spans = []
    for start_s, stop_s in sorted(spans):
        if found and start_s <= found[-1][1]:
            start_s, before_s = found.pop()
            stop_s = max(before_s, stop_s)
        found.append((start_s, stop_s))
    return found


def cocontraction_percent(envelopes: Sequence[Channel], largest_v: Sequence[float]) -> float:
    """Return the mean of the smaller over the larger envelope of the first two muscles, in %.

    Each in units of its largest in the recording; NaN with fewer muscles, or where one is dead.
    """
    if len(envelopes) < 2 or not min(largest_v[:2]) > 0.0:
        return math.nan
    first, second = envelopes[:2]
    one = first.values / largest_v[0]
    two = np.interp(first.time_s, second.time_s, second.values) / largest_v[1]
    larger = np.maximum(one, two)
    pulled = larger > 0.0
    return 100.0 * float(np.mean(np.minimum(one, two)[pulled] / larger[pulled]))


def follows_motion(one: Channel, epoch: Epoch) -> bool:
    """Return whether an envelope follows the motion of its epoch by more than chance.

    Parameters
    ----------
    one : Channel
        The envelope.
    epoch : Epoch
        With its motion as recorded.
    """
    used = [one, *motion_channels(epoch)]
    start_s, stop_s = max(c.time_s[0] for c in used), min(c.time_s[-1] for c in used)
    inside = (one.time_s >= start_s) & (one.time_s <= stop_s)
    time_s, values, rate_hz = one.time_s[inside], one.values[inside], one.mean_rate_hz
    lags, least = round(LONGEST_LAG_S * rate_hz), round(LEAST_SHIFT_S * rate_hz)
    if len(used) == 1 or time_s.size < 8 * lags:
        return False
    velocity = np.asarray(velocity_at(epoch, time_s))
    if not np.all(np.isfinite(velocity)):
        return False
    perturbation = epoch.channels.get("perturbation_nm")
    known = perturbation is not None and moves(perturbation)
    if perturbation is not None and known:
        pushed_nm = np.interp(time_s, perturbation.time_s, perturbation.values)
        velocity = _caused(velocity, pushed_nm, round(CAUSED_WITHIN_S * rate_hz))
    up, down = np.maximum(velocity, 0.0), np.maximum(-velocity, 0.0)
    found = _correlations(np.stack([up, down, up + down]), values)
    # The largest within the lags after each shift, shape (n,).
    after = np.max([np.roll(found, -lag, axis=1) for lag in range(lags + 1)], axis=(0, 1))
    if after[0] < LEAST_CORRELATION or (not known and np.max(found[:, -lags:]) > after[0]):
        return False
    itself = _correlations(velocity[np.newaxis], velocity)[0]
    shifted = (after[least:-least])[np.abs(itself[least:-least]) < REPEATS]
    return bool((1 + np.count_nonzero(shifted >= after[0])) / (1 + shifted.size) <= CHANCE)


def _caused(velocity_rad_s: Array, perturbation_nm: Array, taps: int) -> Array:
    """Return the velocity that a perturbation causes, each half by a filter of the other.

    So that nothing that the subject does is fitted by chance.
    """
    padded = np.concatenate([np.zeros(taps - 1), perturbation_nm - np.mean(perturbation_nm)])
    before = np.lib.stride_tricks.sliding_window_view(padded, taps)
    half = velocity_rad_s.size // 2
    parts = slice(None, half), slice(half, None)
    filters = (np.linalg.lstsq(before[p], velocity_rad_s[p], rcond=1e-3)[0] for p in parts[::-1])
    return np.concatenate([before[p] @ one for p, one in zip(parts, filters, strict=True)])


def _correlations(sides: Array, values: Array) -> Array:
    """Return correlation coefficients by the lag of the values, which goes round: shape (k, n)."""
    n = values.size
    one, other = (
        np.fft.rfft((x - x.mean(axis=-1, keepdims=True)) / (x.std(axis=-1, keepdims=True) + 1e-300))
        for x in (sides, values)
    )
    return np.asarray(np.fft.irfft(one.conj() * other, n)) / n
