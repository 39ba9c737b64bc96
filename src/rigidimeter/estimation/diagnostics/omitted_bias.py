"""How far a torque that is left out moves J, B and K.

A torque c T(t) that is not in the model adds

    Δ = (Σ Re U^H Φ)⁻¹ Σ Re U^H c T

to an estimate with regressors Φ and instruments U, which for least squares are Φ too; c comes from
the part that no linear loop explains. For least squares a fit with the term, as `rigidimeter model`
makes it, is told beside that: a reflex whose two directions are not quite as one half wave has more
in its linear part. A term that is linear comes with the J, B and K beside it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rigidimeter.estimation.closedloop.line_noise import Smoother
from rigidimeter.estimation.closedloop.linear_problems import instrumental
from rigidimeter.estimation.closedloop.observation import observe
from rigidimeter.estimation.diagnostics.check_record import Case
from rigidimeter.estimation.signals import Array
from rigidimeter.estimation.terms.beyond_linear import BeyondLinear, Complex
from rigidimeter.estimation.terms.catalogue import REFLEXES
from rigidimeter.estimation.terms.linear_misfit import LinearTerm
from rigidimeter.estimation.terms.omitted_terms import OmittedTerm


def moved(
    case: Case,
    beyond: BeyondLinear,
    terms: Sequence[OmittedTerm],
    linear: LinearTerm | None = None,
) -> Array:
    """Return what the terms add to J, B and K while they are left out, shape (1 or 2, 3).

    For least squares by a fit with them, which a loop with torque of the subject's own biases, and
    by their coefficients from what is not linear, which it does not.
    """
    torque = np.zeros(beyond.motion.time_s.size)
    for term in terms:
        torque = torque + term.torque(beyond)
    if case.uses_perturbation and case.prepared is not None:
        observation = case.prepared.once(observe)
        grid = observation.lines.grid
        (problem,) = instrumental([observation], case.parameters)
        residual = problem.target - problem.regressors @ case.parameters
        power = Smoother.over(grid.line, 4, 0.1)(np.abs(residual) ** 2)
        weighted = problem.instruments / np.maximum(power, 1e-300)[:, None]
        lines = grid.transform(np.interp(grid.time_s, beyond.motion.time_s, torque, 0.0, 0.0))
        if linear is not None:
            lines = lines + linear.torque(problem.regressors, grid.omega_rad_s)
        return _added(weighted, problem.regressors, lines)[None]
    low, high = case.signals.band_hz
    inside = (beyond.frequency_hz >= low) & (beyond.frequency_hz <= high)
    motion = beyond.linear[inside]
    if linear is not None:
        return (case.parameters - linear.joint)[None]
    refitted = case.parameters - _refitted(beyond, terms, inside)
    return np.stack([refitted, _added(motion, motion, beyond.lines(torque)[inside])])


def _added(weighted: Complex, regressors: Complex, torque: Complex) -> Array:
    """Return (Σ Re U^H Φ)⁻¹ Σ Re U^H T, shape (3,)."""
    scale = np.linalg.norm(regressors, axis=0)
    gram = (weighted.conj().T @ (regressors / scale)).real
    return np.asarray(np.linalg.solve(gram, (weighted.conj().T @ torque).real) / scale)


def _refitted(
    beyond: BeyondLinear, terms: Sequence[OmittedTerm], inside: NDArray[np.bool_]
) -> Array:
    """Return J, B and K by least squares with the terms, shape (3,)."""
    plain = [term.name for term in terms if term.name not in REFLEXES]
    reflexes = [term.name for term in terms if term.name in REFLEXES]
    fixed = beyond.terms_lines(plain)
    columns = _stacked(np.column_stack([beyond.linear, *fixed])[inside])
    target = _stacked(beyond.torque_lines[inside])
    if not reflexes:
        return _solved(columns, target)[:3]
    # One reflex at most is looked for: its direction is decided by what is not linear.
    late = _stacked(
        np.column_stack([beyond.terms_lines(reflexes, q)[0] for q in beyond.grid(reflexes)])[inside]
    )
    scale = np.linalg.norm(columns, axis=0)
    basis, _ = np.linalg.qr(columns / scale)
    rest = target - basis @ (basis.T @ target)
    beside = late - basis @ (basis.T @ late)
    explained = (rest @ beside) ** 2 / np.maximum(np.sum(beside**2, axis=0), 1e-300)
    best = late[:, int(np.argmax(explained))]
    return _solved(np.column_stack([columns, best]), target)[:3]


def _solved(columns: Array, target: Array) -> Array:
    scale = np.linalg.norm(columns, axis=0)
    left, upper = np.linalg.qr(columns / scale)
    return np.asarray(np.linalg.lstsq(upper, left.T @ target)[0] / scale)


def _stacked(lines: Complex) -> Array:
    return np.concatenate([lines.real, lines.imag])
