"""J, B and K from torque and motion by linear least squares (Eq. 6 and 7).

The regressors are scaled to unit length and factorised by singular values; AᵀA is never formed, so
the condition number is not squared, and a motion that cannot distinguish the parameters shows as a
large condition number instead of as a confident wrong answer.

Standard errors and intervals are the textbook's: they take the residual for white, σ² (AᵀA)⁻¹.
"""

from __future__ import annotations

import numpy as np
import scipy

from rigidimeter.analysis.estimation.closedloop.line_noise import Smoother
from rigidimeter.analysis.estimation.linear_solution import solve
from rigidimeter.analysis.estimation.power_lines import lines_inside
from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.analysis.estimation.uncertainty import cramer_rao_coloured, of_fit
from rigidimeter.core.records import Fit, Outcome


def fit_inertia_damping_stiffness(signals: Signals, inertia_kg_m2: float | None = None) -> Fit:
    """Fit Eq. 6, or Eq. 7 when the inertia is given.

    Parameters
    ----------
    signals : Signals
        Torque and motion on one grid.
    inertia_kg_m2 : float, optional
        Hold J at this value and fit B and K alone; its standard error is then 0.

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
    values = solved.values
    degrees = float(residual.size - values.size)
    covariance = float(residual @ residual) / degrees * solved.bread
    bound = _bound(signals, regressors, residual)
    total = float(np.sum((torque - torque.mean()) ** 2))
    return Fit(
        source="",
        epoch="",
        condition="",
        method="",
        outcome=Outcome(),
        **of_fit(values, covariance, degrees, bound, inertia_kg_m2),
        r_squared=1.0 - float(residual @ residual) / total,
        vaf_percent=100.0 * (1.0 - float(np.var(residual)) / float(np.var(torque))),
        condition_number=solved.condition_number,
        residual_sd_nm=float(np.std(residual)),
        n_samples=torque.size,
        band_hz=signals.band_hz,
    )


def _bound(signals: Signals, regressors: Array, residual: Array) -> Array:
    """Return the Cramér–Rao bound on the standard errors, for the power of the residual."""
    n, rate_hz = residual.size, signals.rate_hz
    frequency = scipy.fft.rfftfreq(n, 1.0 / rate_hz)
    power = 2.0 / (n * rate_hz) * np.abs(scipy.fft.rfft(residual)) ** 2
    if n % 2 == 0:
        power[-1] /= 2.0  # half the rate has no other side
    inside = lines_inside(frequency, signals.band_hz)
    density = np.full(power.size, np.inf)
    density[inside] = Smoother.over(inside, 4, 0.1)(power[inside])
    if not np.all(density > 0):
        return np.zeros(regressors.shape[1])  # nothing was left: the channels are exact
    bound = cramer_rao_coloured(regressors, density, rate_hz)
    return np.asarray(np.sqrt(np.diag(bound)), dtype=np.float64)
