"""What columns of complex lines explain of a target by least squares with real coefficients."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.estimation.signals import Array

Complex = NDArray[np.complex128]

COLLINEAR = 1e-8
"""Of the largest singular value: columns that differ by less are one."""


class Explained(NamedTuple):
    """What is left, as a sum of squares, and the coefficients, shape (p,)."""

    left: float
    values: Array


def stacked(lines: Complex) -> Array:
    """Return real parts above imaginary ones."""
    return np.concatenate([lines.real, lines.imag])


def triangle(columns: Complex, target: Complex) -> Array:
    """Return R of the columns with the target as the last: few rows that hold every fit."""
    whole = stacked(np.column_stack([columns, target]))
    lengths = _lengths(whole)
    return np.asarray(np.linalg.qr(whole / lengths, mode="r") * lengths)


def explained(columns: Array, target: Array) -> Explained:
    """Fit columns, shape (n, p), by singular values; collinear ones share their coefficient."""
    lengths = _lengths(columns)
    left, singular, right = np.linalg.svd(columns / lengths, full_matrices=False)
    kept = singular > COLLINEAR * np.max(singular, initial=0.0)
    products = left[:, kept].T @ target
    values = right[kept].T @ (products / singular[kept]) / lengths
    return Explained(float(target @ target - products @ products), np.asarray(values))


def strongest(base: Array, tried: Array, target: Array) -> int:
    """Return which of the columns tried explains most of the target beside those of the base."""
    basis, _ = np.linalg.qr(base / _lengths(base))
    # What one more column explains is its projection beside those that are there.
    left = target - basis @ (basis.T @ target)
    sizes = np.einsum("ij,ij->j", tried, tried)
    beside = sizes - np.sum((basis.T @ tried) ** 2, axis=0)
    new = beside > COLLINEAR * sizes
    power = np.where(new, (left @ tried) ** 2 / np.where(new, beside, 1.0), 0.0)
    return int(np.argmax(power))


def _lengths(columns: Array) -> Array:
    return np.asarray(np.maximum(np.linalg.norm(columns, axis=0), 1e-300))
