"""Estimates from a known perturbation in a closed loop, where the motion itself is not trusted."""

from rigidimeter.estimation.closedloop.estimate import (
    CLOSED_LOOP,
    closed_loop_obstacle,
    drives,
    fit_closed_loop,
)
from rigidimeter.estimation.closedloop.stream import EpochStream

__all__ = ["CLOSED_LOOP", "EpochStream", "closed_loop_obstacle", "drives", "fit_closed_loop"]
