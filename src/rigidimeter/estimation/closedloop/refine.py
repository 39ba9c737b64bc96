"""Weighted estimation from lines, iterated until weights and linearisation no longer change.

Every method of the closed loop is the same linear problem at each step,

    p = C Σ Re(U^H Y)      C = (Σ Re(U^H Φ))⁻¹      U = Z / S

with its own instruments Z, regressors Φ and target Y at the current parameters, and S the power of
the residual. One epoch weights itself; several epochs share their residual's power, which is then
known from so many lines that it need not be smoothed over neighbours that differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigidimeter.estimation.closedloop.between_doubt import moved_elsewhere
from rigidimeter.estimation.closedloop.line_noise import (
    Shape,
    Smoother,
    drawn_lines,
    line_covariance,
    power_on,
)
from rigidimeter.estimation.closedloop.linear_problems import Linearise, Problem
from rigidimeter.estimation.closedloop.observation import Observation
from rigidimeter.estimation.closedloop.spectral_lines import Lines
from rigidimeter.estimation.signals import Array

Complex = NDArray[np.complex128]

ITERATIONS = 25
CONVERGED = 0.02
"""A step of less than this fraction of every standard error ends the iteration."""

UNDAMPED = 10
"""Iterations that have not settled by then go on with half the step and the weights they have,
which may swing where the model does not fit."""

SETTLED, SETTLED_SHARE = 0.5, 0.01
"""After so many iterations a step of more than this fraction of a standard error, and of more than
this fraction of the parameter itself, means that there is no solution."""

BOOTSTRAP_SEED = 1
"""The same epochs give the same interval every time."""

ENOUGH_LINES = 9
"""How many lines, over epochs and neighbours, the power of the noise is averaged over at least."""

NEIGHBOURS = 0.1
"""And over neighbours within this fraction of a line's own number."""

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
    drawn : array, shape (draws, p), or None
        Parameters drawn by bootstrap, if that was asked for.
    """

    values: Array
    covariance: Array
    degrees: Array
    bound: Array
    condition_number: float
    shape: Shape
    between: Array
    drawn: Array | None = None

    @property
    def standard_errors(self) -> Array:
        """Square roots of the diagonal of the covariance."""
        return np.asarray(np.sqrt(np.diag(self.covariance)), dtype=np.float64)


def fit_single(
    observation: Observation,
    linearise: Linearise,
    start: Array,
    shape: Shape | None = None,
    problem: Problem | None = None,
    draws: int = 0,
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
    draws : int
        Of the bootstrap; none if 0.

    Raises
    ------
    ValueError
        If the perturbation did not move the joint enough to tell the parameters apart, or the
        iteration does not settle.
    """
    lines = observation.lines
    smoother = _smoother([lines])
    values = np.array(start, dtype=np.float64)
    weight_from = shape
    fixed = problem is not None
    for iteration in range(1 if fixed and shape is not None else ITERATIONS):
        if problem is None or not fixed:
            (problem,) = linearise([observation], values)
        if shape is None and iteration < UNDAMPED:
            weight_from = _density([lines], [problem], values, smoother)
        assert weight_from is not None
        weighted = problem.instruments / weight_from.at(lines)[:, None]
        inverse = _inverse((weighted.conj().T @ problem.regressors).real)
        step = inverse @ (weighted.conj().T @ problem.target).real - values
        step = step * (1.0 if iteration < UNDAMPED else 0.5)
        values = values + step
        scale = np.sqrt(np.diag(_bound([problem], [lines], [weighted])))
        if np.all(np.abs(step) < CONVERGED * scale):
            break
    assert problem is not None
    assert weight_from is not None
    if not (fixed and shape is not None):
        _refuse_unsettled(step, scale, values)
    residual = problem.target - problem.regressors @ values
    covariance, degrees = line_covariance(
        inverse, weighted, residual, smoother, weight_from.at(lines)
    )
    spread = lines.grid.spread
    # The epoch's own level on the common shape.
    common = weight_from.at(lines)
    own = common * smoother(np.abs(residual) ** 2 / common)
    return LineFit(
        values,
        spread * covariance,
        degrees / spread,
        _bound([problem], [lines], [problem.instruments / own[:, None]]),
        _condition([problem], [lines], weight_from),
        weight_from,
        moved_elsewhere([problem], [weight_from.at(lines)], values),
        values + np.sqrt(spread) * drawn_lines(inverse, weighted, residual, _rng(), draws)
        if draws
        else None,
    )


def fit_pooled(
    observations: Sequence[Observation], linearise: Linearise, start: Array, draws: int = 0
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
    everything = [observation.lines for observation in observations]
    smoother = _smoother(everything)
    values = np.array(start, dtype=np.float64)
    for iteration in range(ITERATIONS):
        problems = linearise(observations, values)
        if iteration < UNDAMPED:
            shape = _density(everything, problems, values, smoother)
        gram = np.zeros((values.size, values.size))
        moment = np.zeros(values.size)
        weighted = _weighted(problems, everything, shape)
        for problem, own in zip(problems, weighted, strict=True):
            gram += (own.conj().T @ problem.regressors).real
            moment += (own.conj().T @ problem.target).real
        inverse = _inverse(gram)
        step = (inverse @ moment - values) * (1.0 if iteration < UNDAMPED else 0.5)
        values = values + step
        bound = _bound(problems, everything, weighted)
        if np.all(np.abs(step) < CONVERGED * np.sqrt(np.diag(bound))):
            break
    _refuse_unsettled(step, np.sqrt(np.diag(bound)), values)
    covariance, degrees, errors = _pooled_covariance(
        problems, everything, shape, weighted, inverse, values, draws
    )
    fit = LineFit(
        values,
        covariance,
        degrees,
        bound,
        _condition(problems, everything, shape),
        shape,
        moved_elsewhere(problems, [shape.at(lines) for lines in everything], values),
        values + errors if draws else None,
    )
    return fit, problems


def _refuse_unsettled(step: Array, scale: Array, values: Array) -> None:
    if not np.all(np.abs(step) < np.maximum(SETTLED * scale, SETTLED_SHARE * np.abs(values))):
        raise ValueError(
            f"the estimate did not settle in {ITERATIONS} iterations: the perturbation causes too "
            "little of the motion, or the controller's values are far off (--controller, per rad)"
        )


def _rng() -> np.random.Generator:
    return np.random.default_rng(BOOTSTRAP_SEED)


def _pooled_covariance(
    problems: Sequence[Problem],
    everything: Sequence[Lines],
    shape: Shape,
    everywhere: Sequence[Complex],
    inverse: Array,
    values: Array,
    draws: int,
) -> tuple[Array, Array, Array]:
    """Return covariance, degrees of freedom and, if draws are asked for, errors drawn."""
    p, count = values.size, len(problems)
    moments = np.empty((count, p))
    of_lines = np.zeros((p, p))
    squares = np.zeros(p)
    errors, rng = np.zeros((draws, p)), _rng()
    smoothers: dict[int, Smoother] = {}
    for i, (problem, lines, weighted) in enumerate(
        zip(problems, everything, everywhere, strict=True)
    ):
        smoother = smoothers.setdefault(id(lines.grid.line), _smoother([lines]))
        residual = problem.target - problem.regressors @ values
        moments[i] = (weighted.conj().T @ residual).real
        part, degrees = line_covariance(inverse, weighted, residual, smoother, shape.at(lines))
        spread = lines.grid.spread
        of_lines += spread * part
        squares += (spread * np.diag(part)) ** 2 / (degrees / spread)
        if draws and count < ENOUGH_EPOCHS:
            errors += np.sqrt(spread) * drawn_lines(inverse, weighted, residual, rng, draws)
    between = inverse @ (moments.T @ moments) @ inverse.T * (count / max(count - 1, 1))
    if draws and count >= ENOUGH_EPOCHS:  # each epoch is a block
        times = rng.multinomial(count, np.full(count, 1.0 / count), size=draws)
        errors = times @ moments @ inverse.T
    if count >= ENOUGH_EPOCHS:
        return between, np.full(p, count - 1.0), errors
    degrees_of_lines = np.diag(of_lines) ** 2 / squares
    wider = np.diag(between) > np.diag(of_lines)
    if count == 1 or not np.any(wider):
        return of_lines, degrees_of_lines, errors
    scale = np.sqrt(np.maximum(np.diag(between) / np.diag(of_lines), 1.0))
    covariance = of_lines * np.outer(scale, scale)
    return covariance, np.where(wider, count - 1.0, degrees_of_lines), errors * scale


def _smoother(everything: Sequence[Lines]) -> Smoother:
    needed = -(-ENOUGH_LINES // len(everything))
    return Smoother.over(everything[0].grid.line, needed // 2, NEIGHBOURS)


def _density(
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


def _weighted(
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


def _bound(
    problems: Sequence[Problem], everything: Sequence[Lines], weighted: Sequence[Complex]
) -> Array:
    """Return (2 Σ Re(Z^H Z) / S)⁻¹."""
    p = problems[0].instruments.shape[1]
    information = np.zeros((p, p))
    made: dict[int, Array] = {}
    for problem, lines, own in zip(problems, everything, weighted, strict=True):
        if id(own) not in made:
            made[id(own)] = 2 * (own.conj().T @ problem.instruments).real
        information += made[id(own)] / lines.grid.spread
    return _inverse(information)


def _condition(problems: Sequence[Problem], everything: Sequence[Lines], shape: Shape) -> float:
    rows = problems[0].instruments / np.sqrt(shape.at(everything[0]))[:, None]
    stacked = np.concatenate([rows.real, rows.imag])
    singular = np.linalg.svd(stacked / np.linalg.norm(stacked, axis=0), compute_uv=False)
    return float(singular[0] / singular[-1])


def _inverse(matrix: Array) -> Array:
    """Invert a small matrix whose columns differ by orders of magnitude."""
    scale = np.sqrt(np.abs(np.diag(matrix)))
    if not np.all(np.isfinite(matrix)) or not np.all(scale > 0):
        raise ValueError("the perturbation did not move the joint")
    scaled = matrix / np.outer(scale, scale)
    if np.linalg.cond(scaled) > 1e10:
        raise ValueError("the motion that the perturbation causes cannot distinguish J, B and K")
    return np.asarray(np.linalg.inv(scaled) / np.outer(scale, scale), dtype=np.float64)
