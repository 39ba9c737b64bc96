"""An epoch as spectral lines: Eq. 3 multiplied by smooth functions of time and integrated.

With a window w(t) that begins and ends at zero and the frequencies ω_k = 2π k/T, multiply Eq. 3 by
w(t) e^(−i ω_k t) and integrate. The derivative of the velocity moves to the known window,

    ∫ w e^(−iωt) θ'' dt = iω ∫ w e^(−iωt) θ' dt − ∫ w' e^(−iωt) θ' dt

and once more for the acceleration where the angle alone was measured,

    ∫ w e^(−iωt) θ'' dt = −ω² ∫ w e^(−iωt) θ dt − 2iω ∫ w' e^(−iωt) θ dt + ∫ w'' e^(−iωt) θ dt

so nothing is differentiated. What is left is linear in J, B and K at every line, all signals are
treated alike, and drift and noise outside the band simply are other lines (the modulating
functions of Shinbrot 1957; Pearson and Lee 1985).

The integrals are sums over the samples of the torque, at the stamps of the torque: a torque that
was sampled at a point in time is held against the motion at that point. Where the command is
recorded and explains the velocity, the motion at those points is the motion that the command
causes, plus what the sensors saw beyond it; so neither slow sensors nor the ripple between the
ticks bias the fit (`drive`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.closedloop.between_samples import (
    TorqueFilter,
    driven_behind,
    filtered,
    in_step,
    seen_beyond_samples,
)
from rigidimeter.analysis.estimation.closedloop.drive_motion import since_ticks
from rigidimeter.analysis.estimation.closedloop.epoch_motion import EpochMotion
from rigidimeter.analysis.estimation.signals import (
    Array,
    motion_channels,
    sampled,
    uniform_grid,
    values_at,
)
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
        Which lines of the FFT are used.
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

    @property
    def used_share(self) -> float:
        """The samples that are not left out, of all."""
        return float(np.count_nonzero(self.window) / self.window.size)

    @property
    def band_hz(self) -> tuple[float, float]:
        """The first and the last line."""
        return float(self.omega_rad_s[0] / (2 * np.pi)), float(self.omega_rad_s[-1] / (2 * np.pi))

    def transform(self, values: Array) -> Complex:
        """Return Σ w x e^(−iωt) at the lines, free of the mean of x."""
        return np.asarray(self.transforms(values, 0)[0, 0])

    def transforms(self, values: Array, derivatives: int) -> Complex:
        """Return `transform` of x and of its derivatives, without differentiating it.

        Means go, of derivatives too: ∫ w² x' dt = −∫ (w²)' x dt. Beside each stands half the
        difference of what the even and the odd samples give: the spectrum as far below half the
        rate as the line is above zero, which is noise where the motion is slow.

        Parameters
        ----------
        values : array, shape (n,)
        derivatives : int
            How many, up to 2.

        Returns
        -------
        complex array, shape (derivatives + 1, 2, m)
            x, x', x''; the line, and half the difference.
        """
        w, slope, curvature = self.window, self.window_slope_per_s, self.window_curvature_per_s2
        centred = values - float(np.add.reduce(w**2 * values)) / self.energy
        half, turn = values.size // 2, 1j * self.omega_rad_s

        def lines(window: Array) -> Complex:
            windowed = window * centred
            spectrum = scipy.fft.rfft(windowed)
            if values.size % 2 == 0:
                apart = spectrum[half - self.line].conj()
            else:
                windowed[1::2] *= -1
                apart = scipy.fft.rfft(windowed)[self.line]
            return np.stack([spectrum[self.line], apart])

        def without_mean(derivative: Complex, by_parts: Array) -> Complex:
            mean = float(np.add.reduce(by_parts * centred)) / self.energy
            return np.stack([derivative[0] - mean * self.window_lines, derivative[1]])

        through = lines(w)
        found = [through]
        if derivatives > 0:
            through_slope = lines(slope)
            found.append(without_mean(turn * through - through_slope, -2 * w * slope))
        if derivatives > 1:
            twice = turn**2 * through - 2 * turn * through_slope + lines(curvature)
            found.append(without_mean(twice, 2 * (slope**2 + w * curvature)))
        return np.stack(found)


@dataclass(frozen=True)
class Lines:
    """Torque and motion of one epoch at the lines of its grid.

    Attributes
    ----------
    grid : Grid
    torque_nm : complex array, shape (m,)
    motion : complex array, shape (m, 3)
        Acceleration, velocity and angle.
    noise : complex array, shape (m, 3), or None
        Half the difference of what the even and the odd samples of the motion give, whose noise is
        independent; None where the motion lies between its samples.
    """

    grid: Grid
    torque_nm: Complex
    motion: Complex
    noise: Complex | None = None

    def on(self, grid: Grid) -> Lines:
        """Return the lines of a grid of the same samples within this one."""
        if grid is self.grid:
            return self
        first = int(grid.line[0] - self.grid.line[0])
        part = slice(first, first + grid.line.size)
        noise = None if self.noise is None else self.noise[part]
        return Lines(grid, self.torque_nm[part], self.motion[part], noise)


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
        n = samples(time_s.size, rate_hz)
        time_s = time_s[time_s.size - n :]
    else:
        n = scipy.fft.prev_fast_len(time_s.size, real=True) if time_s.size else 0
        time_s = time_s[:n]
    if n == 0:
        return Grid(time_s, rate_hz, *_layout(n, float(f"{rate_hz:.9g}"), band_hz, taper_s, ()))
    holes = tuple(
        (round(stretch.start_s - float(time_s[0]), 9), round(stretch.stop_s - float(time_s[0]), 9))
        for stretch in epoch.left_out
    )
    return Grid(time_s, rate_hz, *_layout(n, float(f"{rate_hz:.9g}"), band_hz, taper_s, holes))


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


def epoch_lines(
    epoch: Epoch,
    grid: Grid,
    motion: EpochMotion,
    torque_filter: TorqueFilter | None = None,
) -> Lines:
    """Return torque and motion at the lines.

    Parameters
    ----------
    epoch : Epoch
    grid : Grid
        From `epoch_grid` for this epoch or one with the same stamps.
    motion : EpochMotion
        That of the epoch. Where its drive is known, what the command did between the samples is
        taken into account.
    torque_filter : TorqueFilter or None
        That the torque went through; the motion is sent through it too.
    """
    torque = grid.transform(values_at(epoch.channels["torque_nm"], grid.time_s, SAME_TIME))
    angle, velocity = (
        _sampled(epoch.channels.get(name), grid.time_s) for name in ("angle_rad", "velocity_rad_s")
    )
    through = filtered(torque_filter, grid.omega_rad_s)
    at_stamps = [_sampled(one, grid.time_s) is not None for one in motion_channels(epoch)]
    if motion.driven_at is None:
        if angle is not None and all(at_stamps):
            return Lines(grid, torque, *(through * spectra(grid, angle, velocity)))
        between = spectra(grid, *motion.beyond_at(grid.time_s, SAME_TIME))
        return Lines(grid, torque, through * between[0])
    command = motion.driven_at.command
    tick, after_s = since_ticks(command, grid.time_s, 0.0)
    interval_s = 1.0 / command.mean_rate_hz
    if angle is not None and velocity is not None and in_step(tick, after_s, interval_s):
        beyond = seen_beyond_samples(
            motion.driven_at.drive,
            torque_filter,
            grid.omega_rad_s,
            interval_s,
            float(np.mean(after_s)),
        )
        lines, noise = through * spectra(grid, angle, velocity)
        sent = grid.transform(command.values[tick])
        return Lines(grid, torque, lines + beyond * sent[:, None], noise)
    lines = through * spectra(grid, *motion.beyond_at(grid.time_s, SAME_TIME))[0]
    # At the stamps of the torque, and from there like the torque.
    stamped = epoch.channels["torque_nm"]
    for column, part in enumerate(driven_behind(motion.driven_at, torque_filter, stamped)):
        there = Channel(stamped.name, stamped.time_s, part)
        lines[:, column] += grid.transform(values_at(there, grid.time_s, SAME_TIME))
    return Lines(grid, torque, lines)


def spectra(grid: Grid, angle_rad: Array, velocity_rad_s: Array | None) -> Complex:
    """Return acceleration, velocity and angle at the lines, and their noise.

    Parameters
    ----------
    grid : Grid
    angle_rad, velocity_rad_s : array, shape (n,)
        Without a velocity it is that of the angle.

    Returns
    -------
    complex array, shape (2, m, 3)
        Motion, and half the difference of even and odd samples.
    """
    if velocity_rad_s is None:
        columns = grid.transforms(angle_rad, 2)[::-1]
    else:
        columns = np.concatenate(
            [grid.transforms(velocity_rad_s, 1)[::-1], grid.transforms(angle_rad, 0)]
        )
    return np.moveaxis(columns, 0, -1)


def _sampled(channel: Channel | None, time_s: Array) -> Array | None:
    """Return a channel at the times if it was sampled at just these, else None."""
    place = None if channel is None else sampled(channel, time_s, SAME_TIME)
    return None if place is None or channel is None else channel.values[place]


def _times(torque: Channel, used: list[Channel]) -> tuple[Array, float]:
    """Return the torque's own stamps where every channel overlaps, or a uniform grid near them."""
    rate_hz = torque.rate_hz
    start = max(float(channel.time_s[0]) for channel in used)
    stop = min(float(channel.time_s[-1]) for channel in used)
    inside = slice(
        int(np.searchsorted(torque.time_s, start - SAME_TIME / rate_hz)),
        int(np.searchsorted(torque.time_s, stop + SAME_TIME / rate_hz)),
    )
    own = torque.time_s[inside]
    if own.size > 1:
        even = own[0] + np.arange(own.size) * ((own[-1] - own[0]) / (own.size - 1))
        if np.max(np.abs(own - even)) < SAME_TIME / rate_hz:
            return own, (own.size - 1) / float(own[-1] - own[0])
    return uniform_grid(used, rate_hz), rate_hz
