"""Whether the band decides what J, B and K are: neighbouring bands that contradict the interval.

The epochs of a condition are fitted again in bands with other edges
(`closedloop.band_sensitivity`). An estimate has the finding where another band moves a parameter by
more than chance, over all bands and parameters together, by more than a share of the parameter, and
by more than half of half the interval of that estimate: then the interval does not hold what other
frequencies say.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigidimeter.analysis.estimation.closedloop.band_sensitivity import BandChange
from rigidimeter.analysis.estimation.found import found, half_widths
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.findings import Effect, Finding, Three
from rigidimeter.core.records import PARAMETERS, BandEstimate, Fit
from rigidimeter.core.settings import DiagnosticsSettings

NAME = "band_sensitivity"

CHANCE = 0.01
"""Probability of a change by chance, over all bands and parameters of a condition."""

OF_HALF = 0.5
"""A change of less than this share of half an interval is within it."""


def band_estimates(
    condition: str, pooled: Fit | None, values: Array, changes: Sequence[BandChange]
) -> list[BandEstimate]:
    """Return what each band gives, the band of the fit first.

    Parameters
    ----------
    condition : str
    pooled : Fit or None
        The fit to all epochs of the condition, where it was made by the perturbation.
    values : array, shape (3,)
        J, B and K in the band of the fit, in its place.
    changes : sequence of BandChange
    """
    if not changes:
        return []
    at = values if pooled is None else pooled.value
    # Halves of the epochs are of the band of the fit.
    low_hz, high_hz = changes[-1].low_hz, changes[-1].high_hz
    own = BandEstimate(
        condition, low_hz, high_hz, "all", _three(at), (0.0,) * 3, (0.0,) * 3, (1.0,) * 3
    )
    others = [
        BandEstimate(
            condition,
            band.low_hz,
            band.high_hz,
            band.part,
            _three(at + band.change),
            _three(band.change),
            _three(band.change_se),
            _three(band.p),
        )
        for band in changes
    ]
    return [own, *others]


def band_finding(
    fit: Fit, changes: Sequence[BandChange], settings: DiagnosticsSettings
) -> list[Finding]:
    """Return the finding of a fit that another band contradicts; nothing where none does.

    Parameters
    ----------
    fit : Fit
        Of an epoch of the condition, or of all of them.
    changes : sequence of BandChange
    settings : DiagnosticsSettings
    """
    bands = [band for band in changes if band.part == "all"]
    if not bands:
        return []
    change = np.array([band.change for band in bands])
    p = np.minimum(change.size * np.array([band.p for band in bands]), 1.0)  # Bonferroni
    percent = 100 * np.abs(change / fit.value)
    half = half_widths(fit)
    of_half = np.abs(change) / half
    most = settings.max_band_sensitivity_percent
    contradicting = (p < CHANCE) & (percent > most) & (of_half > OF_HALF)
    if not np.any(contradicting):
        return []
    worst = np.argmax(np.where(contradicting, of_half, 0.0))
    at, j = np.unravel_index(worst, change.shape)
    band, own = bands[int(at)], changes[-1]
    return [
        found(
            NAME,
            settings,
            float(percent[at, j]),
            most,
            p=float(p[at, j]),
            effect=Effect.of(-change[at], fit.value, half),
            facts={
                "symbol": PARAMETERS[int(j)].symbol,
                "way": "more" if change[at, j] * fit.value[j] > 0 else "less",
                "low_hz": band.low_hz,
                "high_hz": band.high_hz,
                "error": float(100 * band.change_se[j] / abs(fit.value[j])),
                "own_low_hz": own.low_hz,
                "own_high_hz": own.high_hz,
                "of_half": float(of_half[at, j]),
            },
        )
    ]


def _three(values: Array) -> Three:
    J, B, K = (float(value) for value in values)
    return J, B, K
