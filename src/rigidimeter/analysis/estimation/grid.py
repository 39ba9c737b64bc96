"""The samples of an epoch, its window and its spectral lines; derivatives without differentiating.

Multiply Eq. 3 by a window w(t) that begins and ends at zero and by e^(−iωt), and integrate. The
derivative moves to the window, which is known (modulating functions, Shinbrot 1957):

    ∫ w e^(−iωt) x' dt = iω ∫ w e^(−iωt) x dt − ∫ w' e^(−iωt) x dt
    ∫ w e^(−iωt) x'' dt = −ω² ∫ w e^(−iωt) x dt − 2iω ∫ w' e^(−iωt) x dt + ∫ w'' e^(−iωt) x dt

What is left is linear in J, B and K at every line ω = 2πk/T; drift and noise outside the band are
other lines. A factor s(t) that changes slowly is another window, ws.

What is not linear in the motion is made of coarse samples, low-passed alike, five a cycle of the
highest line or more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.signals import uniform_grid
from rigidimeter.analysis.estimation.stretches import Array
from rigidimeter.core.records import Channel
from rigidimeter.core.settings import FEWEST_LINES

Complex = NDArray[np.complex128]
Holes = tuple[tuple[float, float], ...]

SAME_TIME = 0.01
"""Stamps closer than this share of an interval are the same time: clocks are rounded."""

COARSE = 5.0
"""Coarse samples a cycle of the highest line, at least."""

REACH = 4
"""Coarse samples to each side that their low-pass reaches."""

POINTS_PER_CYCLE = 2.2
"""Of the highest line, in `Grid.in_time`."""


@dataclass(frozen=True, eq=False)
class Grid:
    """The samples and lines of an epoch.

    Attributes
    ----------
    time_s : array, shape (n,)
        Even; the stamps of the torque where those are.
    rate_hz : float
    window : array, shape (3, n)
        w, w', w''.
    line : array of int, shape (m,)
        Numbers of the lines used, in a row.
    energy : float
        Σ w²: white noise of unit variance puts this much power into every line.
    constant : complex array, shape (m,)
        The lines of the window itself.
    spread : float
        n Σ w⁴ / (Σ w²)²: the window makes neighbouring lines alike, so that the variance of an
        estimate is larger by this than independent lines would have it (Parseval).
    step : int
        Samples from one coarse sample to the next.
    """

    time_s: Array
    rate_hz: float
    window: Array
    line: NDArray[np.intp]
    energy: float
    constant: Complex
    spread: float
    step: int

    @property
    def duration_s(self) -> float:
        """T, of all samples."""
        return self.time_s.size / self.rate_hz

    @property
    def omega_rad_s(self) -> Array:
        """Angular frequencies of the lines, shape (m,)."""
        return np.asarray(2 * np.pi / self.duration_s * self.line)

    @property
    def band_hz(self) -> tuple[float, float]:
        """The first and the last line."""
        return float(self.line[0] / self.duration_s), float(self.line[-1] / self.duration_s)

    @property
    def samples(self) -> int:
        """How many are not left out."""
        return int(np.count_nonzero(self.window[0]))

    @property
    def coarse_window(self) -> Array:
        """The window at the coarse samples, shape (3, n / step)."""
        return self.window[:, :: self.step]

    @property
    def coarse_time_s(self) -> Array:
        """Times of the coarse samples."""
        return self.time_s[:: self.step]

    def lines(self, values: Array, derivatives: int = 0) -> Complex:
        """Return the lines of x and its derivatives, without their means.

        Parameters
        ----------
        values : array, shape (..., n)
        derivatives : int
            How many, up to 2.

        Returns
        -------
        complex array, shape (derivatives + 1, ..., m)
        """
        w, slope, bend = self.window
        x = values - ((values @ (w * w)) / self.energy)[..., None]
        through = np.stack([part * x for part in self.window[: derivatives + 1]])
        place = slice(int(self.line[0]), int(self.line[-1]) + 1)
        spectra = scipy.fft.rfft(through)[..., place]
        turn, found = 1j * self.omega_rad_s, [spectra[0]]
        if derivatives > 0:
            found.append(turn * spectra[0] - spectra[1])
        if derivatives > 1:
            found.append(turn**2 * spectra[0] - 2 * turn * spectra[1] + spectra[2])
        # The mean of a derivative: ∫ w² x' dt = −∫ (w²)' x dt.
        means = -2 * (x @ (w * slope)), 2 * (x @ (w * bend + slope * slope))
        for own, mean in zip(found[1:], means, strict=False):
            own -= self.constant * (mean / self.energy)[..., None]
        return np.stack(found)

    def coarse(self, values: Array) -> Array:
        """Return low-passed samples, one of `step`, shape (..., n / step)."""
        if self.step == 1:
            return values
        reach = REACH * self.step
        edges = [(0, 0)] * (values.ndim - 1) + [(reach, reach)]
        padded = np.pad(values, edges, mode="edge")
        passed = scipy.signal.upfirdn(_lowpass(self.step), padded, 1, self.step)
        return np.asarray(passed[..., 2 * REACH : 2 * REACH + values.shape[-1] // self.step])

    def coarse_lines(self, values: Array, window: Array | None = None) -> Complex:
        """Return the lines of coarse samples, as `lines` would, shape (..., m).

        Parameters
        ----------
        values : array, shape (..., n / step)
            Free of what the mean of w² x is.
        window : array, shape (n / step,), optional
            Another than w.
        """
        w = self.coarse_window[0]
        through = values - ((values @ (w * w)) / (w @ w))[..., None]
        through = through * (w if window is None else window)
        return np.asarray(self.step * scipy.fft.rfft(through)[..., self.line])

    def coarse_motion(self, velocity: Array, angle: Array) -> Complex:
        """Return the lines of acceleration, velocity and angle of coarse samples, shape (m, 3)."""
        w, slope, _ = self.coarse_window
        v, x = self.coarse_lines(np.stack([velocity, angle]))
        mean = 2 * self.step / self.energy * float(velocity @ (w * slope))
        a = 1j * self.omega_rad_s * v - self.coarse_lines(velocity, slope) + mean * self.constant
        return np.stack([a, v, x], 1)

    def in_time(self, lines: Complex) -> Array:
        """Return signals of few samples, shape (..., t).

        The sum of a product of two of them over time is Σ Re(a* b) over the lines.
        """
        n = scipy.fft.next_fast_len(int(POINTS_PER_CYCLE * (int(self.line[-1]) + 1)), real=True)
        spectrum = np.zeros((*lines.shape[:-1], n // 2 + 1), dtype=np.complex128)
        spectrum[..., self.line] = lines
        return np.asarray(scipy.fft.irfft(spectrum, n) * np.sqrt(n / 2))

    def part(self, lines: slice) -> Grid:
        """Return the grid with some of its lines in a row."""
        return replace(self, line=self.line[lines], constant=self.constant[lines])


def grid_of(
    channels: Sequence[Channel],
    band_hz: tuple[float, float],
    taper_s: float,
    holes_s: Sequence[tuple[float, float]] = (),
    period_s: float | None = None,
) -> Grid:
    """Return the grid at the stamps of the first channel, where all overlap.

    The window rises and falls as a raised cosine over `taper_s`, at holes too. The line below the
    band counts: what is no whole number of periods spreads to its neighbours.

    Parameters
    ----------
    channels : sequence of Channel
    band_hz : (float, float)
    taper_s : float
    holes_s : sequence of (float, float)
        What is left out, on the clock of the channels.
    period_s : float, optional
        As many whole periods as there are, at the end; otherwise as many samples as make a fast
        FFT, from the start.

    Raises
    ------
    ValueError
        If the band holds too few lines for three parameters.
    """
    time_s, rate_hz = _even_times(channels)
    if period_s is not None:
        periods = int(time_s.size / rate_hz / period_s + 1e-6)
        time_s = time_s[time_s.size - round(periods * period_s * rate_hz) :]
    elif time_s.size:
        time_s = time_s[: scipy.fft.prev_fast_len(time_s.size, real=True)]
    begin_s = float(time_s[0]) if time_s.size else 0.0
    holes = tuple((round(a - begin_s, 9), round(b - begin_s, 9)) for a, b in holes_s)
    layout = _layout(time_s.size, float(f"{rate_hz:.9g}"), band_hz, taper_s, holes)
    return Grid(time_s, rate_hz, *layout)


def _even_times(channels: Sequence[Channel]) -> tuple[Array, float]:
    first, rate_hz = channels[0], channels[0].rate_hz
    near_s = SAME_TIME / rate_hz
    begin_s = max(float(one.time_s[0]) for one in channels) - near_s
    end_s = min(float(one.time_s[-1]) for one in channels) + near_s
    own = first.time_s[slice(*np.searchsorted(first.time_s, [begin_s, end_s]))]
    if own.size > 1 and np.max(np.abs(own - np.linspace(own[0], own[-1], own.size))) < near_s:
        return own, (own.size - 1) / float(own[-1] - own[0])
    return uniform_grid(channels, rate_hz), rate_hz


def lines_of(band_hz: tuple[float, float], duration_s: float) -> tuple[int, int]:
    """Return the first line of a band, which is below it, and the one after the last."""
    low, high = (edge * duration_s for edge in band_hz)
    return max(int(np.ceil(low - 1e-6)) - 1, 1), int(high + 1e-6) + 1


@lru_cache(maxsize=32)
def _layout(
    n: int, rate_hz: float, band_hz: tuple[float, float], taper_s: float, holes_s: Holes
) -> tuple[Array, NDArray[np.intp], float, Complex, float, int]:
    """Return what does not depend on where an epoch begins."""
    line = np.arange(*lines_of(band_hz, n / rate_hz), dtype=np.intp)
    if line.size < FEWEST_LINES:
        raise ValueError(
            f"{n / rate_hz:.3g} s hold {line.size} spectral lines from {band_hz[0]:g} to "
            f"{band_hz[1]:g} Hz; at least {FEWEST_LINES} are needed"
        )
    window = _window(n, rate_hz, taper_s, holes_s)
    square = window[0] ** 2
    energy = float(np.sum(square))
    constant = np.asarray(scipy.fft.rfft(window[0])[line], dtype=np.complex128)
    most = max(int(rate_hz / (COARSE * band_hz[1])), 1)
    step = next(one for one in range(most, 0, -1) if n % one == 0)
    for part in (window, line, constant):
        part.setflags(write=False)
    return window, line, energy, constant, float(n * np.sum(square**2) / energy**2), step


def _window(n: int, rate_hz: float, taper_s: float, holes_s: Holes) -> Array:
    """Return w, w', w'': the product of raised cosines of the distance from each hole."""
    at_s, early_s = np.arange(n) / rate_hz, 0.5 / rate_hz
    window = np.stack([np.ones(n), np.zeros(n), np.zeros(n)])
    turn = np.pi / max(taper_s, 1e-3 / rate_hz)
    for begin_s, end_s in [(-np.inf, -early_s), (n / rate_hz - early_s, np.inf), *holes_s]:
        away_s = np.maximum(np.maximum(begin_s - at_s, at_s - end_s), 0.0)
        phase = np.minimum(turn * away_s, np.pi)
        f, df = 0.5 - 0.5 * np.cos(phase), 0.5 * turn * np.sin(phase) * np.sign(at_s - end_s)
        d2f = np.where((away_s > 0) & (phase < np.pi), 0.5 * turn**2 * np.cos(phase), 0.0)
        w, dw, d2w = window
        window = np.stack([w * f, dw * f + w * df, d2w * f + 2 * dw * df + w * d2f])
    return window


@lru_cache(maxsize=8)
def _lowpass(step: int) -> Array:
    return np.asarray(scipy.signal.firwin(2 * REACH * step + 1, 1 / step, window=("kaiser", 8.0)))
