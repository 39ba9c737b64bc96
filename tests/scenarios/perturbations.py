"""The torque that is asked for, tick by tick, made from first principles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

TAPS = {5: (5, 3), 6: (6, 5), 7: (7, 6), 8: (8, 6, 5, 4), 9: (9, 5)}
"""Primitive feedback polynomials by register length."""


@dataclass(frozen=True)
class Perturbation:
    """A maximal-length binary sequence, or a multisine of equal lines and Schroeder's phases."""

    amplitude_nm: float = 1.0
    clock_hz: float = 20.0
    bits: int = 7
    kind: Literal["prbs", "multisine"] = "prbs"
    duration_s: float = 20.0
    band_hz: tuple[float, float] = (0.15, 10.0)
    period_s: float = 10.0


def perturbation_nm(wanted: Perturbation, tick_rate_hz: float) -> NDArray[np.float64]:
    """Return the perturbation of an epoch, without a mean."""
    ticks = round(wanted.duration_s * tick_rate_hz)
    time_s = np.arange(ticks) / tick_rate_hz
    if wanted.kind == "prbs":
        chips = _chips(wanted.bits)
        chip = np.floor(time_s * wanted.clock_hz + 1e-9).astype(int)
        values = chips[chip % chips.size]
    else:
        low, high = wanted.band_hz
        lines = np.arange(np.ceil(low * wanted.period_s), np.floor(high * wanted.period_s) + 1)
        phases = -np.pi * np.arange(lines.size) ** 2 / lines.size
        turns = np.outer(time_s, lines / wanted.period_s)
        values = np.cos(2 * np.pi * turns + phases).sum(axis=1)
        values /= np.max(np.abs(values))
    return np.asarray(wanted.amplitude_nm * (values - values.mean()))


def _chips(bits: int) -> NDArray[np.float64]:
    """Return one period of ±1 of a Fibonacci shift register that starts from ones."""
    register = [1] * bits
    out = []
    for _ in range(2**bits - 1):
        out.append(2.0 * register[-1] - 1.0)
        fed_back = 0
        for tap in TAPS[bits]:
            fed_back ^= register[tap - 1]
        register = [fed_back, *register[:-1]]
    return np.array(out)
