"""Where the power of a signal lies, line by line."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigidimeter.estimation.signals import Array

__all__ = ["inside", "lines"]


def lines(values: Array, rate_hz: float, *, tapered: bool = False) -> tuple[Array, Array]:
    """Return frequencies and the power at each; without a taper it sums to the variance.

    Parameters
    ----------
    values : array, shape (n,)
        Its mean is taken off.
    rate_hz : float
    tapered : bool
        Through Hann's window, for signals whose slow part would leak into all other lines.
    """
    n = values.size
    centred = values - np.mean(values)
    if tapered:
        centred = centred * np.hanning(n) * np.sqrt(8.0 / 3.0)
    power = np.asarray(2.0 * np.abs(np.fft.rfft(centred)) ** 2 / n**2, dtype=np.float64)
    power[0] /= 2.0
    if n % 2 == 0:
        power[-1] /= 2.0
    frequency = np.asarray(np.fft.rfftfreq(n, 1.0 / rate_hz), dtype=np.float64)
    return frequency, power


def inside(frequency_hz: Array, band_hz: tuple[float, float]) -> NDArray[np.intp]:
    """Return which lines lie in a band, ends included, zero left out."""
    low, high = band_hz
    return np.flatnonzero((frequency_hz > 0) & (frequency_hz >= low) & (frequency_hz <= high))
