"""An epoch as spectral lines: Eq. 3 multiplied by smooth functions of time and integrated.

With a window w(t) that begins and ends at zero and the frequencies ω_k = 2π k/T, multiply Eq. 3 by
w(t) e^(−i ω_k t) and integrate. The derivative of the velocity moves to the known window,

    ∫ w e^(−iωt) θ'' dt = iω ∫ w e^(−iωt) θ' dt − ∫ w' e^(−iωt) θ' dt

and once more for the acceleration where the angle alone was measured,

    ∫ w e^(−iωt) θ'' dt = −ω² ∫ w e^(−iωt) θ dt − 2iω ∫ w' e^(−iωt) θ dt + ∫ w'' e^(−iωt) θ dt

so nothing is differentiated. What is left is linear in J, B and K at every line, all signals are
treated alike, and drift and noise outside the band are other lines (the modulating functions of
Shinbrot 1957; Pearson and Lee 1985).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.signals import Array, motion_channels, uniform_grid
from rigidimeter.analysis.estimation.window import repetition, tapered_ends, with_hole
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import FEWEST_LINES

Complex = NDArray[np.complex128]

SAME_TIME = 0.01
"""Stamps closer than this share of an interval are the same time: clocks are rounded."""


@dataclass(frozen=True)
class Grid:
    """The samples and lines of an epoch.

    Attributes
    ----------
    time_s : array, shape (n,)
        Uniform, the stamps of the torque where those are uniform.
    rate_hz : float
    window : array, shape (n,)
    window_slope_per_s, window_curvature_per_s2 : array, shape (n,)
        w' and w''.
    line : array of int, shape (m,)
        Which lines of the FFT are used, all from the first to the last.
    omega_rad_s : array, shape (m,)
    energy : float
        Σ w²: white noise of unit variance puts this much power into every line.
    window_lines : complex array, shape (m,)
        What a constant would leave at the lines.
    spread : float
        The window makes neighbouring lines alike. By this factor the variance of an estimate is
        larger than independent lines would have it (`window.repetition`).
    """

    time_s: Array
    rate_hz: float
    window: Array
    window_slope_per_s: Array
    window_curvature_per_s2: Array
    line: NDArray[np.intp]
    omega_rad_s: Array
    energy: float
    window_lines: Complex
    spread: float = 1.0

    @cached_property
    def samples(self) -> int:
        """How many are not left out."""
        return int(np.count_nonzero(self.window))

    @property
    def used_share(self) -> float:
        """The samples that are not left out, of all."""
        return self.samples / self.window.size

    @property
    def band_hz(self) -> tuple[float, float]:
        """The first and the last line."""
        return float(self.omega_rad_s[0] / (2 * np.pi)), float(self.omega_rad_s[-1] / (2 * np.pi))

    def transform(self, values: Array) -> Complex:
        """Return Σ w x e^(−iωt) at the lines, free of the mean of x: (..., n) to (..., m)."""
        return np.asarray(self.transforms(values, 0)[0, 0])

    def transforms(self, values: Array, derivatives: int, *, halves: bool = False) -> Complex:
        """Return `transform` of x and of its derivatives, without differentiating it.

        Means go, of derivatives too: ∫ w² x' dt = −∫ (w²)' x dt.

        Parameters
        ----------
        values : array, shape (..., n)
        derivatives : int
            How many, up to 2.
        halves : bool
            Also return half the difference of what the even and the odd samples give: the spectrum
            as far below half the rate as the line is above zero, which is noise where the motion is
            slow.

        Returns
        -------
        complex array, shape (1 or 2, derivatives + 1, ..., m)
            Of x, x', x''.
        """
        windows = self.window, self.window_slope_per_s, self.window_curvature_per_s2
        w, slope, _ = windows
        centred = values - (values @ (w * w / self.energy))[..., None]
        through = np.empty((derivatives + 1, *values.shape))
        for window, row in zip(windows, through, strict=False):
            np.multiply(window, centred, out=row)
        lines, turn = self._lines(through, halves), 1j * self.omega_rad_s
        found, means = [lines[:, 0]], 2 / self.energy * (through @ w)[..., None]
        if derivatives > 0:
            found.append(turn * lines[:, 0] - lines[:, 1])
            found[1][0] += means[1] * self.window_lines
        if derivatives > 1:
            mean = means[2] + 2 / self.energy * (through[1] @ slope)[..., None]
            found.append(turn**2 * lines[:, 0] - 2 * turn * lines[:, 1] + lines[:, 2])
            found[2][0] -= mean * self.window_lines
        return np.stack(found, axis=1)

    def _lines(self, through: Array, halves: bool) -> Complex:
        """Return the lines of signals through the window, and half the differences."""
        n, place = through.shape[-1], slice(int(self.line[0]), int(self.line[-1]) + 1)
        spectra = scipy.fft.rfft(through)
        found = [spectra[..., place]]
        if halves and n % 2 == 0:
            found.append(spectra[..., n // 2 - self.line].conj())
        elif halves:
            turned = through.copy()
            turned[..., 1::2] *= -1
            found.append(scipy.fft.rfft(turned)[..., place])
        return np.stack(found)


def epoch_grid(
    epoch: Epoch,
    band_hz: tuple[float, float],
    taper_s: float,
    samples: Callable[[int, float], int] | None = None,
) -> Grid:
    """Lay out samples, window and lines.

    The window rises and falls as a raised cosine over `taper_s`. The line below the band counts
    too: a line of a record that is not a whole number of periods spreads to its neighbours.

    Parameters
    ----------
    epoch : Epoch
    band_hz : (float, float)
    taper_s : float
    samples : callable, optional
        Takes how many samples there are and their rate, and returns how many to use, from the end;
        otherwise as many as make a fast FFT, from the start.

    Raises
    ------
    ValueError
        If the band holds too few lines for three parameters.
    """
    torque = epoch.channels["torque_nm"]
    used = [torque, *motion_channels(epoch)]
    if "perturbation_nm" in epoch.channels:
        used.append(epoch.channels["perturbation_nm"])
    time_s, rate_hz = _times(torque, used)
    if samples is not None:
        time_s = time_s[time_s.size - samples(time_s.size, rate_hz) :]
    elif time_s.size:
        time_s = time_s[: scipy.fft.prev_fast_len(time_s.size, real=True)]
    return grid_at(time_s, rate_hz, band_hz, taper_s, epoch)


def grid_at(
    time_s: Array, rate_hz: float, band_hz: tuple[float, float], taper_s: float, epoch: Epoch
) -> Grid:
    """Return the grid of these samples of an epoch; parameters and errors as for `epoch_grid`."""
    start_s = float(time_s[0]) if time_s.size else 0.0
    holes = tuple(
        (round(stretch.start_s - start_s, 9), round(stretch.stop_s - start_s, 9))
        for stretch in epoch.left_out
    )
    rounded_hz = float(f"{rate_hz:.9g}")
    return Grid(time_s, rate_hz, *_layout(time_s.size, rounded_hz, band_hz, taper_s, holes))


@lru_cache(maxsize=32)
def _layout(
    n: int,
    rate_hz: float,
    band_hz: tuple[float, float],
    taper_s: float,
    holes_s: tuple[tuple[float, float], ...],
) -> tuple[Array, Array, Array, NDArray[np.intp], Array, float, Complex, float]:
    """Return what does not depend on where an epoch begins; epochs of a session share it."""
    low, high = band_hz
    duration_s = n / rate_hz
    first = max(int(np.ceil(low * duration_s - 1e-6)) - 1, 1)
    line = np.arange(first, int(np.floor(high * duration_s + 1e-6)) + 1, dtype=np.intp)
    if line.size < FEWEST_LINES:
        raise ValueError(
            f"{duration_s:.3g} s hold {line.size} spectral lines from {low:g} to {high:g} Hz; "
            f"at least {FEWEST_LINES} are needed"
        )
    window = tapered_ends(n, rate_hz, taper_s)
    for hole_s in holes_s:
        window = with_hole(window, rate_hz, taper_s, hole_s)
    energy = float(np.sum(window.value**2))
    constant = np.asarray(scipy.fft.rfft(window.value)[line], dtype=np.complex128)
    omega = np.asarray(2 * np.pi * line / duration_s, dtype=np.float64)
    for part in (*window, line, omega, constant):
        part.setflags(write=False)
    return *window, line, omega, energy, constant, repetition(window.value)


def _times(torque: Channel, used: list[Channel]) -> tuple[Array, float]:
    """Return the torque's own stamps where every channel overlaps, or a uniform grid near them."""
    rate_hz = torque.rate_hz
    start_s = max(float(channel.time_s[0]) for channel in used) - SAME_TIME / rate_hz
    stop_s = min(float(channel.time_s[-1]) for channel in used) + SAME_TIME / rate_hz
    first, last = np.searchsorted(torque.time_s, [start_s, stop_s])
    own = torque.time_s[first:last]
    if own.size > 1:
        even = own[0] + np.arange(own.size) * ((own[-1] - own[0]) / (own.size - 1))
        if np.max(np.abs(own - even)) < SAME_TIME / rate_hz:
            return own, (own.size - 1) / float(own[-1] - own[0])
    return uniform_grid(used, rate_hz), rate_hz
