"""J, B and K from torque and motion by linear least squares (Eq. 6 and 7).

The regressors are scaled to unit length and factorised by singular values; AᵀA is never formed, so
the condition number is not squared, and a motion that cannot tell the parameters apart shows as a
large condition number instead of as a confident wrong answer.

Residuals are coloured: by the subject, by drift, and by the band itself. Standard errors and
intervals therefore are those of `uncertainty`, which hold for any colour. The textbook ones are
there too: a residual that is white within high − low Hz has 2·(high − low) independent values a
second, whatever the sampling rate, so σ² (AᵀA)⁻¹ is scaled by rate / (2·(high − low)).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import signal, stats

from rigidimeter.estimation.closedloop.line_noise import Smoother
from rigidimeter.estimation.signals import Array, Signals
from rigidimeter.estimation.uncertainty import block_bootstrap, cramer_rao_coloured, hac_covariance
from rigidimeter.settings import EstimationSettings

__all__ = ["Solution", "fit_inertia_damping_stiffness"]

BOOTSTRAP_SEED = 1
"""The same epoch gives the same interval every time."""

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Solution:
    """Parameters (J, B, K), how well they are known, and the statistics of the fit.

    `low` and `high` are the ends of the 95 % intervals, `bound` the Cramér–Rao bound on the
    standard errors for a residual of the power that was found.
    """

    parameters: Triple
    standard_errors: Triple
    low: Triple
    high: Triple
    bound: Triple
    r_squared: float
    vaf_percent: float
    condition_number: float
    residual_sd_nm: float
    n_samples: int


class _Solved(NamedTuple):
    values: Array
    bread: Array
    condition_number: float
    residual: Array


def fit_inertia_damping_stiffness(
    signals: Signals,
    inertia_kg_m2: float | None = None,
    settings: EstimationSettings | None = None,
) -> Solution:
    """Fit Eq. 6, or Eq. 7 when the inertia is given.

    Parameters
    ----------
    signals : Signals
        Torque and motion on one grid.
    inertia_kg_m2 : float, optional
        Hold J at this value and fit B and K alone; its standard error is then 0.
    settings : EstimationSettings, optional
        How intervals are made.

    Raises
    ------
    ValueError
        If the regressors are rank deficient: the motion cannot tell the parameters apart.
    """
    settings = settings or EstimationSettings()
    motion = [signals.acceleration_rad_s2, signals.velocity_rad_s, signals.angle_rad]
    torque = signals.torque_nm
    if inertia_kg_m2 is None:
        regressors, target = np.column_stack(motion), torque
    else:
        regressors = np.column_stack(motion[1:])
        target = torque - inertia_kg_m2 * motion[0]
    solved = _solve(regressors, target)
    values, residual = solved.values, solved.residual
    errors, low, high = _interval(signals, regressors, target, solved, settings)
    table = np.column_stack([values, errors, low, high, _bound(signals, regressors, residual)])
    if inertia_kg_m2 is not None:
        table = np.vstack([[inertia_kg_m2, 0.0, inertia_kg_m2, inertia_kg_m2, 0.0], table])
    parameters, standard_errors, low_end, high_end, bound = (
        (float(J), float(B), float(K)) for J, B, K in table.T
    )
    total = float(np.sum((torque - torque.mean()) ** 2))
    return Solution(
        parameters=parameters,
        standard_errors=standard_errors,
        low=low_end,
        high=high_end,
        bound=bound,
        r_squared=1.0 - float(residual @ residual) / total,
        vaf_percent=100.0 * (1.0 - float(np.var(residual)) / float(np.var(torque))),
        condition_number=solved.condition_number,
        residual_sd_nm=float(np.std(residual)),
        n_samples=torque.size,
    )


def _interval(
    signals: Signals,
    regressors: Array,
    target: Array,
    solved: _Solved,
    settings: EstimationSettings,
) -> tuple[Array, Array, Array]:
    """Return standard errors and the ends of the 95 % intervals."""
    values, bread, _, residual = solved
    n, p = regressors.shape
    if settings.intervals == "bootstrap":
        rng = np.random.default_rng(BOOTSTRAP_SEED)
        drawn = block_bootstrap(regressors, regressors, target, rng, draws=settings.bootstrap_draws)
        return np.sqrt(np.diag(drawn.covariance)), drawn.low, drawn.high
    if settings.intervals == "white":
        low, high = signals.band_hz
        independent_per_sample = min(1.0, 2.0 * (high - low) / signals.rate_hz)
        # As many degrees of freedom are left as there are independent values less the parameters.
        degrees = max(n * independent_per_sample - p, 1.0)
        errors = np.sqrt(float(residual @ residual) / degrees * np.diag(bread))
    else:
        scatter = hac_covariance(bread, regressors * residual[:, None])
        errors, degrees = scatter.standard_errors, scatter.degrees_of_freedom
    half = float(stats.t.ppf(0.975, degrees)) * errors
    return errors, values - half, values + half


def _bound(signals: Signals, regressors: Array, residual: Array) -> Array:
    """Return the Cramér–Rao bound on the standard errors, for the power of the residual."""
    frequency, power = signal.periodogram(residual, signals.rate_hz, detrend=False)
    low, high = signals.band_hz
    inside = np.flatnonzero((frequency >= low) & (frequency <= high) & (frequency > 0))
    density = np.full(power.size, np.inf)
    density[inside] = Smoother.over(inside, 4, 0.1)(power[inside])
    if not np.all(density > 0):
        return np.zeros(regressors.shape[1])  # nothing was left: the channels are exact
    bound = cramer_rao_coloured(regressors, density, signals.rate_hz)
    return np.asarray(np.sqrt(np.diag(bound)), dtype=np.float64)


def _solve(regressors: Array, target: Array) -> _Solved:
    """Return the solution, (AᵀA)⁻¹, the condition number and the residual."""
    lengths = np.linalg.norm(regressors, axis=0)
    if not np.all(lengths > 0):
        raise ValueError("a regressor is zero throughout")
    left, singular, right = np.linalg.svd(regressors / lengths, full_matrices=False)
    if singular[-1] < singular[0] * regressors.shape[0] * np.finfo(np.float64).eps:
        raise ValueError(
            "the motion cannot tell J, B and K apart: its regressors are linearly dependent"
        )
    inverse = right.T / singular
    values = (inverse @ (left.T @ target)) / lengths
    residual = target - regressors @ values
    bread = inverse @ inverse.T / np.outer(lengths, lengths)
    return _Solved(values, bread, float(singular[0] / singular[-1]), residual)
