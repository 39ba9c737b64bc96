"""The methods that need the perturbation: what each observes and solves, and how it is described.

A new one is a `LineMethod` and its `Method` record, and a line in `analysis.estimation.methods`.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from rigidimeter.analysis.estimation.closedloop.closed_loop_fit import LineMethod, fit_closed_loop
from rigidimeter.analysis.estimation.closedloop.linear_problems import instrumental, periodic
from rigidimeter.analysis.estimation.closedloop.observation import observe, observe_periods
from rigidimeter.analysis.estimation.closedloop.refine import ENOUGH_EPOCHS
from rigidimeter.analysis.estimation.method_record import Method

CLOSED_LOOP: Mapping[str, LineMethod] = {
    "iv": LineMethod("iv", observe, instrumental),
    "spectral": LineMethod("spectral", observe_periods, periodic),
}
"""The methods that need the perturbation."""


_INTERVALS_TEXT = (
    "Intervals are made from the power of the residual at each frequency, torque that "
    "something but the robot adds included"
)

_POOLED_TEXT = (
    f"From {ENOUGH_EPOCHS} epochs on they come from the scatter between epochs; with fewer, each "
    "is the wider of that and what the residual gives"
)

IV = Method(
    name="iv",
    title="instrumental variables, made from the perturbation",
    needs=("perturbation_nm",),
    methods_text="by refined instrumental variables made from the known perturbation",
    fit=partial(fit_closed_loop, CLOSED_LOOP["iv"]),
    references=("riv", "riv_loop"),
    intervals_text=_INTERVALS_TEXT,
    pooled_text=_POOLED_TEXT,
    in_sensitivity=True,
)
SPECTRAL = Method(
    name="spectral",
    title="instrumental variables at the lines of a periodic perturbation",
    needs=("perturbation_nm",),
    methods_text="by instrumental variables at the lines of the periodic perturbation",
    fit=partial(fit_closed_loop, CLOSED_LOOP["spectral"]),
    intervals_text=_INTERVALS_TEXT,
    pooled_text=_POOLED_TEXT,
)
