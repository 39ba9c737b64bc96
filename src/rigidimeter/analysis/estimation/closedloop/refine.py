"""Weighted estimation from lines, iterated until weights and linearisation no longer change.

Every method of the closed loop is the same linear problem at each step,

    p = C Σ Re(U^H Y)      C = (Σ Re(U^H Φ))⁻¹      U = Z / S

with its own instruments Z, regressors Φ and target Y at the current parameters, and S the power of
the residual. One epoch weights itself; several epochs share their residual's power, which is then
known from so many lines that it need not be smoothed over neighbours that differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigidimeter.analysis.estimation.closedloop.between_uncertainty import moved_elsewhere
from rigidimeter.analysis.estimation.closedloop.line_noise import (
    Shape,
    Solved,
    with_weights,
)
from rigidimeter.analysis.estimation.closedloop.line_weights import (
    condition_number,
    scaled_inverse,
    shared_density,
    smoother_for,
    variance_bound,
    weighted_instruments,
)
from rigidimeter.analysis.estimation.closedloop.linear_problems import Complex, Linearise, Problem
from rigidimeter.analysis.estimation.closedloop.loop_pull import loop_pull
from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.closedloop.spectral_lines import Lines
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

SHARED_FROM = 4
"""From this many epochs on, they share the shape of their noise."""


@dataclass(frozen=True)
class LineFit:
    """Parameters with their uncertainty.

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
    shape : Shape
    between : array, shape (p,)
        How far each parameter may be elsewhere for what is not known of the drive.
    pulled : array, shape (p,)
        How far the loop pulls each parameter (`loop_pull`).
    """

    values: Array
    covariance: Array
    degrees: Array
    bound: Array
    condition_number: float
    shape: Shape
    between: Array
    pulled: Array

    @property
    def standard_errors(self) -> Array:
        """Square roots of the diagonal of the covariance."""
        return np.asarray(np.sqrt(np.diag(self.covariance)), dtype=np.float64)


@dataclass(frozen=True)
class PooledSolution:
    """Parameters that epochs share, where the iteration settled.

    Attributes
    ----------
    values : array, shape (p,)
    shape : Shape
    bound : array, shape (p, p)
        As in `LineFit`.
    problems : sequence of Problem
        At the solution.
    everything : sequence of Lines
    weighted : sequence of array
        U of each epoch.
    inverse : array, shape (p, p)
        C.
    """

    values: Array
    shape: Shape
    bound: Array
    problems: Sequence[Problem]
    everything: Sequence[Lines]
    weighted: Sequence[Complex]
    inverse: Array


def fit_single(
    observation: Observation,
    linearise: Linearise,
    start: Array,
    shape: Shape | None = None,
    problem: Problem | None = None,
) -> LineFit:
    """Fit one epoch.

    Parameters
    ----------
    observation : Observation
    linearise : callable
        Makes the problems at given parameters.
    start : array, shape (p,)
    shape : Shape, optional
        Power of the noise that epochs of the same kind share; else this epoch's own is found.
    problem : Problem, optional
        Use this problem and do not iterate: for instruments from a pooled estimate.

    Raises
    ------
    ValueError
        If the perturbation did not move the joint enough to tell the parameters apart, or the
        iteration does not settle.
    """
    lines = observation.lines
    smoother = smoother_for(lines)
    values = np.array(start, dtype=np.float64)
    weight_from = shape
    fixed = problem is not None
    for iteration in range(1 if fixed and shape is not None else ITERATIONS):
        if problem is None or not fixed:
            (problem,) = linearise([observation], values)
        if shape is None and iteration < UNDAMPED:
            weight_from = shared_density([lines], [problem], values, smoother)
        assert weight_from is not None
        weighted = problem.instruments / weight_from.at(lines)[:, None]
        inverse = scaled_inverse((weighted.conj().T @ problem.regressors).real)
        step = inverse @ (weighted.conj().T @ problem.target).real - values
        step = step * (1.0 if iteration < UNDAMPED else 0.5)
        values = values + step
        scale = np.sqrt(np.diag(variance_bound([problem], [lines], [weighted])))
        if np.all(np.abs(step) < CONVERGED * scale):
            break
    assert problem is not None
    assert weight_from is not None
    if not (fixed and shape is not None):
        _refuse_unsettled(step, scale, values)
    residual = problem.target - problem.regressors @ values
    common = weight_from.at(lines)
    solved = Solved(inverse, weighted, problem.regressors, common, lines.grid.spread)
    if shape is None:
        taken = solved.taken_by_weights(smoother)
        solved = replace(solved, inverse=with_weights(inverse, taken))
    # The epoch's own level on the common shape.
    own = solved.density(residual, smoother)
    covariance, degrees = solved.covariance(own, smoother)
    return LineFit(
        values,
        covariance,
        degrees,
        variance_bound([problem], [lines], [problem.instruments / own[:, None]]),
        condition_number([problem], [lines], weight_from),
        weight_from,
        moved_elsewhere([problem], [common], values),
        loop_pull([problem], [common], values),
    )


def fit_pooled(
    observations: Sequence[Observation], linearise: Linearise, start: Array
) -> tuple[LineFit, list[Problem]]:
    """Fit epochs that share the joint; also return their problems at the solution.

    From ten epochs on the covariance comes from the scatter between them, whatever its cause: noise
    or a joint that is not quite the same each time. With fewer, the scatter itself is poorly known,
    and each variance is the larger of that and what the lines say.

    Raises
    ------
    ValueError
        If the perturbation did not move the joint enough to tell the parameters apart.
    """
    solution = solve_pooled(observations, linearise, start)
    return with_uncertainty(solution), list(solution.problems)


def solve_pooled(
    observations: Sequence[Observation], linearise: Linearise, start: Array
) -> PooledSolution:
    """Iterate until weights and linearisation of epochs that share the joint no longer change.

    Raises
    ------
    ValueError
        As `fit_pooled`.
    """
    everything = [observation.lines for observation in observations]
    smoother = smoother_for(everything[0], len(everything))
    values = np.array(start, dtype=np.float64)
    for iteration in range(ITERATIONS):
        problems = linearise(observations, values)
        if iteration < UNDAMPED:
            shape = shared_density(everything, problems, values, smoother)
        gram = np.zeros((values.size, values.size))
        moment = np.zeros(values.size)
        weighted = weighted_instruments(problems, everything, shape)
        for problem, own in zip(problems, weighted, strict=True):
            gram += (own.conj().T @ problem.regressors).real
            moment += (own.conj().T @ problem.target).real
        inverse = scaled_inverse(gram)
        step = (inverse @ moment - values) * (1.0 if iteration < UNDAMPED else 0.5)
        values = values + step
        bound = variance_bound(problems, everything, weighted)
        if np.all(np.abs(step) < CONVERGED * np.sqrt(np.diag(bound))):
            break
    _refuse_unsettled(step, np.sqrt(np.diag(bound)), values)
    return PooledSolution(values, shape, bound, problems, everything, weighted, inverse)


def with_uncertainty(solution: PooledSolution) -> LineFit:
    """Return a solution with its covariance."""
    everything, shape, values = solution.everything, solution.shape, solution.values
    powers = [shape.at(lines) for lines in everything]
    covariance, degrees = _pooled_covariance(solution)
    return LineFit(
        values,
        covariance,
        degrees,
        solution.bound,
        condition_number(solution.problems, everything, shape),
        shape,
        moved_elsewhere(solution.problems, powers, values),
        loop_pull(solution.problems, powers, values),
    )


def _refuse_unsettled(step: Array, scale: Array, values: Array) -> None:
    if not np.all(np.abs(step) < np.maximum(SETTLED * scale, SETTLED_SHARE * np.abs(values))):
        raise ValueError(
            f"the estimate did not settle in {ITERATIONS} iterations: the perturbation causes too "
            "little of the motion, or the controller's values are far off (--controller, per rad)"
        )


def _pooled_covariance(solution: PooledSolution) -> tuple[Array, Array]:
    """Return covariance and degrees of freedom."""
    values = solution.values
    p, count = values.size, len(solution.problems)
    made = [
        Solved(
            solution.inverse,
            weighted,
            problem.regressors,
            solution.shape.at(lines),
            lines.grid.spread,
        )
        for problem, lines, weighted in zip(
            solution.problems, solution.everything, solution.weighted, strict=True
        )
    ]
    taken = np.zeros((p, p))
    for solved, lines in zip(made, solution.everything, strict=True):
        taken += solved.taken_by_weights(smoother_for(lines, count), count)
    inverse = with_weights(solution.inverse, taken)
    moments = np.empty((count, p))
    of_lines = np.zeros((p, p))
    squares = np.zeros(p)
    for i, (problem, lines, solved) in enumerate(
        zip(solution.problems, solution.everything, made, strict=True)
    ):
        residual = problem.target - problem.regressors @ values
        moments[i] = (solved.weighted.conj().T @ residual).real
        if count < ENOUGH_EPOCHS:
            smoother, solved = smoother_for(lines), replace(solved, inverse=inverse)
            part, degrees = solved.covariance(solved.density(residual, smoother), smoother)
            of_lines += part
            squares += np.diag(part) ** 2 / degrees
    between = inverse @ (moments.T @ moments) @ inverse.T * (count / max(count - 1, 1))
    if count >= ENOUGH_EPOCHS:
        return between, np.full(p, count - 1.0)
    degrees_of_lines = np.diag(of_lines) ** 2 / squares
    wider = np.diag(between) > np.diag(of_lines)
    if count == 1 or not np.any(wider):
        return of_lines, degrees_of_lines
    scale = np.sqrt(np.maximum(np.diag(between) / np.diag(of_lines), 1.0))
    covariance = of_lines * np.outer(scale, scale)
    return covariance, np.where(wider, count - 1.0, degrees_of_lines)
