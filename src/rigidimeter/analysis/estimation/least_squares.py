"""J, B and K from torque and motion by linear least squares (Eq. 6 and 7).

The regressors are scaled to unit length and factorised by singular values; AᵀA is never formed, so
the condition number is not squared, and a motion that cannot distinguish the parameters shows as a
large condition number instead of as a confident wrong answer.

Residuals are coloured: by the subject, by drift, and by the band itself. Standard errors and
intervals therefore are those of `uncertainty`, which hold for any colour. Those of `published`, as
the paper's method has them, take the residual for white: σ² (AᵀA)⁻¹.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy import fft

from rigidimeter.analysis.estimation.closedloop.as_sampled import NONE, InertiaUncertainty
from rigidimeter.analysis.estimation.closedloop.line_noise import Smoother
from rigidimeter.analysis.estimation.linear_solution import solve
from rigidimeter.analysis.estimation.method_record import Progress
from rigidimeter.analysis.estimation.prepared import PreparedEpoch, SignalsOf
from rigidimeter.analysis.estimation.screening import after_fit, unusable
from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.analysis.estimation.uncertainty import (
    Estimate,
    cramer_rao_coloured,
    hac_covariance,
    t_interval,
)
from rigidimeter.core.records import Fit, Outcome

POOLED_TEXT = (
    "The joint is taken for one that does not change, and where epochs differ by more than "
    "their own intervals these are too narrow"
)


INTERVALS_TEXT = (
    "Intervals hold for a residual of any colour (lowest cosines of the scores, quantiles of "
    "Student’s t), and do not include bias: torque that something but the robot adds in a closed "
    "loop pulls least squares away from the joint"
)


class _Kept(NamedTuple):
    """An epoch that counts."""

    fit: Fit
    signals: Signals
    uncertainty: InertiaUncertainty


def fit_inertia_damping_stiffness(
    signals: Signals,
    inertia_kg_m2: float | None = None,
    *,
    white: bool = False,
) -> Fit:
    """Fit Eq. 6, or Eq. 7 when the inertia is given.

    Parameters
    ----------
    signals : Signals
        Torque and motion on one grid.
    inertia_kg_m2 : float, optional
        Hold J at this value and fit B and K alone; its standard error is then 0.
    white : bool
        Whether intervals take the residual for white, as textbooks do.

    Returns
    -------
    Fit
        Without the names of source, epoch, condition and method.

    Raises
    ------
    ValueError
        If the regressors are rank deficient: the motion cannot distinguish the parameters.
    """
    torque = target = signals.torque_nm
    if inertia_kg_m2 is None:
        regressors, solved = signals.motion, signals.solution
    else:
        regressors = np.ascontiguousarray(signals.motion[:, 1:])
        target = torque - inertia_kg_m2 * signals.acceleration_rad_s2
        solved = solve(regressors, target)
    if not np.all(solved.lengths > 0):
        raise ValueError("a regressor is zero throughout")
    if solved.dependent:
        raise ValueError(
            "the motion cannot distinguish J, B and K: its regressors are linearly dependent"
        )
    residual = target - regressors @ solved.values
    values, bread = solved.values, solved.bread
    if white:
        degrees = float(residual.size - values.size)
        covariance = float(residual @ residual) / degrees * bread
    else:
        covariance, degrees = hac_covariance(bread, regressors * residual[:, None])
    se = np.sqrt(np.diag(covariance))
    low, high = t_interval(values, se, degrees)
    bound = _bound(signals, regressors, residual)
    estimate = Estimate(values, se, low, high, bound, covariance)
    if inertia_kg_m2 is not None:
        estimate = estimate.with_inertia(inertia_kg_m2)
    total = float(np.sum((torque - torque.mean()) ** 2))
    return Fit(
        *("", "", "", "", Outcome(), *estimate),
        r_squared=1.0 - float(residual @ residual) / total,
        vaf_percent=100.0 * (1.0 - float(np.var(residual)) / float(np.var(torque))),
        condition_number=solved.condition_number,
        residual_sd_nm=float(np.std(residual)),
        n_samples=torque.size,
        band_hz=signals.band_hz,
    )


def fit_least_squares(
    method: str,
    signals_of: SignalsOf,
    uncertainty_of: Callable[[PreparedEpoch, Signals], InertiaUncertainty],
    epochs: Sequence[PreparedEpoch],
    inertia_kg_m2: float | None = None,
    progress: Progress = lambda _: None,
    pooled: bool = True,
    *,
    white: bool = False,
) -> tuple[list[Fit], list[Fit]]:
    """Fit every epoch, and all epochs of a condition put one after the other.

    `signals_of` prepares the signals of an epoch, and `uncertainty_of` says how far its fit depends
    on what the drive did between the samples; for the rest see `method_record.FitEpochs`.
    """
    fits = []
    free = inertia_kg_m2 is None
    kept: dict[str, list[_Kept]] = {}
    for prepared in epochs:
        epoch = prepared.epoch
        try:
            signals = prepared.signals(signals_of)
            found = fit_inertia_damping_stiffness(signals, inertia_kg_m2, white=white)
        except ValueError as error:
            outcome = unusable(epoch, str(error))
            fits.append(Fit(epoch.source, epoch.label, epoch.condition, method, outcome))
        else:
            uncertainty = uncertainty_of(prepared, signals) if free else NONE
            fit = replace(
                _widened(found, uncertainty.away),
                source=epoch.source,
                epoch=epoch.label,
                condition=epoch.condition,
                method=method,
                outcome=after_fit(epoch, found.r_squared, found.condition_number),
                findings=uncertainty.findings,
            )
            fits.append(fit)
            if fit.outcome.included:
                kept.setdefault(epoch.condition, []).append(_Kept(fit, signals, uncertainty))
        progress(1.0)
    groups = list(kept.items()) if pooled else []
    if len(groups) > 1:
        groups.append(("", [member for _, members in groups for member in members]))
    return fits, [_pooled(name, members, inertia_kg_m2, white) for name, members in groups]


def _pooled(
    condition: str,
    members: Sequence[_Kept],
    inertia_kg_m2: float | None,
    white: bool,
) -> Fit:
    """Return the fit to all epochs of a condition, put one after the other."""
    fits, parts, uncertainties = zip(*members, strict=True)
    first = parts[0]
    together = replace(
        first,
        time_s=np.concatenate([part.time_s for part in parts]),
        torque_nm=np.concatenate([part.torque_nm for part in parts]),
        acceleration_rad_s2=np.concatenate([part.acceleration_rad_s2 for part in parts]),
        velocity_rad_s=np.concatenate([part.velocity_rad_s for part in parts]),
        angle_rad=np.concatenate([part.angle_rad for part in parts]),
    )
    found = fit_inertia_damping_stiffness(together, inertia_kg_m2, white=white)
    return replace(
        _widened(found, uncertainties[0].away),
        findings=uncertainties[0].findings,
        source=", ".join(dict.fromkeys(member.source for member in fits)),
        epoch="pooled",
        condition=condition,
        method=fits[0].method,
    )


def _widened(fit: Fit, away: Array) -> Fit:
    """Return a fit that may be so far away for each unit of J, whatever chance does."""
    moved = abs(float(fit.value[0])) * away
    return replace(fit, low=fit.low - moved, high=fit.high + moved)


def _bound(signals: Signals, regressors: Array, residual: Array) -> Array:
    """Return the Cramér–Rao bound on the standard errors, for the power of the residual."""
    n, rate_hz = residual.size, signals.rate_hz
    frequency = fft.rfftfreq(n, 1.0 / rate_hz)
    power = 2.0 / (n * rate_hz) * np.abs(fft.rfft(residual)) ** 2
    if n % 2 == 0:
        power[-1] /= 2.0  # half the rate has no other side
    low, high = signals.band_hz
    inside = np.flatnonzero((frequency >= low) & (frequency <= high) & (frequency > 0))
    density = np.full(power.size, np.inf)
    density[inside] = Smoother.over(inside, 4, 0.1)(power[inside])
    if not np.all(density > 0):
        return np.zeros(regressors.shape[1])  # nothing was left: the channels are exact
    bound = cramer_rao_coloured(regressors, density, rate_hz)
    return np.asarray(np.sqrt(np.diag(bound)), dtype=np.float64)
