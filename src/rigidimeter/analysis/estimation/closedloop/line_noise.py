"""The noise of an epoch line by line, and what it makes of the parameters.

The residual torque of a fit holds sensor noise and whatever the subject did. Its power over the
lines weights the fit (a line is worth the inverse of its noise), and its own lines give the
covariance: with estimates p = C Σ Re(U_k^H Y_k), U the weighted instruments,

    cov p = C (½ Σ Re(U_k^H U_k) S_k) C^T

whatever the spectrum S: the spectral form of an estimate consistent under heteroscedastic and
autocorrelated errors (Newey and West 1987; Andrews 1991, the smoothed periodogram in place of a
lag window). How many independent lines stand behind it gives the degrees of freedom of Student's t
(Satterthwaite 1946): a stiffness that rests on three lines has a wide interval.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.closedloop.spectral_lines import Grid
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

    def __call__(self, power: Array) -> Array:
        """Return the smoothed power."""
        total = np.concatenate(([0.0], np.cumsum(power)))
        mean = (total[self.stop] - total[self.start]) / (self.stop - self.start)
        return np.asarray(mean, dtype=np.float64)

    def adjoint(self, weight: Array) -> Array:
        """Return how much each raw line counts in weighted sums of smoothed ones, shape (m, p)."""
        share = weight / (self.stop - self.start)[:, None]
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


def line_covariance(
    inverse: Array, weighted: Complex, residual: Complex, smoother: Smoother, shape: Array
) -> tuple[Array, Array]:
    """Return the covariance of the parameters and their degrees of freedom.

    Parameters
    ----------
    inverse : array, shape (p, p)
        C above: the inverse of Σ Re(U^H Φ).
    weighted : complex array, shape (m, p)
        U, the instruments times the weights.
    residual : complex array, shape (m,)
        Y − Φ p.
    smoother : Smoother
        For the power of the residual.
    shape : array, shape (m,)
        What the power looks like over the lines, up to a factor: the residual is divided by it
        before smoothing and multiplied after, so that a steep spectrum is not smeared
        (prewhitening, Andrews and Monahan 1992).

    Returns
    -------
    covariance : array, shape (p, p)
    degrees : array, shape (p,)
        For Student's t, of each parameter.
    """
    power = np.abs(residual) ** 2
    # The fit has taken one degree of freedom a parameter out of two a line.
    p = inverse.shape[0]
    power = power * (2 * power.size / max(2 * power.size - p, 1))
    density = shape * smoother(power / shape)
    middle = 0.5 * ((weighted.conj() * density[:, None]).T @ weighted).real
    covariance = inverse @ middle @ inverse.T
    effect = np.abs(weighted @ inverse.T) ** 2  # (m, p): each line's share of each variance
    share = smoother.adjoint(effect * shape[:, None]) * (density / shape)[:, None]
    degrees = 2 * np.sum(share, axis=0) ** 2 / np.sum(share**2, axis=0)
    return covariance, degrees
