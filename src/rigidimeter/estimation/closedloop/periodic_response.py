"""The periodic response: what repeats with the perturbation, against what does not.

Over P whole periods the response to a periodic perturbation is in every P-th line; the lines in
between hold nothing but noise, so signal and noise are seen apart in one epoch. The ratio at the
excited lines,

    γ²(f) = |response|² / (|response|² + noise)

is the coherence between perturbation and torque. J, B and K are fitted to the excited lines alone,
each weighted with the inverse of the noise beside it: γ²/(1 − γ²) times the response.

The ratio of torque to angle at the excited lines is the impedance of the joint, K − J ω² + i B ω,
without any model: `impedance` gives it for a figure.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from rigidimeter.estimation.closedloop.instruments import instrumental
from rigidimeter.estimation.closedloop.refine import Observation, Problem
from rigidimeter.estimation.signals import Array
from rigidimeter.records import Channel

__all__ = ["Impedance", "impedance", "period_s", "periodic", "whole_periods"]

Complex = NDArray[np.complex128]

REPEATS = 0.999
"""The correlation of a perturbation with itself one period later, at least."""


class Impedance(NamedTuple):
    """Torque over angle at the excited lines, and the coherence; each of shape (m,)."""

    frequency_hz: Array
    impedance_nm_rad: Complex
    coherence: Array


def period_s(perturbation: Channel) -> float | None:
    """Return the shortest period of a perturbation; None if it does not repeat within the epoch."""
    values = perturbation.values - np.mean(perturbation.values)
    n = values.size
    spectrum = fft.rfft(values, 2 * n)
    products = fft.irfft(np.abs(spectrum) ** 2)[: n // 2 + 1]
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
        raise ValueError(
            "the spectral method needs two whole periods of the perturbation in an epoch; "
            "use --method iv"
        )
    return periods, round(periods * period * grid_rate_hz)


def periodic(observations: Sequence[Observation], values: Array) -> list[Problem]:
    """Return the problems of the excited lines: the others have no weight but show the noise."""
    return [
        problem._replace(instruments=problem.instruments * observation.excited[:, None])
        for observation, problem in zip(
            observations, instrumental(observations, values), strict=True
        )
    ]


def impedance(observations: Sequence[Observation]) -> Impedance:
    """Return the impedance of epochs that share the joint, without a model.

    Torque and angle at the excited lines are added over the epochs, turned so that the
    perturbation has phase zero in each; the coherence is that of the sums.

    Parameters
    ----------
    observations : sequence of Observation
        Made for the spectral method, with their excited lines at the same frequencies.
    """
    count = int(np.count_nonzero(observations[0].excited))
    torque, angle = np.zeros(count, dtype=np.complex128), np.zeros(count, dtype=np.complex128)
    noise = np.zeros(count)
    for observation in observations:
        lines, mask = observation.lines, observation.excited
        turn = _toward_zero_phase(observation)[mask]
        torque += turn * lines.torque_nm[mask]
        angle += turn * lines.motion[mask, 2]
        between = np.abs(lines.torque_nm) ** 2
        between[mask] = np.nan
        beside = [between[max(i - 2, 0) : i + 3] for i in np.flatnonzero(mask)]
        noise += np.array([np.nanmean(part) for part in beside])
    power = np.abs(torque) ** 2
    grid = observations[0].lines.grid
    frequency_hz = grid.omega_rad_s[observations[0].excited] / (2 * np.pi)
    return Impedance(frequency_hz, np.asarray(torque / angle), np.clip(1 - noise / power, 0.0, 1.0))


def _toward_zero_phase(observation: Observation) -> Complex:
    """Return what turns each line so that the perturbation has phase zero in it."""
    grid, cause = observation.lines.grid, observation.perturbation
    # A hundredth of a tick of rounding must not hold the level before.
    stamps = cause.time_s - 0.01 / cause.mean_rate_hz
    level = cause.values[np.maximum(np.searchsorted(stamps, grid.time_s, side="right") - 1, 0)]
    there = grid.transform(level)
    size = np.abs(there)
    return np.asarray(np.where(size > 0, there.conj() / np.where(size > 0, size, 1.0), 1.0))
