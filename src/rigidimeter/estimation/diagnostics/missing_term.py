"""Whether the torque needs a term that J, B and K leave out, and how far it moves them.

Whether a term is there is decided by the part of it that no linear loop explains
(`terms.omitted_terms`), so that torque of the subject's own does not pass for it. A torque c T(t)
that is left out adds

    Δ = (Σ Re U^H Φ)⁻¹ Σ Re U^H c T

to an estimate with regressors Φ and instruments U, which for least squares are Φ too; c comes from
the part that no linear loop explains. For least squares a fit with the term, as `rigidimeter model`
makes it, is told beside that: a reflex whose two directions are not quite as one half wave has more
in its linear part.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rigidimeter.estimation.closedloop.line_noise import Smoother
from rigidimeter.estimation.closedloop.linear_problems import instrumental
from rigidimeter.estimation.closedloop.observation import observe
from rigidimeter.estimation.diagnostics.check_record import Case, Check, Look
from rigidimeter.estimation.prepared import PreparedEpoch
from rigidimeter.estimation.signals import Array, motion_channels
from rigidimeter.estimation.terms.beyond_linear import BeyondLinear, Complex, beyond_linear
from rigidimeter.estimation.terms.catalogue import REFLEXES, term_named
from rigidimeter.estimation.terms.omitted_terms import CHANCE, OmittedTerm, omitted_terms
from rigidimeter.estimation.terms.wideband import wideband_signals
from rigidimeter.settings import USABLE_FRACTION_OF_RATE

WORDS = {
    "coulomb": ("friction", "coulomb"),
    "damping+": ("damping that differs between the directions", "directional-damping"),
    "cubic": ("cubic stiffness", "cubic"),
    "quadratic": ("stiffness that differs between the sides", "quadratic"),
    **{
        f"{kind}{side}": ("reflex", f"{kind}{side}")
        for kind in ("reflex", "reflex-second-order")
        for side in "+-"
    },
}
"""What a term is called, and what `rigidimeter model --terms` calls it."""


class _Found:
    """The terms of one epoch, which every method shares."""

    def __init__(self, prepared: PreparedEpoch) -> None:
        epoch, estimation = prepared.epoch, prepared.settings.estimation
        used = [epoch.channels["torque_nm"], *motion_channels(epoch)]
        usable_hz = USABLE_FRACTION_OF_RATE * min(channel.rate_hz for channel in used)
        high_hz = min(estimation.band_high_unknown_hz, usable_hz)
        motion = wideband_signals(epoch, high_hz)
        # Stiffness is that at the mean posture, and what is not linear is so about it.
        motion = replace(motion, angle_rad=motion.angle_rad - np.mean(motion.angle_rad))
        self.beyond: BeyondLinear | None = None
        self.terms: tuple[OmittedTerm, ...] = ()
        try:
            band_hz = estimation.band_low_hz, high_hz
            self.beyond = beyond_linear(motion, band_hz, estimation.trim_s)
        except ValueError:
            return  # too short, or without any noise: nothing can be tested
        self.terms = omitted_terms(self.beyond)


def missing_term(case: Case) -> Look | None:
    """Return how far the terms that are left out move J, B and K, in % of half their intervals."""
    found = case.prepared.once(_Found) if case.prepared is not None else None
    if found is None or found.beyond is None:
        return None
    if not found.terms:
        return Look(0.0, 100.0, False, "no further term is in the torque")
    moved = _moved(case, found.beyond, found.terms)
    largest = np.max(np.abs(moved), axis=0) / np.maximum(case.half_widths, 1e-300)
    value = 100.0 * float(np.max(largest))
    named = "; ".join(_text(term, case, found.beyond) for term in found.terms)
    together = f"; all of them change {_changes(case, moved)}" if len(found.terms) > 1 else ""
    asked = ",".join(["inertia", "damping", "stiffness", *(WORDS[t.name][1] for t in found.terms)])
    # The whole damping and its two halves are one too many.
    asked = asked.replace("damping,", "", 1) if "directional-damping" in asked else asked
    return Look(
        value,
        100.0,
        True,
        f"{named}{together}, {value:.3g} % of half their intervals (at most 100 %)",
        remedy=f"include it: rigidimeter model --terms {asked}",
    )


def _text(term: OmittedTerm, case: Case, beyond: BeyondLinear) -> str:
    words, _ = WORDS[term.name]
    plain = term_named(term.name)
    unit = "N·m·s/rad" if plain is None else plain.unit
    late = f" {1e3 * term.inner[0]:.0f} ms late" if term.name in REFLEXES else ""
    return (
        f"{term.name}: the torque holds a {words} of {term.value:.3g} ± "
        f"{term.standard_error:.2g} {unit}{late} (p = {term.p:.1g}, below {CHANCE:g}); included, "
        f"it changes {_changes(case, _moved(case, beyond, [term]))}"
    )


def _changes(case: Case, moved: Array) -> str:
    found = []
    for row in moved:
        shares = -100 * row / np.abs(case.parameters)
        each = (f"{name} by {share:+.2g} %" for name, share in zip("JBK", shares, strict=True))
        found.append(", ".join(each))
    if len(found) == 1:
        return found[0]
    return f"{found[0]} (its part that is not linear alone: {found[1]})"


def _moved(case: Case, beyond: BeyondLinear, terms: Sequence[OmittedTerm]) -> Array:
    """Return what the terms add to J, B and K while they are left out, shape (1 or 2, 3).

    For least squares by a fit with them, which a loop with torque of the subject's own biases, and
    by their coefficients from what is not linear, which it does not.
    """
    torque = np.sum([term.torque(beyond) for term in terms], axis=0)
    if case.uses_perturbation and case.prepared is not None:
        observation = case.prepared.once(observe)
        grid = observation.lines.grid
        (problem,) = instrumental([observation], case.parameters)
        residual = problem.target - problem.regressors @ case.parameters
        power = Smoother.over(grid.line, 4, 0.1)(np.abs(residual) ** 2)
        weighted = problem.instruments / np.maximum(power, 1e-300)[:, None]
        lines = grid.transform(np.interp(grid.time_s, beyond.motion.time_s, torque))
        return _added(weighted, problem.regressors, lines)[None]
    low, high = case.signals.band_hz
    inside = (beyond.frequency_hz >= low) & (beyond.frequency_hz <= high)
    refitted = case.parameters - _refitted(beyond, terms, inside)
    motion = beyond.linear[inside]
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
    target = _stacked(beyond.torque_lines[inside])
    names = [term.name for term in terms]
    best, values = np.inf, np.zeros(3)
    for inner in beyond.grid(names):
        more = [line[inside] for line in beyond.terms_lines(names, inner)]
        columns = _stacked(np.column_stack([beyond.linear[inside], *more]))
        scale = np.linalg.norm(columns, axis=0)
        left, upper = np.linalg.qr(columns / scale)
        products = left.T @ target
        rest = float(target @ target - products @ products)
        if rest < best:
            best, values = rest, np.linalg.lstsq(upper, products)[0][:3] / scale[:3]
    return values


def _stacked(lines: Complex) -> Array:
    return np.concatenate([lines.real, lines.imag])


def _harmless(case: Case) -> str:
    look = missing_term(case)
    if look is None or look.value > look.threshold:
        return ""
    return "it moves J, B and K by less than half their intervals"


MISSING_TERM_CHECKS = (
    Check(
        "missing_term",
        (),
        missing_term,
        "J, B and K take it for their own",
        "include it: rigidimeter model",
        harmless=_harmless,
    ),
)
