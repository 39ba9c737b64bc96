"""The low-pass in front of the admittance: a second-order section with explicit state."""

from __future__ import annotations

import math
from typing import NamedTuple


class Biquad(NamedTuple):
    """H(z) = (b0 + b1 z⁻¹ + b2 z⁻²) / (1 + a1 z⁻¹ + a2 z⁻²)."""

    b0: float
    b1: float
    b2: float
    a1: float
    a2: float


class BiquadState(NamedTuple):
    """The two delays of the transposed direct form II."""

    first: float = 0.0
    second: float = 0.0


def butterworth_lowpass(cutoff_hz: float, rate_hz: float) -> Biquad:
    """Return a second-order Butterworth low-pass, bilinear with the cutoff prewarped.

    Raises
    ------
    ValueError
        If the cutoff is not between 0 and half the rate.
    """
    if not 0 < cutoff_hz < rate_hz / 2:
        raise ValueError(f"cutoff must be between 0 and {rate_hz / 2:g} Hz, got {cutoff_hz:g} Hz")
    w = math.tan(math.pi * cutoff_hz / rate_hz)
    norm = 1.0 / (1.0 + math.sqrt(2.0) * w + w * w)
    b0 = w * w * norm
    return Biquad(
        b0=b0,
        b1=2.0 * b0,
        b2=b0,
        a1=2.0 * (w * w - 1.0) * norm,
        a2=(1.0 - math.sqrt(2.0) * w + w * w) * norm,
    )


def biquad_step(
    coefficients: Biquad, state: BiquadState, value: float
) -> tuple[BiquadState, float]:
    """Advance one sample; return the new state and the output."""
    b0, b1, b2, a1, a2 = coefficients
    output = b0 * value + state[0]
    return BiquadState(b1 * value - a1 * output + state[1], b2 * value - a2 * output), output
