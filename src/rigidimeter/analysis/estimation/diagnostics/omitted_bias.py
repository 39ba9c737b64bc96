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

from rigidimeter.analysis.estimation.closedloop.line_noise import Smoother
from rigidimeter.analysis.estimation.closedloop.linear_problems import instrumental
from rigidimeter.analysis.estimation.closedloop.normal_equations import solution, sums
from rigidimeter.analysis.estimation.closedloop.observation import observe
from rigidimeter.analysis.estimation.diagnostics.check_record import Case
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.analysis.estimation.terms.beyond_linear import BeyondLinear
from rigidimeter.analysis.estimation.terms.catalogue import REFLEXES
from rigidimeter.analysis.estimation.terms.explained import (
    Complex,
    Filtered,
    explained,
    strongest,
    triangle,
)
from rigidimeter.analysis.estimation.terms.linear_misfit import LinearTerm
from rigidimeter.analysis.estimation.terms.omitted_terms import OmittedTerm


def moved(case: Case, beyond: BeyondLinear, groups: Sequence[Sequence[OmittedTerm]]) -> list[Array]:
    """Return what each group of terms adds to J, B and K while left out, shape (1 or 2, 3) each.

    For least squares by a fit with them, which a loop with torque of the subject's own biases, and
    by their coefficients from what is not linear, which it does not.
    """
    terms = dict.fromkeys(term for group in groups for term in group)
    if case.uses_perturbation and case.prepared is not None:
        grid, here = case.prepared.once(observe).lines.grid, beyond.motion.time_s
        torques = [np.interp(grid.time_s, here, term.torque(beyond), 0.0, 0.0) for term in terms]
        lines = grid.transform(np.reshape(torques, (-1, grid.time_s.size)))
        alone = dict(zip(terms, _added(case, case.prepared, lines), strict=True))
        return [np.sum([alone[term] for term in group], axis=0)[None] for group in groups]
    low, high = case.signals.band_hz
    first, last = np.searchsorted(beyond.frequency_hz, (low, np.nextafter(high, np.inf))).tolist()
    inside = slice(first, last)
    motion = beyond.linear[inside]
    alone = {term: _fitted(motion, term.lines(beyond)[inside]) for term in terms}
    refit = _Refit(beyond, [term.name for term in terms], inside)
    return [
        np.stack([case.parameters - refit.joint(group), np.sum([alone[t] for t in group], axis=0)])
        for group in groups
    ]


def moved_by_linear(case: Case, beyond: BeyondLinear, term: LinearTerm) -> Array:
    """Return what a linear term adds to J, B and K while it is left out, shape (1, 3)."""
    if not case.uses_perturbation or case.prepared is None:
        return (case.parameters - term.joint)[None]
    lines = case.prepared.once(observe).lines
    torque = term.torque(lines.motion, lines.grid.omega_rad_s)
    return _added(case, case.prepared, torque)[None]


def _added(case: Case, prepared: PreparedEpoch, torque: Complex) -> Array:
    """Return (Σ Re U^H Φ)⁻¹ Σ Re U^H T for each torque, of shape (..., m); shape (..., 3)."""
    (problem,) = instrumental([prepared.once(observe)], case.parameters)
    residual = problem.target - problem.regressors @ case.parameters
    power = Smoother.over(problem.observation.lines.grid.line, 4, 0.1)(np.abs(residual) ** 2)
    gram, moment, _ = sums([problem._replace(target=torque)], [np.maximum(power, 1e-300)])
    return solution(gram, moment)


def _fitted(columns: Complex, torque: Complex) -> Array:
    """Return the columns' parts in a torque by least squares."""
    upper = triangle(columns, torque)
    return explained(upper[:, :-1], upper[:, -1]).values


class _Refit:
    """J, B and K by least squares with some of the terms, at lines of the band."""

    def __init__(self, beyond: BeyondLinear, names: Sequence[str], inside: slice) -> None:
        self._beyond, self._inside = beyond, inside
        self._plain = [name for name in names if name not in REFLEXES]
        lines = [beyond.linear, *(beyond.term_lines(name) for name in self._plain)]
        self._columns = np.concatenate(lines, axis=1)[inside]
        self._torque = beyond.torque_lines[inside]
        self._upper = triangle(self._columns, self._torque)

    def joint(self, terms: Sequence[OmittedTerm]) -> Array:
        """Return J, B and K beside these terms, shape (3,)."""
        reflexes = [term.name for term in terms if term.name in REFLEXES]
        used = [
            0,
            1,
            2,
            *(3 + i for i, n in enumerate(self._plain) if n in {t.name for t in terms}),
        ]
        if not reflexes:
            return explained(self._upper[:, used], self._upper[:, -1]).values[:3]
        # One reflex at most is looked for: its direction is decided by what is not linear.
        (name,) = reflexes
        columns = self._columns[:, used]
        signal, gains = self._beyond.reflexes(name)
        late = Filtered(signal[self._inside], gains.part(self._inside, slice(None)))
        best = late.column(strongest(columns, late, self._torque))
        return _fitted(np.column_stack([columns, best]), self._torque)[:3]
