"""How far the loop pulls least squares away from the joint, from the recording itself.

A torque u that is added to the joint's own, Y = Φ p + u, is the subject's own torque and the noise
of the sensor. In admittance control it comes back as motion: Φ = Φ_d + H(p) u, with Φ_d what the
perturbation causes and H the loop's motion per torque. Least squares with weights 1/S then gives

    p + b,    b = G⁻¹ Σ Re(Φ^H u) / S,    G = Σ Re(Φ^H Φ) / S,    E Re(Φ^H u) = Re(H(p)*) |u|²

over the lines, whatever else moves the joint. With u = Y − Φ (p̂ − b) both sides depend on b alone,
and are solved for it by iteration from b = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from rigidimeter.analysis.estimation.closedloop.linear_problems import LEAST
from rigidimeter.analysis.estimation.closedloop.normal_equations import Problem
from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.model import Loop, OpenLoop

ITERATIONS = 50
DAMPING = 0.5
SETTLED = 1e-3
"""A step of less than this share of every parameter ends the iteration."""

DIVERGED = 1e3
"""So does a bias of so many times a parameter."""


def loop_pull(
    problems: Sequence[Problem], powers: Sequence[Array], values: Array, inverse: Array
) -> Array:
    """Return b, shape (p,); NaN where no joint fits recording and loop.

    It is 0 for instruments, and where no loop is known, so that b is not either.

    Parameters
    ----------
    problems : sequence of Problem
    powers : sequence of array, shape (m,)
        S at the lines of each.
    values : array, shape (p,)
        The solution.
    inverse : array, shape (p, p)
        G⁻¹.
    """
    bias = np.zeros(values.size)
    observations = [problem.observation for problem in problems]
    if any(one.excitation is not None or one.loop is None for one in observations):
        return bias
    opened = [_opened(one) for one in observations]
    for _ in range(ITERATIONS):
        moment = np.zeros(values.size)
        for problem, power, loop in zip(problems, powers, opened, strict=True):
            joint = np.concatenate([np.array(problem.held), values - bias])
            J, B, K = np.maximum(joint, LEAST).tolist()
            comes_back = loop.motion_per_torque((J, B, K)).real[len(problem.held) :]
            u = problem.target - problem.regressors @ (values - bias)
            moment += comes_back @ (np.abs(u) ** 2 / power)
        step = inverse @ moment - bias
        bias = bias + DAMPING * step
        if not np.all(np.abs(bias) < DIVERGED * np.abs(values)):
            break
        if np.all(np.abs(step) < SETTLED * np.abs(values)):
            return bias
    return np.full(values.size, np.nan)


@lru_cache(maxsize=8)
def _opened_at(loop: Loop, first: int, count: int, spacing_hz: float) -> OpenLoop:
    highest_hz = 0.49 * loop.rig.tick_rate_hz
    return loop.at_frequency(np.minimum(spacing_hz * np.arange(first, first + count), highest_hz))


def _opened(observation: Observation) -> OpenLoop:
    loop, grid = observation.loop, observation.grid
    assert loop is not None  # else there is no b
    spacing_hz = float(f"{grid.rate_hz / grid.time_s.size:.9g}")
    return _opened_at(loop, int(grid.line[0]), grid.line.size, spacing_hz)
