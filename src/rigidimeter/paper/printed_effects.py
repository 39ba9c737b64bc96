"""Tests and effect sizes: whether the printed p, r and N belong together, and what F tests.

    z = Φ⁻¹(1 − p/2),   r = z/√N,   so that   N = (z/r)²   and   p = 2 (1 − Φ(r √N))

p, r and N of Table 2, Table 1 and the text are held against each other. The F-test of a mixed
model without intercept tests "both means are zero" unless it is given the contrast OFF − DBS.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from scipy.stats import norm

from rigidimeter.paper.comparison_table import (
    AGREES,
    DIFFERS,
    Check,
    Row,
    bounded,
    rounded,
    within_percent,
)
from rigidimeter.paper.context import Workshop
from rigidimeter.paper.printed import COUNTS, MEASURED, Measured
from rigidimeter.paper.virtual_data import Rating
from rigidimeter.reporting.numbers import number, p_value
from rigidimeter.statistics import (
    Mixed,
    PublishedEffect,
    compare_published,
    difference,
    effect_from_p,
    fit_mixed,
    joint_test,
)

__all__ = ["ROWS", "n_from", "p_from", "r_from", "rating_model"]

P_PERCENT = 5.0
"""How far two prints of one p may be apart."""

_TASKS = {
    "mupdrs": "ratings",
    "impulse": "sinusoid",
    "work": "sinusoid",
    "viscosity": "prbs",
    "stiffness": "prbs",
}


def r_from(p: float, n: int) -> float:
    """Return |z|/√N of a two-sided p."""
    return float(norm.isf(p / 2.0)) / math.sqrt(n)


def p_from(r: float, n: int) -> float:
    """Return the two-sided p of z = r √N."""
    return 2.0 * float(norm.sf(r * math.sqrt(n)))


def n_from(p: float, r: float) -> float:
    """Return the N that would make p and r belong together."""
    return (float(norm.isf(p / 2.0)) / r) ** 2


def _effect(measured: Measured, p: float) -> PublishedEffect:
    sizes = COUNTS[_TASKS[measured.name]]
    return effect_from_p(p, sizes["OFF"], sizes["DBS"])


def _better_p(measured: Measured) -> float:
    """Return the printed p from which the printed r follows more nearly."""
    return min(
        (measured.p_table, measured.p_text), key=lambda p: abs(r_from(p, measured.n) - measured.r)
    )


def _table_row(measured: Measured) -> Row:
    n, p, r = measured.n, measured.p_table, measured.r
    found, other = r_from(p, n), r_from(measured.p_text, n)
    fits = abs(other - r) <= 0.005
    other_text = (
        f"The p of {measured.place} ({p_value(measured.p_text)}) gives {other:.3f}, which "
        f"{'fits' if fits else 'does not fit'}."
    )
    same = measured.p_text == p
    return Row(
        id=f"table-2-{measured.name}",
        source="Table 2, Table 1",
        paper=f"{measured.title}: p = {p_value(p)}, r = {r:.2f}, N = {n}",
        ours=f"p and N give r = {found:.3f}; r and N give p = {p_value(p_from(r, n))}; p and r "
        f"give N = {n_from(p, r):.0f}",
        reading=f"r = z/√N with the N of Table 1; z of the two-sided p. {_reading(measured)}",
        checks=(rounded("r from p and N", "1", r, found, 0.01),),
        because={
            AGREES: "p, r and N belong together." + ("" if same else f" {other_text}"),
            DIFFERS: "p, r and N do not belong together."
            + (" No other p is printed." if same else f" {other_text}"),
        },
    )


def _reading(measured: Measured) -> str:
    if measured.p_text == measured.p_table:
        return "The text prints the same p."
    best = _better_p(measured)
    where = "the table's" if best == measured.p_table else f"that of {measured.place}"
    if measured.name == "mupdrs":
        return "Its p is that of an F-test, from which the paper gives no z."
    return f"Of the two printed p, {where} is nearer to r."


def _text_row(measured: Measured) -> Row:
    ratio = measured.p_text / measured.p_table
    return Row(
        id=f"p-{measured.name}",
        source=f"{measured.place} against Table 2",
        paper=f"p = {p_value(measured.p_text)} in {measured.place}, "
        f"{p_value(measured.p_table)} in Table 2",
        ours=f"a factor of {number(ratio, 3)}; r from the text's p "
        f"{r_from(measured.p_text, measured.n):.3f}, from the table's "
        f"{r_from(measured.p_table, measured.n):.3f}, printed {measured.r:.2f}",
        reading=_reading(measured),
        checks=(
            within_percent("p of the text", "1", measured.p_table, measured.p_text, P_PERCENT),
        ),
        because={
            AGREES: "Text and table print one p.",
            DIFFERS: "One test cannot have two p."
            + (" One is exactly twice the other: one-sided and two-sided?"
               if ratio in (2.0, 0.5) else "")
            + (" The digits are the same, the exponent is not."
               if math.isclose(abs(math.log10(ratio)), 1.0) else ""),
        },
    )  # fmt: skip


def order_of_effects(workshop: Workshop) -> Row:
    """Make the row: viscosity and stiffness have the largest effects."""
    deltas = {m.name: _effect(m, _better_p(m)).rank_biserial for m in MEASURED}
    least = min(deltas["viscosity"], deltas["stiffness"])
    most = max(deltas["impulse"], deltas["work"], deltas["mupdrs"])
    text = ", ".join(f"{name} {delta:.2f}" for name, delta in deltas.items())
    return Row(
        id="sec-3.6-order",
        source="Sec. 3.6, Sec. 4, Table 2",
        paper="viscosity and stiffness have the largest effect sizes",
        ours=f"rank-biserial correlation from the printed p: {text}",
        reading="r depends on how unequal the groups are, 92/46 against 78/23; the rank-biserial "
        "correlation does not. For each measure the p that fits r.",
        checks=(bounded("Least of B and K less the largest other", "1", least - most, low=0.0),),
        because={AGREES: "The order holds in either measure of effect."},
    )


def better_than_work(workshop: Workshop) -> Row:
    """Make the row: whether the difference between the effects can be told from nothing."""
    effects = {m.name: _effect(m, _better_p(m)) for m in MEASURED}
    found = {
        name: compare_published(effects[name], effects["work"])
        for name in ("viscosity", "stiffness")
    }
    text = "; ".join(
        f"{name} less work {d.estimate:+.2f} [{d.low:+.2f} to {d.high:+.2f}], p = {p_value(d.p)}"
        for name, d in found.items()
    ).replace("-", "−")
    return Row(
        id="sec-4-better",
        source="Sec. 4, abstract",
        paper="parameter estimation is better at differentiating OFF and DBS than the scores",
        ours=f"difference of the rank-biserial correlations with 95 % interval: {text}",
        reading="As if the epochs were independent, within and between the measures.",
        checks=tuple(
            bounded(f"Lower end, {name} less work", "1", d.low, low=0.0)
            for name, d in found.items()
        ),
        because={
            DIFFERS: "The effects are larger, but so few epochs cannot tell that from chance."
        },
    )


def rating_model(ratings: tuple[Rating, ...], *, days: bool = False) -> Mixed:
    """Fit the model of Sec. 2.2: a mean for each condition, no intercept, examiners at random.

    With `days`, each day has an offset as well: its scores are of one state of the subject.
    """
    groups = {"examiner": [rating.examiner for rating in ratings]}
    if days:
        groups["day"] = [rating.day for rating in ratings]
    return fit_mixed(
        [rating.score for rating in ratings],
        [rating.condition for rating in ratings],
        groups,
    )


def f_test(workshop: Workshop) -> Row:
    """Make the row: what the F-test of a model without intercept tests."""
    fit = rating_model(workshop.study.ratings)
    both_zero = joint_test(fit, np.eye(len(fit.conditions)))
    contrast = difference(fit, "OFF", "DBS")
    off, dbs = fit.means
    return Row(
        id="sec-3.1-f-test",
        source="Sec. 2.2, Sec. 3.1",
        paper="y = β_off x_off + β_dbs x_dbs + Σ b z, no intercept; F-test of DBS against OFF, "
        "p = 0.020",
        ours=f"virtual ratings, means {number(float(off), 3)} and {number(float(dbs), 3)}: "
        f"F of all fixed effects {number(both_zero.f, 3)}, p = {p_value(both_zero.p_residual)}; "
        f"contrast OFF − DBS F {number(contrast.f, 3)}, p = {p_value(contrast.p_residual)}",
        reading="The contrast OFF − DBS, residual degrees of freedom.",
        checks=(
            _same_p(both_zero.p_residual, contrast.p_residual),
        ),
        because={DIFFERS: "Without an intercept the F-test of the fixed effects asks whether both "
                 "means are zero, which no one doubts; only the contrast compares OFF and DBS. "
                 "Which of the two the printed p belongs to cannot be told without the ratings."},
        virtual=True,
    )  # fmt: skip


def _same_p(joint: float, contrast: float) -> Check:
    """Hold the two p against each other, within a factor of two."""
    return Check("p of all fixed effects, no intercept, against the contrast's", "1", contrast,
                 joint, 0.5 * contrast, 2.0 * contrast)  # fmt: skip


def _bound(function: Callable[[Measured], Row], measured: Measured) -> Callable[[Workshop], Row]:
    return lambda _workshop: function(measured)


ROWS: Mapping[str, Callable[[Workshop], Row]] = {
    **{f"table-2-{m.name}": _bound(_table_row, m) for m in MEASURED},
    **{f"p-{m.name}": _bound(_text_row, m) for m in MEASURED if m.p_text != m.p_table},
    "sec-3.6-order": order_of_effects,
    "sec-4-better": better_than_work,
    "sec-3.1-f-test": f_test,
}
