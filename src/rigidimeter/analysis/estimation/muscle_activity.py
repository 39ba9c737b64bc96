"""When a muscle was active, from its EMG alone.

The EMG is confined to 20 to 450 Hz, or to 0.45 of its rate, and rectified; its low-pass at 6 Hz, in
both directions, is the envelope. Rest is the quietest fifth of the envelope over the recording: its
upper end is the baseline. A burst begins where the envelope passes `emg_baseline_factor` times
that, reaches to where it falls to half that excess, and lasts `min_burst_s` at least; bursts that
are closer are one. No notch is used: hum raises the baseline and is no burst.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy

from rigidimeter.core.records import EMG_CHANNELS, Channel, Epoch
from rigidimeter.core.settings import DiagnosticsSettings
from rigidimeter.model import ENVELOPE_RATE_HZ, emg_band_hz, emg_filters, envelope_step

BASELINE_QUANTILE = 0.2

Spans = list[tuple[float, float]]


def emg_channels(epoch: Epoch) -> list[Channel]:
    """Return the EMG of every muscle that has an envelope: ``emg_v``, ``emg_2_v`` and so on."""
    muscles = (epoch.channels[name] for name in EMG_CHANNELS if name in epoch.channels)
    return [
        one
        for one in muscles
        if len(one) > ENVELOPE_RATE_HZ and np.diff(emg_band_hz(one.mean_rate_hz)) > 0
    ]


def envelope(emg: Channel) -> Channel:
    """Return the envelope of an EMG in V, at `ENVELOPE_RATE_HZ` or so."""
    rate_hz = emg.mean_rate_hz
    raw = np.where(np.isfinite(emg.values), emg.values, 0.0)
    band, low = emg_filters(rate_hz)
    rectified = np.abs(scipy.signal.sosfiltfilt(band, raw))
    step = envelope_step(rate_hz)
    values = np.maximum(scipy.signal.sosfiltfilt(low, rectified), 0.0)
    return Channel(emg.name, emg.time_s[::step], values[::step])


def baseline_v(envelopes: Sequence[Channel]) -> float:
    """Return the baseline of a muscle from its envelopes in all epochs of a recording, in V."""
    return float(np.quantile(np.concatenate([one.values for one in envelopes]), BASELINE_QUANTILE))


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
    for first, after in zip(edges[::2], edges[1::2], strict=True):
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
            found[-1] = found[-1][0], max(found[-1][1], stop_s)
        else:
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


def share_percent(spans: Spans, length_s: float) -> float:
    """Return which share of an epoch spans that do not overlap are, in %."""
    return 100.0 * sum(stop_s - start_s for start_s, stop_s in spans) / length_s
