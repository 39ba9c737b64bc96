"""One weighted linear problem over the lines of one or several epochs, and its uncertainty.

With regressors X, instruments Z and torque y at the lines, and S the power of the noise,

    p = G⁻¹ Σ Re(Zᴴ y)/S        G = Σ Re(Zᴴ X)/S

Least squares is Z = X; instrumental variables have Z of the perturbation alone. Z depends on the
parameters and S on the residual r = y − X p, so both are iterated (refined instrumental variables,
Young and Jakeman 1979; for joints Westwick and Perreault 2011). S is a running mean of |r|² over
epochs and neighbouring lines. With U = Z/S and C = G⁻¹

    cov p = c C (½ Σ Re(Uᴴ U) S) Cᵀ

whatever the spectrum (Newey and West 1987; the smoothed periodogram in place of a lag window), c
the window's (`Grid.spread`). How many independent lines stand behind it gives Student's degrees of
freedom (Satterthwaite 1946). Three things make that too small where lines are few:

- the window, which is c;
- the residual, out of which the fit has taken noise: the power of e at a line is |r|² over
  1 − c (Re(X C Uᴴ) − X cov p Xᴴ/(c S)) (weights one less half the leverage, MacKinnon and White
  1985; a line has two degrees);
- the weights, made of the same residual: a line that happens to be quiet counts more, and then
  agrees. The slope of Σ Re(Zᴴ r)/S is −(G − D), since S moves with p (Huber 1967; Kackar and
  Harville 1984). With F = Re(Uᴴ X), F̄ the mean of S F over the n lines averaged, over S,

      D = c Σ (F/n − F C F̄)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.grid import Array, Complex, Grid
from rigidimeter.analysis.estimation.observation import Observation

ITERATIONS, UNDAMPED = 25, 10
"""Those that have not settled after the second go on with half the step and the weights that they
have, which may swing where the model does not fit."""

CONVERGED = 0.02
"""A step of less than this share of every standard error ends the iteration."""

SETTLED, SETTLED_SHARE = 0.5, 0.01
"""After the last a step of more than this share of a standard error, and of more than the other of
the parameter itself, means that there is no solution."""

ENOUGH_EPOCHS = 10
"""From so many on, the scatter between them alone gives the covariance; of fewer it is the larger
of scatter and lines."""

ENOUGH_LINES, NEIGHBOURS = 9, 0.1
"""The power of the noise is averaged over so many lines, over epochs and neighbours, and over
neighbours within this share of a line's own number at least."""

ILL_CONDITIONED = 1e10
"""A condition number from which on rounding decides."""


class Problem(NamedTuple):
    """The linear problem of one epoch at given parameters.

    Attributes
    ----------
    instruments, regressors : complex array, shape (m, p)
    target : complex array, shape (m,)
    observation : Observation
    held : tuple of float
        Values of the first of J, B and K, which are held.
    """

    instruments: Complex
    regressors: Complex
    target: Complex
    observation: Observation
    held: tuple[float, ...] = ()

    def residual(self, values: Array) -> Complex:
        """Return what the parameters leave of the target, shape (m,)."""
        return np.asarray(self.target - self.regressors @ values)


Pose = Callable[[Sequence[Observation], Array], list[Problem]]
"""From observations and parameters to problems: what a method is."""


@dataclass(frozen=True, eq=False)
class Solution:
    """Parameters of one epoch, or that several share, and how far to trust them.

    Attributes
    ----------
    values : array, shape (p,)
    covariance : array, shape (p, p)
    degrees : array, shape (p,)
        Of freedom, for Student's t.
    bound : array, shape (p, p)
        The least covariance of an unbiased estimate from the same excitation (Cramér–Rao).
    condition_number : float
        Of the instruments, each column scaled to unit length; whitened where they are not the
        motion itself.
    problems : sequence of Problem
    powers : sequence of array, shape (m,)
        S at the lines of each.
    gram, inverse : array, shape (p, p)
        G and C.
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
    def se(self) -> Array:
        """The standard errors, shape (p,)."""
        return np.sqrt(np.diag(self.covariance))


def solve(
    observations: Sequence[Observation],
    pose: Pose,
    start: Array,
    powers: Sequence[Array] | None = None,
) -> Solution:
    """Solve for the parameters that epochs share.

    Parameters
    ----------
    observations : sequence of Observation
    pose : callable
    start : array, shape (p,)
    powers : sequence of array, shape (m,), optional
        S of each, where it is known; otherwise it is that of the residual.

    Raises
    ------
    ValueError
        If the motion does not tell the parameters apart, or the iteration does not settle.
    """
    given, values = powers, np.array(start, dtype=np.float64)
    for iteration in range(ITERATIONS):
        free = iteration < UNDAMPED
        problems = pose(observations, values)
        if powers is None or (given is None and free):
            powers = noise_powers(problems, values)
        gram, moment = sums(problems, powers)
        inverse = inverse_of(gram)
        step = (inverse @ moment - values) * (1.0 if free else 0.5)
        values = values + step
        scale = np.sqrt(np.diag(inverse_of(_information(problems, powers))))
        if np.all(np.abs(step) < CONVERGED * scale):
            break
    if not np.all(np.abs(step) < np.maximum(SETTLED * scale, SETTLED_SHARE * np.abs(values))):
        raise ValueError(
            f"the estimate did not settle in {ITERATIONS} iterations: the motion tells J, B and K "
            "apart too little, or, where the perturbation is used, it causes too little of the "
            "motion or the controller's values are far off (--controller, per rad)"
        )
    assert powers is not None  # of the first iteration at least
    return _with_uncertainty(problems, powers, gram, values, fitted_powers=given is None)


def solve_once(problems: Sequence[Problem], powers: Sequence[Array]) -> Solution:
    """Return the solution with the instruments and weights that are given.

    Raises
    ------
    ValueError
        If the motion does not tell the parameters apart.
    """
    gram, moment = sums(problems, powers)
    values = inverse_of(gram) @ moment
    return _with_uncertainty(problems, powers, gram, values, fitted_powers=False)


def of_fit(
    values: Array,
    covariance: Array,
    degrees: Array | float,
    bound: Array,
    inertia_kg_m2: float | None = None,
    away: Array | float = 0.0,
) -> dict[str, Any]:
    """Return what a `Fit` holds of its parameters, by name.

    Parameters
    ----------
    values : array, shape (p,)
    covariance : array, shape (p, p)
    degrees : float or array, shape (p,)
        Of freedom, for Student's t.
    bound : array, shape (p,)
        Least standard errors (Cramér–Rao).
    inertia_kg_m2 : float, optional
        J that was held, which has no error, where the parameters are B and K.
    away : float or array, shape (p,)
        What both ends of an interval are further out, beside noise.
    """
    se = np.sqrt(np.diag(covariance))
    half = scipy.special.stdtrit(degrees, 0.975) * se + away
    found = {"value": values, "se": se, "low": values - half, "high": values + half, "bound": bound}
    if inertia_kg_m2 is not None:
        held = {"value": inertia_kg_m2, "low": inertia_kg_m2, "high": inertia_kg_m2}
        found = {name: np.append(held.get(name, 0.0), rest) for name, rest in found.items()}
        covariance = np.pad(covariance, ((1, 0), (1, 0)))
    return {**found, "covariance": covariance}


def sums(problems: Sequence[Problem], powers: Sequence[Array] | None = None) -> tuple[Array, Array]:
    """Return Σ Re(Zᴴ X)/S and Σ Re(Zᴴ y)/S; without powers all lines count alike."""
    gram: Array = np.zeros(())
    moment: Array = np.zeros(())
    for place, one in enumerate(problems):
        own = one.instruments if powers is None else one.instruments / powers[place][:, None]
        weighted = own.conj().T
        gram = gram + (weighted @ one.regressors).real
        moment = moment + (weighted @ one.target).real
    return gram, moment


def inverse_of(matrix: Array) -> Array:
    """Return the inverse of a matrix whose columns differ by orders of magnitude.

    Raises
    ------
    ValueError
        If that cannot be done.
    """
    size = np.sqrt(np.abs(np.diag(matrix)))
    if not np.all(np.isfinite(matrix)) or not np.all(size > 0):
        raise ValueError("nothing moved the joint in the band of the fit")
    scaled = matrix / np.outer(size, size)
    try:
        inverse = np.linalg.inv(scaled)
        known = float(np.linalg.norm(scaled) * np.linalg.norm(inverse)) < ILL_CONDITIONED
    except np.linalg.LinAlgError:
        known = False
    if not known:
        raise ValueError("the motion that is fitted cannot distinguish J, B and K")
    return np.asarray(inverse / np.outer(size, size))


def shortest(gram: Array, moment: Array) -> Array:
    """Return the solution, the shortest where columns of unit length are alike.

    Parameters
    ----------
    gram : array, shape (..., p, p)
    moment : array, shape (..., p)
    """
    size = np.abs(np.diagonal(gram, axis1=-2, axis2=-1))
    size = np.sqrt(np.maximum(size, np.finfo(np.float64).tiny))
    inverse = np.linalg.pinv(gram / (size[..., :, None] * size[..., None, :]))
    return np.asarray((inverse @ (moment / size)[..., None])[..., 0] / size)


def noise_powers(problems: Sequence[Problem], values: Array) -> list[Array]:
    """Return the mean power of the residuals at the lines of each, smoothed.

    It is found on the lines of the longest epoch.

    Raises
    ------
    ValueError
        If nothing is left at some lines.
    """
    grids = [one.observation.grid for one in problems]
    finest = max(grids, key=lambda grid: grid.line.size)
    own = [np.abs(one.residual(values)) ** 2 for one in problems]
    total = np.sum([on_lines(finest, *one) for one in zip(grids, own, strict=True)], axis=0)
    power = smoother(finest.line, len(problems))(total / len(problems))
    if not np.all(power > 0):
        raise ValueError("the fit leaves nothing at some frequencies: are the channels simulated?")
    return [on_lines(grid, finest, power) for grid in grids]


def on_lines(wanted: Grid, known: Grid, power: Array) -> Array:
    """Return a power at the lines of another grid: it is in proportion to the window's energy."""
    if wanted.line is known.line and wanted.energy == known.energy:
        return power
    share = wanted.energy / known.energy
    return np.interp(wanted.omega_rad_s, known.omega_rad_s, power) * share


class Smoother(NamedTuple):
    """The running mean over lines `start` to `stop` of each line, shape (m,) both."""

    start: NDArray[np.intp]
    stop: NDArray[np.intp]

    @property
    def lines(self) -> NDArray[np.intp]:
        """How many lines are averaged for each, shape (m,)."""
        return self.stop - self.start

    def __call__(self, power: Array) -> Array:
        """Return the means, shape (m,) or (m, q) as given."""
        total = np.concatenate([np.zeros((1, *power.shape[1:])), np.cumsum(power, axis=0)])
        return np.asarray(((total[self.stop] - total[self.start]).T / self.lines).T)

    def adjoint(self, weight: Array) -> Array:
        """Return how much each line's own power counts in weighted means, shape (m, p)."""
        share = np.cumsum(weight / self.lines[:, None], axis=0)
        share = np.concatenate([np.zeros((1, weight.shape[1])), share])
        # Both ends rise, so the lines in whose mean a line is are in a row.
        place = np.arange(self.start.size)
        first = np.searchsorted(self.stop, place, side="right")
        return np.asarray(share[np.searchsorted(self.start, place, side="right")] - share[first])


def smoother(line: NDArray[np.intp], epochs: int) -> Smoother:
    """Return the mean over neighbours that, with that over so many epochs, is of enough lines."""
    return _smoother(int(line[0]), line.size, -(-ENOUGH_LINES // epochs) // 2)


@lru_cache(maxsize=64)
def _smoother(first: int, count: int, least: int) -> Smoother:
    place = np.arange(count)
    half = np.maximum(least, np.rint(NEIGHBOURS * (first + place)).astype(np.intp))
    return Smoother(np.maximum(place - half, 0), np.minimum(place + half + 1, count))


@dataclass(frozen=True, eq=False)
class LineNoise:
    """What the noise of an epoch does to the parameters of a solution, line by line.

    Attributes
    ----------
    problem : Problem
    power : array, shape (m,)
        S, up to a factor.
    weighted : complex array, shape (m, p)
        U.
    inverse : array, shape (p, p)
        C.
    """

    problem: Problem
    power: Array
    weighted: Complex
    inverse: Array

    @property
    def spread(self) -> float:
        """The window's c."""
        return self.problem.observation.grid.spread

    def smooth(self, epochs: int) -> Smoother:
        """Return the `smoother` of its lines."""
        return smoother(self.problem.observation.grid.line, epochs)

    def taken_by_weights(self, epochs: int) -> Array:
        """Return D, shape (p, p), where the power is that of the residual of so many epochs."""
        (m, p), smooth = self.weighted.shape, self.smooth(epochs)
        slope = (self.weighted.conj()[:, :, None] * self.problem.regressors[:, None, :]).real
        slope = slope.reshape(m, p * p)
        around = smooth(self.power[:, None] * slope) / self.power[:, None]
        pairs = (slope.T @ around).reshape(p, p, p, p)
        own = (slope / smooth.lines[:, None]).sum(axis=0).reshape(p, p) / epochs
        return np.asarray(self.spread * (own - np.einsum("ijkl,jk->il", pairs, self.inverse)))

    def density(self, residual: Complex, smooth: Smoother) -> Array:
        """Return the power of the noise: of this epoch's level, with the shape of S, shape (m,).

        The residual is whitened before it is smoothed (Andrews and Monahan 1992).
        """
        regressors = self.problem.regressors
        by_line = _products(regressors @ self.inverse, self.weighted)
        by_all = _products(regressors @ self.variance(self.power), regressors)
        left = smooth(1.0 - self.spread * by_line + by_all / self.power)
        left = np.maximum(left, 0.5 / smooth.lines)  # one degree of freedom at least
        return np.asarray(self.power * smooth(np.abs(residual) ** 2 / self.power) / left)

    def degrees(self, density: Array, smooth: Smoother) -> Array:
        """Return the degrees of freedom of each variance, shape (p,)."""
        effect = np.abs(self.weighted @ self.inverse.T) ** 2 * self.power[:, None]
        share = smooth.adjoint(effect) * (density / self.power)[:, None]
        return np.asarray(2 * np.sum(share, axis=0) ** 2 / np.sum(share**2, axis=0) / self.spread)

    def variance(self, density: Array) -> Array:
        """Return the covariance of the parameters under noise of a power, shape (p, p)."""
        middle = 0.5 * ((self.weighted.conj() * density[:, None]).T @ self.weighted).real
        return np.asarray(self.spread * self.inverse @ middle @ self.inverse.T)


def _products(first: Complex, second: Complex) -> Array:
    """Return Re(a b^H) of each line."""
    return np.asarray(np.sum((first * second.conj()).real, axis=1))


def _information(problems: Sequence[Problem], powers: Sequence[Array]) -> Array:
    """Return 2 Σ Re(Zᴴ Z)/S, the inverse of the least covariance (Cramér–Rao)."""
    total: Array = np.zeros(())
    for one, power in zip(problems, powers, strict=True):
        grid = one.observation.grid
        own = 2 * ((one.instruments / power[:, None]).conj().T @ one.instruments).real
        total = total + own * (grid.samples / grid.time_s.size)
    return total


def _with_uncertainty(
    problems: Sequence[Problem],
    powers: Sequence[Array],
    gram: Array,
    values: Array,
    *,
    fitted_powers: bool,
) -> Solution:
    """Return a solution with its covariance; `fitted_powers` says that S is of its residual."""
    p, count, inverse = values.size, len(problems), inverse_of(gram)
    both = list(zip(problems, powers, strict=True))
    each = [LineNoise(o, power, o.instruments / power[:, None], inverse) for o, power in both]
    widened = inverse
    if fitted_powers:
        taken = np.sum([one.taken_by_weights(count) for one in each], axis=0)
        widened = inverse @ np.linalg.inv(np.eye(p) - taken @ inverse)
    scores = [(one.weighted.conj().T @ one.problem.residual(values)).real for one in each]
    effects = np.stack(scores) @ widened.T
    covariance = effects.T @ effects * (count / max(count - 1, 1))
    degrees, bounds = np.full(p, count - 1.0), powers
    if count < ENOUGH_EPOCHS:
        of_lines, squares = np.zeros((p, p)), np.zeros(p)
        for one in each:
            own, smooth = replace(one, inverse=widened), one.smooth(1)
            density = own.density(one.problem.residual(values), smooth)
            part = own.variance(density)
            of_lines += part
            squares += np.diag(part) ** 2 / own.degrees(density, smooth)
        bounds = [density] if count == 1 else powers
        lines_alone, between = np.diag(of_lines), np.diag(covariance)
        wider = (between > lines_alone) & (count > 1)
        scale = np.sqrt(np.where(wider, between / lines_alone, 1.0))
        covariance = of_lines * np.outer(scale, scale)
        degrees = np.where(wider, degrees, lines_alone**2 / squares)
    return Solution(
        values,
        covariance,
        degrees,
        inverse_of(_information(problems, bounds)),
        _condition_number(problems[0], powers[0]),
        problems,
        powers,
        gram,
        inverse,
    )


def _condition_number(problem: Problem, power: Array) -> float:
    """Return that of the instruments.

    Lines that hold noise alone tell J, B and K apart where they are whitened, and show nothing of
    the joint: where the motion is its own instrument it is not whitened.
    """
    whitened = problem.observation.cause is not None
    alone = problem._replace(regressors=problem.instruments)
    gram, _ = sums([alone], [power] if whitened else None)
    size = np.sqrt(np.diag(gram))
    least, most = np.linalg.eigvalsh(gram / np.outer(size, size))[[0, -1]]
    return float(np.sqrt(most / least)) if least > 0 else np.inf
