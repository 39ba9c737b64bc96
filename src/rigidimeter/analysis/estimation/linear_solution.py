"""Linear least squares by singular values of the columns, each scaled to unit length.

AᵀA is never formed, so the condition number is not squared.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LARGEST_CONDITION_NUMBER = 1e6
"""Beyond this named columns agree to six digits, more than any sensor knows."""


class Solution(NamedTuple):
    """What minimises |target − columns · values|, and how well the columns can be told apart.

    Attributes
    ----------
    values : array, shape (p,)
        Not finite where the columns are linearly dependent.
    lengths, singular : arrays, shape (p,)
        Of the columns; singular values of the columns over their lengths, the largest first.
    right : array, shape (p, p)
        A direction of the scaled values in each row.
    rows : int
    """

    values: Array
    lengths: Array
    singular: Array
    right: Array
    rows: int

    @property
    def condition_number(self) -> float:
        """The largest singular value over the smallest."""
        largest, smallest = float(self.singular[0]), float(self.singular[-1])
        return largest / smallest if smallest > 0 else np.inf

    @property
    def dependent(self) -> bool:
        """Whether the columns are linearly dependent, to rounding."""
        return self.condition_number > 1 / (self.rows * float(np.finfo(np.float64).eps))

    @property
    def bread(self) -> Array:
        """(AᵀA)⁻¹, shape (p, p)."""
        inverse = self.right.T / self.singular
        return np.asarray(inverse @ inverse.T / np.outer(self.lengths, self.lengths))


def solve(columns: Array, target: Array) -> Solution:
    """Return the least-squares solution of columns, shape (n, p), for a target, shape (n,)."""
    lengths = np.linalg.norm(columns, axis=0)
    left, singular, right = np.linalg.svd(
        columns / np.where(lengths > 0, lengths, 1.0), full_matrices=False
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        values = (right.T / singular) @ (left.T @ target) / lengths
    return Solution(values, lengths, singular, right, columns.shape[0])


def solve_named(columns: Array, target: Array, names: Sequence[str]) -> Solution:
    """Return `solve` for columns that have names.

    Raises
    ------
    ValueError
        If a column is zero, or the data cannot distinguish columns; the text names them.
    """
    solved = solve(columns, target)
    for name, length in zip(names, solved.lengths, strict=True):
        if not length > 0:
            raise ValueError(f"{name} is zero throughout: this motion holds no information on it")
    if solved.rows <= len(names):
        raise ValueError(
            f"{solved.rows} independent samples are too few for {len(names)} parameters"
        )
    if solved.singular[-1] * LARGEST_CONDITION_NUMBER < solved.singular[0]:
        share = np.abs(solved.right[-1])
        alike = [name for name, one in zip(names, share, strict=True) if one > 0.2 * share.max()]
        raise ValueError(
            f"the motion cannot distinguish {', '.join(alike[:-1])} and {alike[-1]}; leave one of "
            "them out"
        )
    return solved
