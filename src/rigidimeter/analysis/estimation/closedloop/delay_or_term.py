"""Whether a delay of the torque explains what J, B and K leave, or a term that they lack.

Friction, a stretch reflex and a soft cuff turn the torque against the motion as a delay does. Each
is put in the place of the delay, as one more column T beside J, B and K:

    friction    sgn θ'
    reflex      θ', max(θ', 0) or max(−θ', 0), later by 30, 45 or 60 ms
    soft cuff   Z θ / (1 + Z/(k (1 + iωτ))), with Z = K + iωB − ω²J, for a cuff of k N·m/rad and k τ
                N·m·s/rad: at some k and τ, and to the first order in 1/k about each

Both models are fitted to one half of the lines, in groups of neighbours, by instrumental variables
or, where the perturbation was not recorded, with the measured motion as its own instrument,
and judged by what they leave of the others; S is the smooth power of that. The sum of the
differences of |left|²/S, over the root of the sum of their squares, is about standard normal where
both explain as much.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.closedloop.grid import Complex, Grid
from rigidimeter.analysis.estimation.closedloop.line_noise import Smoother
from rigidimeter.analysis.estimation.closedloop.linear_problems import LEAST, direct
from rigidimeter.analysis.estimation.closedloop.normal_equations import (
    Problem,
    solution,
    sums,
)
from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.closedloop.observe import observe, observe_motion
from rigidimeter.analysis.estimation.closedloop.recorded_perturbation import closed_loop_obstacle
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.signals import Array, velocity_at

REFLEX_DELAYS_S = (0.03, 0.045, 0.06)
CUFF_RATIOS = (5.0, 10.0, 20.0, 40.0, 80.0, 160.0, 320.0)
"""Stiffness of a cuff over that of the joint."""

CUFF_LAGS_S = (0.0, 0.005, 0.01)
"""Damping over stiffness of the cuff: one that is damped looks like a delay. Where the perturbation
was recorded, `lack_of_fit` tells it."""

GROUP_LINES = 8

CLEAR = 3.0
"""A delay that is not better than a term by this many standard deviations is not told from it."""


class Rival(NamedTuple):
    """A term in the place of the delay, and by how many standard deviations it is better."""

    name: str
    better_by: float


def likeliest_term(
    epochs: Sequence[PreparedEpoch], moved: Sequence[PreparedEpoch], values: Array
) -> Rival:
    """Return the term that rivals the delay most.

    Parameters
    ----------
    epochs, moved : sequences of PreparedEpoch
        As recorded, and with their torque earlier by the delay.
    values : array, shape (3,)
        J, B and K with the delay.
    """
    J, B, K = np.maximum(values, LEAST).tolist()
    with_delay = [_of_joint(_observed(epoch), (J, B, K)) for epoch in moved]
    plain = [_of_joint(_observed(epoch), (J, B, K)) for epoch in epochs]
    without = np.maximum(_solved(plain, [_power(problem) for problem in plain]), LEAST)
    rivals = [
        dict(_rivals(epoch, problem, (J, B, K), without))
        for epoch, problem in zip(epochs, plain, strict=True)
    ]
    found = [
        Rival(name.split(",")[0], _better([own[name] for own in rivals], with_delay))
        for name in rivals[0]
    ]
    return max(found, key=lambda rival: rival.better_by)


def _observed(prepared: PreparedEpoch) -> Observation:
    return prepared.once(observe_motion if closed_loop_obstacle(prepared.epoch) else observe)


def _of_joint(observation: Observation, joint: tuple[float, float, float]) -> Problem:
    if observation.excitation is None:
        return direct([observation], np.array(joint))[0]
    instruments = observation.excitation.motion_lines(joint)
    return Problem(instruments, observation.motion, observation.torque_nm, observation)


def _rivals(
    prepared: PreparedEpoch,
    plain: Problem,
    joint: tuple[float, float, float],
    without_delay: Array,
) -> Iterator[tuple[str, Problem]]:
    """Yield the problem with each term, from the simulated and from the measured motion.

    `without_delay` are J, B and K of the fit without delay or term.
    """
    observation = _observed(prepared)
    grid = observation.grid
    omega = grid.omega_rad_s
    measured = velocity_at(prepared.epoch, grid.time_s) * grid.window
    excitation = observation.excitation
    caused = measured if excitation is None else excitation.windowed_motion(joint)[1]
    both = caused, measured
    rubbing = _pair(grid, *(grid.window * np.sign(velocity) for velocity in both))
    yield "friction", _beside(plain, rubbing)
    for side, sign in (("+", 1.0), ("-", -1.0), ("both", 0.0)):
        stretch = _pair(grid, *(v if sign == 0.0 else np.maximum(sign * v, 0.0) for v in both))
        for delay_s in REFLEX_DELAYS_S:
            late = np.exp(-1j * omega * delay_s)
            yield (
                f"a reflex,{side},{delay_s}",
                _beside(plain, (stretch[0] * late, stretch[1] * late)),
            )
    J, B, K = without_delay.tolist()
    impedance = K + 1j * omega * B - omega**2 * J
    lags_s = CUFF_LAGS_S if excitation is None else CUFF_LAGS_S[:1]
    for ratio, lag_s in itertools.product(CUFF_RATIOS, lags_s):
        gives = 1.0 + 1j * omega * lag_s
        soft = (1.0 / (1.0 + impedance / (ratio * K * gives)))[:, None]
        through = plain._replace(
            instruments=plain.instruments * soft, regressors=plain.regressors * soft
        )
        softer = -(impedance**2 * soft[:, 0] ** 2) / gives
        column = (plain.instruments[:, 2] * softer, plain.regressors[:, 2] * softer)
        yield f"a soft cuff,{ratio},{lag_s}", _beside(through, column)


def _beside(problem: Problem, column: tuple[Complex, Complex]) -> Problem:
    """Return the problem with one more column."""
    return problem._replace(
        instruments=np.column_stack([problem.instruments, column[0]]),
        regressors=np.column_stack([problem.regressors, column[1]]),
    )


def _pair(grid: Grid, simulated: Array, measured: Array) -> tuple[Complex, Complex]:
    """Return the lines of two signals that went through the window."""

    def lines(windowed: Array) -> Complex:
        mean = float(np.add.reduce(windowed * grid.window)) / grid.energy
        return np.asarray(scipy.fft.rfft(windowed - mean * grid.window)[grid.line])

    return lines(simulated), lines(measured)


def _better(first: Sequence[Problem], second: Sequence[Problem]) -> float:
    """Return by how many standard deviations the first explains more of lines it has not seen."""
    left = [_left_out(first), _left_out(second)]
    gain, power = 0.0, 0.0
    for one, other in zip(*left, strict=True):
        m = min(one.size, other.size)
        smoother = Smoother.over(np.arange(m), GROUP_LINES, 0.1)
        difference = (other[:m] - one[:m]) / smoother(0.5 * (one[:m] + other[:m]))
        gain += float(np.sum(difference))
        power += float(np.sum(difference**2))
    return gain / float(np.sqrt(power)) if power > 0 else 0.0


def _left_out(problems: Sequence[Problem]) -> list[Array]:
    """Return |left|² at each line by the fit to the other half of the lines, of each epoch."""
    left = [np.zeros(problem.target.size) for problem in problems]
    powers = [_power(problem) for problem in problems]
    for half in (0, 1):
        used = [_half(problem) == half for problem in problems]
        values = _solved(
            [_part(problem, rows) for problem, rows in zip(problems, used, strict=True)],
            [power[rows] for power, rows in zip(powers, used, strict=True)],
        )
        for own, problem, rows in zip(left, problems, used, strict=True):
            residual = problem.target[~rows] - problem.regressors[~rows] @ values
            own[~rows] = np.abs(residual) ** 2
    return left


def _solved(problems: Sequence[Problem], powers: Sequence[Array] | None = None) -> Array:
    """Return the parameters by instrumental variables."""
    gram, moment, _ = sums(problems, powers)
    return solution(gram, moment)


def _part(problem: Problem, rows: NDArray[np.bool_]) -> Problem:
    return problem._replace(
        instruments=problem.instruments[rows],
        regressors=problem.regressors[rows],
        target=problem.target[rows],
    )


def _half(problem: Problem) -> NDArray[np.intp]:
    return np.asarray(np.arange(problem.target.size) // GROUP_LINES % 2)


def _power(problem: Problem) -> Array:
    """Return the smooth power of what J, B and K leave at every line."""
    motion = problem.regressors[:, :3]
    joint = problem._replace(instruments=problem.instruments[:, :3], regressors=motion)
    power = np.abs(problem.target - motion @ _solved([joint])) ** 2
    return Smoother.over(np.arange(power.size), GROUP_LINES, 0.1)(power)
