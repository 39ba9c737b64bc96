"""A recorded perturbation: whether it can be used, at every tick, and how it repeats."""

from __future__ import annotations

import numpy as np
import scipy

from rigidimeter.core.records import Channel, Epoch

REPEATS = 0.999
"""The correlation of a perturbation with itself one period later, at least."""


def closed_loop_obstacle(epoch: Epoch) -> str:
    """Return why the methods of the closed loop cannot be used, or an empty text."""
    perturbation = epoch.channels.get("perturbation_nm")
    if perturbation is None:
        return "perturbation_nm was not recorded"
    if len(perturbation) < 2 or not np.all(np.isfinite(perturbation.values)):
        return "perturbation_nm holds no samples or numbers that are not finite"
    if float(np.ptp(perturbation.values)) == 0.0:
        return "perturbation_nm is constant"
    torque = epoch.channels.get("torque_nm")
    if torque is not None and np.array_equal(torque.values, perturbation.values):
        return "perturbation_nm holds the same numbers as torque_nm"
    return ""


def period_s(perturbation: Channel) -> float | None:
    """Return the shortest period of a perturbation; None if it does not repeat within the epoch."""
    values = perturbation.values - np.mean(perturbation.values)
    n = values.size
    length = scipy.fft.next_fast_len(2 * n, real=True)
    spectrum = scipy.fft.rfft(values, length)
    products = scipy.fft.irfft(np.abs(spectrum) ** 2, length)[: n // 2 + 1]
    power = np.concatenate(([0.0], np.cumsum(values**2)))
    lag = np.arange(products.size)
    scale = np.sqrt((power[n] - power[lag]) * power[n - lag])
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = products / scale
    low = np.flatnonzero(correlation < 0.5)
    if low.size == 0:
        return None
    again = np.flatnonzero(correlation[low[0] :] > REPEATS)
    if again.size == 0:
        return None
    # The best of the neighbours: a period need not be a whole number of ticks.
    first = low[0] + again[0]
    near = slice(first, min(first + 3, products.size))
    return float(first + np.argmax(correlation[near])) / perturbation.mean_rate_hz


def whole_periods(perturbation: Channel, grid_rate_hz: float, samples: int) -> tuple[int, int]:
    """Return how many whole periods an epoch holds, and how many samples they are.

    Raises
    ------
    ValueError
        If the epoch does not hold two whole periods.
    """
    period = period_s(perturbation)
    periods = 0 if period is None else int(samples / grid_rate_hz / period + 1e-6)
    if period is None or periods < 2:
        long_s = samples / grid_rate_hz
        shown = (
            f"no period of the perturbation is twice in the {long_s:.3g} s in a row"
            if period is None
            else f"the perturbation repeats every {period:.3g} s, and of the {2 * period:.3g} s of "
            f"two periods there are {long_s:.3g} s in a row"
        )
        raise ValueError(
            f"{shown} that can be used; the spectral method needs two whole periods with nothing "
            "left out between; use --method iv, which needs none and allows for what is left out"
        )
    return periods, round(periods * period * grid_rate_hz)


def while_sampled(perturbation: Channel, torque: Channel) -> Channel:
    """Return the perturbation while the torque was sampled: elsewhere it may not be known."""
    early, late = np.searchsorted(perturbation.time_s, torque.time_s[[0, -1]])
    rows = slice(int(early), int(late) + 1)
    return Channel(perturbation.name, perturbation.time_s[rows], perturbation.values[rows])


def evenly(perturbation: Channel) -> Channel:
    """Return the perturbation at every tick: the last level is held where ticks are missing."""
    interval_s, spacing_s = 1.0 / perturbation.rate_hz, np.diff(perturbation.time_s)
    if np.max(spacing_s) - np.min(spacing_s) < 0.5 * interval_s:
        return perturbation
    count = int((perturbation.time_s[-1] - perturbation.time_s[0]) / interval_s + 0.5) + 1
    time_s = perturbation.time_s[0] + interval_s * np.arange(count)
    last = np.searchsorted(perturbation.time_s, time_s + 0.5 * interval_s, side="right") - 1
    return Channel(perturbation.name, time_s, perturbation.values[np.maximum(last, 0)])
