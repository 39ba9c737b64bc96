"""Torque over angle at the lines of a periodic perturbation: the joint without a model.

Over P whole periods the response to a periodic perturbation is in every P-th line; the lines in
between hold nothing but noise, so signal and noise are seen apart in one epoch. The ratio at the
excited lines,

    γ²(f) = |response|² / (|response|² + noise)

is the coherence between perturbation and torque, and the ratio of torque to angle the impedance of
the joint, K − J ω² + i B ω.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.closedloop.lack_of_fit import (
    Answer,
    proportional,
    toward_zero_phase,
)
from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.signals import Array

Complex = NDArray[np.complex128]

CHANCE = 1e-6
"""A motion that answers with a larger probability by chance does not follow the perturbation."""


class Impedance(NamedTuple):
    """Torque over angle at the excited lines, and the coherence; each of shape (m,)."""

    frequency_hz: Array
    impedance_nm_rad: Complex
    coherence: Array


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
        mask = observation.excited
        turn = toward_zero_phase(perturbation_lines(observation))[mask]
        torque += turn * observation.torque_nm[mask]
        angle += turn * observation.motion[mask, 2]
        between = np.where(mask, np.nan, np.abs(observation.torque_nm) ** 2)
        beside = sliding_window_view(np.pad(between, 2, constant_values=np.nan), 5)
        noise += np.nanmean(beside[mask], axis=1)
    power = np.abs(torque) ** 2
    grid = observations[0].grid
    frequency_hz = grid.omega_rad_s[observations[0].excited] / (2 * np.pi)
    return Impedance(frequency_hz, np.asarray(torque / angle), np.clip(1 - noise / power, 0.0, 1.0))


def perturbation_lines(observation: Observation) -> Complex:
    """Return the perturbation at the lines, held from tick to tick, shape (m,)."""
    grid, cause = observation.grid, observation.perturbation
    assert cause is not None  # without one an epoch has no lines of it
    # A hundredth of a tick of rounding must not hold the level before.
    stamps = cause.time_s - 0.01 / cause.mean_rate_hz
    level = cause.values[np.maximum(np.searchsorted(stamps, grid.time_s, side="right") - 1, 0)]
    return grid.transform(level)


def follows_perturbation(observation: Observation) -> bool:
    """Return whether any of the motion answers the perturbation, beyond chance.

    The velocity is regressed on the perturbation in groups of neighbouring lines, so a perturbation
    with stamps of another clock, or of another epoch, has no answer.
    """
    answer = Answer(observation, perturbation_lines(observation), observation.motion[:, 1])
    parts = proportional([answer])
    return min(part.p for part in parts) * len(parts) < CHANCE
