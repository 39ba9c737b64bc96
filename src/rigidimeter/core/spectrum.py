"""Power spectral density of a signal of one epoch."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]

SEGMENT_S = 5.0
"""Of Welch's method: lines 0.2 Hz apart, which separates a tremor from slower movements."""


def density(values: Array, rate_hz: float) -> tuple[Array, Array]:
    """Return frequencies in Hz and the one-sided power spectral density, in unit²/Hz."""
    segment = min(values.size, max(round(SEGMENT_S * rate_hz), 8))
    frequency_hz, power = scipy.signal.welch(values, rate_hz, nperseg=segment)
    return frequency_hz, power
