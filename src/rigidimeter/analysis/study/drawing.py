"""From the samples of a result to what a page shows of them: traces, examples, spectra, facts.

Where an epoch has more samples than are kept in its traces, every n-th one is; it is shown only as
far as that leaves enough points for the highest frequency.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation import Ready, epoch_signals, scoring_cycles
from rigidimeter.analysis.study.drawn_signals import ChannelFacts, EpochTrace, facts_of
from rigidimeter.analysis.study.examples import prepared_epochs
from rigidimeter.analysis.study.results import StudyResult
from rigidimeter.core.records import Fit, Score

MOST_POINTS = 800
POINTS_PER_CYCLE = 3.0
"""Of the highest frequency: what is less would not show its peaks."""

_STEPS = 2**15 - 1


def channel_facts(result: StudyResult) -> tuple[tuple[ChannelFacts, ...], ...]:
    """Return what tables say of the channels of each epoch, in the order of the epochs."""
    return tuple(tuple(map(facts_of, epoch.channels.values())) for epoch in result.epochs)


def epoch_traces(result: StudyResult) -> Iterator[EpochTrace]:
    """Yield what the page shows of each epoch that was fitted or scored, each once."""
    analysis = result.analysis
    results: list[Fit | Score] = [*analysis.fits, *analysis.scores]
    seen: set[tuple[str, str]] = set()
    prepared = prepared_epochs(result)
    for one in results:
        key = one.source, one.epoch
        if key not in seen and (trace := _trace(result, one, prepared.get(key))) is not None:
            seen.add(key)
            yield trace


def _trace(result: StudyResult, one: Fit | Score, ready: Ready | None) -> EpochTrace | None:
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
            cycles = scoring_cycles(epoch, result.settings.scores)
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
