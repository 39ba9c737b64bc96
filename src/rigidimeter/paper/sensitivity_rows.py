"""Fig. 6: how the scores change with damping and stiffness, and why the work seems to fall with K.

The closed forms are those of `score_rows`. Each parameter goes through 25, 50, 150 and 175 % of its
median, with J 0.0044, B 0.1300 and K 1.130 as the caption prints them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from rigidimeter.analysis.report import Figure
from rigidimeter.core.settings import Settings
from rigidimeter.core.words import number
from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import Bound, Claim, bounded
from rigidimeter.paper.context import Context
from rigidimeter.paper.paper_figures import Curves, sensitivity_plot
from rigidimeter.paper.score_rows import factored, scored, work_change_percent, work_closed_form_j

PERCENTS = (25.0, 50.0, 100.0, 150.0, 175.0)
"""Values of one parameter in percent of the median, as in Fig. 6; 100 is the median itself."""

DELAY_S = 0.01
"""One sample of the torque at 100 samples/s."""

VISIBLE_PERCENT = 0.5
"""The least change that a figure would show."""

_INSIGNIFICANT_PERCENT = 10.0

_RULES: Mapping[str, tuple[float, str, float]] = {
    "left sum, 100 samples/s": (100.0, "left", 0.0),
    "left sum, 50 samples/s": (50.0, "left", 0.0),
    "torque 10 ms late": (100.0, "trapezoid", DELAY_S),
}
"""Ways to compute the loop that make it depend on K: rate, rule, delay of the torque."""


def _changes(settings: Settings, measure: str) -> dict[str, list[float]]:
    """Return the change of a score at each of `PERCENTS`, by the product's own scoring."""

    def score(**factors: float) -> float:
        return float(getattr(scored(factored(printed.FIG_6, **factors), settings), measure))

    before = score()
    return {
        title: [100.0 * (score(**{name: p / 100.0}) / before - 1.0) for p in PERCENTS]
        for title, name in (("damping B", "damping"), ("stiffness K", "stiffness"))
    }


def _rises(what: str, changes: Sequence[float]) -> Bound:
    step = float(np.min(np.diff(changes)))
    return bounded(f"Smallest step with {what}", "%", step, low=VISIBLE_PERCENT)


def _falls(what: str, change: float) -> Bound:
    return bounded(f"Change at K 175 %, {what}", "%", change, high=-VISIBLE_PERCENT)


def figure_6a(context: Context) -> Claim:
    """Compare how the impulse rises with damping and stiffness."""
    curves = _changes(context.settings, "impulse_nm_s")
    B, K = curves.values()
    return Claim(
        ours=f"at 25, 50, 150 and 175 %: B {_listed(B)}; K {_listed(K)}",
        checks=(
            _rises("B", B),
            _rises("K", K),
            bounded("Range with K over range with B", "1", float(np.ptp(K) / np.ptp(B)), low=1.0),
        ),
        figures=(
            _figure(
                "fig-6a",
                "Fig. 6(a): the impulse rises with damping and, more, with stiffness.",
                "angular impulse",
                curves,
            ),
        ),
    )


def figure_6b(context: Context) -> Claim:
    """Compare how the work changes with damping and stiffness."""
    settings = context.settings
    curves = _changes(settings, "work_j")
    # What is left of nothing after rounding is nothing.
    curves["stiffness K"] = [round(change, 9) + 0.0 for change in curves["stiffness K"]]
    B, K = curves.values()
    trapezoid = round(work_change_percent(settings, 100.0, stiffness=1.75), 9) + 0.0
    artefacts = {"K: loop area": K} | {
        f"K: {name}": [
            work_change_percent(settings, *rule, stiffness=percent / 100.0) for percent in PERCENTS
        ]
        for name, rule in _RULES.items()
    }
    return Claim(
        ours=f"B: {_listed(B)}; K at 175 %: {abs(K[-1]):.2f} % by the "
        f"product, {abs(trapezoid):.2f} % by the trapezoid rule at 100 samples/s, 0 by the closed "
        "form πBωA²",
        checks=(_rises("B", B), _falls("product", K[-1]), _falls("trapezoid", trapezoid)),
        figures=(
            _figure(
                "fig-6b",
                "Fig. 6(b): the work follows the damping and not the stiffness (left). "
                "Enlarged (right), what makes it seem to fall: a sum from one side, and a "
                "torque that is late.",
                "work",
                curves,
                artefacts,
            ),
        ),
    )


def left_sum(context: Context) -> Claim:
    """Compare the fall of the work with K when the loop is summed from one side."""
    change = {
        rate_hz: work_change_percent(context.settings, rate_hz, "left", stiffness=1.75)
        for rate_hz in (100.0, 50.0)
    }
    text = " and ".join(f"{number(c, 2)} % at {r:g} samples/s" for r, c in change.items())
    return Claim(
        ours=f"K +75 %, Σ M(k)(θ(k+1) − θ(k)): {text}",
        checks=tuple(_falls(f"{rate:g} samples/s", c) for rate, c in change.items()),
    )


def delay(context: Context) -> Claim:
    """Compare the fall of the work with K when the torque is late against the angle."""
    settings = context.settings
    change = work_change_percent(settings, 100.0, "trapezoid", DELAY_S, stiffness=1.75)
    before, after = (
        work_closed_form_j(factored(printed.FIG_6, stiffness=factor), settings, DELAY_S)
        for factor in (1.0, 1.75)
    )
    closed = 100.0 * (after / before - 1.0)
    return Claim(
        ours=f"K +75 %, trapezoid rule, torque 10 ms late: {number(change, 3)} %; closed form "
        f"πA²(Bω cos ωτ − (K − Jω²) sin ωτ): {number(closed, 3)} %",
        checks=(_falls("10 ms", change),),
    )


def cancelling(context: Context) -> Claim:
    """Compare the work when damping and stiffness rise together."""
    settings = context.settings
    both = work_change_percent(settings, 100.0, damping=1.5, stiffness=1.5)
    late = work_change_percent(settings, 100.0, "trapezoid", DELAY_S, damping=1.5, stiffness=1.5)
    return Claim(
        ours=f"both +50 %: {number(both, 3)} % (with the torque 10 ms late {number(late, 3)} %)",
        checks=(
            bounded("Change with both at 150 %", "%", abs(both), high=_INSIGNIFICANT_PERCENT),
        ),
    )  # fmt: skip


def _figure(
    name: str, caption: str, score: str, curves: Curves, artefacts: Curves | None = None
) -> Figure:
    return Figure(
        name,
        caption,
        f"Change in {score} against damping and stiffness from 25 to 175 % of nominal.",
        partial(sensitivity_plot, score, PERCENTS, curves, artefacts),
    )


def _listed(changes: Sequence[float]) -> str:
    shown = (c for c, percent in zip(changes, PERCENTS, strict=True) if percent != 100.0)
    return ", ".join(f"{change:+.0f}".replace("-", "−") for change in shown) + " %"
