"""The window through which the spectrum of an epoch is taken, and its first two derivatives.

Its ends rise as a raised cosine, 0.5 − 0.5 cos(π d/T) at a distance d < T from an edge; around a
stretch that is left out it falls to zero in the same way. The derivatives are what those of the
motion make of the window, when integrated by parts.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rigidimeter.analysis.estimation.signals import Array


class Window(NamedTuple):
    """A window w with w' in 1/s and w'' in 1/s², each of shape (n,)."""

    value: Array
    slope: Array
    curvature: Array


@lru_cache(maxsize=4)
def tapered_ends(n: int, rate_hz: float, taper_s: float) -> Window:
    """Return a window with raised-cosine ends, which epochs of one length share.

    Parameters
    ----------
    n : int
        Samples; sample k stands for the middle of its interval.
    rate_hz, taper_s : float
        The length of an end; 0 for none.
    """
    centre_s = (np.arange(n) + 0.5) / rate_hz
    value, steep, curvature = _edge(np.minimum(centre_s, n / rate_hz - centre_s), taper_s)
    window = Window(value, np.where(np.arange(n) < n / 2, steep, -steep), curvature)
    for array in window:
        array.setflags(write=False)
    return window


def with_hole(
    window: Window, rate_hz: float, taper_s: float, hole_s: tuple[float, float]
) -> Window:
    """Return a window times one that is zero in a hole and rises from it.

    Parameters
    ----------
    window : Window
    rate_hz, taper_s : float
    hole_s : tuple of float
        Start and stop, in s from the first sample.
    """
    at_s = np.arange(window.value.size) / rate_hz
    start_s, stop_s = hole_s
    distance_s = np.maximum(np.maximum(start_s - at_s, at_s - stop_s), 0.0)
    factor, steep, bend = _edge(distance_s, taper_s)
    inside = (at_s >= start_s) & (at_s <= stop_s)
    factor[inside] = bend[inside] = 0.0
    signed = np.where(at_s < start_s, -steep, steep)
    value, slope, curvature = window
    return Window(
        value * factor,
        slope * factor + value * signed,
        curvature * factor + 2.0 * slope * signed + value * bend,
    )


def _edge(distance_s: Array, taper_s: float) -> Window:
    """Return a raised cosine of the distance from an edge, with its derivatives."""
    n = distance_s.size
    if not taper_s > 0:
        return Window(np.ones(n), np.zeros(n), np.zeros(n))
    phase, turn = np.pi * np.minimum(distance_s / taper_s, 1.0), np.pi / taper_s
    bend = np.where(distance_s < taper_s, 0.5 * turn**2 * np.cos(phase), 0.0)
    return Window(0.5 - 0.5 * np.cos(phase), 0.5 * turn * np.sin(phase), bend)


def repetition(window: Array) -> float:
    """Return n Σ w⁴ / (Σ w²)², how much alike a window makes neighbouring lines.

    Noise and signal are both seen through the window, so the sum of their products over the lines
    is one over time weighted by w⁴ (Parseval), while independent lines of noise with the power
    Σ w² would give (Σ w²)² / n.
    """
    square = window * window
    return float(window.size * np.sum(square * square) / np.sum(square) ** 2)
