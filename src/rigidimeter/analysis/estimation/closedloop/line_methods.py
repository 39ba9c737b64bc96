"""The methods that weight each line by its noise: what each observes, solves, and is called.

A new one is a `LineMethod` and its `Method` record, and a line in `analysis.estimation.methods`.
"""

from __future__ import annotations

from functools import partial

from rigidimeter.analysis.estimation.closedloop.closed_loop_fit import LineMethod, fit_closed_loop
from rigidimeter.analysis.estimation.closedloop.linear_problems import (
    direct,
    instrumental,
    periodic,
)
from rigidimeter.analysis.estimation.closedloop.observe import (
    observe,
    observe_motion,
    observe_periods,
)
from rigidimeter.analysis.estimation.closedloop.refine import ENOUGH_EPOCHS
from rigidimeter.analysis.estimation.method_record import Method

LINE_METHODS = {
    one.name: one
    for one in (
        LineMethod("iv", observe, instrumental),
        LineMethod("spectral", observe_periods, periodic),
        LineMethod("bandlimited", observe_motion, direct),
    )
}
"""What each observes and solves."""


_INTERVALS_TEXT = (
    "Intervals are made from the power of the residual at each frequency, torque that "
    "is not from the robot included"
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
    fit=partial(fit_closed_loop, LINE_METHODS["iv"]),
    references=("riv", "riv_loop"),
    intervals_text=_INTERVALS_TEXT,
    pooled_text=_POOLED_TEXT,
    by_noise=True,
    in_sensitivity=True,
)
SPECTRAL = Method(
    name="spectral",
    title="instrumental variables at the lines of a periodic perturbation",
    needs=("perturbation_nm",),
    methods_text="by instrumental variables at the lines of the periodic perturbation",
    fit=partial(fit_closed_loop, LINE_METHODS["spectral"]),
    intervals_text=_INTERVALS_TEXT,
    pooled_text=_POOLED_TEXT,
    by_noise=True,
)
BANDLIMITED = Method(
    name="bandlimited",
    title="least squares, each frequency weighted by its noise",
    needs=(),
    methods_text="by least squares in which each frequency counts by its noise",
    fit=partial(fit_closed_loop, LINE_METHODS["bandlimited"]),
    intervals_text=_INTERVALS_TEXT
    + ". They hold what that torque, coming back by the loop of the settings, does to least "
    "squares, and where the drive is not known what one as that of the settings does between the "
    "samples",
    pooled_text=_POOLED_TEXT,
    by_noise=True,
    in_sensitivity=True,
)
