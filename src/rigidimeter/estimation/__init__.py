"""From an epoch to numbers: offline and pure."""

from rigidimeter.estimation.bandlimited import band_hz
from rigidimeter.estimation.epochs import METHODS, epoch_signals, fit_epoch
from rigidimeter.estimation.leastsquares import Solution, fit_inertia_damping_stiffness
from rigidimeter.estimation.scores import Cycles, score_epoch, scoring_cycles
from rigidimeter.estimation.signals import Signals
from rigidimeter.estimation.sinusoid import find_motion, single_frequency_share

__all__ = [
    "METHODS",
    "Cycles",
    "Signals",
    "Solution",
    "band_hz",
    "epoch_signals",
    "find_motion",
    "fit_epoch",
    "fit_inertia_damping_stiffness",
    "score_epoch",
    "scoring_cycles",
    "single_frequency_share",
]
