r"""The spectral lines that `iv` weighs, and what it will make of them.

`iv` multiplies the record by a window w with raised-cosine ends, takes its lines at ω_k = 2π k/T
and weighs each with the inverse of its noise. With Z_k the motion that the perturbation causes, and
torque noise ν of autocovariance r, the noise N_k of a line has the power

    S_k = Σ c(τ) r(τ) e^(−iω_k τ)      c(τ) = Σ w(t) w(t + τ)

which is the density of ν as the window smears it. Below a steep edge that is far more than the
density itself: under voluntary torque K is read below 0.3 Hz, and what stands in its way there has
leaked from above. The estimate is

    p = A⁻¹ Σ Re(Z_kᴴ Y_k)/S_k      A = Σ Re(Z_kᴴ Z_k)/S_k

and since Σ Re(Z_kᴴ N_k)/S_k = Σ h(t) ν(t) with h(t) = w(t) Σ Re(Z_k e^(iω_k t))/S_k, its covariance
is A⁻¹ Q A⁻¹, Q = Σ Σ h(t) hᵀ(t') r(t − t'): for noise of any colour, and although the window makes
neighbouring lines resemble each other. Were they independent it would be (2A)⁻¹.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, prev_fast_len, rfft

from rigidimeter.dynamics.velocity_drive import Array
from rigidimeter.errors import UserError
from rigidimeter.experiment.predicted_record import Record, noise_covariance
from rigidimeter.settings import EstimationSettings, RigSettings, SubjectSettings

__all__ = ["USABLE_FRACTION_OF_RATE", "Layout", "layout", "weighted_products"]

USABLE_FRACTION_OF_RATE = 0.4
"""The estimation uses a channel up to this share of its rate."""

FEWEST_LINES = 8
"""The estimation asks for as many."""

_ROUNDING = 1e-6


@dataclass(frozen=True)
class Layout:
    """Window and lines of one epoch.

    Attributes
    ----------
    rate_hz : float
        Of the torque.
    window : array, shape (n,)
        One value a sample of the torque; as many from the start as make a fast FFT.
    line : array of int, shape (m,)
        Which lines of the FFT are used.
    """

    rate_hz: float
    window: Array
    line: NDArray[np.intp]

    @property
    def band_hz(self) -> tuple[float, float]:
        """The first and the last line."""
        low, high = self.line[[0, -1]] * self.rate_hz / self.window.size
        return float(low), float(high)


def layout(
    record: Record, estimation: EstimationSettings, band_hz: tuple[float, float] | None = None
) -> Layout:
    """Return window and lines as the estimation lays them out where the drive is known.

    Parameters
    ----------
    record : Record
    estimation : EstimationSettings
        Its `trim_s` is the length of a taper.
    band_hz : (float, float), optional
        By default from `band_low_hz` to `band_high_closed_loop_hz`; in any case not above 0.4 times
        the torque rate. The line below it counts too.

    Raises
    ------
    UserError
        If the band holds too few lines.
    """
    low_hz, high_hz = band_hz or (estimation.band_low_hz, estimation.band_high_closed_loop_hz)
    high_hz = min(high_hz, USABLE_FRACTION_OF_RATE * record.rate_hz)
    n = prev_fast_len(record.motion.shape[1], real=True)
    length_s = n / record.rate_hz
    first = max(math.ceil(low_hz * length_s - _ROUNDING) - 1, 1)
    line = np.arange(first, math.floor(high_hz * length_s + _ROUNDING) + 1, dtype=np.intp)
    if line.size < FEWEST_LINES:
        raise UserError(
            f"the band {low_hz:g} to {high_hz:g} Hz holds {line.size} lines of an epoch of "
            f"{length_s:.3g} s; the fit needs at least {FEWEST_LINES}"
        )
    return Layout(record.rate_hz, _window(n, record.rate_hz, estimation.trim_s), line)


def weighted_products(
    record: Record, rig: RigSettings, subject: SubjectSettings, lines: Layout
) -> tuple[Array, Array]:
    """Return A and Q, each of shape (3, 3).

    Parameters
    ----------
    record : Record
    rig : RigSettings
        For the torque sensor; it or the subject must make some noise.
    subject : SubjectSettings
        For voluntary torque and tremor.
    lines : Layout
    """
    window, line, n = lines.window, lines.line, lines.window.size
    # Over twice the length nothing comes round, and line k is bin 2k.
    covariance = noise_covariance(rig, subject, n + 1)
    covariance = np.concatenate([covariance, covariance[n - 1 : 0 : -1]])
    pairs = irfft(np.abs(rfft(window, 2 * n)) ** 2, 2 * n)
    power = rfft(pairs * covariance).real[2 * line]
    motion = record.motion[:, :n]
    # A mean is not fitted: the estimation takes it out under the window.
    mean = np.sum(window**2 * motion, axis=1) / np.sum(window**2)
    Z = rfft(window * (motion - mean[:, None]))[:, line]
    weighted = np.zeros((3, n // 2 + 1), dtype=np.complex128)
    weighted[:, line] = Z / power
    A = np.real(weighted[:, line] @ Z.conj().T)
    # irfft sums both signs of frequency over n: Re Σ of one sign is n/2 times that.
    h = window * irfft(weighted, n) * (n / 2.0)
    Q = h @ irfft(rfft(h, 2 * n) * rfft(covariance).real, 2 * n)[:, :n].T
    return np.asarray(A), np.asarray(Q)


def _window(n: int, rate_hz: float, taper_s: float) -> Array:
    """Return a window whose ends rise and fall as (1 − cos(π t/taper))/2."""
    if taper_s == 0.0:
        return np.ones(n)
    centre_s = (np.arange(n) + 0.5) / rate_hz
    edge_s = np.minimum(centre_s, n / rate_hz - centre_s)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.minimum(edge_s / taper_s, 1.0)))
