"""What a page shows of epochs over time, without all their samples: traces, facts of channels.

Where an epoch has more samples than are kept in its traces, every n-th one is; it is shown only as
far as that leaves enough points for the highest frequency.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation import Ready, epoch_signals, scoring_cycles
from rigidimeter.analysis.traces.examples import Prepared
from rigidimeter.core.records import Analysis, Channel, Epoch, Fit, Score
from rigidimeter.core.settings import Settings

MOST_POINTS = 800
POINTS_PER_CYCLE = 3.0
"""Of the highest frequency: what is less would not show its peaks."""

_STEPS = 2**15 - 1


@dataclass(frozen=True)
class ChannelFacts:
    """What tables say of a channel of an epoch.

    Attributes
    ----------
    name : str
    rate_hz, mean_rate_hz : float
        As `Channel` has them.
    span_s : float
        From the first sample to the last; NaN without one.
    lowest, highest : float
        Of its finite samples, in its unit; NaN without one.
    """

    name: str
    rate_hz: float
    mean_rate_hz: float
    span_s: float
    lowest: float = math.nan
    highest: float = math.nan


@dataclass(frozen=True)
class EpochTrace:
    """The traces of an epoch: each a unit and 16-bit numbers in base64, little-endian.

    Attributes
    ----------
    source, epoch : str
    start_s : float
        Of the first point, from the start of the epoch.
    step_s : float
    shown_s, length_s : float
        How much is shown, of how much.
    series : mapping of str to (float, str)
        ``torque``, ``angle`` and of a fit ``residual``.
    active : tuple of (float, float)
        From when to when a muscle was active, in s from the start of the epoch.
    """

    source: str
    epoch: str
    start_s: float
    step_s: float
    shown_s: float
    length_s: float
    series: Mapping[str, tuple[float, str]]
    active: tuple[tuple[float, float], ...] = ()


def channel_facts(epochs: Iterable[Epoch]) -> tuple[tuple[ChannelFacts, ...], ...]:
    """Return what tables say of the channels of each epoch, in the order of the epochs."""
    return tuple(tuple(map(_facts, epoch.channels.values())) for epoch in epochs)


def _facts(channel: Channel) -> ChannelFacts:
    span_s = float(channel.time_s[-1] - channel.time_s[0]) if len(channel) else float("nan")
    finite = channel.values[np.isfinite(channel.values)]
    ends = (float(finite.min()), float(finite.max())) if finite.size else (math.nan, math.nan)
    return ChannelFacts(channel.name, channel.rate_hz, channel.mean_rate_hz, span_s, *ends)


def epoch_traces(
    analysis: Analysis, prepared: Prepared, settings: Settings
) -> Iterator[EpochTrace]:
    """Yield what the page shows of each epoch that was fitted or scored, each once.

    Parameters
    ----------
    analysis : Analysis
    prepared : mapping of (str, str) to Ready
        As `prepared_epochs` returns it.
    settings : Settings
        Of the study.
    """
    results: list[Fit | Score] = [*analysis.fits, *analysis.scores]
    seen: set[tuple[str, str]] = set()
    for one in results:
        key = one.source, one.epoch
        if key not in seen and (trace := _trace(one, prepared.get(key), settings)) is not None:
            seen.add(key)
            yield trace


def _trace(one: Fit | Score, ready: Ready | None, settings: Settings) -> EpochTrace | None:
    if ready is None:
        return None
    epoch = ready.epoch
    try:
        if isinstance(one, Fit):
            if ready.obstacle:
                return None
            signals = epoch_signals(epoch, ready.settings, one.method, ready.drive)
            model = signals.motion @ np.asarray(one.value)
            series = {
                "torque": signals.torque_nm,
                "residual": signals.torque_nm - model,
                "angle": np.degrees(signals.angle_rad),
            }
            time_s, highest_hz = signals.time_s, signals.band_hz[1]
        else:
            cycles = scoring_cycles(epoch, settings.scores)
            series = {"torque": cycles.torque_nm, "angle": np.degrees(cycles.angle_rad)}
            time_s, highest_hz = cycles.time_s, 5 * cycles.frequency_hz
    except ValueError:
        return None  # it could not be fitted or scored: the exclusions say why
    if not all(np.isfinite(values).all() and values.size > 1 for values in series.values()):
        return None
    begins_s = min(c.time_s[0] for c in epoch.channels.values() if len(c))
    start_s = float(time_s[0] - begins_s)
    activity = one.activity if isinstance(one, Fit) else None
    bursts = () if activity is None else activity.stretches
    kept, shown_s = thinned(time_s, highest_hz)
    return EpochTrace(
        one.source,
        one.epoch,
        round(start_s, 4),
        float(np.mean(np.diff(time_s[kept]))),
        shown_s,
        float(time_s[-1] - time_s[0]),
        {name: packed(values[kept]) for name, values in series.items()},
        tuple((round(b.start_s - begins_s, 3), round(b.stop_s - begins_s, 3)) for b in bursts),
    )


def thinned(time_s: NDArray[np.float64], highest_hz: float) -> tuple[slice, float]:
    """Return which samples are kept, and how much of the epoch they show, in s.

    Parameters
    ----------
    time_s : array, shape (n,)
        Evenly spaced, at least two.
    highest_hz : float
        The highest frequency of the signals.
    """
    length_s = float(time_s[-1] - time_s[0])
    rate_hz = (time_s.size - 1) / length_s
    most = max(int(rate_hz / (POINTS_PER_CYCLE * highest_hz)), 1)
    every = min(-(-time_s.size // MOST_POINTS), most)
    kept = slice(0, every * MOST_POINTS, every)
    if time_s.size > every * MOST_POINTS:
        return kept, float(time_s[kept][-1] - time_s[0])
    return kept, length_s


def packed(values: NDArray[np.float64]) -> tuple[float, str]:
    """Return a signal as the size of its unit and 16-bit numbers in base64, little-endian.

    Examples
    --------
    >>> unit, text = packed(np.array([0.5, -1.0]))
    >>> list(unit * np.frombuffer(base64.b64decode(text), "<i2"))
    [0.5000152592547379, -1.0]
    """
    largest = float(np.max(np.abs(values)))
    unit = largest / _STEPS if largest > 0 else 1.0
    whole = np.round(values / unit).astype("<i2")
    return unit, base64.b64encode(whole.tobytes()).decode("ascii")
