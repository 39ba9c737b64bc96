"""J, B and K from torque and motion by linear least squares (Eq. 6 and 7).

The regressors are scaled to unit length and factorised by singular values; AᵀA is never formed, so
the condition number is not squared, and a motion that cannot tell the parameters apart shows as a
large condition number instead of as a confident wrong answer.

Standard errors are those of a white residual within the band of the fit: a residual confined to
high − low Hz has 2·(high − low) independent values a second, whatever the sampling rate, so the
textbook covariance σ² (AᵀA)⁻¹ is scaled by rate / (2·(high − low)).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rigidimeter.estimation.signals import Array, Signals

__all__ = ["Solution", "fit_inertia_damping_stiffness"]


@dataclass(frozen=True)
class Solution:
    """Parameters (J, B, K), their standard errors, and the statistics of the fit."""

    parameters: tuple[float, float, float]
    standard_errors: tuple[float, float, float]
    r_squared: float
    vaf_percent: float
    condition_number: float
    residual_sd_nm: float
    n_samples: int


def fit_inertia_damping_stiffness(signals: Signals, inertia_kg_m2: float | None = None) -> Solution:
    """Fit Eq. 6, or Eq. 7 when the inertia is given.

    Parameters
    ----------
    signals : Signals
        Torque and motion on one grid.
    inertia_kg_m2 : float, optional
        Hold J at this value and fit B and K alone; its standard error is then 0.

    Raises
    ------
    ValueError
        If the regressors are rank deficient: the motion cannot tell the parameters apart.
    """
    motion = [signals.acceleration_rad_s2, signals.velocity_rad_s, signals.angle_rad]
    torque = signals.torque_nm
    if inertia_kg_m2 is None:
        regressors, target = np.column_stack(motion), torque
    else:
        regressors = np.column_stack(motion[1:])
        target = torque - inertia_kg_m2 * motion[0]
    values, variances, condition_number, residual = _solve(regressors, target)
    n, p = regressors.shape
    low, high = signals.band_hz
    independent_per_sample = min(1.0, 2.0 * (high - low) / signals.rate_hz)
    # As many degrees of freedom are left as there are independent values less the parameters.
    degrees = max(n * independent_per_sample - p, 1.0)
    sigma_squared = float(residual @ residual) / degrees
    errors = np.sqrt(sigma_squared * variances)
    total = float(np.sum((torque - torque.mean()) ** 2))
    if inertia_kg_m2 is not None:
        values = np.concatenate(([inertia_kg_m2], values))
        errors = np.concatenate(([0.0], errors))
    return Solution(
        parameters=(float(values[0]), float(values[1]), float(values[2])),
        standard_errors=(float(errors[0]), float(errors[1]), float(errors[2])),
        r_squared=1.0 - float(residual @ residual) / total,
        vaf_percent=100.0 * (1.0 - float(np.var(residual)) / float(np.var(torque))),
        condition_number=condition_number,
        residual_sd_nm=float(np.std(residual)),
        n_samples=n,
    )


def _solve(regressors: Array, target: Array) -> tuple[Array, Array, float, Array]:
    """Return the solution, the diagonal of (AᵀA)⁻¹, the condition number and the residual."""
    lengths = np.linalg.norm(regressors, axis=0)
    if not np.all(lengths > 0):
        raise ValueError("a regressor is zero throughout")
    left, singular, right = np.linalg.svd(regressors / lengths, full_matrices=False)
    if singular[-1] < singular[0] * regressors.shape[0] * np.finfo(np.float64).eps:
        raise ValueError(
            "the motion cannot tell J, B and K apart: its regressors are linearly dependent"
        )
    values = (right.T @ ((left.T @ target) / singular)) / lengths
    variances = np.sum((right.T / singular) ** 2, axis=1) / lengths**2
    residual = target - regressors @ values
    return values, variances, float(singular[0] / singular[-1]), residual
