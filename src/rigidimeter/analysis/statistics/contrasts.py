"""Tests of condition means in a mixed model, with three choices of degrees of freedom.

    F = (L β)ᵀ (L C Lᵀ)⁻¹ (L β) / rank L,   C = σ² (Xᵀ V⁻¹ X)⁻¹
    residual: n − p.   Satterthwaite: ν = 2 (l C lᵀ)² / (gᵀ A g)

with g the gradient of l C lᵀ in the variances and A twice the inverse Hessian of the restricted
deviance. Kenward and Roger enlarge C for what the variances are uncertain, and match two moments.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from rigidimeter.analysis.statistics.mixed import Mixed
from rigidimeter.analysis.statistics.summary import Array

_NOTHING = 1e-10


@dataclass(frozen=True)
class JointTest:
    """Several contrasts at once against zero: F, its degrees of freedom and p, by choice.

    Attributes
    ----------
    f : float
    df_numerator : int
        How many contrasts.
    df_residual, p_residual : float
        n − p, the choice of the paper's software.
    df_satterthwaite, p_satterthwaite : float
    f_kenward_roger, df_kenward_roger, p_kenward_roger : float
        With the enlarged covariance.
    """

    f: float
    df_numerator: int
    df_residual: float
    p_residual: float
    df_satterthwaite: float
    p_satterthwaite: float
    f_kenward_roger: float
    df_kenward_roger: float
    p_kenward_roger: float


@dataclass(frozen=True)
class Contrast(JointTest):
    """A weighted sum of condition means against zero: its estimate, beside the test of it.

    Attributes
    ----------
    weights : tuple of float
        One for each condition of the model.
    estimate, se : float
        In the unit of the scores; f is (estimate/se)².
    se_kenward_roger : float
        The enlarged standard error.
    """

    weights: tuple[float, ...]
    estimate: float
    se: float
    se_kenward_roger: float


def difference(fit: Mixed, first: str, second: str) -> Contrast:
    """Test the mean of one condition less that of another.

    Raises
    ------
    ValueError
        If the model has no such condition, or both are the same.
    """
    for name in (first, second):
        if name not in fit.conditions:
            raise ValueError(f"there is no condition {name}; known: {', '.join(fit.conditions)}")
    if first == second:
        raise ValueError(f"a difference needs two conditions, got {first} twice")
    weights = [float(name == first) - float(name == second) for name in fit.conditions]
    return contrast(fit, weights)


def interval_of(
    estimate: float, se: float, df: float, confidence: float = 0.95
) -> tuple[float, float]:
    """Return the interval of an estimate whose error follows t with these degrees of freedom."""
    half = float(scipy.stats.t.isf((1 - confidence) / 2, df)) * se
    return estimate - half, estimate + half


def contrast(fit: Mixed, weights: ArrayLike) -> Contrast:
    """Test a weighted sum of the means against zero.

    Parameters
    ----------
    fit : Mixed
    weights : array_like, shape (p,)
        Not all zero.

    Raises
    ------
    ValueError
        If the weights have another length or are all zero.
    """
    row = np.asarray(weights, dtype=np.float64)
    return Contrast(
        **vars(joint_test(fit, row[None, :])),
        weights=tuple(row.tolist()),
        estimate=float(row @ fit.means),
        se=math.sqrt(row @ fit.covariance @ row),
        se_kenward_roger=math.sqrt(row @ _enlarged(fit)[0] @ row),
    )


def joint_test(fit: Mixed, weights: ArrayLike | None = None) -> JointTest:
    """Test that all rows of weights give zero; without weights, that all means are equal.

    Parameters
    ----------
    fit : Mixed
    weights : array_like, shape (m, p), optional
        Linearly independent rows.

    Raises
    ------
    ValueError
        If the rows have another length, are not independent, or there is only one condition.

    References
    ----------
    Giesbrecht and Burns 1985, and Fai and Cornelius 1996, as in Kuznetsova, Brockhoff and
    Christensen, lmerTest package, J. Stat. Softw. 82, 2017. Kenward and Roger, Small sample
    inference for fixed effects from REML, Biometrics 53, 1997.
    """
    p = len(fit.conditions)
    rows = np.eye(p)[:-1] - np.eye(p)[1:] if weights is None else np.asarray(weights, np.float64)
    if rows.ndim != 2 or rows.shape[1] != p:
        raise ValueError(f"weights must have {p} columns, one for each of {fit.conditions}")
    if rows.shape[0] == 0 or np.linalg.matrix_rank(rows) < rows.shape[0]:
        raise ValueError("the rows of weights must be independent and not zero")
    m = rows.shape[0]
    # Turned to independent contrasts, F is the mean of their squares.
    values, vectors = np.linalg.eigh(rows @ fit.covariance @ rows.T)
    turned = vectors.T @ rows
    f = float(np.mean((turned @ fit.means) ** 2 / values))
    each = [_satterthwaite(fit, row) for row in turned]
    df = each[0] if m == 1 else _fai_cornelius(each)
    scaled, df_kr = _kenward_roger(fit, rows)
    return JointTest(
        f=f,
        df_numerator=m,
        df_residual=float(fit.df_residual),
        p_residual=float(scipy.stats.f.sf(f, m, fit.df_residual)),
        df_satterthwaite=df,
        p_satterthwaite=float(scipy.stats.f.sf(f, m, df)),
        f_kenward_roger=scaled,
        df_kenward_roger=df_kr,
        p_kenward_roger=float(scipy.stats.f.sf(scaled, m, df_kr)),
    )


def _fai_cornelius(each: Sequence[float]) -> float:
    """Return the degrees of freedom of a mean of squares of t with these degrees."""
    if min(each) <= 2:
        return 2.0
    total = sum(nu / (nu - 2) for nu in each)
    return 2 * total / (total - len(each))


def _satterthwaite(fit: Mixed, row: Array) -> float:
    """Return 2 v²/(gᵀ A g) in the coordinates (γ, σ²), without the ratios that are at zero.

    At an inner minimum any coordinates of the variances give the same; at zero, a standard
    deviation has slope zero, so that component drops out (lmerTest counts by these).
    """
    point, variance, free = fit.point, fit.variance_residual, fit.df_residual
    inner = [block for block, ratio in zip(fit.blocks, point.ratios, strict=True) if ratio > 0]
    k = len(inner)
    hessian = np.empty((k + 1, k + 1))
    gradient = np.empty(k + 1)
    along = point.unscaled @ row
    for i, first in enumerate(inner):
        own = point.zpy[first]
        hessian[i, k] = hessian[k, i] = own @ own / variance**2
        gradient[i] = variance * np.sum((point.zvx[first] @ along) ** 2)
        for j, second in enumerate(inner):
            pair = point.zpz[first, second]
            hessian[i, j] = 2 * own @ pair @ point.zpy[second] / variance - np.sum(pair**2)
    hessian[k, k] = free / variance**2
    gradient[k] = row @ along
    spread = float(gradient @ np.linalg.solve(hessian, gradient)) * 2
    return 2 * float(variance * gradient[k]) ** 2 / spread


def _enlarged(fit: Mixed) -> tuple[Array, Array, list[Array]]:
    """Return Kenward and Roger's covariance, W, and the slopes of C in each variance.

    V is linear in the variances, and nothing changes in other linear coordinates: here those of
    Z_k Z_kᵀ and of V itself, which need no matrix of size n.
    """
    point, blocks = fit.point, fit.blocks
    k = len(blocks)
    unscaled = point.unscaled
    information = np.empty((k + 1, k + 1))
    information[k, k] = fit.df_residual
    pieces = [point.zvx[block].T @ point.zvx[block] for block in blocks]
    pieces.append(np.asarray(np.linalg.inv(unscaled), dtype=np.float64))
    crossed = [[pieces[max(i, j)] for j in range(k + 1)] for i in range(k + 1)]
    for i in range(k + 1):
        crossed[i][k] = crossed[k][i] = pieces[i]
    for i, first in enumerate(blocks):
        information[i, k] = information[k, i] = np.trace(point.zpz[first, first])
        for j, second in enumerate(blocks):
            information[i, j] = np.sum(point.zpz[first, second] ** 2)
            crossed[i][j] = point.zvx[first].T @ point.zvz[first, second] @ point.zvx[second]
    weight = np.asarray(2 * np.linalg.inv(information), dtype=np.float64)
    excess = np.zeros_like(unscaled)
    for i in range(k + 1):
        for j in range(k + 1):
            excess += weight[i, j] * (crossed[i][j] - pieces[i] @ unscaled @ pieces[j])
    enlarged = fit.variance_residual * (unscaled + 2 * unscaled @ excess @ unscaled)
    slopes = [fit.variance_residual * unscaled @ piece @ unscaled for piece in pieces]
    return enlarged, weight, slopes


def _kenward_roger(fit: Mixed, rows: Array) -> tuple[float, float]:
    """Return the scaled F and its degrees of freedom below; NaN where its moments do not exist."""
    enlarged, weight, slopes = _enlarged(fit)
    m = rows.shape[0]
    middle = np.linalg.inv(rows @ fit.covariance @ rows.T)
    turned = [middle @ rows @ slope @ rows.T for slope in slopes]
    count = range(len(slopes))
    a1 = float(sum(weight[i, j] * np.trace(turned[i]) * np.trace(turned[j])
                   for i in count for j in count))  # fmt: skip
    a2 = float(sum(weight[i, j] * np.trace(turned[i] @ turned[j]) for i in count for j in count))
    found = rows @ fit.means
    f = float(found @ np.linalg.solve(rows @ enlarged @ rows.T, found)) / m
    if m == 1:  # what follows then reduces to this, where it does not divide by zero
        return f, 2 / a2
    b = (a1 + 6 * a2) / (2 * m)
    g = ((m + 1) * a1 - (m + 4) * a2) / ((m + 2) * a2)
    over = 3 * m + 2 * (1 - g)
    v0 = 1 + g / over * b
    v1 = 1 - (m - g) / over * b
    v2 = 1 - (m + 2 - g) / over * b
    if min(abs(v1), abs(v2)) < _NOTHING:
        return math.nan, math.nan
    rho = ((1 - a2 / m) / v1) ** 2 * v0 / v2 / m
    df = 4 + (m + 2) / (m * rho - 1) if m * rho > 1 else math.nan
    scale = df * (1 - a2 / m) / (df - 2) if df > 2 else math.nan
    return scale * f, df
