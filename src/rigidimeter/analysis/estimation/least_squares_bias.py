"""How far the loop pulls least squares away from the joint, from the recording itself.

A torque u that is added to the joint's own, M = Φ p + u, is the subject's own torque and the noise
of the sensor. In admittance control it comes back as motion: Φ = Φ_d + H(p) u, with Φ_d what the
perturbation causes and H the loop's motion per torque. Least squares then gives

    p + b,    b = (Φ'Φ)⁻¹ Φ'u,    E Φ'u = Σ Re H(p)* |U|²

over the lines of u, whatever else moves the joint. With u = M − Φ (p̂ − b) both sides depend on b
alone, and are solved for it by iteration from b = 0.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy import fft

from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.model import Loop, OpenLoop

BEYOND_BAND = 2.0
"""The filter of the band lets nothing pass above this many times its upper edge."""

ITERATIONS = 50
DAMPING = 0.5
SETTLED = 1e-3
"""A step of less than this share of every parameter ends the iteration."""


def compensated(signals: Signals, loop: Loop) -> Array | None:
    """Return J, B and K by least squares without the bias of the loop, shape (3,).

    None where no J, B and K fit the recording and the loop.

    Parameters
    ----------
    signals : Signals
        All through one filter.
    loop : Loop
        In which the joint was moved.
    """
    solution = signals.solution
    if solution.dependent:
        return None
    fitted, lengths, n = solution.values, solution.lengths, solution.rows
    everything = np.stack([*signals.motion.T, signals.torque_nm])
    # A taper, or the slow part of u leaks into all lines.
    spectra = fft.rfft(everything * _taper(n))
    fastest_hz = 0.49 * min(signals.rate_hz, loop.rig.tick_rate_hz)
    highest_hz = min(BEYOND_BAND * signals.band_hz[1], fastest_hz)
    lines = slice(1, int(highest_hz * n / signals.rate_hz) + 1)
    motion, applied = spectra[:3, lines], spectra[3, lines]
    opened = _opened(loop, lines.stop - 1, float(f"{signals.rate_hz / n:.9g}"))
    gram = (motion.conj() @ motion.T).real / np.outer(lengths, lengths)
    bias = np.zeros(3)
    for _ in range(ITERATIONS):
        joint = fitted - bias
        power = np.abs(applied - joint @ motion) ** 2
        J, B, K = joint.tolist()
        pulled = np.sum(opened.motion_per_torque((J, B, K)).real * power, axis=1)
        step = np.linalg.solve(gram, pulled / lengths) / lengths - bias
        bias = bias + DAMPING * step
        if np.all(np.abs(step) < SETTLED * np.abs(fitted)):
            return np.asarray(fitted - bias)
    return None


@lru_cache(maxsize=4)
def _taper(n: int) -> Array:
    taper = np.hanning(n)
    taper.setflags(write=False)
    return taper


@lru_cache(maxsize=8)
def _opened(loop: Loop, count: int, spacing_hz: float) -> OpenLoop:
    return loop.at_frequency(spacing_hz * np.arange(1, count + 1))
