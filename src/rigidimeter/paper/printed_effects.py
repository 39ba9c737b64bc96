"""Tests and effect sizes: whether the printed p, r and N belong together, and what F tests.

    z = Φ⁻¹(1 − p/2),   r = z/√N,   so that   N = (z/r)²   and   p = 2 (1 − Φ(r √N))

p, r and N of Table 2, Table 1 and the text are held against each other. The F-test of a mixed
model without intercept tests "both means are zero" unless it is given the contrast OFF − DBS.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.stats import norm

from rigidimeter.analysis.statistics import (
    Contrast,
    compare_published,
    difference,
    effect_from_p,
    joint_test,
)
from rigidimeter.analysis.study import Ratings
from rigidimeter.core.words import number, p_value
from rigidimeter.paper.comparison_table import Bound, Claim, bounded, rounded, within_percent
from rigidimeter.paper.context import Context
from rigidimeter.paper.printed import MEASURED, TABLE_1, Measured

P_PERCENT = 5.0
"""How far two prints of one p may be apart."""


def r_from(p: float, n: int) -> float:
    """Return |z|/√N of a two-sided p."""
    return float(norm.isf(p / 2.0)) / math.sqrt(n)


def p_from(r: float, n: int) -> float:
    """Return the two-sided p of z = r √N."""
    return 2.0 * float(norm.sf(r * math.sqrt(n)))


def n_from(p: float, r: float) -> float:
    """Return the N that would make p and r belong together."""
    return (float(norm.isf(p / 2.0)) / r) ** 2


_PRINTS: Mapping[str, Callable[[Measured], float]] = {
    "Table 2": lambda measured: measured.p_table,
    "the text": lambda measured: measured.p_text,
}
"""The two places where p is printed; a comparison of measures takes all of one place."""

_AS_P: Mapping[str, Callable[[Measured], float]] = {
    **{f"p of {place}": p_of for place, p_of in _PRINTS.items()},
    "r as printed": lambda measured: p_from(measured.r, measured.n),
}
"""The same, and the p that the printed r and N come to."""


def line_of_table_2(name: str, context: Context) -> Claim:
    """Compare p, r and N of one line of Table 2 with each other."""
    measured = MEASURED[name]
    n, p, r = measured.n, measured.p_table, measured.r
    found, other = r_from(p, n), r_from(measured.p_text, n)
    fits = abs(other - r) <= 0.005
    same = measured.p_text == p
    other_text = (
        f" The p of {measured.place} ({p_value(measured.p_text)}) gives {other:.3f}, which "
        f"{'fits' if fits else 'does not fit'}."
    )
    return Claim(
        source="Table 2, Table 1",
        paper=f"{measured.title}: p = {p_value(p)}, r = {r:.2f}, N = {n}",
        ours=f"p and N give r = {found:.3f}; r and N give p = {p_value(p_from(r, n))}; p and r "
        f"give N = {n_from(p, r):.0f}",
        reading=f"r = z/√N with the N of Table 1; z of the two-sided p. {_reading(name)}",
        checks=(rounded("r from p and N", "1", r, found, 0.01),),
        agrees="p, r and N belong together." + ("" if same else other_text),
        differs="p, r and N do not belong together."
        + (" No other p is printed." if same else other_text),
    )


def _reading(name: str) -> str:
    measured = MEASURED[name]
    if measured.p_text == measured.p_table:
        return "The text prints the same p."
    if name == "mupdrs":
        return "Its p is that of an F-test, from which the paper gives no z."
    best = min(
        (measured.p_table, measured.p_text), key=lambda p: abs(r_from(p, measured.n) - measured.r)
    )
    where = "the table's" if best == measured.p_table else f"that of {measured.place}"
    return f"Of the two printed p, {where} is nearer to r."


def p_of_text(name: str, context: Context) -> Claim:
    """Compare the p of the text with that of Table 2."""
    measured = MEASURED[name]
    table, text = measured.p_table, measured.p_text
    ratio = text / table
    differs = "One test cannot have two p."
    if ratio in (2.0, 0.5):
        differs += " One is exactly twice the other: one-sided and two-sided?"
    if math.isclose(abs(math.log10(ratio)), 1.0):
        differs += " The digits are the same, the exponent is not."
    return Claim(
        source=f"{measured.place} against Table 2",
        paper=f"p = {p_value(text)} in {measured.place}, {p_value(table)} in Table 2",
        ours=f"a factor of {number(ratio, 3)}; r from the text's p {r_from(text, measured.n):.3f}, "
        f"from the table's {r_from(table, measured.n):.3f}, printed {measured.r:.2f}",
        reading=_reading(name),
        checks=(within_percent("p of the text", "1", table, text, P_PERCENT),),
        agrees="Text and table print one p.",
        differs=differs,
    )


def order_of_effects(context: Context) -> Claim:
    """Compare the sizes of all effects: r as printed, and from the p of one place at a time."""
    found = {"r as printed": {name: one.r for name, one in MEASURED.items()}}
    for place, p_of in _PRINTS.items():
        found[f"r from the p of {place}"] = {
            name: r_from(p_of(one), one.n) for name, one in MEASURED.items()
        }
    text = "; ".join(
        f"{which}: " + ", ".join(f"{name} {r:.3f}" for name, r in sizes.items())
        for which, sizes in found.items()
    )
    return Claim(
        ours=text,
        checks=tuple(
            bounded(
                f"Least of B and K less the largest other, {which}",
                "1",
                min(sizes["viscosity"], sizes["stiffness"])
                - max(sizes["mupdrs"], sizes["impulse"], sizes["work"]),
                low=0.0,
            )
            for which, sizes in found.items()
        ),
    )


def larger_effects(names: Sequence[str], other: str, context: Context) -> Claim:
    """Compare the effects of some measures with that of another: all p of one place, or all r."""
    texts, checks = [], []
    for place, p_of in _AS_P.items():
        effects = {
            name: effect_from_p(p_of(m), TABLE_1[m.counted]["OFF"], TABLE_1[m.counted]["DBS"])
            for name, m in MEASURED.items()
        }
        found = []
        for name in names:
            d = compare_published(effects[name], effects[other])
            found.append(
                f"{name} {d.estimate:+.2f} [{d.low:+.2f} to {d.high:+.2f}], p = {p_value(d.p)}"
            )
            checks.append(bounded(f"Lower end, {name} less {other}, {place}", "1", d.low, low=0.0))
        texts.append(f"{place}: {', '.join(found)}".replace("-", "−"))
    return Claim(
        ours=f"rank-biserial correlation less that of {other}, with 95 % interval. "
        + "; ".join(texts),
        checks=tuple(checks),
    )


def virtual_ratings(context: Context) -> Ratings:
    """Return the ratings of the virtual study with the model of Sec. 2.2.

    A mean for each condition, no intercept, and a random offset for each examiner.
    """
    ratings = context.study.study.ratings
    assert ratings is not None  # every virtual study is rated
    return ratings


def contrast_of(ratings: Ratings) -> Contrast:
    """Return the contrast DBS − OFF of virtual ratings."""
    return difference(ratings.fit, "DBS", "OFF")


def f_test(context: Context) -> Claim:
    """Compare the F-test of all fixed effects with that of the contrast."""
    ratings = virtual_ratings(context)
    fit, contrast = ratings.fit, contrast_of(ratings)
    both_zero = joint_test(fit, np.eye(len(fit.conditions)))
    means = " and ".join(number(mean, 3) for mean in fit.means.tolist())
    return Claim(
        ours=f"virtual ratings, means {means}: "
        f"F of all fixed effects {number(both_zero.f, 3)}, p = {p_value(both_zero.p_residual)}; "
        f"contrast OFF − DBS F {number(contrast.f, 3)}, p = {p_value(contrast.p_residual)}",
        checks=(
            Bound(
                "p of all fixed effects, no intercept, against the contrast's",
                "1",
                contrast.p_residual,
                both_zero.p_residual,
                0.5 * contrast.p_residual,
                2.0 * contrast.p_residual,
            ),
        ),
        virtual=True,
    )
