"""The filters of the EMG's envelope, and the envelope of samples as they come."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]

EMG_BAND_HZ = (20.0, 450.0)
ENVELOPE_HZ = 6.0
ENVELOPE_RATE_HZ = 50.0
_HIGHEST_OF_RATE = 0.45


def emg_band_hz(rate_hz: float) -> tuple[float, float]:
    """Return the band of EMG of a rate, which may be empty."""
    return EMG_BAND_HZ[0], min(EMG_BAND_HZ[1], _HIGHEST_OF_RATE * rate_hz)


def emg_filters(rate_hz: float) -> tuple[Array, Array]:
    """Return the band-pass before the EMG is rectified and the low-pass after it, as sections."""
    band = scipy.signal.butter(2, emg_band_hz(rate_hz), "bandpass", fs=rate_hz, output="sos")
    low = scipy.signal.butter(2, ENVELOPE_HZ, "lowpass", fs=rate_hz, output="sos")
    return band, low


def envelope_step(rate_hz: float) -> int:
    """Return how many samples of the EMG give one of the envelope."""
    return max(int(rate_hz / ENVELOPE_RATE_HZ), 1)


class LiveEnvelope:
    """The envelope block by block, of past samples alone, and so some 50 ms late.

    Parameters
    ----------
    rate_hz : float
    muscles : int
    """

    def __init__(self, rate_hz: float, muscles: int) -> None:
        self._filters, self._step = emg_filters(rate_hz), envelope_step(rate_hz)
        self._memories = [np.zeros((sos.shape[0], 2, muscles)) for sos in self._filters]
        self._next = 0

    def block(self, time_s: Array, emg: Array) -> Array:
        """Return time and envelope of every few samples of the next block.

        Parameters
        ----------
        time_s : array, shape (n,)
            In s.
        emg : array, shape (n, muscles)
            In any unit, which is that of the envelope.

        Returns
        -------
        array, shape (m, 1 + muscles)
        """
        if not time_s.size:
            return np.empty((0, 1 + emg.shape[1]))
        values = np.where(np.isfinite(emg), emg, 0.0)
        for k, sos in enumerate(self._filters):
            values, self._memories[k] = scipy.signal.sosfilt(
                sos, np.abs(values) if k else values, axis=0, zi=self._memories[k]
            )
        own = slice(-self._next % self._step, None, self._step)
        self._next += time_s.size
        return np.column_stack([time_s[own], np.maximum(values[own], 0.0)])
