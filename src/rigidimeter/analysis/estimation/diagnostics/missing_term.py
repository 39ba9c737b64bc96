"""Whether the torque needs a term that J, B and K leave out, and how far it moves them.

Whether a term is there is decided by the part of it that no linear loop explains
(`terms.omitted_terms`), so that torque of the subject's own does not pass for it; where there is
none, terms that are linear are looked for (`terms.linear_misfit`).

A torque c T(t) that is not in the model adds

    Δ = (Σ Re U^H Φ)⁻¹ Σ Re U^H c T

to an estimate with regressors Φ and instruments U, which for least squares are Φ too; c comes from
the part that no linear loop explains. For least squares a fit with the term, as `rigidimeter model`
makes it, is told beside that: a reflex whose two directions are not quite as one half wave has more
in its linear part. A term that is linear comes with the J, B and K beside it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import scipy

from rigidimeter.analysis.estimation.closedloop.line_noise import Smoother
from rigidimeter.analysis.estimation.closedloop.linear_problems import instrumental
from rigidimeter.analysis.estimation.closedloop.normal_equations import solution, sums
from rigidimeter.analysis.estimation.closedloop.observe import observe
from rigidimeter.analysis.estimation.diagnostics.check_record import (
    HARMFUL,
    Case,
    Check,
    Look,
)
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.signals import Array, usable_hz
from rigidimeter.analysis.estimation.stretches import longest_part
from rigidimeter.analysis.estimation.terms.beyond_linear import BeyondLinear, beyond_linear
from rigidimeter.analysis.estimation.terms.catalogue import REFLEXES, term_named
from rigidimeter.analysis.estimation.terms.explained import (
    Complex,
    Filtered,
    explained,
    strongest,
    triangle,
)
from rigidimeter.analysis.estimation.terms.linear_misfit import LinearTerm, linear_term
from rigidimeter.analysis.estimation.terms.omitted_terms import OmittedTerm, omitted_terms
from rigidimeter.analysis.estimation.terms.wideband import wideband_signals
from rigidimeter.core.findings import Effect, Fact

WORDS = {
    "coulomb": ("friction", "coulomb"),
    "damping+": ("directional damping", "directional-damping"),
    "cubic": ("cubic stiffness", "cubic"),
    "quadratic": ("one-sided stiffness", "quadratic"),
    **{
        f"{kind}{side}": ("reflex", f"{kind}{side}")
        for kind in ("reflex", "reflex-second-order")
        for side in "+-"
    },
}
"""What a term is called, and what `rigidimeter model --terms` calls it."""

MOST_PERCENT = 100.0
"""Of half the intervals: what is within them is in what they say."""

LITTLE = 0.02
"""A friction below this share of the torque's SD may be one of the drive: in simulated recordings a
drive with 3 N·m of it, which sticks where the motion turns, left 0.013 of it in the torque."""


class _Found:
    """The terms of one epoch, which every method shares."""

    def __init__(self, prepared: PreparedEpoch) -> None:
        epoch, estimation = longest_part(prepared.epoch), prepared.settings.estimation
        high_hz = min(estimation.band_high_unknown_hz, usable_hz(epoch))
        motion = wideband_signals(epoch, high_hz)
        # Stiffness is that at the mean posture, and what is not linear is so about it.
        motion = replace(motion, angle_rad=motion.angle_rad - np.mean(motion.angle_rad))
        motion = motion.part(slice(scipy.fft.prev_fast_len(motion.time_s.size)))
        self.beyond: BeyondLinear | None = None
        self.terms: tuple[OmittedTerm, ...] = ()
        self.linear: LinearTerm | None = None
        try:
            band_hz = estimation.band_low_hz, high_hz
            self.beyond = beyond_linear(motion, band_hz, estimation.trim_s)
        except ValueError:
            return  # too short, or without any noise: nothing can be tested
        self.terms = omitted_terms(self.beyond)
        if not self.terms:
            self.linear = linear_term(self.beyond)


def terms_found(case: Case) -> str:
    """Return what the terms are called that are not linear and are missing; empty if none is."""
    found = case.prepared.once(_Found) if case.prepared is not None else None
    return " and ".join(WORDS[term.name][0] for term in found.terms) if found is not None else ""


def missing_term(case: Case) -> Look | None:
    """Return how far the terms that are left out move J, B and K, in % of half their intervals."""
    found = case.prepared.once(_Found) if case.prepared is not None else None
    if found is None or found.beyond is None:
        return None
    if found.linear is not None:
        return _linear(case, found.beyond, found.linear)
    if not found.terms:
        return Look(0.0, MOST_PERCENT, False)
    *alone, added = _moved(case, found.beyond, [*((term,) for term in found.terms), found.terms])
    asked = ",".join(["inertia", "damping", "stiffness", *(WORDS[t.name][1] for t in found.terms)])
    # The whole damping and its two halves are one too many.
    asked = asked.replace("damping,", "", 1) if "directional-damping" in asked else asked
    facts: dict[str, Fact] = {
        "terms": " and ".join(WORDS[term.name][0] for term in found.terms),
        "sizes": " and ".join(map(_size, found.terms)),
        "asked": asked,
    }
    variants = ""
    if len(found.terms) > 1:
        variants = "several"
        for term, (by_fit, *_) in zip(found.terms, alone, strict=True):
            percent = Effect.of(by_fit, case.parameters, case.half_widths).percent
            for symbol, one in zip("JBK", percent, strict=True):
                facts[f"{symbol}_percent_of_{term.name}"] = one
    if _little_friction(case, found.terms):
        variants = "of_drive"
    return _look(case, added, max(term.p for term in found.terms), facts, variants)


def _little_friction(case: Case, terms: Sequence[OmittedTerm]) -> bool:
    most = LITTLE * float(np.std(case.signals.torque_nm))
    return [term.name for term in terms] == ["coulomb"] and terms[0].value <= most


def friction_of_drive(case: Case) -> Look | None:
    """Return that J hangs on a drive that is not known, where its friction may be in the torque.

    A drive shows in the torque only by what it does between the samples of the velocity.
    """
    known = case.uses_perturbation or "velocity_command_rad_s" in case.epoch.channels
    said = case.fit is not None and any(f.name == "between_samples" for f in case.fit.findings)
    look = None if known or said else case.once(missing_term)
    if look is None or case.prepared is None or not look.value > look.limit:
        return None
    if not _little_friction(case, case.prepared.once(_Found).terms):
        return None
    most = case.settings.max_between_samples_percent
    return Look(np.nan, most, True, {"little": 100 * LITTLE}, "friction")


def _linear(case: Case, beyond: BeyondLinear, term: LinearTerm) -> Look:
    facts: dict[str, Fact] = {"size": term.value, "share": 100 * term.share}
    if term.name != "coupling":
        facts |= {"terms": "a reflex", "late_ms": 1e3 * term.delay_s}
        facts["asked"] = "inertia,damping,stiffness,reflex+,reflex-"
    return _look(case, _moved_by_linear(case, beyond, term), term.p, facts, term.name)


def _look(case: Case, added: Array, p: float, facts: Mapping[str, Fact], variant: str) -> Look:
    """Return a look for what terms add to J, B and K while left out, shape (1 or 2, 3)."""
    largest = np.max(np.abs(added), axis=0) / np.maximum(case.half_widths, 1e-300)
    value = 100.0 * float(np.max(largest))
    by_fit, *beside = (Effect.of(row, case.parameters, case.half_widths) for row in added)
    # In a loop the fit with the terms may be biased: it is not enough to call them harmless.
    effect = beside[0] if by_fit.negligible and beside else by_fit
    return Look(value, MOST_PERCENT, True, facts, variant, effect, p)


def _moved(
    case: Case, beyond: BeyondLinear, groups: Sequence[Sequence[OmittedTerm]]
) -> list[Array]:
    """Return what each group of terms adds to J, B and K while left out, shape (1 or 2, 3) each.

    For least squares by a fit with them, which a loop with torque of the subject's own biases, and
    by their coefficients from what is not linear, which it does not.
    """
    terms = dict.fromkeys(term for group in groups for term in group)
    if case.uses_perturbation and case.prepared is not None:
        grid, here = case.prepared.once(observe).grid, beyond.motion.time_s
        torques = [np.interp(grid.time_s, here, term.torque(beyond), 0.0, 0.0) for term in terms]
        lines = grid.transform(np.reshape(torques, (-1, grid.time_s.size)))
        alone = dict(zip(terms, _added(case, case.prepared, lines), strict=True))
        return [np.sum([alone[term] for term in group], axis=0)[None] for group in groups]
    low, high = case.signals.band_hz
    first, last = np.searchsorted(beyond.frequency_hz, (low, np.nextafter(high, np.inf))).tolist()
    inside = slice(first, last)
    plain = [term for term in terms if term.name not in REFLEXES]
    with_motion = [beyond.linear, *(term.lines(beyond) for term in plain)]
    columns, torque = np.column_stack(with_motion)[inside], beyond.torque_lines[inside]
    upper = triangle(columns, torque)

    def joint(group: Sequence[OmittedTerm]) -> Array:
        """Return J, B and K by least squares beside these terms, shape (3,)."""
        used = [0, 1, 2, *(3 + i for i, term in enumerate(plain) if term in group)]
        reflexes = [term.name for term in group if term.name in REFLEXES]
        if not reflexes:
            return explained(upper[:, used], upper[:, -1]).values[:3]
        # One reflex at most is looked for: its direction is decided by what is not linear.
        (name,) = reflexes
        signal, gains = beyond.reflexes(name)
        late = Filtered(signal[inside], gains.part(inside, slice(None)))
        best = late.column(strongest(columns[:, used], late, torque))
        return _fitted(np.column_stack([columns[:, used], best]), torque)[:3]

    motion = columns[:, :3]
    alone = {term: _fitted(motion, term.lines(beyond)[inside]) for term in terms}
    return [
        np.stack([case.parameters - joint(group), np.sum([alone[t] for t in group], axis=0)])
        for group in groups
    ]


def _moved_by_linear(case: Case, beyond: BeyondLinear, term: LinearTerm) -> Array:
    """Return what a linear term adds to J, B and K while it is left out, shape (1, 3)."""
    if not case.uses_perturbation or case.prepared is None:
        return (case.parameters - term.joint)[None]
    seen = case.prepared.once(observe)
    torque = term.torque(seen.motion, seen.grid.omega_rad_s)
    return _added(case, case.prepared, torque)[None]


def _added(case: Case, prepared: PreparedEpoch, torque: Complex) -> Array:
    """Return (Σ Re U^H Φ)⁻¹ Σ Re U^H T for each torque, of shape (..., m); shape (..., 3)."""
    (problem,) = instrumental([prepared.once(observe)], case.parameters)
    residual = problem.target - problem.regressors @ case.parameters
    power = Smoother.over(problem.observation.grid.line, 4, 0.1)(np.abs(residual) ** 2)
    gram, moment, _ = sums([problem._replace(target=torque)], [np.maximum(power, 1e-300)])
    return solution(gram, moment)


def _fitted(columns: Complex, torque: Complex) -> Array:
    """Return the columns' parts in a torque by least squares."""
    upper = triangle(columns, torque)
    return explained(upper[:, :-1], upper[:, -1]).values


def _size(term: OmittedTerm) -> str:
    """Return a term with its coefficient."""
    plain = term_named(term.name)
    unit = "N·m·s/rad" if plain is None else plain.unit
    late = f" {1e3 * term.inner[0]:.0f} ms late" if term.name in REFLEXES else ""
    return f"{WORDS[term.name][0]} {term.value:.3g} ± {term.standard_error:.2g} {unit}{late}"


MISSING_TERM_CHECKS = (
    Check(
        "missing_term",
        (),
        lambda c: c.once(missing_term),
        harmless=lambda _, look: HARMFUL if look.value > look.limit else ("within", {}),
    ),
)
