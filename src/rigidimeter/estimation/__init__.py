"""From an epoch to numbers: offline and pure."""

from rigidimeter.estimation.alignment import aligned, estimate_delays
from rigidimeter.estimation.bandlimited import band_hz
from rigidimeter.estimation.least_squares import fit_inertia_damping_stiffness
from rigidimeter.estimation.methods import (
    METHODS,
    choose_method,
    epoch_signals,
    fit_epoch,
    fit_epochs,
)
from rigidimeter.estimation.scores import Cycles, score_epoch, scoring_cycles
from rigidimeter.estimation.signals import Signals
from rigidimeter.estimation.sinusoid_detection import find_motion, single_frequency_share

__all__ = [
    "METHODS",
    "Cycles",
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
    "score_epoch",
    "scoring_cycles",
    "single_frequency_share",
]
