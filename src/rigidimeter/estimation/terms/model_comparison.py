"""Which model: fitted on the first part of a recording, judged on the rest.

More terms always fit better; they predict better only if they are there. Among the models whose
held-out residual variance is within 5 % of the least, the one with the fewest parameters is
recommended.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rigidimeter.estimation.terms.catalogue import REFLEXES, parse_terms
from rigidimeter.estimation.terms.reflex import REFLEX_KINDS
from rigidimeter.estimation.terms.term_fit import TermsFit, fit_terms, predict
from rigidimeter.estimation.terms.wideband_motion import Motion, split

__all__ = ["BASE", "Comparison", "ModelRow", "candidates", "compare_models"]

BASE = ("inertia", "damping", "stiffness")

NEARLY_AS_GOOD = 1.05
"""Held-out residual variance, over the least, up to which fewer parameters are preferred."""

SMALL_P = 0.01


@dataclass(frozen=True)
class ModelRow:
    """One model: its fit to the first part, and the VAF of what it predicts of the rest.

    `fit` is None where the model could not be fitted; `problem` then says why.
    """

    terms: tuple[str, ...]
    fit: TermsFit | None
    held_out_vaf_percent: float
    problem: str = ""


@dataclass(frozen=True)
class Comparison:
    """A row for each model, the recommended one among them (None if no model could be fitted)."""

    rows: tuple[ModelRow, ...]
    recommended: ModelRow | None
    reason: str


def candidates(terms: Sequence[str]) -> list[tuple[str, ...]]:
    """Return models from J, B, K up to the named terms: alone, with each further one, with all.

    A reflex named without its dynamics is tried with each.
    """
    terms = parse_terms(terms)
    base = tuple(name for name in terms if name in (*BASE, "offset")) or terms[:1]
    more = [name for name in terms if name not in base]
    plain = [name for name in more if name.rstrip("+-") == "reflex"]
    more += [name.replace("reflex", kind) for name in plain for kind in REFLEX_KINDS[1:]]
    steps = [base, *((*base, name) for name in more), terms]
    return list(dict.fromkeys(steps))


def compare_models(
    motion: Motion,
    models: Sequence[Sequence[str]],
    band_hz: tuple[float, float],
    trim_s: float = 1.0,
    fraction: float = 0.5,
) -> Comparison:
    """Fit each model on the first `fraction`, predict the rest, and recommend one.

    Parameters
    ----------
    motion : Motion
    models : sequence of sequences of str
        The terms of each.
    band_hz, trim_s
        As for `fit_terms`; the cut between the parts is trimmed on both sides.
    fraction : float
    """
    first, rest = split(motion, fraction)
    rows = []
    for model in models:
        terms = parse_terms(model)
        try:
            fit = fit_terms(first, terms, band_hz, trim_s)
            rows.append(ModelRow(fit.terms, fit, predict(fit, rest).vaf_percent))
        except ValueError as error:
            rows.append(ModelRow(terms, None, float("nan"), str(error)))
    return Comparison(tuple(rows), *_recommend(rows))


def _recommend(rows: Sequence[ModelRow]) -> tuple[ModelRow | None, str]:
    fitted = [(row, row.fit) for row in rows if row.fit is not None]
    if not fitted:
        return None, "no model could be fitted"
    best, _ = max(fitted, key=lambda pair: pair[0].held_out_vaf_percent)
    least = 100.0 - best.held_out_vaf_percent
    good = [
        pair for pair in fitted if 100.0 - pair[0].held_out_vaf_percent <= NEARLY_AS_GOOD * least
    ]
    chosen, fit = min(good, key=lambda pair: (pair[1].n_parameters, pair[1].bic))
    named = "+".join(chosen.terms)
    reason = f"{named}: predicts {chosen.held_out_vaf_percent:.2f} % of the part it has not seen"
    if chosen is not best:
        reason += (
            f", and {'+'.join(best.terms)} with {best.held_out_vaf_percent:.2f} % is not worth its "
            "further parameters"
        )
    elif len(fitted) > 1:
        second = max(row.held_out_vaf_percent for row, _ in fitted if row is not chosen)
        reason += f", the next best {second:.2f} %"
    if fit.test.input_p < SMALL_P:
        reason += "; its residual still depends on the velocity, so a term may be missing"
    elif not any(name in REFLEXES for name in chosen.terms) and fit.test.ljung_box_p < SMALL_P:
        reason += "; its residual is coloured"
    return chosen, reason
