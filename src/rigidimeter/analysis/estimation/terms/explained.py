"""What columns of complex lines explain of a target by least squares with real coefficients."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.signals import Array

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


class Gains(NamedTuple):
    """Several complex gains at every line: real and imaginary parts, and |gain|², (n, q) each."""

    real: Array
    imaginary: Array
    power: Array

    @classmethod
    def of(cls, gains: Complex) -> Gains:
        """Return gains, shape (n, q), which can then not be changed."""
        parts = (gains.real.copy(), gains.imag.copy(), gains.real**2 + gains.imag**2)
        for part in parts:
            part.setflags(write=False)
        return cls(*parts)

    def part(self, lines: slice, columns: slice) -> Gains:
        """Return those of some lines and columns."""
        return Gains(*(one[lines, columns] for one in self))


class Filtered(NamedTuple):
    """The lines of one signal, shape (n,), behind each of several gains: q columns, not made."""

    signal: Complex
    gains: Gains

    def along(self, rows: Complex) -> Array:
        """Return Σ Re(rows* column), shape (p, q), for rows of shape (n, p)."""
        turned = rows.conj() * self.signal[:, None]
        return np.asarray(turned.real.T @ self.gains.real - turned.imag.T @ self.gains.imaginary)

    @property
    def sizes(self) -> Array:
        """Σ |column|², shape (q,)."""
        return np.asarray((self.signal.real**2 + self.signal.imag**2) @ self.gains.power)

    def column(self, place: int) -> Complex:
        """Return one of the columns, shape (n,)."""
        gain = self.gains.real[:, place] + 1j * self.gains.imaginary[:, place]
        return np.asarray(self.signal * gain)


def strongest(base: Complex, tried: Filtered, target: Complex, sizes: Array | None = None) -> int:
    """Return which of the columns tried explains most of the target beside those of the base.

    Parameters
    ----------
    base, target : complex arrays, shapes (n, p) and (n,)
    tried : Filtered
        q columns.
    sizes : array, shape (q,), optional
        Σ |tried|², if it is not that of the columns: they may hold a part beside that is at right
        angles to base and target and not counted.
    """
    columns = stacked(base)
    basis, _ = np.linalg.qr(columns / _lengths(columns))
    goal = stacked(target)
    # What one more column explains is its projection beside those that are there.
    left = goal - basis @ (basis.T @ goal)
    n = len(target)
    rows = np.column_stack([basis, left])
    along = tried.along(rows[:n] + 1j * rows[n:])
    if sizes is None:
        sizes = tried.sizes
    beside = sizes - np.sum(along[:-1] ** 2, axis=0)
    new = beside > COLLINEAR * sizes
    power = np.where(new, along[-1] ** 2 / np.where(new, beside, 1.0), 0.0)
    return int(np.argmax(power))


def one_more(base: Array, tried: Array, target: Array) -> tuple[Array, Array]:
    """Return what each of the columns tried takes from the sum of squares, and its coefficient.

    Each alone beside the columns of the base; nothing where it is one of them.
    """
    basis, _ = np.linalg.qr(base / _lengths(base))
    left = target - basis @ (basis.T @ target)
    beside = tried - basis @ (basis.T @ tried)
    power = np.einsum("ij,ij->j", beside, beside)
    new = np.sqrt(power) > COLLINEAR * _lengths(tried)
    values = np.where(new, (left @ beside) / np.where(new, power, 1.0), 0.0)
    return np.asarray(values**2 * power), np.asarray(values)


def _lengths(columns: Array) -> Array:
    return np.asarray(np.maximum(np.sqrt(np.einsum("ij,ij->j", columns, columns)), 1e-300))
