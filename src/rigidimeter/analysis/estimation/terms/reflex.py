"""The reflex path, in parallel to the joint's own mechanics.

A stretched muscle answers its stretch velocity after a delay; a shortening one does not answer:

    stretch(t) = max(v, 0)  where motion toward positive angle stretches it (`+`)
               = min(v, 0)  where the other direction does (`-`)
    torque     = h * stretch

After the rectifier all is linear, so the stretch goes through the band of the fit like every
regressor, and h may be applied afterwards, on few samples. h is a transfer function H(f):

    reflex               G exp(−j2πfτ)                                          G, delay τ
    reflex-second-order  G exp(−j2πfτ) · ω² / (s² + 2ζωs + ω²),  s = j2πf       G, τ, ω/2π, ζ
    reflex-fir           Σ c_k · Δ sinc²(fΔ) exp(−j2πf τ_k),  τ_k = τ_0 + kΔ    c_k; G = Δ Σ c_k

The last is a free impulse response made of triangles of half width Δ: neighbouring triangles
overlap, so it is continuous, which keeps its values from alternating.
G is in N·m·s/rad: a steady stretch of
1 rad/s is answered by G. Mirbagheri, Barbeau and Kearney (2000) use the second-order path.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.signals import Array, Signals

REFLEX_KINDS = ("reflex", "reflex-fir", "reflex-second-order")

FIR_FIRST_S, FIR_LAST_S = 0.04, 0.44
"""Lags of the free response. Before 40 ms no stretch reflex can act: nerves take that long."""

FIR_SPACING_S = 0.02
"""Between the triangles; a reflex muscle is a low-pass of a few Hz, for which this is fine."""

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Kernel:
    """A family of transfer functions.

    Attributes
    ----------
    columns : tuple of str
        The linear parameters.
    nonlinear, units : tuples of str
        The parameters inside H, and their units.
    low, high : tuples of float
        Their bounds.
    starts : tuple of tuples of float
        A grid from which the search begins.
    """

    kind: str
    columns: tuple[str, ...]
    nonlinear: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    low: tuple[float, ...] = ()
    high: tuple[float, ...] = ()
    starts: tuple[tuple[float, ...], ...] = ((),)

    def transfer(self, frequency_hz: Array, nonlinear: Array) -> list[Complex]:
        """Return H(f) of each linear parameter at 1."""
        if self.kind == "reflex-fir":
            shape = FIR_SPACING_S * np.sinc(frequency_hz * FIR_SPACING_S) ** 2
            return [shape * _delayed(frequency_hz, lag_s) for lag_s in _fir_lags_s()]
        pure = _delayed(frequency_hz, nonlinear[0])
        if self.kind == "reflex":
            return [pure]
        ratio = frequency_hz / nonlinear[1]
        return [pure / (1.0 - ratio**2 + 2j * nonlinear[2] * ratio)]


def kernel(name: str) -> Kernel:
    """Return the kernel of a reflex term, whatever its direction."""
    return _kernel(name.rstrip("+-"))


@lru_cache
def _kernel(kind: str) -> Kernel:
    if kind == "reflex-fir":
        return Kernel(kind, tuple(f"response {lag_s:.3f} s" for lag_s in _fir_lags_s()))
    delays = (0.03, 0.045, 0.06, 0.08, 0.1, 0.13)
    if kind == "reflex":
        # A pure delay has many local minima; the grid must be finer than a half period.
        grid = tuple((delay,) for delay in np.arange(0.02, 0.3001, 0.005).tolist())
        return Kernel(kind, ("gain",), ("delay",), ("s",), (0.015,), (0.31,), grid)
    return Kernel(
        kind,
        ("gain",),
        ("delay", "natural frequency", "damping ratio"),
        ("s", "Hz", "1"),
        (0.015, 0.3, 0.2),
        (0.2, 20.0, 4.0),
        tuple((d, f, z) for d in delays for f in (1.0, 2.0, 4.0, 8.0) for z in (0.5, 1.0)),
    )


def points_tried(names: Iterable[str]) -> list[tuple[float, ...]]:
    """Return the points at which the parameters inside the reflexes among terms are tried."""
    starts = (kernel(name).starts for name in names if name.startswith(REFLEX_KINDS))
    return [sum(parts, ()) for parts in product(*starts)]


def stretch_velocity(motion: Signals, name: str) -> Array:
    """Return the half-wave rectified velocity, wide-band, in its own sign."""
    if name[-1] not in "+-":
        raise ValueError(f"{name}: the direction that stretches the muscle is not known")
    rectify = np.maximum if name.endswith("+") else np.minimum
    return np.asarray(rectify(motion.velocity_rad_s, 0.0), dtype=np.float64)


def pass_through(stretch: Array, rate_hz: float, found: Kernel, nonlinear: Array) -> list[Array]:
    """Return the stretch after H, a column for each linear parameter.

    The past before the first sample is taken as its mirror image; what depends on it belongs to the
    samples that are trimmed.
    """
    n = stretch.size
    past = min(n - 1, round(2.0 * rate_hz))
    # As many zeros as past, so that what leaves at the end does not come back at the start.
    whole = np.concatenate((stretch[past:0:-1], stretch, np.zeros(past)))
    size = scipy.fft.next_fast_len(whole.size, real=True)
    spectrum = scipy.fft.rfft(whole, size)
    frequency_hz = scipy.fft.rfftfreq(size, 1.0 / rate_hz)
    return [
        np.asarray(scipy.fft.irfft(spectrum * gain, size)[past : past + n], dtype=np.float64)
        for gain in found.transfer(frequency_hz, nonlinear)
    ]


def _delayed(frequency_hz: Array, delay_s: float) -> Complex:
    return np.asarray(np.exp(-2j * np.pi * frequency_hz * delay_s), dtype=np.complex128)


def _fir_lags_s() -> Array:
    count = round((FIR_LAST_S - FIR_FIRST_S) / FIR_SPACING_S) + 1
    return FIR_FIRST_S + FIR_SPACING_S * np.arange(count, dtype=np.float64)
