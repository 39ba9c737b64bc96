"""What follows the perturbation and is not J, B and K: a test in the method's own band.

Epochs of one sequence hold the same response to it and different noise. What the fits leave
therefore has a mean over the epochs only where the joint is not what Eq. 3 says: a soft cuff, a
reflex, a lag between the channels. In a band of m lines and over E epochs with residuals R_e,

    F = E Σ |R̄|² / S ÷ Σ_e Σ |R_e − R̄|² / (S (E − 1))

has Fisher's distribution with 2m and 2m (E − 1) degrees of freedom when nothing but noise is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy import stats

from rigidimeter.estimation.closedloop.linear_problems import Problem
from rigidimeter.estimation.closedloop.observation import Observation
from rigidimeter.estimation.closedloop.refine import LineFit
from rigidimeter.records import Finding
from rigidimeter.settings import DiagnosticsSettings

FEWEST_EPOCHS = 3
SPLIT = (0.25, 0.5)
"""The band is tested in three parts, divided at these shares of its upper edge."""

CHANCE = 1e-4
"""Probability, over the parts, below which the mean is not taken for noise."""


class Misfit(NamedTuple):
    """One part of the band.

    Attributes
    ----------
    low_hz, high_hz : float
    share : float
        Of the torque's response to the perturbation, what follows it beyond the model, less what
        noise would leave; 0 to 1 and beyond.
    p : float
        Probability of as much from noise alone.
    """

    low_hz: float
    high_hz: float
    share: float
    p: float


def misfits(
    observations: Sequence[Observation], problems: Sequence[Problem], fits: Sequence[LineFit]
) -> list[Misfit]:
    """Return the misfit in each part of the band; none for fewer than three epochs.

    Parameters
    ----------
    observations, problems, fits
        Of epochs with the same response to the perturbation.
    """
    count = len(fits)
    if count < FEWEST_EPOCHS:
        return []
    residual = np.stack(
        [problem.target - problem.regressors @ fit.values
         for problem, fit in zip(problems, fits, strict=True)]
    )  # fmt: skip
    torque = np.stack([observation.lines.torque_nm for observation in observations])
    mean, response = residual.mean(0), torque.mean(0)
    scatter = np.sum(np.abs(residual - mean) ** 2, axis=0) / (count - 1)
    power = fits[0].shape.at(observations[0].lines)
    frequency = observations[0].lines.grid.omega_rad_s / (2 * np.pi)
    edges = [0.0, *(share * frequency[-1] for share in SPLIT), np.inf]
    found = []
    for low, high in pairwise(edges):
        part = (frequency >= low) & (frequency < high)
        m = int(np.count_nonzero(part))
        if m == 0:
            continue
        between = count * np.sum(np.abs(mean[part]) ** 2 / power[part]) / (2 * m)
        within = np.sum(scatter[part] / power[part]) / (2 * m)
        beyond = float(np.sum(np.abs(mean[part]) ** 2 - scatter[part] / count))
        size = float(np.sum(np.maximum(np.abs(response[part]) ** 2 - scatter[part] / count, 0)))
        found.append(
            Misfit(
                float(frequency[part][0]),
                float(frequency[part][-1]),
                float(np.sqrt(max(beyond, 0.0) / size)) if size > 0 else 0.0,
                float(stats.f.sf(between / within, 2 * m, 2 * m * (count - 1))),
            )
        )
    return found


def worst_misfit(parts: Sequence[Misfit], settings: DiagnosticsSettings) -> Finding | None:
    """Return the finding for the part with the largest misfit that is not noise; None without."""
    most = settings.lack_of_fit_most_percent
    sure = [part for part in parts if part.p * len(parts) < CHANCE and 100 * part.share > most]
    if not sure:
        return None
    worst = max(sure, key=lambda part: part.share)
    return Finding(
        "lack_of_fit",
        settings.levels.lack_of_fit,
        100 * worst.share,
        most,
        f"from {worst.low_hz:.3g} to {worst.high_hz:.3g} Hz {100 * worst.share:.2g} % of the "
        f"torque's response to the perturbation is not J, B and K (at most {most:g} %; by chance "
        f"p = {worst.p:.1g}): a soft cuff, a reflex or a lag of a channel is taken for the joint",
        "lower the upper edge of the band (--band-hz) and see whether J and B change; look at the "
        "coupling",
    )
