"""Thousands of epochs, a chunk at a time, in memory that does not grow.

The first chunk gives instruments and weights U = Z/S as `refine` finds them. With U held, an epoch
is four FFTs and two small sums,

    A = Re(U^H Φ)      b = Re(U^H Y)      p = A⁻¹ b

and of all epochs so far only ΣA, Σb and the products of A and b are kept: enough for the pooled
estimate and for its covariance from the scatter between the epochs. U need not be perfect for
either: it only follows from the perturbation.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from rigidimeter.dynamics import DriveModel
from rigidimeter.estimation.closedloop.linear_problems import instrumental, least_squares_start
from rigidimeter.estimation.closedloop.observation import Observation, observe
from rigidimeter.estimation.closedloop.refine import fit_pooled
from rigidimeter.estimation.closedloop.spectral_lines import SAME_TIME, Grid
from rigidimeter.estimation.prepared import prepare
from rigidimeter.estimation.signals import Array
from rigidimeter.records import Epoch
from rigidimeter.settings import Settings

Complex = NDArray[np.complex128]

_CHANNELS = ("torque_nm", "angle_rad", "velocity_rad_s")


class EpochStream:
    """Estimate epochs that share perturbation and stamps, as those of the batch simulator do.

    Parameters
    ----------
    first : sequence of Epoch
        Epochs that set instruments and weights, a dozen or more; they are not counted. Torque,
        angle and velocity must have been sampled together.
    settings : Settings

    Raises
    ------
    ValueError
        If the channels were not sampled together, or the epochs cannot be fitted.
    """

    def __init__(self, first: Sequence[Epoch], settings: Settings) -> None:
        prepared = prepare(first, settings)
        observations = [observe(epoch) for epoch in prepared]
        start = least_squares_start(observations)
        fit, problems = fit_pooled(observations, instrumental, start)
        self._epoch, observation = first[0], observations[0]
        self._grid: Grid = observation.lines.grid
        self._offset_s = float(self._grid.time_s[0] - self._epoch.channels["torque_nm"].time_s[0])
        self._stamps_s = self._grid.time_s - self._grid.time_s[0]
        weight = fit.shape.at(observation.lines)
        self._weighted: Complex = problems[0].instruments / weight[:, None]
        self._ratio = self._sampled_ratio(observation, prepared[0].source.drive)
        for epoch in first:
            self._values(epoch)
        self._count = 0
        self._gram = np.zeros((3, 3))
        self._moment = np.zeros(3)
        self._gram_gram = np.zeros((3, 3, 3, 3))
        self._gram_moment = np.zeros((3, 3, 3))
        self._moment_moment = np.zeros((3, 3))

    def estimate(self, epochs: Sequence[Epoch]) -> Array:
        """Return J, B and K of each epoch, shape (epochs, 3), and count them in the pool.

        Raises
        ------
        ValueError
            If an epoch has other stamps than the first.
        """
        torque, angle, velocity = (
            np.stack(values)
            for values in zip(*(self._values(epoch) for epoch in epochs), strict=True)
        )
        Y = self._transform(torque)
        v = self._transform(velocity)
        slope = fft.rfft(self._grid.window_slope_per_s * velocity)[:, self._grid.line]
        mean = self._mean(velocity)[:, None] * (self._grid.window_lines * self._rise)
        acceleration = (self._rise * v - (slope - mean)) * self._ratio
        motion = np.stack([acceleration, v, self._transform(angle)], axis=2)
        adjoint = self._weighted.conj().T
        gram = (adjoint @ motion).real
        moment = (Y @ self._weighted.conj()).real
        self._count += len(epochs)
        self._gram += gram.sum(0)
        self._moment += moment.sum(0)
        self._gram_gram += np.einsum("eij,ekl->ijkl", gram, gram)
        self._gram_moment += np.einsum("eij,ek->ijk", gram, moment)
        self._moment_moment += moment.T @ moment
        return np.asarray(np.linalg.solve(gram, moment[:, :, None])[:, :, 0], dtype=np.float64)

    def pooled(self) -> tuple[Array, Array]:
        """Return J, B and K of all epochs so far, shape (3,), and their covariance (3, 3).

        Raises
        ------
        ValueError
            If fewer than two epochs were estimated.
        """
        if self._count < 2:
            raise ValueError("the scatter between epochs needs at least two of them")
        inverse = np.linalg.inv(self._gram)
        values = inverse @ self._moment
        # Σ (b − A p)(b − A p)ᵀ from the sums of products.
        crossed = np.einsum("ijk,j->ik", self._gram_moment, values)
        squared = np.einsum("ijkl,j,l->ik", self._gram_gram, values, values)
        scatter = self._moment_moment - crossed - crossed.T + squared
        covariance = inverse @ scatter @ inverse.T * (self._count / (self._count - 1))
        return values, covariance

    @property
    def _rise(self) -> Complex:
        return np.asarray(1j * self._grid.omega_rad_s)

    def _sampled_ratio(self, observation: Observation, drive: DriveModel | None) -> Complex:
        if drive is None or "velocity_command_rad_s" not in self._epoch.channels:
            return np.ones(self._grid.line.size, dtype=np.complex128)
        command = self._epoch.channels["velocity_command_rad_s"]
        return drive.sampled_derivative(
            observation.lines.grid.omega_rad_s, 1.0 / command.mean_rate_hz
        )

    def _values(self, epoch: Epoch) -> list[Array]:
        """Return the channels on the grid."""
        start_s = float(epoch.channels["torque_nm"].time_s[0]) + self._offset_s
        values = []
        for name in _CHANNELS:
            channel = epoch.channels[name]
            close_s = SAME_TIME / self._grid.rate_hz
            first = int(np.searchsorted(channel.time_s, start_s - close_s))
            stamps = channel.time_s[first : first + self._stamps_s.size]
            if stamps.size < self._stamps_s.size or not (
                np.max(np.abs(stamps - start_s - self._stamps_s)) < close_s
            ):
                raise ValueError(
                    f"{epoch.name}: {name} has other stamps than the first epoch; a stream needs "
                    "torque, angle and velocity that were sampled together"
                )
            values.append(channel.values[first : first + self._stamps_s.size])
        return values

    def _mean(self, values: Array) -> Array:
        weight = self._grid.window * self._grid.window
        return np.asarray((values * weight).sum(axis=1) / self._grid.energy)

    def _transform(self, values: Array) -> Complex:
        spectrum = fft.rfft(self._grid.window * values)[:, self._grid.line]
        return np.asarray(spectrum - self._mean(values)[:, None] * self._grid.window_lines)
