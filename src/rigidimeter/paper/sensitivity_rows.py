"""Fig. 6: how the scores change with damping and stiffness, and why the work seems to fall with K.

The closed forms are those of `scores`. Each parameter goes through 25, 50, 150 and 175 % of its
median, with J 0.0044, B 0.1300 and K 1.130 as the caption prints them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import AGREES, DIFFERS, Picture, Row, bounded
from rigidimeter.paper.context import Workshop
from rigidimeter.paper.figures import sensitivity
from rigidimeter.paper.score_rows import scaled, scored, work_change_percent, work_closed_form_j
from rigidimeter.reporting.numbers import number
from rigidimeter.reporting.style import svg_text
from rigidimeter.settings import Settings

__all__ = ["DELAY_S", "PERCENTS", "ROWS"]

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


def _changes(settings: Settings, measure: str, *, of_damping: bool) -> list[float]:
    """Return the change of a score at each of `PERCENTS`, by the product's own scoring."""
    before = getattr(scored(printed.FIG_6, settings), measure)
    changes = []
    for percent in PERCENTS:
        factor = percent / 100.0
        joint = scaled(printed.FIG_6, factor) if of_damping else scaled(printed.FIG_6, 1.0, factor)
        changes.append(100.0 * (getattr(scored(joint, settings), measure) / before - 1.0))
    return changes


def figure_6a(workshop: Workshop) -> Row:
    """Make the row: the impulse rises with damping and stiffness, more with stiffness."""
    settings = workshop.settings
    by_damping = _changes(settings, "impulse_nm_s", of_damping=True)
    by_stiffness = _changes(settings, "impulse_nm_s", of_damping=False)
    curves = {"damping B": by_damping, "stiffness K": by_stiffness}
    return Row(
        id="fig-6a",
        source="Fig. 6(a), Sec. 3.2",
        paper="impulse increases with stiffness and with viscosity, more with stiffness",
        ours="at 25, 50, 150 and 175 %: B "
        + _listed(by_damping)
        + "; K "
        + _listed(by_stiffness),
        reading="Nominal J 0.0044, B 0.1300, K 1.130, as the caption prints.",
        checks=(
            bounded("Smallest step with B", "%", float(np.min(np.diff(by_damping))),
                    low=VISIBLE_PERCENT),
            bounded("Smallest step with K", "%", float(np.min(np.diff(by_stiffness))),
                    low=VISIBLE_PERCENT),
            bounded("Range with K over range with B", "1",
                    float(np.ptp(by_stiffness) / np.ptp(by_damping)), low=1.0),
        ),
        because={AGREES: "Both raise the amplitude of the torque; at 1 Hz the elastic part is the "
                 "larger one."},
        pictures=(
            _picture("fig-6a", "angular impulse", curves,
                     "Fig. 6(a): the impulse rises with damping and, more, with stiffness."),
        ),
    )  # fmt: skip


def figure_6b(workshop: Workshop) -> Row:
    """Make the row: the work rises with damping and does not depend on stiffness."""
    settings = workshop.settings
    by_damping = _changes(settings, "work_j", of_damping=True)
    by_stiffness = _changes(settings, "work_j", of_damping=False)
    trapezoid = work_change_percent(settings, 100.0, stiffness=1.75)
    # What is left of nothing after rounding is nothing.
    by_stiffness = [round(change, 9) + 0.0 for change in by_stiffness]
    trapezoid = round(trapezoid, 9) + 0.0
    artefacts = {"K: loop area": by_stiffness} | {
        f"K: {name}": [
            work_change_percent(settings, *rule, stiffness=percent / 100.0) for percent in PERCENTS
        ]
        for name, rule in _RULES.items()
    }
    return Row(
        id="fig-6b",
        source="Fig. 6(b), Sec. 3.2",
        paper="work increases with viscosity and is a monotonically decreasing function of "
        "stiffness",
        ours=f"B: {_listed(by_damping)}; K at 175 %: {abs(by_stiffness[-1]):.2f} % by the "
        f"product, {abs(trapezoid):.2f} % by the trapezoid rule at 100 samples/s, 0 by the closed "
        "form πBωA²",
        reading="Work is the area of the loop of torque and angle on one clock.",
        checks=(
            bounded("Smallest step with B", "%", float(np.min(np.diff(by_damping))),
                    low=VISIBLE_PERCENT),
            bounded("Change at K 175 %, product", "%", by_stiffness[-1], high=-VISIBLE_PERCENT),
            bounded("Change at K 175 %, trapezoid", "%", trapezoid, high=-VISIBLE_PERCENT),
        ),
        because={DIFFERS: "A spring gives back what it takes: the area is πBωA² whatever K. The "
                 "fall comes from the numerics (rows fig-6b-left-sum and fig-6b-delay)."},
        pictures=(
            _picture("fig-6b", "work", {"damping B": by_damping, "stiffness K": by_stiffness},
                     "Fig. 6(b): the work follows the damping and not the stiffness (left). "
                     "Enlarged (right), what makes it seem to fall: a sum from one side, and a "
                     "torque that is late.", artefacts),
        ),
    )  # fmt: skip


def left_sum(workshop: Workshop) -> Row:
    """Make the row: a sum from one side makes the work fall with K."""
    settings = workshop.settings
    change = {
        rate_hz: work_change_percent(settings, rate_hz, "left", stiffness=1.75)
        for rate_hz in (100.0, 50.0)
    }
    text = " and ".join(f"{number(c, 2)} % at {r:g} samples/s" for r, c in change.items())
    return Row(
        id="fig-6b-left-sum",
        source="Fig. 6(b)",
        paper="work falls with stiffness",
        ours=f"K +75 %, Σ M(k)(θ(k+1) − θ(k)): {text}",
        reading="An artefact, not a property of the arm.",
        checks=tuple(
            bounded(f"Change at K 175 %, {rate:g} samples/s", "%", c, high=-VISIBLE_PERCENT)
            for rate, c in change.items()
        ),
        because={AGREES: "A sum that takes the torque at the left of each step adds "
                 "−K/2 Σ(Δθ)²; it falls with K, and more so the slower the sampling."},
    )  # fmt: skip


def delay(workshop: Workshop) -> Row:
    """Make the row: a torque that is late against the angle makes the work fall with K."""
    settings = workshop.settings
    change = work_change_percent(settings, 100.0, "trapezoid", DELAY_S, stiffness=1.75)
    before, after = (
        work_closed_form_j(joint, settings, DELAY_S)
        for joint in (printed.FIG_6, scaled(printed.FIG_6, 1.0, 1.75))
    )
    closed = 100.0 * (after / before - 1.0)
    return Row(
        id="fig-6b-delay",
        source="Fig. 6(b)",
        paper="work falls with stiffness",
        ours=f"K +75 %, trapezoid rule, torque 10 ms late: {number(change, 3)} %; closed form "
        f"πA²(Bω cos ωτ − (K − Jω²) sin ωτ): {number(closed, 3)} %",
        reading="An artefact: one sample of the torque. Torque and angle are aligned before they "
        "are scored.",
        checks=(bounded("Change at K 175 %, 10 ms", "%", change, high=-VISIBLE_PERCENT),),
        because={AGREES: "A late torque turns some of the elastic part into work."},
    )


def cancelling(workshop: Workshop) -> Row:
    """Make the row: raising damping and stiffness together raises the work."""
    settings = workshop.settings
    both = work_change_percent(settings, 100.0, damping=1.5, stiffness=1.5)
    late = work_change_percent(settings, 100.0, "trapezoid", DELAY_S, damping=1.5, stiffness=1.5)
    return Row(
        id="sec-3.2-cancel",
        source="Sec. 3.2, Sec. 4",
        paper="a simultaneous increase in stiffness and viscosity can lead to insignificant "
        "changes in the work score",
        ours=f"both +50 %: {number(both, 3)} % (with the torque 10 ms late {number(late, 3)} %)",
        reading="The work score measures the damping alone.",
        checks=(
            bounded("Change with both at 150 %", "%", abs(both), high=_INSIGNIFICANT_PERCENT),
        ),
        because={DIFFERS: "Nothing cancels: the work is proportional to B. What the score cannot "
                 "show is a change of stiffness."},
    )  # fmt: skip


def _picture(
    name: str,
    score: str,
    curves: Mapping[str, Sequence[float]],
    caption: str,
    artefacts: Mapping[str, Sequence[float]] | None = None,
) -> Picture:
    return Picture(
        name,
        svg_text(sensitivity(score, PERCENTS, curves, artefacts, "stiffness K, enlarged")),
        f"Change in {score} against damping and stiffness from 25 to 175 % of nominal.",
        caption,
    )


def _listed(changes: Sequence[float]) -> str:
    shown = (c for c, percent in zip(changes, PERCENTS, strict=True) if percent != 100.0)
    return ", ".join(f"{change:+.0f}".replace("-", "−") for change in shown) + " %"


ROWS: Mapping[str, Callable[[Workshop], Row]] = {
    "fig-6a": figure_6a,
    "fig-6b": figure_6b,
    "fig-6b-left-sum": left_sum,
    "fig-6b-delay": delay,
    "sec-3.2-cancel": cancelling,
}
