"""Separable least squares: what is linear is solved, what is not is searched (variable projection).

    min over q, c of |y − A(q) c|²  =  min over q of |y − A(q) c(q)|²

For each q the coefficients c(q) come from singular values of A with its columns scaled to unit
length; AᵀA is never formed. Golub and Pereyra 1973; 2003 for a review.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from rigidimeter.analysis.estimation.signals import Array

LARGEST_CONDITION_NUMBER = 1e6
"""Beyond this the columns agree to six digits, more than any sensor knows."""

REFINED_STARTS = 3
"""How many of the best points of the grid are refined; the rest have lost by then."""


@dataclass(frozen=True)
class Linear:
    """Coefficients, shape (p,), residual, shape (n,), and condition number of A as scaled."""

    values: Array
    residual: Array
    condition_number: float


def solve(columns: Array, target: Array, names: Sequence[str]) -> Linear:
    """Solve by singular values.

    Raises
    ------
    ValueError
        If a column is zero, or the data cannot distinguish columns; the text names them.
    """
    lengths, left, singular, right = _factors(columns, names)
    values = (right.T @ ((left.T @ target) / singular)) / lengths
    return Linear(values, target - columns @ values, float(singular[0] / singular[-1]))


def bread(columns: Array, names: Sequence[str]) -> Array:
    """Return (AᵀA)⁻¹, shape (p, p), by way of the singular values of A."""
    lengths, _, singular, right = _factors(columns, names)
    root = (right.T / singular) / lengths[:, None]
    return np.asarray(root @ root.T, dtype=np.float64)


def search(
    columns_at: Callable[[Array], Array],
    target: Array,
    starts: Sequence[Sequence[float]],
    low: Sequence[float],
    high: Sequence[float],
) -> Array:
    """Return the nonlinear parameters of least residual: best of a grid, then refined.

    Parameters
    ----------
    columns_at : callable
        From q, shape (k,), to A(q), shape (n, p).
    target : array, shape (n,)
    starts : sequence of sequences of k floats
    low, high : sequences of k floats
    """

    def residual(parameters: Array) -> Array:
        columns = columns_at(parameters)
        lengths = np.linalg.norm(columns, axis=0)
        scaled = columns / np.where(lengths > 0, lengths, 1.0)
        # On the way q may make columns alike; the search only needs the distance to their span.
        values, *_ = np.linalg.lstsq(scaled, target, rcond=1e-10)
        return np.asarray(target - scaled @ values, dtype=np.float64)

    def cost(parameters: Sequence[float]) -> float:
        found = residual(np.asarray(parameters, dtype=np.float64))
        return float(found @ found)

    if not low:
        return np.zeros(0)
    inside = [np.clip(start, low, high) for start in starts]
    best = sorted(inside, key=lambda start: cost(start.tolist()))[:REFINED_STARTS]
    scale = np.asarray(high) - np.asarray(low)
    refined = [
        scipy.optimize.least_squares(
            residual,
            start,
            bounds=(low, high),
            x_scale=scale,
            diff_step=np.full(len(low), 1e-5),
            max_nfev=60,
        )
        for start in best
    ]
    return np.asarray(min(refined, key=lambda found: float(found.cost)).x, dtype=np.float64)


def _factors(columns: Array, names: Sequence[str]) -> tuple[Array, Array, Array, Array]:
    lengths = np.linalg.norm(columns, axis=0)
    for name, length in zip(names, lengths, strict=True):
        if not length > 0:
            raise ValueError(f"{name} is zero throughout: this motion holds no information on it")
    if columns.shape[0] <= columns.shape[1]:
        raise ValueError(
            f"{columns.shape[0]} independent samples are too few for {columns.shape[1]} parameters"
        )
    left, singular, right = np.linalg.svd(columns / lengths, full_matrices=False)
    if singular[-1] * LARGEST_CONDITION_NUMBER < singular[0]:
        share = np.abs(right[-1])
        alike = [name for name, one in zip(names, share, strict=True) if one > 0.2 * share.max()]
        raise ValueError(
            f"the motion cannot distinguish {', '.join(alike[:-1])} and {alike[-1]}; leave one of "
            "them out"
        )
    return lengths, left, singular, right
