"""One score test: whether the torque follows a column beside those that are fitted.

At every line of every epoch, divided by √S (S the power of the noise),

    y = X p + C q + n,      Z and D instruments of X and C

with X, p what is fitted and C, q what is tested. Sums Σ Re go over lines and epochs:

    D* = D − Z (XᴴZ)⁻¹ XᴴD,    g = Σ Re D*ᴴ y
    T = gᵀ (Σ g_b g_bᵀ)⁻¹ g,    χ² = 2 gᵀ (Σ Re D*ᴴD*)⁻¹ g

Whitened noise has no memory, so the parts g_b of g from blocks of a quarter of a second are
independent, whatever their sizes: a subject who pushes now and then is no other case. The
probability of so large a T is

    p = max(2^(1−n), 4.46 min(P(χ²_q > T), P(Beta(q/2, (n−q)/2) > T/n)))

The first is a bound that needs nothing but blocks whose signs are chance (Pinelis 1994,
2e³/9 = 4.46), the second is exact for n Gaussian blocks of one size. Coefficients have the
covariance G⁻¹ (Σ g_b g_bᵀ) G⁻ᵀ n/(n − p) and for each h = G⁻¹ g the degrees of freedom
3 (Σ h_b²)²/Σ h_b⁴ − p (Satterthwaite).

A *place* is (column, epoch): a coefficient that all epochs share, or one of an epoch's own. Whether
K differs between epochs is a test of K of single epochs beside that of all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.estimation.grid import Array, Complex, Grid

BLOCK_S = 0.25
PINELIS = 2 * np.exp(3) / 9
LEAST_DEGREES = 3.0
TINY, ALIKE = 1e-300, 1e-9

EVERY = -1
"""The epoch of a place that is all epochs'."""

EMPTY = 0.05
"""Blocks with less than this share of the mean power of the window are left out."""

STRETCH_HZ, FEWEST_LINES = 1.0, 9
"""A free linear filter has one gain over so much, or so many lines."""

Place = tuple[int, int]


class Part(NamedTuple):
    """One epoch, whitened.

    Attributes
    ----------
    grid : Grid
    instruments, columns : complex array, shape (q, m)
        D and C; the first three are those of acceleration, velocity and angle.
    target : complex array, shape (m,)
    """

    grid: Grid
    instruments: Complex
    columns: Complex
    target: Complex


class Score(NamedTuple):
    """Probability by chance, χ², coefficients."""

    p: float
    explained: float
    values: Array


def real(left: Complex | Array, right: Complex | Array) -> Array:
    """Return Σ Re left* right over lines, shape (l, r), of (l, m) and (r, m)."""
    first, second = (np.ascontiguousarray(one).view(np.float64) for one in (left, right))
    return np.asarray(first @ second.T)


@dataclass(frozen=True, eq=False)
class Fitted:
    """What was fitted at the places of a base, and products with those of what may be tested.

    Attributes
    ----------
    parts : sequence of Part
    base : sequence of Place
    at : dict
        Where a place is in the products.
    cross : array, shape (s, s + 1)
        Σ Re Dᴴ (C, y).
    own : array, shape (s, s)
        Σ Re DᴴD.
    values : array, shape (b,)
    inverse : array, shape (b, b)
        G⁻¹.
    left : list of complex array
        What each epoch's target has left.
    """

    parts: Sequence[Part]
    base: Sequence[Place]
    at: dict[Place, int]
    cross: Array
    own: Array
    values: Array
    inverse: Array
    left: list[Complex]

    def blocks(self) -> list[Array]:
        """Return Σ Re D* r of each block of each epoch, shape (b, q) each."""
        found, made = [], dict[int, Array]()
        for part, left in zip(self.parts, self.left, strict=True):
            key = id(part.instruments)
            made[key] = made[key] if key in made else part.grid.in_time(part.instruments)
            course, power = part.grid.in_time(left), part.grid.coarse_window[0] ** 2
            count = np.arange(max(int(part.grid.duration_s / BLOCK_S), 1))
            share = np.add.reduceat(power, count * power.size // count.size)
            at = count * course.size // count.size
            each = np.add.reduceat(made[key] * course, at, axis=1).T
            found.append(each[share > EMPTY * share.mean()])
        return found

    def uncertain(self, blocks: Sequence[Array]) -> tuple[Array, Array]:
        """Return the covariance of the coefficients, and half their 95 % intervals."""
        own = _of_places(blocks, self.base) @ self.inverse.T
        count, p = own.shape
        covariance = own.T @ own * (count / max(count - p, 1))
        fourth = np.maximum(np.sum(own**4, axis=0), TINY)
        degrees = np.maximum(3 * np.sum(own**2, axis=0) ** 2 / fourth - p, LEAST_DEGREES)
        t = scipy.special.stdtrit(degrees, 0.975)
        return covariance, np.asarray(t * np.sqrt(np.diag(covariance)))

    def score(self, blocks: Sequence[Array], tested: Sequence[Place]) -> Score:
        """Return the score test of places beside the base."""
        b, t = ([self.at[one] for one in places] for places in (self.base, tested))
        cross, own = self.cross[t], _of_places(blocks, tested)
        through = cross[:, b] @ self.inverse
        g: Array = cross[:, -1] - through @ self.cross[b, -1]
        crossed = through @ self.own[np.ix_(b, t)]
        size = self.own[np.ix_(t, t)] - crossed - crossed.T
        size = size + through @ self.own[np.ix_(b, b)] @ through.T
        slope = cross[:, t] - through @ self.cross[np.ix_(b, t)]
        if b:
            own = own - _of_places(blocks, self.base) @ through.T
        scale = np.sqrt(np.abs(np.diag(size))) + TINY
        one = g / scale
        if one.size == 1:
            return Score(chance(own / scale), 2 * float(one[0] ** 2), g / float(slope[0, 0]))
        values = np.asarray(np.linalg.lstsq(slope / scale[:, None], one, rcond=1e-12)[0], float)
        return Score(chance(own / scale), quadratic(g, size), values)


def quadratic(g: Array, size: Array) -> float:
    """Return χ² of a score g, 2 gᵀ size⁻¹ g, where columns may be alike."""
    scale = np.sqrt(np.abs(np.diag(size))) + TINY
    precision = np.linalg.pinv(size / np.outer(scale, scale), rcond=1e-8, hermitian=True)
    return 2 * float((g / scale) @ precision @ (g / scale))


def fitted(parts: Sequence[Part], base: Sequence[Place], tested: Sequence[Place] = ()) -> Fitted:
    """Fit the places of a base; products are made with those that are tested, too.

    Raises
    ------
    ValueError
        If the base cannot be told apart.
    """
    places = list(dict.fromkeys([*base, *tested]))
    column, epoch = np.array(places, dtype=np.intp).reshape(-1, 2).T
    cross, own = np.zeros((len(places), len(places) + 1)), np.zeros((len(places),) * 2)
    made: dict[int, Array] = {}
    for e, part in enumerate(parts):
        on = np.flatnonzero((epoch == EVERY) | (epoch == e))
        of, key = column[on], id(part.instruments)
        made[key] = made[key] if key in made else real(part.instruments, part.instruments)
        found = real(part.instruments, np.concatenate([part.columns, part.target[None]]))
        cross[on[:, None], np.append(on, -1)] += found[of[:, None], np.append(of, -1)]
        own[on[:, None], on] += made[key][of[:, None], of]
    b = len(base)
    size = np.sqrt(np.abs(np.diag(cross[:b, :b]))) + TINY
    try:
        inverse = np.linalg.inv(cross[:b, :b] / np.outer(size, size)) / np.outer(size, size)
    except np.linalg.LinAlgError:
        raise ValueError("the motion does not tell the terms apart") from None
    values, left = inverse @ cross[:b, -1], []
    for e, part in enumerate(parts):
        on = np.flatnonzero((epoch[:b] == EVERY) | (epoch[:b] == e))
        left.append(part.target - values[on] @ part.columns[column[on]])
    at = {place: i for i, place in enumerate(places)}
    return Fitted(parts, base, at, cross, own, values, inverse, left)


def _of_places(blocks: Sequence[Array], places: Sequence[Place]) -> Array:
    """Return the blocks of places, shape (blocks of all epochs, s)."""
    column, epoch = np.array(places, dtype=np.intp).reshape(-1, 2).T
    on = [(epoch == EVERY) | (epoch == e) for e in range(len(blocks))]
    return np.concatenate([one[:, column] * own for one, own in zip(blocks, on, strict=True)])


def explained(instruments: Sequence[Complex], fit: Fitted) -> Array:
    """Return χ² beside a base of each of many single instruments, shape (k, m) an epoch.

    It has the sign of the coefficient.
    """
    b = [column for column, epoch in fit.base if epoch == EVERY]
    total = [np.zeros(()) for _ in range(6)]
    for D, part, left in zip(instruments, fit.parts, fit.left, strict=True):
        Z, X = part.instruments[b], part.columns[b]
        pairs = (D, left[None]), (D, X), (D, Z), (Z, X), (Z, Z)
        found = [*(real(*pair) for pair in pairs), np.sum(np.abs(D) ** 2, axis=1)]
        total = [np.asarray(one + more) for one, more in zip(total, found, strict=True)]
    g, cross, own, gram, within, size = total
    through = cross @ np.linalg.inv(gram)
    beside = size - 2 * np.sum(through * own, axis=1) + np.sum(through @ within * through, axis=1)
    return np.asarray(2 * g[:, 0] * np.abs(g[:, 0]) / np.maximum(beside, ALIKE * size + TINY))


def chance(of_blocks: Array) -> float:
    """Return the probability of a sum as far from zero if only signs of blocks are chance."""
    of_blocks = of_blocks[np.any(of_blocks != 0.0, axis=1)]
    n, q = of_blocks.shape
    if n <= q:
        return 1.0
    g = of_blocks.sum(axis=0)
    T = float(g @ np.linalg.pinv(of_blocks.T @ of_blocks, rcond=1e-10, hermitian=True) @ g)
    normal = scipy.special.chdtrc(q, T)
    even = scipy.special.betainc((n - q) / 2, q / 2, max(1 - T / n, 0.0))
    return float(min(1.0, max(2.0 ** (1 - n), PINELIS * min(normal, even))))


def holm(p: Sequence[float]) -> list[float]:
    """Return probabilities adjusted for their number (Holm 1979)."""
    worst, adjusted = 0.0, [0.0] * len(p)
    for rank, i in enumerate(np.argsort(p, kind="stable")):
        worst = max(worst, (len(p) - rank) * p[i])
        adjusted[i] = min(worst, 1.0)
    return adjusted


def without_filter(grid: Grid, rows: Complex) -> Complex:
    """Return rows free of what a linear filter of the motion can make, and whitened.

    The first is the torque, the next three are the motion; what the filter, with a gain of its own
    in every stretch of lines, leaves of the torque is the noise.
    """
    found, each = rows.copy(), max(round(STRETCH_HZ * grid.duration_s), FEWEST_LINES)
    edges = [*(k * each for k in range(max(grid.line.size // each, 1))), grid.line.size]
    for first, last in pairwise(edges):
        motion, part = rows[1:4, first:last], rows[:, first:last]
        basis = np.linalg.qr((motion / np.linalg.norm(motion, axis=1)[:, None]).T)[0]
        part = part - (part @ basis.conj()) @ basis.T
        noise = np.sum(np.abs(part[0]) ** 2) / max(last - first - 3, 1)
        found[:, first:last] = part / np.sqrt(noise)
    return found
