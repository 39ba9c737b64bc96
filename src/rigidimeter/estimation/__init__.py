"""From an epoch to numbers: offline and pure."""

from rigidimeter.estimation.alignment import aligned, estimate_delays
from rigidimeter.estimation.bandlimited import band_hz
from rigidimeter.estimation.from_arrays import identify
from rigidimeter.estimation.least_squares import fit_inertia_damping_stiffness
from rigidimeter.estimation.method_record import Method
from rigidimeter.estimation.methods import (
    METHODS,
    choose_method,
    epoch_signals,
    fit_epoch,
    fit_epochs,
    method_named,
    method_names,
    no_such_method,
)
from rigidimeter.estimation.scores import (
    Cycles,
    find_motion,
    score_epoch,
    scoring_cycles,
    single_frequency_share,
)
from rigidimeter.estimation.signals import Signals

__all__ = [
    "METHODS",
    "Cycles",
    "Method",
    "Signals",
    "aligned",
    "band_hz",
    "choose_method",
    "epoch_signals",
    "estimate_delays",
    "find_motion",
    "fit_epoch",
    "fit_epochs",
    "fit_inertia_damping_stiffness",
    "identify",
    "method_named",
    "method_names",
    "no_such_method",
    "score_epoch",
    "scoring_cycles",
    "single_frequency_share",
]
