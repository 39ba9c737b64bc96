"""An angle that begins anew after each turn, as that of an encoder from 0° to 360°, made to go on.

A step of nearly one turn is such a beginning if the motion across it, taken to be the short way
round, is no faster than between the other samples. A sensor that drops to 0 is none.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

TURN_RAD = 2.0 * np.pi
_ROUNDING = 1e-6
_FASTER = 1.5


def unwrapped(angle_rad: NDArray[np.float64]) -> tuple[NDArray[np.float64], int]:
    """Return an angle that goes on, and how often it began anew; the same array if it did not.

    Parameters
    ----------
    angle_rad : array, shape (n,)
        NaN where there is no sample.

    Examples
    --------
    >>> unwrapped(np.radians([358.0, 359.5, 1.0, 2.5]))[1]
    1
    """
    here = np.flatnonzero(np.isfinite(angle_rad))
    inside = angle_rad[here]
    steps = np.diff(inside)
    anew = np.abs(steps) > TURN_RAD / 2
    if not np.any(anew) or np.ptp(inside) > TURN_RAD * (1 + _ROUNDING):
        return angle_rad, 0
    turns = np.where(anew, -np.sign(steps), 0.0)
    fastest = float(np.max(np.abs(steps[~anew]), initial=0.0))
    if fastest > TURN_RAD / 4:
        return angle_rad, 0
    if np.max(np.abs(steps + TURN_RAD * turns)[anew]) > _FASTER * fastest:
        return angle_rad, 0
    whole = angle_rad.copy()
    whole[here[1:]] += TURN_RAD * np.cumsum(turns)
    return whole, int(np.count_nonzero(anew))


def wrapping_text(n_turns: int) -> str:
    """Say of a column what `unwrapped` did."""
    times = "once" if n_turns == 1 else f"{n_turns} times"
    return f"begins anew after a turn ({times}); it is read as an angle that goes on"
