"""Standard errors and intervals of least squares when the residual is coloured.

Least squares solves Aᵀ(M − A p) = 0, so that

    cov p = D S D,    D = (AᵀA)⁻¹,    S = cov Σ a e

The textbook S = σ² AᵀA takes the residual e for white. Voluntary torque, tremor and drift are not,
and S then also counts how the scores g = a e are correlated over time: n times their spectral
density at frequency zero. `hac_covariance` takes the mean square of K cosine sums of the scores,
all below the frequency K / (2 T). It is positive by construction and has K degrees of freedom, so
that t quantiles make up for what little a short epoch knows (Lazarus, Lewis, Stock and Watson 2018,
J. Bus. Econ. Stat. 36:541).

`cramer_rao_coloured` is what no unbiased estimate can beat.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.estimation.linear_solution import Array, solve

COSINES = 0.8
"""Cosines are this times (independent scores)^(2/3).

The published rule, 0.41 n^(2/3), counts samples; at the correlation for which it was made (first
order, 0.7) it is 1.3 (independent samples)^(2/3). Counting independent ones makes the choice the
same at 100 and at 1000 samples/s.
"""

FEWEST_COSINES = 6


def of_fit(
    values: Array,
    covariance: Array,
    degrees: Array | float,
    bound: Array,
    inertia_kg_m2: float | None = None,
    away: Array | float = 0.0,
) -> dict[str, Any]:
    """Return what a `Fit` holds of its parameters, by name.

    Parameters
    ----------
    values : array, shape (p,)
    covariance : array, shape (p, p)
    degrees : float or array, shape (p,)
        Of freedom, for Student's t.
    bound : array, shape (p,)
        Least standard errors (Cramér–Rao).
    inertia_kg_m2 : float, optional
        J that was held, which has no error, where the parameters are B and K.
    away : float or array, shape (p,)
        What both ends of an interval are further out, beside noise.
    """
    se = np.sqrt(np.diag(covariance))
    half = scipy.special.stdtrit(degrees, 0.975) * se + away
    found = {"value": values, "se": se, "low": values - half, "high": values + half, "bound": bound}
    if inertia_kg_m2 is not None:
        held = {"value": inertia_kg_m2, "low": inertia_kg_m2, "high": inertia_kg_m2}
        found = {name: np.append(held.get(name, 0.0), rest) for name, rest in found.items()}
        covariance = np.pad(covariance, ((1, 0), (1, 0)))
    return {**found, "covariance": covariance}


class Scatter(NamedTuple):
    """Covariance of the parameters, shape (p, p), and the degrees of freedom of its t quantiles."""

    covariance: Array
    degrees_of_freedom: float

    @property
    def standard_errors(self) -> Array:
        """The roots of the diagonal, shape (p,)."""
        return np.sqrt(np.diag(self.covariance))


def correlation_samples(scores: Array) -> Array:
    """Return the correlation time of each column in samples, shape (p,), at least 1.

    τ = 1 + 2 Σ ρ(h), from the first lag to the last before the autocorrelation ρ first turns
    negative. Beyond, ρ must sum to −½, because a fit makes its scores sum to zero. n / τ is the
    number of independent scores, whatever the sampling rate.

    Parameters
    ----------
    scores : array, shape (n, p)
    """
    n = len(scores)
    length = scipy.fft.next_fast_len(2 * n, real=True)
    lines = scipy.fft.rfft(np.ascontiguousarray(scores.T), length)
    autocovariance = scipy.fft.irfft(lines.real**2 + lines.imag**2, length)[:, :n]
    times = []
    for column in autocovariance:
        if column[0] <= 0:
            times.append(1.0)
            continue
        negative = np.flatnonzero(column <= 0)
        stop = int(negative[0]) if negative.size else n
        times.append(max(2.0 * float(np.sum(column[:stop])) / float(column[0]) - 1.0, 1.0))
    return np.asarray(times)


def hac_covariance(bread: Array, scores: Array) -> Scatter:
    """Return the covariance of an estimate whose residual may be coloured and uneven.

    It is enlarged by n_eff / (n_eff − p), with n_eff the independent scores of the slowest column:
    p of them went into the fit.

    Parameters
    ----------
    bread : array, shape (p, p)
        (AᵀA)⁻¹.
    scores : array, shape (n, p)
        Regressors times residual, a e, one row for each sample.

    Returns
    -------
    Scatter
        The degrees of freedom are the number of cosines, as many as the correlation of the scores
        allows.

    Raises
    ------
    ValueError
        If the shapes do not agree or there are not more samples than parameters.
    """
    n, p = scores.shape
    if bread.shape != (p, p):
        raise ValueError(f"bread has shape {bread.shape}; scores of shape {(n, p)} need {(p, p)}")
    if n <= p + 1:
        raise ValueError(f"{n} samples are too few for the scatter of {p} parameters")
    independent = max(n / float(np.max(correlation_samples(scores))), p + 1.0)
    count = min(max(round(COSINES * independent ** (2.0 / 3.0)), FEWEST_COSINES), n - 1)
    # The transform gives 2 Σ cos(π j (t + ½)/n) g_t; a sum of unit mean square has √2 before it.
    sums = scipy.fft.dct(scores, type=2, axis=0)[1 : count + 1] / np.sqrt(2.0)
    middle = sums.T @ sums / count * independent / (independent - p)
    return Scatter(bread @ middle @ bread.T, float(count))


def cramer_rao_coloured(regressors: Array, density: Array, rate_hz: float) -> Array:
    """Return the least covariance under noise of a known spectrum, on the lines of the DFT.

    Line by line the noise is independent with E|E_k|² = n · rate · S(f_k), so the information is
    Σ X_kᴴ X_k / (n · rate · S(f_k)) over all lines, S two-sided.

    Parameters
    ----------
    regressors : array, shape (n, p)
        Without noise.
    density : array, shape (n // 2 + 1,)
        One-sided power spectral density of the noise at k · rate / n, in N²m²/Hz, as
        `scipy.signal.periodogram` gives it. Infinity leaves a line out.
    rate_hz : float
    """
    n = regressors.shape[0]
    count = n // 2 + 1
    if density.shape != (count,):
        raise ValueError(f"density has shape {density.shape}; {n} samples need {(count,)}")
    # A one-sided density holds both sides of a line, and so does the sum, but for 0 and Nyquist.
    weight = np.full(count, 4.0)
    weight[0] = 1.0
    if n % 2 == 0:
        weight[-1] = 1.0
    known = np.flatnonzero(np.isfinite(density))
    lines = scipy.fft.rfft(np.ascontiguousarray(regressors.T)).T[known]
    matrix = np.sqrt(weight[known] / (n * rate_hz * density[known]))[:, None] * lines
    stacked = np.concatenate([matrix.real, matrix.imag])
    return solve(stacked, np.zeros(len(stacked))).bread
