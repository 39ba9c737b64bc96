"""How late the torque's stamps are against those of the motion.

If the torque is stamped τ after the motion that it belongs to, every line turns by e^(−iωτ):

    Y = e^(−iωτ) Φ p

With J, B and K alone the turn looks like more damping and less inertia at low frequency, but its
part τ J ω³ is like nothing else, so τ is estimated beside them. It is common to a source: one
amplifier, one bus. The instruments are those of ``iv`` turned alike, so a subject who pushes
does not move it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigidimeter.analysis.estimation.closedloop.linear_problems import Linearise, instrumental
from rigidimeter.analysis.estimation.closedloop.normal_equations import (
    Complex,
    Problem,
    solution,
    sums,
)
from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.closedloop.refine import LineFit, fit_lines, shared_powers
from rigidimeter.analysis.estimation.signals import Array

SCAN_STEP_S = 0.005
"""The search for the delay begins at the best of steps this far apart: a quarter of a period at
50 Hz, so that the nearest valley is the right one."""

MOST_VALLEYS = 3

REWEIGHTED = 3
"""So often each line is weighted by its noise before the search: torque of the subject decides a
solution in which all lines count alike."""

SCAN_HIGH_HZ = 20.0
"""And is made below this frequency."""


def delayed(linearise: Linearise) -> Linearise:
    """Return the problems with the delay as the last parameter."""

    def with_delay(observations: Sequence[Observation], values: Array) -> list[Problem]:
        parameters, delay_s = values[:-1], values[-1]
        problems = []
        turns: dict[int, tuple[Complex, Complex]] = {}  # epochs of one layout have the same lines,
        turned: dict[tuple[int, int], Complex] = {}  # and of one perturbation, instruments
        for observation, problem in zip(
            observations, linearise(observations, parameters), strict=True
        ):
            omega, instruments = observation.grid.omega_rad_s, problem.instruments
            if id(omega) not in turns:
                turn = np.exp(-1j * omega * delay_s)[:, None]
                turns[id(omega)] = turn, -1j * omega[:, None] * turn
            turn, slope = turns[id(omega)]
            both = id(omega), id(instruments)
            if both not in turned:
                late = slope * (instruments @ parameters)[:, None]
                turned[both] = np.hstack([turn * instruments, late])
            late = slope * (problem.regressors @ parameters)[:, None]
            problems.append(
                problem._replace(
                    instruments=turned[both],
                    regressors=np.hstack([turn * problem.regressors, late]),
                    target=problem.target + late[:, 0] * delay_s,
                )
            )
        return problems

    return with_delay


def estimate_delay(
    observations: Sequence[Observation],
    start: Array,
    longest_s: float,
    linearise: Linearise = instrumental,
    near: Array | None = None,
) -> LineFit:
    """Return J, B, K and the delay of the torque against the motion, in s, pooled.

    Parameters
    ----------
    observations : sequence of Observation
    start : array, shape (3,)
        J, B and K to begin with.
    longest_s : float
        The search is between minus and plus this delay.
    linearise : callable
    near : array, shape (4,), optional
        J, B, K and the delay at which the search begins, where it is known which valley is meant.

    Raises
    ------
    ValueError
        If the parameters cannot be told apart.
    """
    if near is not None:
        return fit_lines(observations, delayed(linearise), near)
    problems = linearise(observations, start)
    delays = np.linspace(-longest_s, longest_s, 2 * max(round(longest_s / SCAN_STEP_S), 1) + 1)
    left = _unexplained(observations, problems, delays)
    # The valleys of the scan, the deepest first, and none: the subject may have dug the deepest.
    inner = np.r_[True, left[1:] < left[:-1]] & np.r_[left[:-1] < left[1:], True]
    valleys = sorted(np.flatnonzero(inner), key=lambda i: left[i])[:MOST_VALLEYS]
    best: LineFit | None = None
    for near_s in dict.fromkeys([*(float(delays[i]) for i in valleys), 0.0]):
        turned = [
            one._replace(target=one.target * np.exp(1j * one.observation.grid.omega_rad_s * near_s))
            for one in problems
        ]
        near = solution(*sums(turned)[:2])  # every line with the same weight
        for _ in range(REWEIGHTED):
            near = solution(*sums(turned, shared_powers(turned, near))[:2])
        try:
            found = fit_lines(observations, delayed(linearise), np.append(near, near_s))
        except ValueError:
            continue  # nothing settles from there
        if abs(found.values[-1]) > longest_s or found.values[0] <= 0:
            continue  # no joint has a negative inertia
        if best is None or _unlikeliness(found) < _unlikeliness(best):
            best = found
    if best is None:
        raise ValueError("no delay explains the torque")
    return best


def _unlikeliness(found: LineFit) -> float:
    """Return Σ log S over the lines: twice the Whittle log-likelihood's negative, but a constant.

    Every line counts by the logarithm of what is left in it, so a subject who pushes slowly and
    strongly does not outvote the lines above.
    """
    return float(np.sum(np.log(found.powers[0])))


def _unexplained(
    observations: Sequence[Observation], problems: Sequence[Problem], delays_s: Array
) -> Array:
    """Return the torque's power up to `SCAN_HIGH_HZ` that the instruments leave, at each delay."""
    left = np.zeros(delays_s.size)
    turns: dict[int, Complex] = {}
    bases: dict[tuple[int, int], Array] = {}
    for observation, problem in zip(observations, problems, strict=True):
        omega, instruments = observation.grid.omega_rad_s, problem.instruments
        low = omega < 2 * np.pi * SCAN_HIGH_HZ
        if id(omega) not in turns:
            turns[id(omega)] = np.exp(1j * omega[low, None] * delays_s)
        key = id(omega), id(instruments)
        if key not in bases:
            rows = instruments[low]
            bases[key] = np.linalg.qr(np.vstack([rows.real, rows.imag]))[0]
        turned, basis = problem.target[low, None] * turns[id(omega)], bases[key]
        both = np.vstack([turned.real, turned.imag])
        left += np.sum(both**2, axis=0) - np.sum((basis.T @ both) ** 2, axis=0)
    return left
