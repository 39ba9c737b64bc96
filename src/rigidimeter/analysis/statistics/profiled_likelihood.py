"""The profiled likelihood of a linear model with random intercepts, and its minimum.

    y = X β + Σ_k Z_k b_k + e,   b_k ~ N(0, γ_k σ² I),  e ~ N(0, σ² I)
    V = I + Σ γ_k Z_k Z_kᵀ,      P = V⁻¹ − V⁻¹ X (Xᵀ V⁻¹ X)⁻¹ Xᵀ V⁻¹
    d(γ) = log|V| + log|Xᵀ V⁻¹ X| + (n − p) (1 + log(2π yᵀ P y / (n − p)))

σ² and β are profiled out: only the ratios γ ≥ 0 are searched, with exact gradient and Hessian. No
matrix is larger than the number of groups.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.statistics.summary import Array

_STEPS = 200
_PRECISION = 1e-13
_MAX_ELEMENTS = 1_000_000
"""Elements of each matrix while the grid is computed, so that memory does not grow with it."""


@dataclass(frozen=True)
class Products:
    """Everything that the likelihood needs of the data.

    Attributes
    ----------
    n, p : int
        Numbers of observations and of fixed effects.
    ols : ndarray, shape (p,)
        Least squares of y on X; what follows is of the residual r = y − X ols.
    xx, zx, zz : ndarray
        XᵀX, ZᵀX and ZᵀZ with Z = (Z_1, Z_2, ...).
    zr : ndarray, shape (q,)
        Zᵀ r.
    rr : float
        rᵀ r.
    blocks : tuple of slice
        The columns of Z that belong to each random effect.
    """

    n: int
    p: int
    ols: Array
    xx: Array
    zx: Array
    zz: Array
    zr: Array
    rr: float
    blocks: tuple[slice, ...]


@dataclass(frozen=True)
class Point:
    """The likelihood at one γ, and the matrices that tests of the means are made from.

    Attributes
    ----------
    ratios : ndarray, shape (k,)
        γ.
    deviance : float
        −2 log L, restricted.
    gradient : ndarray, shape (k,)
    hessian : ndarray, shape (k, k)
        Of the profiled deviance.
    shift : ndarray, shape (p,)
        β − ols.
    unscaled : ndarray, shape (p, p)
        (Xᵀ V⁻¹ X)⁻¹: the covariance of β divided by σ².
    squares : float
        yᵀ P y.
    zvx, zvz, zpz : ndarray
        Zᵀ V⁻¹ X, Zᵀ V⁻¹ Z and Zᵀ P Z.
    zpy : ndarray, shape (q,)
        Zᵀ P y.
    """

    ratios: Array
    deviance: float
    gradient: Array
    hessian: Array
    shift: Array
    unscaled: Array
    squares: float
    zvx: Array
    zvz: Array
    zpz: Array
    zpy: Array


def products(y: Array, x: Array, z: Sequence[Array]) -> Products:
    """Return the cross products of observations (n,), fixed (n, p) and random (n, q_k) effects."""
    ols = np.asarray(np.linalg.lstsq(x, y)[0], dtype=np.float64)
    rest = y - x @ ols
    ends = np.cumsum([0, *(part.shape[1] for part in z)]).tolist()
    every = np.concatenate([np.empty((y.size, 0)), *z], axis=1)
    return Products(
        n=y.size,
        p=x.shape[1],
        ols=ols,
        xx=x.T @ x,
        zx=every.T @ x,
        zz=every.T @ every,
        zr=every.T @ rest,
        rr=float(rest @ rest),
        blocks=tuple(slice(low, high) for low, high in itertools.pairwise(ends)),
    )


class _Solved(NamedTuple):
    """The likelihood at γ, with the leading axes of γ; root is of γ, lower of I + √γ ZᵀZ √γ."""

    deviance: Array
    squares: Array
    shift: Array
    unscaled: Array
    lower: Array
    root: Array


def _solved(data: Products, ratios: Array) -> _Solved:
    """Return the deviance at γ of shape (..., k), and what its derivatives are made from."""
    widths = np.array([block.stop - block.start for block in data.blocks], dtype=np.intp)
    root = np.sqrt(np.repeat(ratios, widths, axis=-1))
    lower = np.linalg.cholesky(
        np.eye(root.shape[-1]) + root[..., :, None] * data.zz * root[..., None, :]
    )
    right = root[..., None] * np.column_stack([data.zx, data.zr])
    half = np.linalg.solve(lower, right)
    taken = half.swapaxes(-1, -2) @ half  # of X and r, by the random effects
    fixed = np.linalg.cholesky(data.xx - taken[..., :-1, :-1])
    turned = np.linalg.inv(fixed)
    unscaled = turned.swapaxes(-1, -2) @ turned
    xvr = -taken[..., :-1, -1]
    shift = (unscaled @ xvr[..., None])[..., 0]
    squares = data.rr - taken[..., -1, -1] - np.sum(xvr * shift, axis=-1)
    free = data.n - data.p
    deviance = free * (1 + np.log(2 * math.pi * squares / free))
    for factor in (lower, fixed):
        diagonal = np.diagonal(factor, axis1=-2, axis2=-1)
        deviance = deviance + 2 * np.sum(np.log(diagonal), axis=-1)
    return _Solved(deviance, squares, shift, unscaled, np.asarray(lower, np.float64), root)


def evaluate(data: Products, ratios: Array) -> Point:
    r"""Return the restricted deviance at γ with its exact derivatives.

    Notes
    -----
    With B = ZᵀPZ and u = ZᵀPy, cut into blocks, s = yᵀPy and m = n − p:

    .. math:: d_i = tr B_{ii} - m u_i^T u_i / s, \qquad
              d_{ij} = -|B_{ij}|^2 + m (2 u_i^T B_{ij} u_j / s - u_i^T u_i u_j^T u_j / s^2)

    References
    ----------
    Bates, Mächler, Bolker and Walker, Fitting linear mixed-effects models using lme4, J. Stat.
    Softw. 67, 2015, eq. 42 (the profiled criterion).
    """
    solved = _solved(data, ratios)
    squares, shift, unscaled = float(solved.squares), solved.shift, solved.unscaled
    half = np.linalg.inv(solved.lower) * solved.root
    middle = half.T @ half
    zvz = data.zz - data.zz @ middle @ data.zz
    zvx = data.zx - data.zz @ middle @ data.zx
    zpz = zvz - zvx @ unscaled @ zvx.T
    zpy = data.zr - data.zz @ middle @ data.zr - zvx @ shift
    free, k = data.n - data.p, len(data.blocks)
    gradient, hessian = np.zeros(k), np.zeros((k, k))
    own = [float(zpy[block] @ zpy[block]) for block in data.blocks]
    for i, first in enumerate(data.blocks):
        gradient[i] = np.trace(zpz[first, first]) - free * own[i] / squares
        for j, second in enumerate(data.blocks):
            hessian[i, j] = -np.sum(zpz[first, second] ** 2) + free * (
                2 * zpy[first] @ zpz[first, second] @ zpy[second] / squares
                - own[i] * own[j] / squares**2
            )
    return Point(
        np.array(ratios, dtype=np.float64),
        float(solved.deviance),
        gradient,
        hessian,
        shift,
        unscaled,
        squares,
        zvx,
        zvz,
        zpz,
        zpy,
    )


def minimise(data: Products) -> Point:
    """Return the point of least deviance with γ ≥ 0.

    A grid finds the valley, since a likelihood of variances may have two; Newton steps, kept
    within γ ≥ 0, find its floor.

    Raises
    ------
    ArithmeticError
        If no minimum is reached, as where the observations leave no residual.
    """
    if not data.blocks:
        return evaluate(data, np.zeros(0))
    sizes = [data.n / (block.stop - block.start) for block in data.blocks]
    steps = np.array([0.0, *np.geomspace(1e-3, 1e4, 15 if len(sizes) == 1 else 8)])
    shape = (steps.size,) * len(sizes)
    grid = np.array(list(itertools.product(*([steps] * len(sizes))))) / sizes
    together = math.ceil(grid.shape[0] * data.zz.size / _MAX_ELEMENTS)
    heights = np.concatenate(
        [_solved(data, part).deviance for part in np.array_split(grid, together)]
    ).reshape(shape)
    valleys = heights == scipy.ndimage.minimum_filter(heights, size=3, mode="nearest")
    found = [_descend(data, evaluate(data, grid[k])) for k in np.flatnonzero(valleys)]
    return min(found, key=lambda point: point.deviance)


def _descend(data: Products, point: Point) -> Point:
    for _ in range(_STEPS):
        free = (point.ratios > 0) | (point.gradient < 0)
        if not np.any(free):
            return point
        step = np.zeros_like(point.ratios)
        gradient, hessian = point.gradient[free], point.hessian[np.ix_(free, free)]
        values, vectors = np.linalg.eigh(hessian)
        # Where the valley bends the wrong way, go downhill with its steepness turned round.
        bend = np.maximum(np.abs(values), 1e-8 * max(float(np.max(np.abs(values))), 1e-300))
        step[free] = -vectors @ ((vectors.T @ gradient) / bend)
        moved = _shortened(data, point, step)
        if moved is None:
            return point
        change = np.max(np.abs(moved.ratios - point.ratios) / (moved.ratios + 1e-12))
        point = moved
        if change < _PRECISION:
            return point
    raise ArithmeticError("the search for the variances did not reach a minimum of the likelihood")


def _shortened(data: Products, point: Point, step: Array) -> Point | None:
    """Return the point after the longest halving of a step that improves, or None."""
    for halving in range(40):
        ratios = np.maximum(point.ratios + step / 2**halving, 0.0)
        if np.array_equal(ratios, point.ratios):
            return None
        moved = evaluate(data, ratios)
        change = moved.deviance - point.deviance
        # On the valley's floor rounding hides the descent; there the slope decides.
        level = abs(change) < 1e-10 and _slope(moved) < _slope(point)
        if change < -1e-10 or level:
            return moved
    return None


def _slope(point: Point) -> float:
    """Return the steepness that a step within γ ≥ 0 could still use."""
    free = (point.ratios > 0) | (point.gradient < 0)
    return float(np.max(np.abs(point.gradient[free]), initial=0.0))
