"""Weighted estimation from lines, iterated until weights and linearisation no longer change.

Instruments Z, regressors Φ and target Y of `normal_equations` are those at the current parameters,
S is the power of the residual. One epoch weights itself; several epochs share their residual's
power, which is then known from so many lines that it need not be smoothed over neighbours that
differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigidimeter.analysis.estimation.closedloop.line_noise import (
    Solved,
    power_on,
    smoother_for,
    with_weights,
)
from rigidimeter.analysis.estimation.closedloop.linear_problems import Linearise
from rigidimeter.analysis.estimation.closedloop.normal_equations import (
    Complex,
    Problem,
    Sums,
    scaled_inverse,
    sums,
)
from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.signals import Array

ITERATIONS = 25
CONVERGED = 0.02
"""A step of less than this fraction of every standard error ends the iteration."""

UNDAMPED = 10
"""Iterations that have not settled by then go on with half the step and the weights they have,
which may swing where the model does not fit."""

SETTLED, SETTLED_SHARE = 0.5, 0.01
"""After so many iterations a step of more than this fraction of a standard error, and of more than
this fraction of the parameter itself, means that there is no solution."""

ENOUGH_EPOCHS = 10
"""From this many epochs on, the scatter between them alone gives the covariance of the pooled
estimate; of fewer it is the larger of scatter and lines."""


@dataclass(frozen=True)
class LineFit:
    """Parameters of one epoch, or that several share, with their uncertainty.

    Attributes
    ----------
    values : array, shape (p,)
    covariance : array, shape (p, p)
    degrees : array, shape (p,)
        Degrees of freedom for Student's t.
    bound : array, shape (p, p)
        Covariance that no unbiased estimate from the perturbation can fall below, for the noise
        that was found (Cramér–Rao).
    condition_number : float
        Of the whitened instruments, each scaled to unit length.
    problems : sequence of Problem
        Of each epoch, at the solution.
    powers : sequence of array, shape (m,)
        S at the lines of each.
    gram, inverse : array, shape (p, p)
        Σ Re(U^H Φ) over the epochs, and its inverse.
    """

    values: Array
    covariance: Array
    degrees: Array
    bound: Array
    condition_number: float
    problems: Sequence[Problem]
    powers: Sequence[Array]
    gram: Array
    inverse: Array

    @property
    def standard_errors(self) -> Array:
        """Square roots of the diagonal of the covariance."""
        return np.asarray(np.sqrt(np.diag(self.covariance)), dtype=np.float64)


def fit_lines(
    observations: Sequence[Observation],
    linearise: Linearise,
    start: Array,
    powers: Sequence[Array] | None = None,
) -> LineFit:
    """Fit epochs that share their parameters; one epoch is fitted alone.

    Parameters
    ----------
    observations : sequence of Observation
    linearise : callable
        Makes the problems at given parameters.
    start : array, shape (p,)
    powers : sequence of array, shape (m,), optional
        S of each, where it is known; else it is that of the residual.

    Raises
    ------
    ValueError
        If the perturbation did not move the joint enough to tell the parameters apart, or the
        iteration does not settle.
    """
    given, values = powers, np.array(start, dtype=np.float64)
    for iteration in range(ITERATIONS):
        free = iteration < UNDAMPED
        problems = linearise(observations, values)
        if powers is None or (given is None and free):
            powers = shared_powers(problems, values)
        made = sums(problems, powers)
        inverse = scaled_inverse(made.gram)
        step = (inverse @ made.moment - values) * (1.0 if free else 0.5)
        values = values + step
        scale = np.sqrt(np.diag(scaled_inverse(_information(problems, made.weighted))))
        if np.all(np.abs(step) < CONVERGED * scale):
            break
    if not np.all(np.abs(step) < np.maximum(SETTLED * scale, SETTLED_SHARE * np.abs(values))):
        raise ValueError(
            f"the estimate did not settle in {ITERATIONS} iterations: the motion tells J, B and K "
            "apart too little, or, where the perturbation is used, it causes too little of the "
            "motion or the controller's values are far off (--controller, per rad)"
        )
    assert powers is not None
    return _with_uncertainty(problems, powers, made, inverse, values, found=given is None)


def fit_at(problems: Sequence[Problem], powers: Sequence[Array]) -> LineFit:
    """Return the fit where instruments and weights are those given: for one epoch of several.

    Raises
    ------
    ValueError
        As `fit_lines`.
    """
    made = sums(problems, powers)
    inverse = scaled_inverse(made.gram)
    values = inverse @ made.moment
    return _with_uncertainty(problems, powers, made, inverse, values, found=False)


def shared_powers(problems: Sequence[Problem], values: Array) -> list[Array]:
    """Return the mean power of the residuals at the lines of each, smoothed.

    It is found on the lines of the longest epoch, as that of a window of one energy.

    Raises
    ------
    ValueError
        If nothing is left at some lines.
    """
    grids = [problem.observation.grid for problem in problems]
    finest = max(grids, key=lambda grid: grid.line.size)
    total = np.zeros(finest.line.size)
    for problem, grid in zip(problems, grids, strict=True):
        power = np.abs(problem.target - problem.regressors @ values) ** 2
        total += power_on(finest, grid, power)
    power = smoother_for(finest.line, len(problems))(total / len(problems))
    if not np.all(power > 0):
        raise ValueError("the fit leaves nothing at some frequencies: are the channels simulated?")
    made = {id(grid.line): power_on(grid, finest, power) for grid in grids}
    return [made[id(grid.line)] for grid in grids]


def _information(problems: Sequence[Problem], weighted: Sequence[Complex]) -> Array:
    """Return 2 Σ Re(U^H Z), the inverse of the least covariance (Cramér–Rao)."""
    total: Array = np.zeros(())
    made: dict[int, Array] = {}
    for problem, own in zip(problems, weighted, strict=True):
        if id(own) not in made:
            made[id(own)] = 2 * (own.conj().T @ problem.instruments).real
        total = total + made[id(own)] * problem.observation.grid.used_share
    return total


def _with_uncertainty(
    problems: Sequence[Problem],
    powers: Sequence[Array],
    summed: Sums,
    inverse: Array,
    values: Array,
    *,
    found: bool,
) -> LineFit:
    """Return a solution with its covariance; `found` says that the powers are of its residual.

    From ten epochs on that comes from the scatter between them, whatever its cause: noise or a
    joint that is not quite the same each time. With fewer, the scatter itself is poorly known, and
    each variance is the larger of that and what the lines say.
    """
    p, count, weighted, widened = values.size, len(problems), summed.weighted, inverse
    made = [
        Solved(inverse, own, problem.regressors, power, problem.observation.grid.spread)
        for problem, power, own in zip(problems, powers, weighted, strict=True)
    ]
    if found:
        taken = np.zeros((p, p))
        for problem, solved in zip(problems, made, strict=True):
            line = problem.observation.grid.line
            taken += solved.taken_by_weights(smoother_for(line, count), count)
        widened = with_weights(inverse, taken)
    effects, of_lines, squares = np.empty((count, p)), np.zeros((p, p)), np.zeros(p)
    for place, (problem, solved) in enumerate(zip(problems, made, strict=True)):
        residual = problem.target - problem.regressors @ values
        effects[place] = widened @ (residual @ solved.weighted.conj()).real
        if count >= ENOUGH_EPOCHS:
            continue
        smoother = smoother_for(problem.observation.grid.line, 1)
        # The epoch's own level on the common shape.
        own = replace(solved, inverse=widened)
        left = own.density(residual, smoother)
        part, degrees = own.covariance(left, smoother)
        of_lines += part
        squares += np.diag(part) ** 2 / degrees
    if count == 1:
        weighted = [problem.instruments / left[:, None]]
    covariance = effects.T @ effects * (count / max(count - 1, 1))
    degrees = np.full(p, count - 1.0)
    if count < ENOUGH_EPOCHS:
        wider = np.diag(covariance) > np.diag(of_lines) if count > 1 else np.zeros(p, dtype=bool)
        scale = np.sqrt(np.where(wider, np.diag(covariance) / np.diag(of_lines), 1.0))
        covariance = of_lines * np.outer(scale, scale)
        degrees = np.where(wider, degrees, np.diag(of_lines) ** 2 / squares)
    return LineFit(
        values,
        covariance,
        degrees,
        scaled_inverse(_information(problems, weighted)),
        _condition_number(problems[0], powers[0]),
        problems,
        powers,
        summed.gram,
        inverse,
    )


def _condition_number(problem: Problem, power: Array) -> float:
    """Return that of the whitened instruments, each scaled to unit length.

    Of least squares that of the motion itself: lines that hold noise alone tell J, B and K apart
    where they are whitened, and show nothing of the joint.
    """
    whitened = problem.observation.excitation is not None
    alone = problem._replace(regressors=problem.instruments)
    gram, _, _ = sums([alone], [power] if whitened else None)
    size = np.sqrt(np.diag(gram))
    least, *_, most = np.linalg.eigvalsh(gram / np.outer(size, size))
    return float(np.sqrt(most / least)) if least > 0 else np.inf
