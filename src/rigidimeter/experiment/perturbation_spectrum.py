"""What the perturbation excites: lines, envelope and power spectral density (Fig. 3b).

A periodic sequence of N = 2ⁿ − 1 chips at f_clock has lines at whole multiples of f_clock / N.
Spread over that spacing, the line at f carries the density

    S(f) = 2 A² (N + 1) / (N f_clock) · sinc²(f / f_clock)      (one-sided, N²m²/Hz)

that is, a plateau that the hold of each chip rolls off: −3 dB at 0.443 f_clock, nothing at f_clock.
`rigidimeter.experiment.band` holds this against the wanted band.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from rigidimeter.experiment.prbs import chip_count
from rigidimeter.records import readonly
from rigidimeter.settings import PrbsSettings

__all__ = [
    "HALF_POWER_DB",
    "Spectrum",
    "envelope_db",
    "envelope_edge_hz",
    "line_spacing_hz",
    "plateau_n2m2_hz",
    "power_spectrum",
]

HALF_POWER_DB = 10.0 * math.log10(2.0)
"""What "−3 dB" means here and in `JointDynamics.bandwidth_hz`: half the power."""

_NOTHING_DB = -120.0


@dataclass(frozen=True)
class Spectrum:
    """One-sided power spectral density of a torque.

    Parameters
    ----------
    frequency_hz : array, shape (m,)
        From 0, evenly spaced.
    density_n2m2_hz : array, shape (m,)
        In N²m²/Hz; its sum times the spacing is the variance.
    """

    frequency_hz: NDArray[np.float64]
    density_n2m2_hz: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "frequency_hz", readonly(self.frequency_hz))
        object.__setattr__(self, "density_n2m2_hz", readonly(self.density_n2m2_hz))

    def share(self, low_hz: float, high_hz: float) -> float:
        """Return the part of the variance between two frequencies, both included, 0 to 1.

        Raises
        ------
        ValueError
            If there is no variance at all.
        """
        total = float(np.sum(self.density_n2m2_hz))
        if total <= 0:
            raise ValueError("a torque that never changes has no power to share out")
        inside = (self.frequency_hz >= low_hz) & (self.frequency_hz <= high_hz)
        return float(np.sum(self.density_n2m2_hz[inside])) / total


def line_spacing_hz(settings: PrbsSettings) -> float:
    """Return the spacing of the lines, which is also the lowest: f_clock / (2ⁿ − 1), in Hz."""
    return settings.clock_hz / chip_count(settings)


def plateau_n2m2_hz(settings: PrbsSettings) -> float:
    """Return the density that the envelope approaches at low frequency, in N²m²/Hz.

    2 A² (N + 1) / (N f_clock), with A the amplitude and N = 2ⁿ − 1.
    """
    chips = chip_count(settings)
    return 2.0 * settings.amplitude_nm**2 * (chips + 1) / (chips * settings.clock_hz)


def envelope_db(frequency_hz: ArrayLike, clock_hz: float) -> NDArray[np.float64]:
    """Return sinc²(f / f_clock) in dB: the envelope relative to its plateau.

    Nulls, and anything as low, are given as −120 dB.
    """
    power = np.sinc(np.asarray(frequency_hz, dtype=np.float64) / clock_hz) ** 2
    return np.asarray(10.0 * np.log10(np.maximum(power, 10.0 ** (_NOTHING_DB / 10.0))))


def envelope_edge_hz(clock_hz: float, drop_db: float = HALF_POWER_DB) -> float:
    """Return where sinc²(f / f_clock) first falls `drop_db` below its plateau, in Hz.

    Solved numerically inside the main lobe, where the envelope falls all the way: 0.4429 f_clock
    for half the power, 0.6028 f_clock for 6 dB.

    Raises
    ------
    ValueError
        If `drop_db` is not above 0 and at most 100 dB.
    """
    if not 0 < drop_db <= 100:
        raise ValueError(f"drop_db must be above 0 and at most 100 dB, got {drop_db}")
    wanted = 10.0 ** (-drop_db / 20.0)
    ratio = scipy.optimize.brentq(lambda x: float(np.sinc(x)) - wanted, 0.0, 1.0, xtol=1e-14)
    return float(ratio) * clock_hz


def power_spectrum(torque_nm: ArrayLike, rate_hz: float) -> Spectrum:
    """Return the one-sided power spectral density of a torque, by the plain periodogram.

    The mean is taken off and no window is applied, so that by Parseval's theorem the density sums,
    times the spacing, to the variance.

    Parameters
    ----------
    torque_nm : array, shape (n,)
        In N·m, evenly sampled.
    rate_hz : float
        Samples a second.
    """
    frequency_hz, density_n2m2_hz = scipy.signal.periodogram(
        np.asarray(torque_nm, dtype=np.float64), fs=rate_hz, detrend="constant"
    )
    return Spectrum(frequency_hz, density_n2m2_hz)
