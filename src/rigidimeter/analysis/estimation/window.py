"""The window through which the spectrum of an epoch is taken, and its slope.

Its ends rise as a raised cosine, 0.5 − 0.5 cos(π d/T) at a distance d < T from an edge; around a
stretch that is left out it falls to zero in the same way. The slope is what a derivative in the
model makes of the window.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from rigidimeter.analysis.estimation.signals import Array


@lru_cache(maxsize=4)
def tapered_ends(n: int, rate_hz: float, taper_s: float) -> tuple[Array, Array]:
    """Return a window with raised-cosine ends, and its slope, which epochs of one length share.

    Parameters
    ----------
    n : int
        Samples.
    rate_hz, taper_s : float
        The length of an end; 0 for none.

    Returns
    -------
    window, slope : ndarray, shape (n,)
        Sample k stands for the middle of its interval; the slope is in 1/s.
    """
    centre_s = (np.arange(n) + 0.5) / rate_hz
    window, steep = _edge(np.minimum(centre_s, n / rate_hz - centre_s), taper_s)
    slope = np.where(np.arange(n) < n / 2, steep, -steep)
    for array in (window, slope):
        array.setflags(write=False)
    return window, slope


def with_hole(
    window: Array, slope: Array, rate_hz: float, taper_s: float, hole_s: tuple[float, float]
) -> tuple[Array, Array]:
    """Return a window times one that is zero in a hole and rises from it, and its slope.

    Parameters
    ----------
    window, slope : ndarray, shape (n,)
        As `tapered_ends` returns them.
    rate_hz, taper_s : float
    hole_s : tuple of float
        Start and stop, in s from the first sample.
    """
    at_s = np.arange(window.size) / rate_hz
    start_s, stop_s = hole_s
    factor, steep = _edge(np.maximum(np.maximum(start_s - at_s, at_s - stop_s), 0.0), taper_s)
    factor[(at_s >= start_s) & (at_s <= stop_s)] = 0.0
    signed = np.where(at_s < start_s, -steep, steep)
    return window * factor, slope * factor + window * signed


def _edge(distance_s: Array, taper_s: float) -> tuple[Array, Array]:
    """Return a raised cosine of the distance from an edge, and its slope."""
    n = distance_s.size
    phase = np.pi * np.minimum(distance_s / taper_s, 1.0) if taper_s > 0 else np.full(n, np.pi)
    steep = 0.5 * np.pi / taper_s * np.sin(phase) if taper_s > 0 else np.zeros(n)
    return 0.5 - 0.5 * np.cos(phase), steep


def repetition(window: Array) -> float:
    """Return n Σ w⁴ / (Σ w²)², how much alike a window makes neighbouring lines.

    Noise and signal are both seen through the window, so the sum of their products over the lines
    is one over time weighted by w⁴ (Parseval), while independent lines of noise with the power
    Σ w² would give (Σ w²)² / n.
    """
    square = window * window
    return float(window.size * np.sum(square * square) / np.sum(square) ** 2)
