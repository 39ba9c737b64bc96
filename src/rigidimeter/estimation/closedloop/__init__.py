"""Estimates from a known perturbation in a closed loop, where the motion itself is not trusted."""

from rigidimeter.estimation.closedloop.closed_loop_fit import (
    CLOSED_LOOP,
    IV,
    ML,
    SPECTRAL,
    closed_loop_obstacle,
    drives,
    fit_closed_loop,
)
from rigidimeter.estimation.closedloop.epoch_stream import EpochStream

__all__ = [
    "CLOSED_LOOP",
    "IV",
    "ML",
    "SPECTRAL",
    "EpochStream",
    "closed_loop_obstacle",
    "drives",
    "fit_closed_loop",
]
