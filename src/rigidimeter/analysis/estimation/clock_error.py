"""What the error of two clocks' offset, or of a delay, adds to the intervals of J, B and K.

Torque whose stamps are late by δ against those of the motion has, at each frequency ω,

    (K − J ω² + i ω B) (1 − i ω δ) = K − (J − B δ) ω² + i ω (B − K δ + J δ ω²)      to first order

so that J is wrong by −B δ and B by −K δ + J δ ω², of which the band and the method decide what
remains. It is therefore found by fitting again with the torque moved by the standard error of the
offset forth and back, and added in quadrature. So it is for the error of a delay that was estimated
and taken out. All epochs of a source have the same error: it does not become smaller by pooling
them, but by pooling sources.

At the ticks the acceleration alone is late: hardly with a drive of velocity, by half a tick T/2
with a motor that holds its torque between them. Where the drive is not known, that much of a delay
that was taken out may have been the acceleration's. Then velocity and angle are δ too early, and
J is B δ too high and B is K δ. Every δ from 0 to T/2 is as likely. A delay within T/2 that was not
taken out may be all the acceleration's or all the torque's, so it is an offset as well.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from rigidimeter.analysis.estimation.alignment import SIGNIFICANT, matters
from rigidimeter.analysis.estimation.method_record import FitEpochs
from rigidimeter.analysis.estimation.prepared import PreparedEpoch, drive_followed
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.records import Delay, Fit


def with_clock_error(
    fit: FitEpochs,
    epochs: Sequence[PreparedEpoch],
    inertia_kg_m2: float | None,
    found: tuple[list[Fit], list[Fit]],
    delays: Sequence[Delay] = (),
) -> tuple[list[Fit], list[Fit]]:
    """Return fits whose errors and intervals contain that of the clocks of torque and motion.

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
        Where one was corrected, its standard error counts: of two clocks, in place of the offset's.
    """
    of = {delay.source: delay for delay in delays}
    sources = [one.epoch.source for one in epochs]
    own = [of.get(source, Delay(source)) for source in sources]
    errors_s = [_error_s(one, delay) for one, delay in zip(epochs, own, strict=True)]
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
            False,
        )[0]
        for sign in (1.0, -1.0)
    )
    alone, pooled = found
    by_error = [(one.value - other.value) / 2 for one, other in zip(early, late, strict=True)]
    by_drive = [
        _of_drive(one, fit_alone) if delay.corrected else np.zeros(3)
        for one, fit_alone, delay in zip(epochs, alone, own, strict=True)
    ]
    return (
        [_widened(own, both) for own, *both in zip(alone, by_error, by_drive, strict=True)],
        [
            _widened(
                one,
                _changes_of_sources(one, alone, by_error, sources)
                + _changes_of_sources(one, alone, by_drive, sources),
            )
            for one in pooled
        ],
    )


def _error_s(prepared: PreparedEpoch, delay: Delay) -> float:
    """Return the standard error of the offset between torque and motion, in s."""
    late_s, error_s = delay.delay_s, delay.delay_s_se
    if delay.corrected:
        return error_s
    most_s = 0.5 / prepared.settings.rig.tick_rate_hz + SIGNIFICANT * error_s
    unknown = matters(late_s, error_s) and 0.0 < late_s < most_s and not drive_followed(prepared)
    return max(prepared.epoch.clock_error_s, late_s / math.sqrt(3.0) if unknown else 0.0)


def _of_drive(prepared: PreparedEpoch, fit: Fit) -> Array:
    """Return what the standard error of δ changes; nothing where the drive is known."""
    if drive_followed(prepared):
        return np.zeros(3)
    delay_s = 0.5 / prepared.settings.rig.tick_rate_hz / math.sqrt(3.0)
    _, B, K = fit.value
    return np.where(fit.se > 0, np.array([B, K, 0.0]) * delay_s, 0.0)


def _changes_of_sources(
    pooled: Fit, alone: Sequence[Fit], changes: Sequence[Array], sources: Sequence[str]
) -> list[Array]:
    """Return what the error of each source changes in a pooled fit.

    A pooled fit is nearly the mean of its epochs, each weighted by the inverse of its covariance.
    """
    total = np.zeros((3, 3))
    weighted: dict[str, Array] = {}
    for one, change, source in zip(alone, changes, sources, strict=True):
        free = one.se > 0  # an inertia that is held has no error
        known = np.all(np.isfinite(one.covariance)) and np.all(np.isfinite(change))
        if pooled.condition in ("", one.condition) and one.outcome.included and known:
            weight = np.zeros((3, 3))
            weight[np.ix_(free, free)] = np.linalg.pinv(one.covariance[np.ix_(free, free)])
            total += weight
            weighted[source] = weighted.get(source, np.zeros(3)) + weight @ change
    return [np.linalg.pinv(total) @ one for one in weighted.values()]


def _widened(fit: Fit, changes: Sequence[Array]) -> Fit:
    """Return a fit with changes of one standard error each, which are independent, added."""
    if not changes or not np.all(np.isfinite(changes)):
        return fit
    together = np.sqrt(np.sum(np.square(changes), axis=0))
    return replace(
        fit,
        se=np.hypot(fit.se, together),
        low=fit.value - np.hypot(fit.value - fit.low, scipy.special.ndtri(0.975) * together),
        high=fit.value + np.hypot(fit.high - fit.value, scipy.special.ndtri(0.975) * together),
        covariance=fit.covariance + sum(np.outer(change, change) for change in changes),
    )
