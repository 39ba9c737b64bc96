"""An epoch as the tests of a joint that varies see it: lines, instruments, and the way to time.

A parameter that varies multiplies the motion by a slow function of time, so the tests go from lines
to time, multiply, and come back. The lines of the band are few, and a time grid as coarse as they
allow holds all of them. Below the band the motion is kept down to the first line: multiplied by a
slow function it comes into the band.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.closedloop.grid import Grid
from rigidimeter.analysis.estimation.closedloop.linear_problems import LEAST
from rigidimeter.analysis.estimation.closedloop.normal_equations import Problem
from rigidimeter.analysis.estimation.closedloop.observe import observe, observe_motion
from rigidimeter.analysis.estimation.closedloop.recorded_perturbation import closed_loop_obstacle
from rigidimeter.analysis.estimation.closedloop.refine import shared_powers
from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.records import Epoch

Complex = NDArray[np.complex128]

POINTS_PER_CYCLE = 2.2
"""Of the highest line, on the coarse time grid."""


@dataclass(frozen=True, eq=False)
class VaryingLines:
    """One epoch, ready to be tested.

    Attributes
    ----------
    grid : Grid
        Of the band that is fitted.
    torque_nm : complex array, shape (m,)
        At the m lines of the band.
    motion, instruments : complex arrays, shape (l, 3)
        Acceleration, velocity and angle at the lines from the first of the record to the last of
        the band. The instruments are what the perturbation alone causes, or the motion itself.
    weight : array, shape (m,)
        One over the amplitude of the noise.
    angle_rad : array, shape (n,)
        On the coarse time grid, without the window, about its mean.
    by_perturbation : bool
        Whether the perturbation is the instrument.
    """

    grid: Grid
    torque_nm: Complex
    motion: Complex
    instruments: Complex
    weight: Array
    angle_rad: Array
    by_perturbation: bool

    @cached_property
    def duration_s(self) -> float:
        """How long the window is."""
        return self.grid.time_s.size / self.grid.rate_hz

    @cached_property
    def time_s(self) -> Array:
        """The coarse time grid, from the beginning of the window, shape (n,)."""
        n = self.angle_rad.size
        return np.asarray(np.arange(n) * (self.duration_s / n), dtype=np.float64)

    @cached_property
    def window(self) -> Array:
        """The window on the coarse time grid."""
        return np.interp(self.time_s, self.grid.time_s - self.grid.time_s[0], self.grid.window)

    def in_time(self, lines: Complex) -> Array:
        """Return the signals with these lines, which end with the last of the band."""
        n = self.angle_rad.size
        spectrum = np.zeros((n // 2 + 1, *lines.shape[1:]), dtype=np.complex128)
        last = int(self.grid.line[-1]) + 1
        spectrum[last - lines.shape[0] : last] = lines
        return np.asarray(scipy.fft.irfft(spectrum, n, axis=0))

    def whitened(self, lines: Complex) -> Array:
        """Return lines of the band over the noise, real parts above imaginary ones."""
        weighted = lines * (self.weight if lines.ndim == 1 else self.weight[:, None])
        return np.concatenate([weighted.real, weighted.imag])

    def in_band(self, signals: Array) -> Complex:
        """Return the lines of the band of signals on the coarse time grid, shape (n, c)."""
        spectrum = scipy.fft.rfft(signals, axis=0)
        return np.asarray(spectrum[int(self.grid.line[0]) : int(self.grid.line[-1]) + 1])

    def slow_part(self, signal: Array, below_hz: float) -> Array:
        """Return what of a signal on the coarse time grid is slower, without phase."""
        n = signal.size
        spectrum = scipy.fft.rfft(signal)
        frequency = np.arange(spectrum.size) / self.duration_s
        return np.asarray(scipy.fft.irfft(spectrum * np.exp(-0.5 * (frequency / below_hz) ** 2), n))


def varying_lines(prepared: PreparedEpoch, parameters: Array) -> VaryingLines:
    """Return an epoch ready to be tested.

    Parameters
    ----------
    prepared : PreparedEpoch
    parameters : array, shape (3,)
        J, B and K of the epoch's fit: what the instruments are simulated with and what the noise
        is found by.

    Raises
    ------
    ValueError
        If the epoch cannot be observed; the text says why.
    """
    observation = prepared.once(observe_motion if closed_loop_obstacle(prepared.epoch) else observe)
    grid = observation.grid
    n = scipy.fft.next_fast_len(int(POINTS_PER_CYCLE * (grid.line[-1] + 1)), real=True)
    time_s = grid.time_s[0] + np.arange(n) * (grid.time_s.size / grid.rate_hz / n)
    angle, velocity = _coarse_motion(prepared.epoch, time_s)
    wide = _from_first_line(grid)
    below = int(grid.line[0]) - 1
    torque, motion = observation.torque_nm, observation.motion
    (noise,) = shared_powers([Problem(motion, motion, torque, observation)], parameters)
    motion = np.concatenate([_low_motion(grid, wide.omega_rad_s[:below], angle, velocity), motion])
    instruments = motion
    if observation.excitation is not None:
        J, B, K = np.maximum(parameters, LEAST).tolist()
        instruments = replace(observation.excitation, grid=wide).motion_lines((J, B, K))
    return VaryingLines(
        grid,
        torque,
        motion,
        instruments,
        1 / np.sqrt(noise),
        angle - float(np.mean(angle)),
        observation.excitation is not None,
    )


def _from_first_line(grid: Grid) -> Grid:
    line = np.arange(1, int(grid.line[-1]) + 1, dtype=np.intp)
    step_rad_s = float(grid.omega_rad_s[0]) / int(grid.line[0])
    return replace(
        grid,
        line=line,
        omega_rad_s=np.asarray(step_rad_s * line, dtype=np.float64),
        window_lines=np.asarray(scipy.fft.rfft(grid.window)[line]),
    )


def _coarse_motion(epoch: Epoch, time_s: Array) -> tuple[Array, Array]:
    """Return angle and velocity at the times; what was not recorded, from the other."""
    step_s = float(time_s[1] - time_s[0])
    angle, velocity = (
        None if channel is None else np.interp(time_s, channel.time_s, channel.values)
        for channel in map(epoch.channels.get, ("angle_rad", "velocity_rad_s"))
    )
    if angle is None:
        assert velocity is not None  # an epoch without motion is not observed
        return np.cumsum(velocity) * step_s, velocity
    return angle, np.gradient(angle, step_s) if velocity is None else velocity


def _low_motion(grid: Grid, omega_rad_s: Array, angle_rad: Array, velocity_rad_s: Array) -> Complex:
    """Return acceleration, velocity and angle at the lines below the band, shape (k, 3)."""
    n, place = angle_rad.size, np.arange(angle_rad.size) * (grid.time_s.size / angle_rad.size)
    window, slope = (
        np.interp(place, np.arange(grid.time_s.size), part)
        for part in (grid.window, grid.window_slope_per_s)
    )
    signals = np.stack([angle_rad, velocity_rad_s])
    centred = signals - np.sum(window**2 * signals, axis=1, keepdims=True) / np.sum(window**2)
    below = slice(1, omega_rad_s.size + 1)
    angle, velocity = (scipy.fft.rfft(window * centred, axis=1) * (grid.time_s.size / n))[:, below]
    turning = scipy.fft.rfft(slope * centred[1])[below] * (grid.time_s.size / n)
    return np.stack([1j * omega_rad_s * velocity - turning, velocity, angle], axis=1)
