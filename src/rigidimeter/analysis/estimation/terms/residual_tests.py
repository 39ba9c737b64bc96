"""Tests of what a fit leaves behind: is it noise, and does it still depend on the motion.

A residual confined to a band is never white at a higher rate, so it is first brought to twice 0.8
of the upper edge, where the filter is still flat. Whiteness is tested by Ljung and Box (1978):

    Q = n (n + 2) Σ r_k² / (n − k),  k = 1 … m,   about χ² with m degrees of freedom

Residual against velocity, at lags of both signs: ρ_k is about normal with variance Σ r_e r_v / n
(Bartlett), so a coloured residual does not pass for a forgotten term.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.estimation.signals import Array

LAGS = 20
FLAT_PART = 0.8


class ResidualTest(NamedTuple):
    """Of one residual.

    Attributes
    ----------
    ljung_box_p : float
        Small: the residual is coloured, so that standard errors must not take it for white.
    input_correlation, input_p : float
        The largest correlation with the velocity at lags up to 20 samples and its probability,
        corrected for the number of lags. Small p: something of the motion is left unexplained.
    """

    ljung_box_p: float
    input_correlation: float
    input_p: float


def residual_test(
    residual: Array, velocity: Array, rate_hz: float, band_hz: tuple[float, float]
) -> ResidualTest:
    """Test a residual against its own past and against the velocity.

    Parameters
    ----------
    residual, velocity : arrays, shape (n,)
        In the band of the fit.
    rate_hz : float
    band_hz : (float, float)
    """
    count = max(int(residual.size * min(1.0, 2 * FLAT_PART * band_hz[1] / rate_hz)), 8)
    error, motion = (
        np.asarray(scipy.signal.resample(values - np.mean(values), count), dtype=np.float64)
        for values in (residual, velocity)
    )
    lags = min(LAGS, count // 4)
    own = _correlation(error, error, lags)[lags:]
    k = np.arange(1, lags + 1)
    q = float(count * (count + 2) * np.sum(own[1:] ** 2 / (count - k)))
    cross = _correlation(error, motion, lags)
    reach = min(count // 4, 10 * LAGS)
    both = _correlation(error, error, reach) * _correlation(motion, motion, reach)
    # Triangular weights keep the estimated variance positive.
    weights = 1.0 - np.abs(np.arange(-reach, reach + 1)) / (reach + 1)
    variance = max(float(np.sum(weights * both)), 1e-3) / count
    largest = float(cross[np.argmax(np.abs(cross))])
    single = 2.0 * float(scipy.stats.norm.sf(abs(largest) / math.sqrt(variance)))
    return ResidualTest(
        ljung_box_p=float(scipy.stats.chi2.sf(q, lags)),
        input_correlation=largest,
        input_p=min(1.0, single * cross.size),
    )


def _correlation(one: Array, other: Array, lags: int) -> Array:
    """Return the correlation at lags from −lags to lags; zero where a signal is."""
    size = one.size
    full = scipy.signal.correlate(one, other, mode="full", method="fft")[
        size - 1 - lags : size + lags
    ]
    scale = math.sqrt(float(one @ one) * float(other @ other))
    return np.asarray(full / scale if scale > 0 else 0.0 * full, dtype=np.float64)
