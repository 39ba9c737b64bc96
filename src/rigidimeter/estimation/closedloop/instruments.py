"""Refined instrumental variables from the known perturbation.

A subject who pushes moves the joint through the loop, so the motion carries the push that is also
in the torque, and least squares takes it for the joint's own: it drifts toward −(J_c, B_c, 0). The
perturbation carries nothing of the subject. With Z the motion that the perturbation *alone* causes,
simulated through controller and joint (`loop`), and S the power of the noise,

    p = (Σ Re(Z^H Φ / S))⁻¹ Σ Re(Z^H Y / S)

over the lines of all epochs that share the joint. Nothing of the noise is in Z, so the estimate is
consistent whatever the subject did; a wrong controller makes Z weaker, not wrong. Z depends on the
parameters and S on the residual: both are iterated (refined instrumental variables, Young and
Jakeman 1979; for joints Westwick and Perreault 2011). With Z and S right the estimate is as precise
as maximum likelihood from the same response to the perturbation.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rigidimeter.estimation.closedloop.refine import Observation, Problem
from rigidimeter.estimation.closedloop.spectral_lines import SAME_TIME, Grid, response_lines
from rigidimeter.estimation.signals import Array
from rigidimeter.records import Channel

__all__ = ["instrumental", "on_grid", "stable"]

Complex = NDArray[np.complex128]

LEAST = np.array([1e-5, 1e-3, 1e-2])
"""Smallest J, B and K that a response is simulated with, so that the simulated loop is stable."""


def instrumental(observations: Sequence[Observation], values: Array) -> list[Problem]:
    """Return the problems with instruments simulated at the given J, B and K."""
    made: dict[Hashable, Complex] = {}
    problems = []
    for observation in observations:
        lines, perturbation, loop, _, key = observation
        if key not in made:
            rate_hz = perturbation.mean_rate_hz
            response = loop.response(perturbation.values, rate_hz, stable(values))
            made[key] = response_lines(lines.grid, on_grid(response, perturbation, lines.grid))
        problems.append(Problem(made[key], lines.motion, lines.torque_nm))
    return problems


def stable(values: Array) -> tuple[float, float, float]:
    """Return parameters that a response can be simulated with."""
    J, B, K = np.maximum(values, LEAST)
    return float(J), float(B), float(K)


def on_grid(parts: Sequence[Array], ticks: Channel, grid: Grid) -> list[Array]:
    """Bring signals from the ticks onto the grid; without interpolation where they coincide."""
    place = (grid.time_s - ticks.time_s[0]) * ticks.mean_rate_hz
    nearest = np.clip(np.rint(place).astype(np.intp), 0, ticks.time_s.size - 1)
    if np.max(np.abs(ticks.time_s[nearest] - grid.time_s)) < SAME_TIME / ticks.mean_rate_hz:
        return [part[nearest] for part in parts]
    return list(CubicSpline(ticks.time_s, np.stack(parts), axis=1)(grid.time_s))
