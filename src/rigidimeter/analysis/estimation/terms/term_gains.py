"""The coefficients of terms from what no linear filter of the motion explains, and their signs."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rigidimeter.analysis.estimation.terms.beyond_linear import BeyondLinear
from rigidimeter.analysis.estimation.terms.catalogue import REFLEXES, term_named
from rigidimeter.analysis.estimation.terms.reflex import FIR_SPACING_S, kernel


@dataclass(frozen=True)
class TermGain:
    """A term's coefficient from its part that no linear filter of the motion explains."""

    term: str
    value: float
    standard_error: float
    unit: str


def directed(
    beyond: BeyondLinear, names: tuple[str, ...]
) -> tuple[tuple[str, ...], tuple[TermGain, ...]]:
    """Decide the direction of a reflex, and return the terms that are not linear with their gains.

    Of max(v, 0) = (v + |v|)/2 and min(v, 0) = (v − |v|)/2 the even part has opposite signs: a
    reflex that resists has a positive gain in one direction only.
    """
    undecided = [name for name in names if name in REFLEXES and name[-1] not in "+-"]
    found = [
        _gains(beyond, tuple(name + side if name in undecided else name for name in names))
        for side in ("+-" if undecided else "+")
    ]
    if not undecided:
        return names, found[0]
    kind = undecided[0]
    plus = next(one.value for one in found[0] if one.term == f"{kind}+")
    side, solved = ("+", found[0]) if plus > 0 else ("-", found[1])
    return tuple(name + side if name in undecided else name for name in names), solved


def _gains(beyond: BeyondLinear, names: tuple[str, ...]) -> tuple[TermGain, ...]:
    """Return the coefficients of the terms that are not linear in the motion."""
    bent = beyond.not_linear(names)
    if not bent:
        return ()
    tried = [beyond.solve(beyond.columns(bent, q)) for q in beyond.grid(bent)]
    best = min(tried, key=lambda one: float(np.sum(np.abs(one.residual) ** 2)))
    found, column = [], 0
    for name in bent:
        term = term_named(name)
        count = 1 if term is not None else len(kernel(name).columns)
        part = slice(column, column + count)
        column += count
        width = FIR_SPACING_S if count > 1 else 1.0
        found.append(
            TermGain(
                name,
                width * float(np.sum(best.values[part])),
                width * math.sqrt(float(np.sum(best.covariance[part, part]))),
                "N·m·s/rad" if term is None else term.unit,
            )
        )
    return tuple(found)


def pushes(one: TermGain) -> str:
    """Return that a reflex or a friction pushes, by more than chance; empty where it does not."""
    term = term_named(one.term)
    if one.value >= -2 * one.standard_error or (term is not None and not term.resists):
        return ""
    kind = "reflex" if term is None else "friction"
    return (
        f"the gain of {one.term} is {one.value:.3g} ± {one.standard_error:.2g} {one.unit}: it "
        f"pushes, and a {kind} resists, so it stands for something else"
    )
