"""How long a pause of a recording may be for the samples around it to say what was between.

A cubic through samples T apart follows a sinusoid of f Hz to (2π f T)⁴/384 of its amplitude: 0.07
for f T = 0.36. So the longest pause depends on the fastest of torque and motion, not on the
sampling rate.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]

BRIDGED_CYCLES = 0.36
"""f T: of the fastest component a few per cent are lost in pauses so long, of all others less."""
FASTEST_ABOVE = 0.98
"""Of the power of a signal lies below its fastest component."""
MOST_S = 0.25
"""A pause that is longer is one, however slow the motion."""
_PIECE_S = 4.0


def bridged_s(channels: Sequence[tuple[Array, Array]]) -> float:
    """Return the longest interval between samples that need not be cut, 0 where it is not known.

    Parameters
    ----------
    channels : sequence of (array, array)
        Time in s and values of torque and motion, without NaN.
    """
    with np.errstate(all="ignore"):  # of numbers that are refused elsewhere
        fastest_hz = [_fastest_hz(time_s, values) for time_s, values in channels]
    if not fastest_hz or not all(hz > 0 for hz in fastest_hz):
        return 0.0
    return min(BRIDGED_CYCLES / max(fastest_hz), MOST_S)


def _fastest_hz(time_s: Array, values: Array) -> float:
    """Return the frequency below which nearly all of a signal is, of its longer pieces; or 0."""
    step_s = float(np.median(np.diff(time_s))) if time_s.size > 1 else 0.0
    count = int(_PIECE_S / step_s) if step_s > 0 else 0
    power: Array | None = None
    hz = np.empty(0)
    for rows in np.split(np.arange(time_s.size), np.flatnonzero(np.diff(time_s) > MOST_S) + 1):
        n_even = int((time_s[rows[-1]] - time_s[rows[0]]) / step_s) if step_s > 0 else 0
        if count < 16 or n_even < count:
            continue
        clock = time_s[rows[0]] + step_s * np.arange(n_even)
        even = scipy.interpolate.CubicSpline(time_s[rows], values[rows])(clock)
        hz, of_piece = scipy.signal.welch(even, 1.0 / step_s, nperseg=count)
        power = of_piece * n_even + (0.0 if power is None else power)
    if power is None or not np.sum(power) > 0:
        return 0.0
    return float(hz[int(np.searchsorted(np.cumsum(power), FASTEST_ABOVE * np.sum(power)))])
