"""The power of a signal line by line."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.signals import Array


def power_lines(
    values: Array, rate_hz: float, *, tapered: bool = False, longer: int = 1
) -> tuple[Array, Array]:
    """Return frequencies and the power at each; without a taper it sums to the variance.

    A few samples at the end are not used where the transform of all takes many times as long: that
    of 18,001 takes 15 times as long as of 18,000. They are at most 2.2 % of a thousand or more.

    Parameters
    ----------
    values : array, shape (n,)
        Its mean is taken off.
    rate_hz : float
    tapered : bool
        Through Hann's window, for signals whose slow part would leak into all other lines.
    longer : int
        So many times as many lines, for a peak between two of them.
    """
    values = values[: scipy.fft.prev_fast_len(values.size)]
    n = longer * values.size
    centred = values - np.mean(values)
    if tapered:
        centred *= _taper(values.size)
    spectrum = scipy.fft.rfft(centred, n)
    power = (2.0 / (n * values.size)) * (spectrum.real**2 + spectrum.imag**2)
    power[0] /= 2.0
    if n % 2 == 0:
        power[-1] /= 2.0
    return scipy.fft.rfftfreq(n, 1.0 / rate_hz), power


@lru_cache(maxsize=4)
def _taper(n: int) -> Array:
    """Return Hann's window with a mean square of 1, which epochs of one length share."""
    taper = np.asarray(np.sqrt(8.0 / 3.0) * scipy.signal.windows.hann(n))
    taper.setflags(write=False)
    return taper


def lines_inside(frequency_hz: Array, band_hz: tuple[float, float]) -> NDArray[np.intp]:
    """Return which lines lie in a band, ends included, zero left out."""
    low, high = band_hz
    return np.flatnonzero((frequency_hz > 0) & (frequency_hz >= low) & (frequency_hz <= high))
