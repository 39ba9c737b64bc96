"""What the error of two clocks' offset adds to the intervals of J, B and K.

Torque whose stamps are late by δ against those of the motion has, at each frequency ω,

    (K − J ω² + i ω B) (1 − i ω δ) = K − (J − B δ) ω² + i ω (B − K δ + J δ ω²)      to first order

so that J is wrong by −B δ and B by −K δ + J δ ω², of which the band and the method decide what
remains. It is therefore found by fitting again with the torque moved by the standard error of the
offset forth and back, and added in quadrature. All epochs of a source have the same offset: its
error does not become smaller by pooling.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from rigidimeter.estimation.method_record import FitEpochs
from rigidimeter.estimation.prepared import PreparedEpoch
from rigidimeter.records import Delay, Fit

_QUANTILE = float(stats.norm.ppf(0.975))


def with_clock_error(
    fit: FitEpochs,
    epochs: Sequence[PreparedEpoch],
    inertia_kg_m2: float | None,
    found: tuple[list[Fit], list[Fit]],
    delays: Sequence[Delay] = (),
) -> tuple[list[Fit], list[Fit]]:
    """Return fits whose errors and intervals contain that of the offset of the epochs' clocks.

    Parameters
    ----------
    fit : callable
        Of the method that made them.
    epochs : sequence of PreparedEpoch
    inertia_kg_m2 : float or None
        As the fits were made.
    found : (list of Fit, list of Fit)
        Of each epoch, and pooled.
    delays : sequence of Delay
        Where one was corrected, its standard error counts instead: it is that of the clocks too.
    """
    corrected = {delay.source: delay.delay_s_se for delay in delays if delay.corrected}
    errors_s = [
        corrected.get(one.epoch.source, one.epoch.clock_error_s) if one.epoch.clock_error_s else 0.0
        for one in epochs
    ]
    if not any(errors_s):
        return found
    early, late = (
        fit(
            [
                one.moved(sign * error_s) if error_s else one
                for one, error_s in zip(epochs, errors_s, strict=True)
            ],
            inertia_kg_m2,
            lambda _: None,
            bool(found[1]),
        )
        for sign in (1.0, -1.0)
    )
    alone, pooled = (
        [_widened(*three) for three in zip(*lists, strict=True)]
        for lists in zip(found, early, late, strict=True)
    )
    return alone, pooled


def _widened(fit: Fit, early: Fit, late: Fit) -> Fit:
    """Return a fit with the change between two others, of one standard error each way, added."""
    change = (early.value - late.value) / 2
    if not np.all(np.isfinite(change)):
        return fit
    return replace(
        fit,
        se=np.hypot(fit.se, change),
        low=fit.value - np.hypot(fit.value - fit.low, _QUANTILE * change),
        high=fit.value + np.hypot(fit.high - fit.value, _QUANTILE * change),
        covariance=fit.covariance + np.outer(change, change),
    )
