"""The noise of an epoch line by line, and what it makes of the parameters.

The residual torque of a fit holds sensor noise and whatever the subject did. Its power over the
lines weights the fit (a line is worth the inverse of its noise), and its own lines give the
covariance: with estimates p = C Σ Re(U_k^H Y_k), U the weighted instruments,

    cov p = c C (½ Σ Re(U_k^H U_k) S_k) C^T

whatever the spectrum S: the spectral form of an estimate consistent under heteroscedastic and
autocorrelated errors (Newey and West 1987; Andrews 1991, the smoothed periodogram in place of a
lag window). How many independent lines stand behind it gives the degrees of freedom of Student's t
(Satterthwaite 1946): a stiffness that rests on three lines has a wide interval.

Three things make that too small in an epoch of few lines, and each is known without a simulation.

The window. Neighbouring lines share noise and signal; c = n Σ w⁴ / (Σ w²)² (`window.repetition`).

The residual. The fit has taken noise out of the lines that decide it: what is left of e is
e − Φ C Σ Re(U^H e), so the power at a line is S times (`share_left`)

    1 − c (Re(Φ_k C U_k^H) − Φ_k cov p Φ_k^H / (c S_k))

with weights 1/S one less half the leverage (MacKinnon and White 1985; a line has two degrees).

The weights. U = Z/Ŝ, and Ŝ is the mean of |r|² over n_k lines, r of the same fit: a line that
happens to be quiet counts more, and then agrees. The solution is that of Σ Re(Z^H r)/Ŝ = 0, whose
slope is not −G = −C⁻¹ but −(G − D), since Ŝ moves with p too (Huber 1967; for variances Kackar and
Harville 1984). With F_k = Re(U_k^H Φ_k) and F̄_k the mean of S F over the same lines, over S_k,

    E D = c Σ_k (F_k / n_k − F_k C F̄_k)

and (G − D)⁻¹ stands for C. Where all lines have one weight D is 0; where each has its own n_k, the
variance is 1/(1 − 1/n_k)² times as large.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.closedloop.grid import Grid
from rigidimeter.analysis.estimation.signals import Array

Complex = NDArray[np.complex128]

ENOUGH_LINES = 9
"""How many lines, over epochs and neighbours, the power of the noise is averaged over at least."""

NEIGHBOURS = 0.1
"""And over neighbours within this fraction of a line's own number."""


@dataclass(frozen=True)
class Smoother:
    """Running mean over neighbouring lines, wider where the lines are high.

    Voluntary torque has its edges at low frequency, where lines are few and matter most; above,
    the spectrum is smooth on a logarithmic scale.

    Attributes
    ----------
    start, stop : array of int, shape (m,)
        The lines that are averaged for each line.
    """

    start: NDArray[np.intp]
    stop: NDArray[np.intp]

    @classmethod
    def over(cls, lines: NDArray[np.intp], least: int, fraction: float) -> Smoother:
        """Average `least` lines in a row to each side or more, and this fraction of their own."""
        return _smoother(int(lines[0]), lines.size, least, fraction)

    @property
    def count(self) -> NDArray[np.intp]:
        """How many lines are averaged for each, shape (m,)."""
        return self.stop - self.start

    def __call__(self, power: Array) -> Array:
        """Return the smoothed power, shape (m,) or (m, q) as given."""
        total = np.zeros((len(power) + 1, *power.shape[1:]))
        np.cumsum(power, axis=0, out=total[1:])
        count = self.count if power.ndim == 1 else self.count[:, None]
        return np.asarray((total[self.stop] - total[self.start]) / count, dtype=np.float64)

    def adjoint(self, weight: Array) -> Array:
        """Return how much each raw line counts in weighted sums of smoothed ones, shape (m, p)."""
        share = weight / self.count[:, None]
        total = np.zeros((len(share) + 1, share.shape[1]))
        np.cumsum(share, axis=0, out=total[1:])
        first, last = self._among
        return total[last] - total[first]

    @cached_property
    def _among(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """From and to which line each line is averaged in."""
        # Both ends of the lines that are averaged rise, so those with a line among them are a row.
        line = np.arange(self.start.size)
        first = np.searchsorted(self.stop, line, side="right")
        return first, np.searchsorted(self.start, line, side="right")


@lru_cache(maxsize=64)
def _smoother(first: int, count: int, least: int, fraction: float) -> Smoother:
    """Return `Smoother.over` lines from the first on, which epochs of one layout share."""
    place = np.arange(count)
    half = np.maximum(least, np.rint(fraction * (first + place)).astype(np.intp))
    return Smoother(np.maximum(place - half, 0), np.minimum(place + half + 1, count))


def smoother_for(line: NDArray[np.intp], epochs: int) -> Smoother:
    """Return the mean over neighbours that, with that over epochs, takes `ENOUGH_LINES`."""
    return Smoother.over(line, -(-ENOUGH_LINES // epochs) // 2, NEIGHBOURS)


def power_on(wanted: Grid, known: Grid, power: Array) -> Array:
    """Return power on the lines of another epoch; epochs of one layout have the same.

    Noise leaves power in proportion to the energy of the window, so to the length of an epoch.
    """
    if wanted.line is known.line and wanted.energy == known.energy:
        return power
    return np.interp(wanted.omega_rad_s, known.omega_rad_s, power) * (wanted.energy / known.energy)


@dataclass(frozen=True)
class Solved:
    """The linear problem of an epoch, solved: p = C Σ Re(U^H Y).

    Attributes
    ----------
    inverse : array, shape (p, p)
        C, the inverse of Σ Re(U^H Φ) over all epochs that share the parameters.
    weighted : complex array, shape (m, p)
        U, the instruments times the weights.
    regressors : complex array, shape (m, p)
        Φ.
    shape : array, shape (m,)
        What the power of the noise looks like over the lines, up to a factor.
    spread : float
        c, that of the grid.
    """

    inverse: Array
    weighted: Complex
    regressors: Complex
    shape: Array
    spread: float

    def density(self, residual: Complex, smoother: Smoother) -> Array:
        """Return the power of the noise from Y − Φ p, shape (m,).

        The residual is divided by `shape` before smoothing and multiplied after, so that a steep
        spectrum is not smeared (prewhitening, Andrews and Monahan 1992), and by what the fit has
        left in the lines that are averaged: one of their degrees of freedom at least.
        """
        left = np.maximum(smoother(self.share_left()), 0.5 / smoother.count)
        return np.asarray(self.shape * smoother(np.abs(residual) ** 2 / self.shape) / left)

    def share_left(self) -> Array:
        """Return the power that noise of this shape leaves in the residual, over its own."""
        by_line = _products(self.regressors @ self.inverse, self.weighted)
        by_all = _products(self.regressors @ self._variance(self.shape), self.regressors)
        return np.asarray(1.0 - self.spread * by_line + by_all / self.shape)

    def taken_by_weights(self, smoother: Smoother, epochs: int = 1) -> Array:
        """Return E D, shape (p, p), where `shape` is the smoothed residual of so many epochs.

        Epochs are taken to be alike: the sum of their D is that of the epochs together.
        """
        m, p = self.weighted.shape
        slope = (self.weighted.conj()[:, :, None] * self.regressors[:, None, :]).real
        slope = slope.reshape(m, p * p)
        around = smoother(self.shape[:, None] * slope) / self.shape[:, None]
        pairs = (slope.T @ around).reshape(p, p, p, p)
        own = (slope / smoother.count[:, None]).sum(axis=0).reshape(p, p) / epochs
        return np.asarray(self.spread * (own - np.einsum("ijkl,jk->il", pairs, self.inverse)))

    def covariance(self, density: Array, smoother: Smoother) -> tuple[Array, Array]:
        """Return the covariance of the parameters and their degrees of freedom for Student's t.

        Parameters
        ----------
        density : array, shape (m,)
            Power of the noise.
        smoother : Smoother
            That the power was smoothed with.

        Returns
        -------
        covariance : array, shape (p, p)
        degrees : array, shape (p,)
        """
        # (m, p): each line's share of each variance
        effect = np.abs(self.weighted @ self.inverse.T) ** 2 * self.shape[:, None]
        share = smoother.adjoint(effect) * (density / self.shape)[:, None]
        degrees = 2 * np.sum(share, axis=0) ** 2 / np.sum(share**2, axis=0)
        return self._variance(density), degrees / self.spread

    def _variance(self, density: Array) -> Array:
        middle = 0.5 * ((self.weighted.conj() * density[:, None]).T @ self.weighted).real
        return np.asarray(self.spread * self.inverse @ middle @ self.inverse.T)


def with_weights(inverse: Array, taken: Array) -> Array:
    """Return (G − D)⁻¹ of C and D."""
    return np.asarray(inverse @ np.linalg.inv(np.eye(len(inverse)) - taken @ inverse))


def _products(first: Complex, second: Complex) -> Array:
    """Return Re(a b^H) of each line."""
    return np.asarray(np.sum((first * second.conj()).real, axis=1))
