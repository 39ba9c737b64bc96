"""Whether the torque needs a term that J, B and K leave out, and how far it moves them.

Whether a term is there is decided by the part of it that no linear loop explains
(`terms.omitted_terms`), so that torque of the subject's own does not pass for it; where there is
none, terms that are linear are looked for (`terms.linear_misfit`). How far they move J, B and K is
found in `omitted_bias`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import fft

from rigidimeter.analysis.estimation.between_epochs import in_full
from rigidimeter.analysis.estimation.closedloop.between_finding import REMEDY
from rigidimeter.analysis.estimation.diagnostics.check_record import (
    Case,
    Check,
    Look,
)
from rigidimeter.analysis.estimation.diagnostics.omitted_bias import moved, moved_by_linear
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.signals import Array, motion_channels
from rigidimeter.analysis.estimation.stretches import longest_part
from rigidimeter.analysis.estimation.terms.beyond_linear import BeyondLinear, beyond_linear
from rigidimeter.analysis.estimation.terms.catalogue import REFLEXES, term_named
from rigidimeter.analysis.estimation.terms.linear_misfit import LinearTerm, linear_term
from rigidimeter.analysis.estimation.terms.omitted_terms import CHANCE, OmittedTerm, omitted_terms
from rigidimeter.analysis.estimation.terms.wideband import wideband_signals
from rigidimeter.core.settings import USABLE_FRACTION_OF_RATE

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


LITTLE = 0.02
"""A friction below this share of the torque's SD may be one of the drive: in simulated recordings a
drive with 3 N·m of it, which sticks where the motion turns, left 0.013 of it in the torque."""


class _Found:
    """The terms of one epoch, which every method shares."""

    def __init__(self, prepared: PreparedEpoch) -> None:
        epoch, estimation = longest_part(prepared.epoch), prepared.settings.estimation
        used = [epoch.channels["torque_nm"], *motion_channels(epoch)]
        usable_hz = USABLE_FRACTION_OF_RATE * min(channel.rate_hz for channel in used)
        high_hz = min(estimation.band_high_unknown_hz, usable_hz)
        motion = wideband_signals(epoch, high_hz)
        # Stiffness is that at the mean posture, and what is not linear is so about it.
        motion = replace(motion, angle_rad=motion.angle_rad - np.mean(motion.angle_rad))
        motion = motion.part(slice(fft.prev_fast_len(motion.time_s.size)))
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
        return Look(0.0, 100.0, False, "no further term is in the torque")
    *alone, added = moved(case, found.beyond, [*((term,) for term in found.terms), found.terms])
    value = _share_percent(case, added)
    named = "; ".join(_text(*one, case) for one in zip(found.terms, alone, strict=True))
    together = f"; all of them change {_changes(case, added)}" if len(found.terms) > 1 else ""
    asked = ",".join(["inertia", "damping", "stiffness", *(WORDS[t.name][1] for t in found.terms)])
    # The whole damping and its two halves are one too many.
    asked = asked.replace("damping,", "", 1) if "directional-damping" in asked else asked
    return Look(
        value,
        100.0,
        True,
        f"{named}{together}, {in_full(value, '.3g', limit=100.0)} % of half their intervals "
        "(at most 100 %)",
        meaning=_of_drive(case, found.terms),
        remedy=f"include it: rigidimeter model --terms {asked}",
    )


def _of_drive(case: Case, terms: Sequence[OmittedTerm]) -> str:
    """Say that a friction is so small that it may be the drive's; else return an empty text."""
    if not _little_friction(case, terms):
        return ""
    return (
        f"J, B and K take it for their own; or, since it is below {100 * LITTLE:g} % of the "
        "torque's SD, it is friction of the drive, and including it does not make them better"
    )


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
    if look is None or case.prepared is None or not look.value > look.threshold:
        return None
    if not _little_friction(case, case.prepared.once(_Found).terms):
        return None
    most = case.settings.max_between_samples_percent
    return Look(
        np.nan,
        most,
        True,
        f"the torque holds a friction below {100 * LITTLE:g} % of its SD, as friction of the drive "
        "leaves there, and without the command it is not known how the drive moved between the "
        "samples",
    )


def _linear(case: Case, beyond: BeyondLinear, term: LinearTerm) -> Look:
    added = moved_by_linear(case, beyond, term)
    value = _share_percent(case, added)
    if term.name == "coupling":
        what = f"coupling: between sensor and joint something gives, with {term.value:.3g} N·m/rad"
        remedy = "make the coupling stiffer, or lower the upper edge of the band (--band-hz)"
    else:
        what = (
            f"reflex: the torque holds a reflex of both directions of {term.value:.3g} N·m·s/rad "
            f"{1e3 * term.delay_s:.0f} ms late"
        )
        remedy = "include it: rigidimeter model --terms inertia,damping,stiffness,reflex+,reflex-"
    return Look(
        value,
        100.0,
        True,
        f"{what} (it explains {100 * term.share:.0f} % of what J, B and K leave to a linear "
        f"filter; p = {term.p:.1g}, below {CHANCE:g}); included, it changes "
        f"{_changes(case, added)}, {in_full(value, '.3g', limit=100.0)} % of half their intervals "
        "(at most 100 %)",
        remedy=remedy,
    )


def _share_percent(case: Case, added: Array) -> float:
    largest = np.max(np.abs(added), axis=0) / np.maximum(case.half_widths, 1e-300)
    return 100.0 * float(np.max(largest))


def _text(term: OmittedTerm, moved: Array, case: Case) -> str:
    words, _ = WORDS[term.name]
    plain = term_named(term.name)
    unit = "N·m·s/rad" if plain is None else plain.unit
    late = f" {1e3 * term.inner[0]:.0f} ms late" if term.name in REFLEXES else ""
    return (
        f"{term.name}: the torque holds a {words} of {term.value:.3g} ± "
        f"{term.standard_error:.2g} {unit}{late} (p = {term.p:.1g}, below {CHANCE:g}); included, "
        f"it changes {_changes(case, moved)}"
    )


def _changes(case: Case, moved: Array) -> str:
    found = []
    for row in moved:
        shares = -100 * row / np.abs(case.parameters)
        each = (
            f"{name} by {in_full(share, '+.2g')} %"
            for name, share in zip("JBK", shares, strict=True)
        )
        found.append(", ".join(each))
    if len(found) == 1:
        return found[0]
    return f"{found[0]} (its part that is not linear alone: {found[1]})"


def _harmless(case: Case, look: Look) -> str:
    del case
    if look.value > look.threshold:
        return ""
    return "it moves J, B and K by less than half their intervals"


MISSING_TERM_CHECKS = (
    Check(
        "missing_term",
        (),
        lambda c: c.once(missing_term),
        "J, B and K take it for their own",
        "include it: rigidimeter model",
        harmless=_harmless,
    ),
    Check(
        "between_samples",
        (),
        friction_of_drive,
        "J may be some percent too small",
        f"record the command; or {REMEDY}",
    ),
)
