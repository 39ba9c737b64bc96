"""Maximum likelihood: the torque that the perturbation causes, against the torque measured.

The whole loop is simulated from the perturbation alone, and J, B, K are those that make the
simulated torque M̂(p) most likely, given a disturbance of unknown colour:

    minimise Σ |Y − Ŷ(p)|² / S + log S

over the lines (the Whittle likelihood), by Gauss-Newton steps with ∂Ŷ/∂p = S_loop Φ̂, S being the
smoothed power of the residual. Only the torque is used, so the motion sensor's noise, rate and
delay do not matter; but the controller and the drive must be what the settings say or what the
recording shows, for a wrong controller is taken for the joint. The alternative, whitening the
equation error of torque against measured motion, is no more precise and biased for K when the
subject pushes slowly: see docs/explanation/closed-loop.md.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np
from numpy.typing import NDArray

from rigidimeter.estimation.closedloop.instruments import on_grid, stable
from rigidimeter.estimation.closedloop.refine import Observation, Problem
from rigidimeter.estimation.closedloop.spectral_lines import response_lines
from rigidimeter.estimation.signals import Array

__all__ = ["output_error"]

Complex = NDArray[np.complex128]


def output_error(observations: Sequence[Observation], values: Array) -> list[Problem]:
    """Return the problems of one Gauss-Newton step at the given J, B and K."""
    made: dict[Hashable, tuple[Complex, Complex]] = {}
    problems = []
    used = np.array(stable(values))
    for observation in observations:
        lines, perturbation, loop, _, key = observation
        if key not in made:
            rate_hz = perturbation.mean_rate_hz
            response = loop.response(perturbation.values, rate_hz, stable(values))
            slopes = loop.sensed(response, rate_hz, stable(values))
            torque = used @ np.stack(response)
            parts = on_grid((torque, *slopes), perturbation, lines.grid)
            spectra = response_lines(lines.grid, parts)
            made[key] = spectra[:, 0], spectra[:, 1:]
        simulated, slope = made[key]
        problems.append(Problem(slope, slope, lines.torque_nm - simulated + slope @ used))
    return problems
