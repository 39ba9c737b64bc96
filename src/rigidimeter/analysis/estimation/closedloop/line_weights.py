"""The power of the noise on the lines, the weights that it gives, and the bound that follows.

With instruments Z and the power S of the residual the weights are U = Z / S, and no unbiased
estimate from the perturbation has a covariance below (2 Σ Re(Z^H Z) / S)⁻¹ (Cramér–Rao).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigidimeter.analysis.estimation.closedloop.line_noise import Shape, Smoother, power_on
from rigidimeter.analysis.estimation.closedloop.linear_problems import Complex, Problem
from rigidimeter.analysis.estimation.closedloop.spectral_lines import Lines
from rigidimeter.analysis.estimation.signals import Array

ENOUGH_LINES = 9
"""How many lines, over epochs and neighbours, the power of the noise is averaged over at least."""

NEIGHBOURS = 0.1
"""And over neighbours within this fraction of a line's own number."""


def smoother_for(lines: Lines, epochs: int = 1) -> Smoother:
    """Return the mean over neighbours that, with that over epochs, takes `ENOUGH_LINES`."""
    needed = -(-ENOUGH_LINES // epochs)
    return Smoother.over(lines.grid.line, needed // 2, NEIGHBOURS)


def shared_density(
    everything: Sequence[Lines],
    problems: Sequence[Problem],
    values: Array,
    smoother: Smoother,
) -> Shape:
    """Return the mean power of the residuals on the lines of the first epoch, smoothed."""
    omega = everything[0].grid.omega_rad_s
    total = np.zeros(omega.size)
    for lines, problem in zip(everything, problems, strict=True):
        residual = problem.target - problem.regressors @ values
        total += power_on(omega, lines.grid.omega_rad_s, np.abs(residual) ** 2)
    density = smoother(total / len(everything))
    if not np.all(density > 0):
        raise ValueError("the fit leaves nothing at some frequencies: are the channels simulated?")
    return Shape(omega, density)


def weighted_instruments(
    problems: Sequence[Problem], everything: Sequence[Lines], shape: Shape
) -> list[Complex]:
    """Return U of each epoch: the same array for those that share instruments and lines."""
    made: dict[tuple[int, int], Complex] = {}
    found = []
    for problem, lines in zip(problems, everything, strict=True):
        key = id(problem.instruments), id(lines.grid.omega_rad_s)
        if key not in made:
            made[key] = problem.instruments / shape.at(lines)[:, None]
        found.append(made[key])
    return found


def variance_bound(
    problems: Sequence[Problem], everything: Sequence[Lines], weighted: Sequence[Complex]
) -> Array:
    """Return (2 Σ Re(Z^H Z) / S)⁻¹, of the samples that are not left out."""
    p = problems[0].instruments.shape[1]
    information = np.zeros((p, p))
    made: dict[int, Array] = {}
    for problem, lines, own in zip(problems, everything, weighted, strict=True):
        if id(own) not in made:
            made[id(own)] = 2 * (own.conj().T @ problem.instruments).real
        information += made[id(own)] * lines.grid.used_share
    return scaled_inverse(information)


def condition_number(
    problems: Sequence[Problem], everything: Sequence[Lines], shape: Shape
) -> float:
    """Return that of the whitened instruments, each scaled to unit length.

    Of least squares that of the motion itself: lines that hold noise alone tell J, B and K apart
    where they are whitened, and show nothing of the joint.
    """
    rows = problems[0].instruments
    if problems[0].observation is None or problems[0].observation.excitation is not None:
        rows = rows / np.sqrt(shape.at(everything[0]))[:, None]
    stacked = np.concatenate([rows.real, rows.imag])
    singular = np.linalg.svd(stacked / np.linalg.norm(stacked, axis=0), compute_uv=False)
    return float(singular[0] / singular[-1])


def scaled_inverse(matrix: Array) -> Array:
    """Invert a small matrix whose columns differ by orders of magnitude."""
    scale = np.sqrt(np.abs(np.diag(matrix)))
    if not np.all(np.isfinite(matrix)) or not np.all(scale > 0):
        raise ValueError("the perturbation did not move the joint")
    scaled = matrix / np.outer(scale, scale)
    if np.linalg.cond(scaled) > 1e10:
        raise ValueError("the motion that the perturbation causes cannot distinguish J, B and K")
    return np.asarray(np.linalg.inv(scaled) / np.outer(scale, scale), dtype=np.float64)
