"""The linear problem that every method of the closed loop solves, over the lines of epochs.

With instruments Z, regressors Φ and target Y at the lines of each epoch, and S the power of the
noise there, the estimate is

    p = (Σ Re(U^H Φ))⁻¹ Σ Re(U^H Y),    U = Z / S

over the epochs that share p. One epoch is a sum of one. What another motion, band or weight makes
of the estimate is the same sums with other Φ, Z or S.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.signals import Array

Complex = NDArray[np.complex128]

ILL_CONDITIONED = 1e10
"""A condition number from which on rounding decides."""


class Problem(NamedTuple):
    """The linear problem of one epoch at given parameters.

    Attributes
    ----------
    instruments, regressors : complex array, shape (m, p)
    target : complex array, shape (m,)
    observation : Observation
        That they were made of.
    held : tuple of float
        Values of the first of J, B and K, which are held.
    """

    instruments: Complex
    regressors: Complex
    target: Complex
    observation: Observation
    held: tuple[float, ...] = ()


class Sums(NamedTuple):
    """Σ Re(U^H Φ), shape (p, p), Σ Re(U^H Y), shape (p,), and U of each problem."""

    gram: Array
    moment: Array
    weighted: list[Complex]


def sums(problems: Sequence[Problem], powers: Sequence[Array] | None = None) -> Sums:
    """Return the sums over the lines of problems that share their parameters.

    Parameters
    ----------
    problems : sequence of Problem
        Regressors may have shape (k, m, p) and targets (k, m): then so many alternatives.
    powers : sequence of array, shape (m,), optional
        S of each; otherwise every line counts alike.
    """
    made: dict[tuple[int, int], tuple[Complex, Complex]] = {}
    weighted = []
    gram: Array = np.zeros(())
    moment: Array = np.zeros(())
    for place, problem in enumerate(problems):
        # Epochs of one perturbation share their instruments, and of one layout the power.
        power = None if powers is None else powers[place]
        key = id(problem.instruments), id(power)
        if key not in made:
            own = problem.instruments
            own = own if power is None else own / power[:, None]
            made[key] = own, own.conj()
        own, conjugate = made[key]
        gram = gram + (conjugate.T @ problem.regressors).real
        moment = moment + (problem.target @ conjugate).real
        weighted.append(own)
    return Sums(gram, moment, weighted)


def solution(gram: Array, moment: Array) -> Array:
    """Return the shortest solution where columns, each scaled to unit length, are alike.

    Parameters
    ----------
    gram : array, shape (..., p, p)
    moment : array, shape (..., p)
    """
    size = np.sqrt(np.abs(np.diagonal(gram, axis1=-2, axis2=-1)))
    size = np.maximum(size, np.sqrt(np.finfo(np.float64).tiny))
    inverse = np.linalg.pinv(gram / (size[..., :, None] * size[..., None, :]))
    return np.asarray((inverse @ (moment / size)[..., None])[..., 0] / size)


def scaled_inverse(matrix: Array) -> Array:
    """Invert a small matrix whose columns differ by orders of magnitude.

    Raises
    ------
    ValueError
        If that cannot be done.
    """
    scale = np.sqrt(np.abs(np.diag(matrix)))
    if not np.all(np.isfinite(matrix)) or not np.all(scale > 0):
        raise ValueError("nothing moved the joint in the band of the fit")
    scaled = matrix / np.outer(scale, scale)
    try:
        inverse = np.linalg.inv(scaled)
        known = float(np.linalg.norm(scaled) * np.linalg.norm(inverse)) < ILL_CONDITIONED
    except np.linalg.LinAlgError:
        known = False
    if not known:
        raise ValueError("the motion that is fitted cannot distinguish J, B and K")
    return np.asarray(inverse / np.outer(scale, scale), dtype=np.float64)
