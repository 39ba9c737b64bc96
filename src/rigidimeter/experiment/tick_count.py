"""Counting ticks exactly: a duration and a rate as the decimals that were written.

A float such as 22.6 is not the decimal 22.6, and `floor(i * 22.6 / 1000)` slips by one tick
wherever the product rounds across a whole number. Counting with fractions of the written decimals
cannot slip.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

__all__ = ["as_written", "tick_count", "tick_times_s"]


def as_written(value: float, name: str) -> Fraction:
    """Return the shortest decimal that reads back as this float, as an exact fraction.

    Raises
    ------
    ValueError
        If the value is not finite or not greater than zero; `name` is for that message.
    """
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"{name} must be finite and greater than 0, got {value}")
    return Fraction(repr(float(value)))


def tick_count(duration_s: float, rate_hz: float) -> int:
    """Return the number of ticks in a duration, to the nearest whole tick.

    Raises
    ------
    ValueError
        If a value is not greater than zero, or the duration is shorter than half a tick.
    """
    count = round(as_written(duration_s, "duration_s") * as_written(rate_hz, "rate_hz"))
    if count < 1:
        raise ValueError(f"{duration_s:g} s holds no tick at {rate_hz:g} Hz")
    return count


def tick_times_s(count: int, rate_hz: float) -> NDArray[np.float64]:
    """Return the times of the first `count` ticks, from 0, in seconds."""
    return np.arange(count, dtype=np.float64) / rate_hz
