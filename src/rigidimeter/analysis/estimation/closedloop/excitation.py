"""The noise-free response to a perturbation at the lines of an epoch, for any J, B and K.

What does not change with the joint is made once: the spectrum of the command that the perturbation
would cause alone, and the transfer functions of the loop and of the drive at the frequencies of the
FFT. A response at other parameters then costs an inverse FFT and an FFT for each signal.

Where the grid of the epoch lies between the ticks, the signals are taken from the cubic spline
through the ticks. Where ticks and grid are both uniform that spline is a filter (Unser 1999),

    H(z) = Σ_k β(k + f) z^(−k) ÷ Σ_k β(k) z^(−k)      f the part of a tick, β the cubic B-spline

and one more factor of the transfer functions.

A loop that would be unstable with the joint was not the one that moved it: its controller has other
values. The motion is then made without feedback, by admittance and drive alone. That too follows
from the perturbation alone, so it is an instrument.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.closedloop.grid import SAME_TIME, Grid
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.records import Channel
from rigidimeter.model import Loop, Parameters, on_circle

Complex = NDArray[np.complex128]

EVEN = 1e-6
"""Stamps this share of a tick from even are even: a spline is then a filter."""


@dataclass(frozen=True, eq=False)
class Excitation:
    """A perturbation in a loop, seen at the lines of a grid.

    Attributes
    ----------
    command : complex array, shape (f,)
        The command without feedback: admittance times perturbation, at the f frequencies of the
        FFT.
    gain : complex array, shape (3, f)
        The loop gain per J, B and K.
    motion : complex array, shape (3, f)
        Acceleration, velocity and angle per command, as they come to the first sample of the grid.
    size : int
        Ticks of the FFT.
    stride : int
        Ticks from one sample of the grid to the next.
    weight : array, shape (n,)
        The window, with the damping of the FFT taken away.
    grid : Grid
    ticks_s, raising : arrays, shape (l,), or None
        Stamps of the ticks, and what takes the damping away there, where a spline through them has
        to be evaluated.
    """

    command: Complex
    gain: Complex
    motion: Complex
    size: int
    stride: int
    weight: Array
    grid: Grid
    ticks_s: Array | None = None
    raising: Array | None = None

    def motion_lines(self, parameters: Parameters) -> Complex:
        """Return acceleration, velocity and angle that the perturbation causes, shape (m, 3)."""
        grid, found = self.grid, []
        for signal in self._signals(parameters):
            mean = signal @ grid.window / grid.energy
            found.append(scipy.fft.rfft(signal)[grid.line] - mean * grid.window_lines)
        return np.stack(found, axis=1)

    def windowed_motion(self, parameters: Parameters) -> Array:
        """Return the motion that the perturbation causes, times the window, shape (3, n)."""
        return np.stack(list(self._signals(parameters)))

    def _signals(self, parameters: Parameters) -> Iterator[Array]:
        """Yield the windowed motion, one signal after the other: less memory is filled at once."""
        J, B, K = parameters
        around = 1 + (J * self.gain[0] + B * self.gain[1] + K * self.gain[2])
        command = self.command if _unstable(around) else self.command / around
        # The inverse FFT gives only the samples that are wanted, where their number allows it.
        folds = self.stride if self.stride % 2 == 0 and self.size % (2 * self.stride) == 0 else 1
        for motion in self.motion:
            signal = scipy.fft.irfft(_folded(motion * command, folds), self.size // folds)
            if self.ticks_s is not None and self.raising is not None:
                raised = signal[: self.raising.size] * self.raising
                signal = scipy.interpolate.CubicSpline(self.ticks_s, raised)(self.grid.time_s)
            yield signal[:: self.stride // folds][: self.weight.size] * self.weight


def excitation(perturbation: Channel, loop: Loop, grid: Grid) -> Excitation:
    """Return what of the response to a perturbation does not change with the joint.

    Parameters
    ----------
    perturbation : Channel
        One value a tick.
    loop : Loop
    grid : Grid
        Within the ticks.
    """
    rate_hz, n = perturbation.mean_rate_hz, len(perturbation)
    circle = on_circle(loop, n, rate_hz, 1)
    opened, size = circle.loop, circle.length
    command = circle.to(perturbation.values) * opened.admittance
    gain, motion = opened.forward * opened.read, opened.sensed
    steps = _steps(perturbation, grid)
    if steps is None:
        raising = 1 / circle.damping
        return Excitation(
            command, gain, motion, size, 1, grid.window, grid, perturbation.time_s, raising
        )
    first, part, stride = steps
    # To the first sample of the grid, by whole ticks and then by a part of one.
    motion = motion * np.exp(2j * np.pi * first / size * np.arange(circle.z.size))
    if part != 0:
        motion *= _spline_response(circle.z, part)
    weight = grid.window / circle.damping[first : first + stride * grid.time_s.size : stride]
    return Excitation(command, gain, motion, size, stride, weight, grid)


def _steps(ticks: Channel, grid: Grid) -> tuple[int, float, int] | None:
    """Return the tick before the grid, the part of a tick between them, and the ticks a sample.

    None where that is not the same throughout.
    """
    rate_hz = ticks.mean_rate_hz
    place = (grid.time_s - ticks.time_s[0]) * rate_hz
    nearest = np.clip(np.rint(place).astype(np.intp), 0, len(ticks) - 1)
    if np.max(np.abs(ticks.time_s[nearest] - grid.time_s)) < SAME_TIME / rate_hz:
        index, part = nearest, 0.0
    else:
        even = np.max(np.abs(ticks.time_s - ticks.time_s[0]) * rate_hz - np.arange(len(ticks)))
        index = np.floor(place + EVEN).astype(np.intp)
        parts = place - index
        if even > EVEN or np.ptp(parts) > EVEN or not 0 <= place[0] <= place[-1] <= len(ticks) - 1:
            return None
        part = float(np.mean(parts))
    stride = int(index[1] - index[0])
    if stride < 1 or np.any(np.diff(index) != stride):
        return None
    return int(index[0]), part, stride


def _unstable(around: Complex) -> bool:
    """Return whether 1 + L, on the upper half of the circle, has zeros outside (Nyquist).

    L has no poles there, so each zero turns the phase by −2π around the circle.
    """
    turned = np.sum(np.angle(around[1:] * around[:-1].conj()))
    return bool(turned < -0.5 * np.pi)


def _folded(spectrum: Complex, times: int) -> Complex:
    """Return the half spectrum of every `times`-th sample: the aliases of each line, added."""
    if times == 1:
        return spectrum
    kept = 2 * (spectrum.size - 1) // times
    blocks = spectrum[:-1].reshape(times // 2, kept)
    folded = blocks[:, : kept // 2 + 1].sum(axis=0)
    # The other half of the spectrum is the first one's mirror image.
    folded[1:] += blocks[:, kept // 2 :].sum(axis=0)[::-1].conj()
    folded[0] += (blocks[1:, 0].sum() + spectrum[-1]).conj()
    return np.asarray(folded / times)


def _spline_response(z: Complex, part: float) -> Complex:
    """Return the cubic spline's response at a part of a tick after each tick."""
    rest = 1 - part
    weights = (
        rest**3 / 6,
        2 / 3 - part**2 + part**3 / 2,
        2 / 3 - rest**2 + rest**3 / 2,
        part**3 / 6,
    )
    between = weights[0] / z + weights[1] + weights[2] * z + weights[3] * z * z
    return np.asarray(6 * between / (z + 4 + 1 / z), dtype=np.complex128)
