"""Which model: judged by what it predicts of blocks that it has not seen.

More terms always fit better; they predict better only if they are there. And in a closed loop the
subject's own torque moves the joint, so that a delayed velocity predicts it in every block though
the joint has no reflex. Models are therefore compared by what no linear filter of the motion
predicts (`beyond_linear`); where they differ in linear terms alone, by the torque itself.

A model is recommended if its prediction is better than that of an offset alone, by a margin and
with an interval for all comparisons together; a larger one instead of a smaller one likewise. A
reflex or a friction that pushes, however well it predicts, is something else and not chosen.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.analysis.estimation.terms.beyond_linear import BeyondLinear, beyond_linear
from rigidimeter.analysis.estimation.terms.catalogue import (
    GROUPS,
    REFLEXES,
    parse_terms,
    term_named,
)
from rigidimeter.analysis.estimation.terms.held_out import Gain, block_errors, gain
from rigidimeter.analysis.estimation.terms.reflex import (
    FIR_SPACING_S,
    REFLEX_KINDS,
    kernel,
    points_tried,
)
from rigidimeter.analysis.estimation.terms.regressors import Design
from rigidimeter.analysis.estimation.terms.term_fit import TermsFit, fit_terms

BASE = ("inertia", "damping", "stiffness")

LEAST_PERCENT = 5.0
"""Of the torque's variance, that a model must predict beyond an offset."""

MARGIN_PERCENT = 1.0
"""Of the error of a smaller model, that a larger one must predict."""


@dataclass(frozen=True)
class TermGain:
    """A term's coefficient from its part that no linear filter of the motion explains."""

    term: str
    value: float
    standard_error: float
    unit: str


@dataclass(frozen=True)
class ModelRow:
    """One model: its fit to all of the data, and where models are compared what it predicts.

    Attributes
    ----------
    terms : tuple of str
    fit : TermsFit or None
        None where the model could not be fitted; `problem` then says why.
    held_out : Gain or None
        The share of the torque's variance that it predicts beyond an offset, in blocks that it has
        not seen.
    beyond : tuple of TermGain
        The terms that are not linear in the motion.
    problem : str
        Why it could not be fitted, or is not to be chosen.
    """

    terms: tuple[str, ...]
    fit: TermsFit | None
    held_out: Gain | None = None
    beyond: tuple[TermGain, ...] = ()
    problem: str = ""
    errors: Array = field(default_factory=lambda: np.zeros(0), repr=False, compare=False)
    beyond_errors: Array = field(default_factory=lambda: np.zeros(0), repr=False, compare=False)

    @property
    def held_out_vaf_percent(self) -> float:
        """The share that it predicts, NaN where models are not compared."""
        return math.nan if self.held_out is None else self.held_out.percent

    @property
    def name(self) -> str:
        """Its terms in one word."""
        return "+".join(self.terms)


@dataclass(frozen=True)
class Comparison:
    """A row for each model, the recommended one among them (None where there is none)."""

    rows: tuple[ModelRow, ...]
    recommended: ModelRow | None
    reason: str


def candidates(terms: Sequence[str]) -> list[tuple[str, ...]]:
    """Return models from J, B, K up to one further term: alone, and with each of the others.

    A reflex named without its dynamics is tried with each; of two halves beside their whole one is
    enough.
    """
    terms = parse_terms(terms)
    base = tuple(name for name in terms if name in (*BASE, "offset")) or terms[:1]
    halves = [half for group in GROUPS.values() for half in group if half[:-1] in terms]
    more = [name for name in terms if name not in base and not (name in halves and "-" in name)]
    plain = [name for name in more if name.rstrip("+-") == "reflex"]
    more += [name.replace("reflex", kind) for name in plain for kind in REFLEX_KINDS[1:]]
    return list(dict.fromkeys([base, *((*base, name) for name in more)]))


def compare_models(
    motion: Signals,
    models: Sequence[Sequence[str]],
    band_hz: tuple[float, float],
    trim_s: float = 1.0,
    *,
    grow: bool = False,
) -> Comparison:
    """Let each model predict blocks that it has not seen, and recommend one.

    Parameters
    ----------
    motion : Signals
        Wide-band.
    models : sequence of sequences of str
        The terms of each.
    band_hz, trim_s
        As for `fit_terms`; as long is left out at each side of a block.
    grow : bool
        Add further terms to the best model, one by one, as long as that predicts better.
    """
    judge = _Judge(motion, band_hz, trim_s, len(models))
    rows = [judge.row(model) for model in models]
    chosen, reason = judge.recommend(rows)
    single = dict.fromkeys(name for model in models for name in parse_terms(model))
    while grow and chosen is not None and chosen.beyond:
        known = {frozenset(row.terms) for row in rows}
        bases = {_base(name) for name in chosen.terms}
        further = [(*chosen.terms, name) for name in single if _base(name) not in bases]
        new = [judge.row(model) for model in further if frozenset(model) not in known]
        rows += new
        smaller, (chosen, reason) = chosen, judge.recommend(rows)
        if chosen is smaller:
            break
    return Comparison(tuple(rows), chosen, reason)


def fit_models(
    motion: Signals,
    models: Sequence[Sequence[str]],
    band_hz: tuple[float, float],
    trim_s: float = 1.0,
) -> Comparison:
    """Fit each model to all of the data; none is recommended."""
    rows = [fit_model(motion, model, band_hz, trim_s) for model in models]
    try:
        beyond = beyond_linear(motion, band_hz, trim_s)
    except ValueError:  # too few lines, or no noise: the coefficients of the fit have to do
        return Comparison(tuple(rows), None, "")
    gains = [() if row.fit is None else _directed(beyond, row.terms)[1] for row in rows]
    both = zip(rows, gains, strict=True)
    return Comparison(tuple(replace(row, beyond=found) for row, found in both), None, "")


def fit_model(
    motion: Signals, terms: Sequence[str], band_hz: tuple[float, float], trim_s: float = 1.0
) -> ModelRow:
    """Fit one model; one that cannot be fitted says why."""
    try:
        fit = fit_terms(motion, terms, band_hz, trim_s)
    except ValueError as error:
        return ModelRow(parse_terms(terms), None, problem=str(error))
    return ModelRow(fit.terms, fit)


class _Judge:
    """The blocks of one epoch, and how well each model predicts them."""

    def __init__(
        self, motion: Signals, band_hz: tuple[float, float], trim_s: float, models: int
    ) -> None:
        self._comparisons = max(models - 1, 1)
        self._motion, self._band_hz, self._trim_s = motion, band_hz, trim_s
        self._beyond = beyond_linear(motion, band_hz, trim_s)
        self._target = self._beyond.series(self._beyond.torque)

    def row(self, model: Sequence[str]) -> ModelRow:
        """Fit one model to all, let it predict each block, and look at its signs."""
        names = parse_terms(model)
        decided, solved = _directed(self._beyond, names)
        row = fit_model(self._motion, decided, self._band_hz, self._trim_s)
        if row.fit is None:
            return replace(row, terms=names)
        bent = self._beyond.not_linear(decided)
        beyond = self._beyond
        tried = [beyond.series(beyond.columns(bent, inner)) for inner in points_tried(bent)]
        design = Design(self._motion, decided, self._band_hz, self._trim_s)
        target, columns = design.torque_nm[design.keep], design.columns(row.fit.nonlinear)
        rate_hz, gap_s = design.rate_hz, self._trim_s
        errors = block_errors(target, [columns], rate_hz, gap_s)
        return replace(
            row,
            held_out=gain(block_errors(target, [], rate_hz, gap_s, mean=True), errors),
            beyond=solved,
            problem="; ".join(filter(None, map(_pushes, solved))),
            errors=errors,
            beyond_errors=block_errors(self._target, tried, beyond.series_rate_hz, gap_s),
        )

    def recommend(self, rows: Sequence[ModelRow]) -> tuple[ModelRow | None, str]:
        """Return the model to use, and why."""
        fitted = [row for row in rows if row.fit is not None and row.held_out is not None]
        if not fitted:
            return None, "no model could be fitted"
        # A larger model has to be better than the smallest, whether or not that explains enough.
        sound = [row for row in fitted if not row.problem]
        chosen, more, smaller = self._climb(sound or fitted)
        held_out = chosen.held_out
        assert held_out is not None
        if not _beats(held_out, LEAST_PERCENT) or chosen.problem:
            return None, "none of these models explains this torque: " + (
                chosen.problem
                or f"the best, {chosen.name}, predicts {held_out.text} of its variance in blocks "
                f"that it has not seen; it must be {LEAST_PERCENT:g} % and its interval above 0"
            )
        reason = (
            f"{chosen.name}: predicts {held_out.text} of the torque's variance in blocks that it "
            "has not seen"
        )
        if more is None:
            return chosen, reason
        return chosen, (
            f"{reason}, and {more.text} of what {smaller.name} leaves"
            f"{'' if _same_bent(smaller, chosen) else ' beyond any linear loop'}"
        )

    def _climb(self, rows: Sequence[ModelRow]) -> tuple[ModelRow, Gain | None, ModelRow]:
        """Return the largest model that predicts better than those it was held against.

        With it what it gains over the one before it, None where it is the smallest.
        """
        chosen = smaller = min(rows, key=lambda row: (_size(row), -row.held_out_vaf_percent))
        count = self._comparisons
        gained: Gain | None = None
        while True:
            better = [
                (row, more)
                for row in rows
                if _size(row) > _size(chosen)
                and _beats(more := _more(chosen, row, count), MARGIN_PERCENT)
            ]
            if not better:
                return chosen, gained, smaller
            best, _ = max(better, key=lambda pair: pair[1].percent)
            alike = [
                pair for pair in better if not _beats(_more(pair[0], best, count), MARGIN_PERCENT)
            ]
            smaller = chosen
            chosen, gained = min(alike, key=lambda pair: (_size(pair[0]), -pair[1].percent))


def _directed(
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
    tried = [beyond.solve(beyond.columns(bent, inner)) for inner in points_tried(bent)]
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


def _pushes(one: TermGain) -> str:
    """Return that a reflex or a friction pushes, by more than chance; empty where it does not."""
    term = term_named(one.term)
    if one.value >= -2 * one.standard_error or (term is not None and not term.resists):
        return ""
    kind = "reflex" if term is None else "friction"
    return (
        f"the gain of {one.term} is {one.value:.3g} ± {one.standard_error:.2g} {one.unit}: it "
        f"pushes, and a {kind} resists, so it stands for something else"
    )


def _more(smaller: ModelRow, larger: ModelRow, comparisons: int) -> Gain:
    if _same_bent(smaller, larger):
        return gain(smaller.errors, larger.errors, comparisons)
    return gain(smaller.beyond_errors, larger.beyond_errors, comparisons)


def _same_bent(one: ModelRow, other: ModelRow) -> bool:
    return {gain.term for gain in one.beyond} == {gain.term for gain in other.beyond}


def _beats(more: Gain, least_percent: float) -> bool:
    return more.low_percent > 0 and more.percent > least_percent


def _size(row: ModelRow) -> int:
    return 0 if row.fit is None else row.fit.n_parameters


def _base(name: str) -> str:
    """Return what of a name two terms of one model may not share."""
    return "reflex" if name in REFLEXES else name
