"""Ticks that are missing in a record: left out by a loop that was late, or lost behind it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Gaps(NamedTuple):
    """How many ticks are missing, by what made them so."""

    left_out: int
    lost: int


def gaps(ticks: NDArray[Any], lateness_s: NDArray[np.float64], tick_rate_hz: float) -> Gaps:
    """Tell the two apart.

    A loop that wakes a whole tick late or more leaves out the ticks whose time has passed, and its
    next sample says by how much it was late; so each sample tells what its predecessor's number is.

    Parameters
    ----------
    ticks : array of int
        Numbers of the recorded ticks, in order.
    lateness_s : array of float
        Of the same, behind the first deadline that was not kept.
    tick_rate_hz : float

    Examples
    --------
    >>> gaps(np.array([7, 8, 12, 14]), np.array([0.0, 0.0, 3.4e-3, 0.1e-3]), 1000.0)
    Gaps(left_out=3, lost=1)
    """
    whole = np.where(lateness_s * tick_rate_hz >= 1.0, lateness_s * tick_rate_hz, 0.0)
    left_out = whole[1:].astype(int)
    missing = np.diff(ticks) - 1
    return Gaps(int(left_out.sum()), int(np.abs(missing - left_out).sum()))
