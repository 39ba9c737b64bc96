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

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.core.records import Channel
from rigidimeter.core.settings import FEWEST_LINES

Array = NDArray[np.float64]
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
        return self._by_parts(values, self.window, derivatives)[0]

    def lines_and_noise(self, values: Array, derivatives: int = 0) -> tuple[Complex, Complex]:
        """Return `lines`, and half the difference of what even and odd samples give.

        That is the spectrum as far below half the rate as the line is above zero: noise alone
        where the motion is slow.
        """
        found, apart = self._by_parts(values, self.window, derivatives, halves=True)
        return found, apart

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
        both = np.stack([velocity, angle])
        both = both - ((both @ (w * w)) / (w @ w))[:, None]
        through = np.stack([w * both[0], slope * both[0], w * both[1]])
        v, turning, found = self.step * scipy.fft.rfft(through)[..., self.line]
        mean = 2 * self.step / self.energy * float(both[0] @ (w * slope))
        return np.stack([1j * self.omega_rad_s * v - turning + mean * self.constant, v, found], 1)

    def in_time(self, lines: Complex) -> Array:
        """Return signals of few samples, shape (..., t).

        The sum of a product of two of them over time is Σ Re(a* b) over the lines.
        """
        n = scipy.fft.next_fast_len(int(POINTS_PER_CYCLE * (int(self.line[-1]) + 1)), real=True)
        spectrum = np.zeros((*lines.shape[:-1], n // 2 + 1), dtype=np.complex128)
        spectrum[..., self.line] = lines
        return np.asarray(scipy.fft.irfft(spectrum, n) * np.sqrt(n / 2))

    def _by_parts(
        self, values: Array, window: Array, derivatives: int, *, halves: bool = False
    ) -> list[Complex]:
        """Return the lines, free of the means of x, x', x'', and half the differences."""
        w, slope, bend = window
        x = values - ((values @ (w * w)) / self.energy)[..., None]
        through = np.stack([part * x for part in window[: derivatives + 1]])
        turn = 1j * self.omega_rad_s
        # The mean of a derivative: ∫ w² x' dt = −∫ (w²)' x dt.
        means = [-2 * (x @ (w * slope)), 2 * (x @ (w * bend + slope * slope))][:derivatives]
        found = []
        for spectra, constant in self._spectra(through, halves):
            lines = [spectra[0]]
            if derivatives > 0:
                lines.append(turn * spectra[0] - spectra[1])
            if derivatives > 1:
                lines.append(turn**2 * spectra[0] - 2 * turn * spectra[1] + spectra[2])
            for own, mean in zip(lines[1:], means, strict=True):
                own -= constant * (mean / self.energy)[..., None]
            found.append(np.stack(lines))
        return found

    def _spectra(self, through: Array, halves: bool) -> list[tuple[Complex, Complex | float]]:
        n, place = through.shape[-1], slice(int(self.line[0]), int(self.line[-1]) + 1)
        whole = scipy.fft.rfft(through)
        found: list[tuple[Complex, Complex | float]] = [(whole[..., place], self.constant)]
        if halves and n % 2 == 0:
            found.append((whole[..., n // 2 - self.line].conj(), 0.0))
        elif halves:
            through = through.copy()
            through[..., 1::2] *= -1
            found.append((scipy.fft.rfft(through)[..., place], 0.0))
        return found

    def part(self, lines: slice) -> Grid:
        """Return the grid with some of its lines in a row."""
        return Grid(
            self.time_s,
            self.rate_hz,
            self.window,
            self.line[lines],
            self.energy,
            self.constant[lines],
            self.spread,
            self.step,
        )


def grid_of(
    channels: Sequence[Channel],
    band_hz: tuple[float, float],
    taper_s: float,
    holes_s: Sequence[tuple[float, float]] = (),
    count: Callable[[int, float], int] | None = None,
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
    count : callable, optional
        From how many samples there are, and their rate, to how many to use, from the end; otherwise
        as many as make a fast FFT, from the start.

    Raises
    ------
    ValueError
        If the band holds too few lines for three parameters.
    """
    time_s, rate_hz = _even_times(channels)
    if count is not None:
        time_s = time_s[time_s.size - count(time_s.size, rate_hz) :]
    elif time_s.size:
        time_s = time_s[: scipy.fft.prev_fast_len(time_s.size, real=True)]
    begin_s = float(time_s[0]) if time_s.size else 0.0
    holes = tuple((round(a - begin_s, 9), round(b - begin_s, 9)) for a, b in holes_s)
    layout = _layout(time_s.size, float(f"{rate_hz:.9g}"), band_hz, taper_s, holes)
    return Grid(time_s, rate_hz, *layout)


def _even_times(channels: Sequence[Channel]) -> tuple[Array, float]:
    first = channels[0]
    rate_hz = first.rate_hz
    near_s = SAME_TIME / rate_hz
    begin_s = max(float(one.time_s[0]) for one in channels)
    end_s = min(float(one.time_s[-1]) for one in channels)
    own = first.time_s[slice(*np.searchsorted(first.time_s, [begin_s - near_s, end_s + near_s]))]
    if own.size > 1:
        even = own[0] + np.arange(own.size) * ((own[-1] - own[0]) / (own.size - 1))
        if np.max(np.abs(own - even)) < near_s:
            return own, (own.size - 1) / float(own[-1] - own[0])
    count = int(np.floor((end_s - begin_s) * rate_hz + 1e-6)) + 1 if end_s >= begin_s else 0
    return np.minimum(begin_s + np.arange(count) / rate_hz, end_s), rate_hz


@lru_cache(maxsize=32)
def _layout(
    n: int, rate_hz: float, band_hz: tuple[float, float], taper_s: float, holes_s: Holes
) -> tuple[Array, NDArray[np.intp], float, Complex, float, int]:
    """Return what does not depend on where an epoch begins."""
    low, high = (edge * n / rate_hz for edge in band_hz)
    line = np.arange(max(int(np.ceil(low - 1e-6)) - 1, 1), int(high + 1e-6) + 1, dtype=np.intp)
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
    """Return w, w', w''."""
    from_start_s = (np.arange(n) + 0.5) / rate_hz
    rising = from_start_s < n / rate_hz / 2
    window = _edge(np.where(rising, from_start_s, n / rate_hz - from_start_s), taper_s, rising)
    at_s = np.arange(n) / rate_hz
    for begin_s, end_s in holes_s:
        away_s = np.maximum(np.maximum(begin_s - at_s, at_s - end_s), 0.0)
        f, df, d2f = _edge(away_s, taper_s, at_s > end_s)
        w, dw, d2w = window
        d2f = np.where(away_s > 0, d2f, 0.0)
        window = np.stack([w * f, dw * f + w * df, d2w * f + 2 * dw * df + w * d2f])
    return window


def _edge(away_s: Array, taper_s: float, rising: NDArray[np.bool_]) -> Array:
    """Return a raised cosine of the distance from an edge, and its derivatives in time."""
    if not taper_s > 0:
        return np.stack([np.ones(away_s.size), np.zeros(away_s.size), np.zeros(away_s.size)])
    turn = np.pi / taper_s
    phase = np.minimum(turn * away_s, np.pi)
    slope = 0.5 * turn * np.sin(phase)
    bend = np.where(phase < np.pi, 0.5 * turn**2 * np.cos(phase), 0.0)
    return np.stack([0.5 - 0.5 * np.cos(phase), np.where(rising, slope, -slope), bend])


@lru_cache(maxsize=8)
def _lowpass(step: int) -> Array:
    return np.asarray(scipy.signal.firwin(2 * REACH * step + 1, 1 / step, window=("kaiser", 8.0)))
