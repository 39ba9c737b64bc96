"""The linear problem that each method of the closed loop solves at given J, B and K.

With instruments Z, regressors Φ and target Y at the lines of an epoch, the estimate is

    p = (Σ Re(Z^H Φ / S))⁻¹ Σ Re(Z^H Y / S)

with S the power of the noise (`normal_equations`, `refine`). The methods differ in Z alone.

Least squares (``bandlimited``). Z is the measured motion. Torque u of the subject comes back by the
loop as motion H u, and pulls the estimate by

    b = (Σ Re(Φ^H Φ) / S)⁻¹ Σ Re(H^*) |u|² / S

Where S is that of u, |u|² / S is 1 whatever the size of u: b is then of the order of H times the
square of the standard error, while without weights it is of the order of |u|² over |Φ|².

Instrumental variables (``iv``). A subject who pushes moves the joint through the loop, so the
motion carries the push that is also in the torque, and least squares takes it for the joint's own:
it drifts toward −(J_c, B_c, 0). The perturbation carries nothing of the subject. Z is the motion
that the perturbation *alone* causes, simulated through controller and joint (`excitation`), so the
estimate is consistent whatever the subject did; a wrong controller makes Z weaker, not wrong, and
where its loop would be unstable Z is made without feedback. Z depends on the parameters and S on
the residual: both are iterated (refined instrumental variables, Young and Jakeman 1979; for joints
Westwick and Perreault 2011). With Z and S right the estimate is as precise as maximum likelihood
from the same response to the perturbation.

The lines of a periodic perturbation (``spectral``). The same at the excited lines alone; the lines
between them hold nothing but noise and set S.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from rigidimeter.analysis.estimation.closedloop.excitation import Excitation
from rigidimeter.analysis.estimation.closedloop.normal_equations import (
    Problem,
    solution,
    sums,
)
from rigidimeter.analysis.estimation.closedloop.observation import DENSE, Observation
from rigidimeter.analysis.estimation.signals import Array

LEAST = np.array([1e-5, 1e-3, 1e-2])
"""Smallest J, B and K that a response is simulated with, so that the simulated loop is stable."""

T = TypeVar("T")


Linearise = Callable[[Sequence[Observation], Array], list[Problem]]


def direct(observations: Sequence[Observation], values: Array) -> list[Problem]:
    """Return the problems of least squares: the measured motion is its own instrument.

    Noise of the motion sensor must not be: on every second line the motion is that of the even
    samples and the instrument that of the odd ones, and on the others the reverse.
    """
    del values  # they do not depend on the parameters
    problems = []
    for one in observations:
        motion = instruments = one.motion
        if one.noise is not None and one.grid.rate_hz >= DENSE * one.grid.band_hz[1]:
            apart = one.noise * np.where(one.grid.line % 2, 1.0, -1.0)[:, None]
            motion, instruments = one.motion + apart, one.motion - apart
        problems.append(Problem(instruments, motion, one.torque_nm, one))
    return problems


def instrumental(observations: Sequence[Observation], values: Array) -> list[Problem]:
    """Return the problems with instruments simulated at the given J, B and K."""
    J, B, K = np.maximum(values, LEAST).tolist()
    made = _of_each(observations, lambda excitation: excitation.motion_lines((J, B, K)))
    return [
        Problem(instruments, observation.motion, observation.torque_nm, observation)
        for observation, instruments in zip(observations, made, strict=True)
    ]


def periodic(observations: Sequence[Observation], values: Array) -> list[Problem]:
    """Return the problems of the excited lines: the others have no weight but show the noise."""
    return [
        problem._replace(instruments=problem.instruments * observation.excited[:, None])
        for observation, problem in zip(
            observations, instrumental(observations, values), strict=True
        )
    ]


def holding(linearise: Linearise, inertia_kg_m2: float) -> Linearise:
    """Return the problems of B and K alone (Eq. 7)."""

    def held(observations: Sequence[Observation], values: Array) -> list[Problem]:
        full = linearise(observations, np.concatenate(([inertia_kg_m2], values)))
        return [
            problem._replace(
                instruments=problem.instruments[:, 1:],
                regressors=problem.regressors[:, 1:],
                target=problem.target - inertia_kg_m2 * problem.regressors[:, 0],
                held=(inertia_kg_m2,),
            )
            for problem in full
        ]

    return held


def least_squares_start(observations: Sequence[Observation]) -> Array:
    """Return where to begin: least squares, kept where the loop can be simulated; shape (3,)."""
    found = least_squares(direct(observations, np.empty(0)))
    return np.asarray(np.maximum(found, 10 * LEAST), dtype=np.float64)


def least_squares(problems: Sequence[Problem]) -> Array:
    """Return the solution in which every line counts alike, shape (3,)."""
    own = [problem._replace(instruments=problem.regressors) for problem in problems]
    gram, moment, _ = sums(own)
    return solution(gram, moment)


def _of_each(observations: Sequence[Observation], simulate: Callable[[Excitation], T]) -> list[T]:
    """Return what each epoch's perturbation causes; epochs that share it are simulated once."""
    made: dict[int, T] = {}
    for observation in observations:
        excitation = observation.excitation
        assert excitation is not None  # without it an epoch is not observed for these methods
        if id(excitation) not in made:
            made[id(excitation)] = simulate(excitation)
    return [made[id(observation.excitation)] for observation in observations]
