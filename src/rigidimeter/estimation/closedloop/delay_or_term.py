"""Whether a delay of the torque explains what J, B and K leave, or a term that they lack.

Friction, a stretch reflex and a soft cuff turn the torque against the motion as a delay does. Each
is put in the place of the delay, as one more column T beside J, B and K:

    friction    sgn θ'
    reflex      θ', max(θ', 0) or max(−θ', 0), later by 30, 45 or 60 ms
    soft cuff   −Z² θ, with Z = K + iωB − ω²J: Z θ / (1 + Z/k) to the first order in 1/k, for a
                cuff of k N·m/rad

Both models are fitted by instrumental variables to one half of the lines, in groups of neighbours,
and judged by what they leave of the others; S is the smooth power of that. The sum of the
differences of |left|²/S, over the root of the sum of their squares, is about standard normal where
both explain as much.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy import fft

from rigidimeter.estimation.closedloop.line_noise import Smoother
from rigidimeter.estimation.closedloop.linear_problems import LEAST, Problem
from rigidimeter.estimation.closedloop.observation import Observation, observe
from rigidimeter.estimation.closedloop.spectral_lines import Complex, Grid
from rigidimeter.estimation.prepared import PreparedEpoch
from rigidimeter.estimation.signals import Array, kinematics

REFLEX_DELAYS_S = (0.03, 0.045, 0.06)
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
    with_delay = [_of_joint(epoch.once(observe), (J, B, K)) for epoch in moved]
    plain, terms = [], []
    for epoch in epochs:
        observation = epoch.once(observe)
        plain.append(_of_joint(observation, (J, B, K)))
        terms.append(dict(_columns(epoch, observation, (J, B, K))))
    found = []
    for name in terms[0]:
        with_term = [
            Problem(
                np.column_stack([problem.instruments, columns[name][0]]),
                np.column_stack([problem.regressors, columns[name][1]]),
                problem.target,
            )
            for problem, columns in zip(plain, terms, strict=True)
        ]
        found.append(Rival(name.split(",")[0], _better(with_term, with_delay)))
    return max(found, key=lambda rival: rival.better_by)


def _of_joint(observation: Observation, joint: tuple[float, float, float]) -> Problem:
    assert observation.excitation is not None  # `observe` gives it
    instruments = observation.excitation.motion_lines(joint)
    return Problem(instruments, observation.lines.motion, observation.lines.torque_nm)


def _columns(
    prepared: PreparedEpoch, observation: Observation, joint: tuple[float, float, float]
) -> Iterator[tuple[str, tuple[Complex, Complex]]]:
    """Yield the column of each term, from the simulated and from the measured motion."""
    assert observation.excitation is not None
    J, B, K = joint
    grid, lines = observation.lines.grid, observation.lines
    omega = grid.omega_rad_s
    measured = kinematics(prepared.epoch, grid.time_s)[1] * grid.window
    both = observation.excitation.windowed_motion(joint)[1], measured
    yield "friction", _pair(grid, *(grid.window * np.sign(velocity) for velocity in both))
    for side, sign in (("+", 1.0), ("-", -1.0), ("both", 0.0)):
        stretch = _pair(grid, *(v if sign == 0.0 else np.maximum(sign * v, 0.0) for v in both))
        for delay_s in REFLEX_DELAYS_S:
            late = np.exp(-1j * omega * delay_s)
            yield f"a reflex,{side},{delay_s}", (stretch[0] * late, stretch[1] * late)
    impedance = K + 1j * omega * B - omega**2 * J
    caused = observation.excitation.motion_lines(joint) @ np.array(joint)
    through = lines.motion @ np.array(joint)
    yield "a soft cuff", (-impedance * caused, -impedance * through)


def _pair(grid: Grid, simulated: Array, measured: Array) -> tuple[Complex, Complex]:
    """Return the lines of two signals that went through the window."""

    def lines(windowed: Array) -> Complex:
        mean = float(np.add.reduce(windowed * grid.window)) / grid.energy
        return np.asarray(fft.rfft(windowed)[grid.line] - mean * grid.window_lines)

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
    weights = [_weight(problem) for problem in problems]
    for half in (0, 1):
        p = problems[0].regressors.shape[1]
        gram, moment = np.zeros((p, p)), np.zeros(p)
        for problem, weight in zip(problems, weights, strict=True):
            used = _half(problem) == half
            weighted = problem.instruments[used] * weight[used, None]
            gram += (weighted.conj().T @ problem.regressors[used]).real
            moment += (weighted.conj().T @ problem.target[used]).real
        scale = np.sqrt(np.maximum(np.abs(np.diag(gram)), np.finfo(np.float64).tiny))
        solution = np.linalg.lstsq(gram / np.outer(scale, scale), moment / scale)[0] / scale
        for own, problem in zip(left, problems, strict=True):
            unseen = _half(problem) != half
            residual = problem.target[unseen] - problem.regressors[unseen] @ solution
            own[unseen] = np.abs(residual) ** 2
    return left


def _half(problem: Problem) -> Array:
    return np.asarray(np.arange(problem.target.size) // GROUP_LINES % 2)


def _weight(problem: Problem) -> Array:
    """Return one over the smooth power of what J, B and K leave at every line."""
    motion = problem.regressors[:, :3]
    instruments = problem.instruments[:, :3]
    scale = np.sqrt(np.sum(np.abs(motion) ** 2, axis=0))
    gram = (instruments.conj().T @ motion).real / np.outer(scale, scale)
    values = np.linalg.lstsq(gram, (instruments.conj().T @ problem.target).real / scale)[0] / scale
    power = np.abs(problem.target - motion @ values) ** 2
    smooth = Smoother.over(np.arange(power.size), GROUP_LINES, 0.1)(power)
    return np.asarray(1.0 / smooth)
