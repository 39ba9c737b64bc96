"""The traces of every epoch, small enough to be part of the page.

Each signal is a row of 16-bit numbers and the size of their unit. Where an epoch has more samples
than are kept, every n-th one is; it is shown only as far as that leaves enough points for the
highest frequency.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.estimation import epoch_signals, scoring_cycles
from rigidimeter.records import Fit, Score
from rigidimeter.reporting.numbers import amount, condition_name, number
from rigidimeter.reporting.representative import analysed_epoch, place
from rigidimeter.study import StudyResult

MOST_POINTS = 800
POINTS_PER_CYCLE = 3.0
"""Of the highest frequency: what is less would not show its peaks."""

_STEPS = 2**15 - 1

Trace = dict[str, Any]


def epoch_traces(result: StudyResult) -> dict[tuple[str, str], Trace]:
    """Return what the page shows of each epoch that was fitted or scored, by source and label."""
    analysis = result.analysis
    found: dict[tuple[str, str], Trace] = {}
    results: list[Fit | Score] = [*(analysis.fixed_inertia or analysis.fits), *analysis.scores]
    for one in results:
        key = one.source, one.epoch
        if key not in found and (trace := _trace(result, one)) is not None:
            found[key] = trace
    return found


def _trace(result: StudyResult, one: Fit | Score) -> Trace | None:
    epoch = analysed_epoch(result, one)
    if epoch is None:
        return None
    try:
        if isinstance(one, Fit):
            signals = epoch_signals(epoch, one.method, result.settings.estimation)
            model = signals.motion @ np.asarray(one.value)
            series = {
                "torque": signals.torque_nm,
                "residual": signals.torque_nm - model,
                "angle": np.degrees(signals.angle_rad),
            }
            time_s, highest_hz = signals.time_s, signals.band_hz[1]
            words = "; ".join(_values(one))
        else:
            cycles = scoring_cycles(epoch, result.settings.scores)
            series = {"torque": cycles.torque_nm, "angle": np.degrees(cycles.angle_rad)}
            time_s, highest_hz = cycles.time_s, 5 * cycles.frequency_hz
            words = f"{number(one.work_j)} J and {number(one.impulse_nm_s)} N·m·s per cycle"
    except ValueError:
        return None  # it could not be fitted or scored: the exclusions say why
    if not all(np.isfinite(values).all() and values.size > 1 for values in series.values()):
        return None
    start_s = float(time_s[0] - min(c.time_s[0] for c in epoch.channels.values() if len(c)))
    kept, told = thinned(time_s, highest_hz)
    if not one.outcome.included:
        words += f". Does not count: {one.outcome.reason}"
    return {
        "title": f"{condition_name(one.condition)}, {place(result, one)}",
        "words": f"{words}. {told}".strip(),
        "start": round(start_s, 4),
        "step": float(np.mean(np.diff(time_s[kept]))),
        **{name: packed(values[kept]) for name, values in series.items()},
    }


def _values(fit: Fit) -> Iterator[str]:
    for letter, value, unit in zip(
        "JBK", fit.value, ("kg·m²", "N·m·s/rad", "N·m/rad"), strict=True
    ):
        yield f"{letter} {amount(value, unit)}"
    yield f"VAF {number(fit.vaf_percent)} %"


def thinned(time_s: NDArray[np.float64], highest_hz: float) -> tuple[slice, str]:
    """Return which samples are kept, and what is to be said of the others.

    Parameters
    ----------
    time_s : array, shape (n,)
        Evenly spaced, at least two.
    highest_hz : float
        The highest frequency of the signals.
    """
    rate_hz = (time_s.size - 1) / float(time_s[-1] - time_s[0])
    most = max(int(rate_hz / (POINTS_PER_CYCLE * highest_hz)), 1)
    every = min(-(-time_s.size // MOST_POINTS), most)
    kept = slice(0, every * MOST_POINTS, every)
    shown_s = float(time_s[kept][-1] - time_s[0])
    if time_s.size > every * MOST_POINTS:
        return kept, f"The first {number(shown_s, 3)} s of {number(time_s[-1] - time_s[0], 3)} s."
    return kept, ""


def packed(values: NDArray[np.float64]) -> list[Any]:
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
    return [unit, base64.b64encode(whole.tobytes()).decode("ascii")]


def traces_json(traces: Iterable[Trace]) -> str:
    """Return the traces as JSON that may stand inside an element of the page."""
    text = json.dumps(list(traces), ensure_ascii=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")
