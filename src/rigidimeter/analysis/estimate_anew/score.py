"""One score test: does the torque follow a column beside those that are fitted?

At every line of every epoch, divided by √S (S the power of the noise),

    y = X p + C q + n,      Z and D instruments of X and C

with X, p what is fitted and C, q what is tested. Sums Σ Re go over lines and epochs:

    D* = D − Z (XᴴZ)⁻¹ XᴴD,    g = Σ Re D*ᴴ y,    T = gᵀ (Σ g_b g_bᵀ)⁻¹ g,    χ² = 2 gᵀ (Σ Re D*ᴴD*)⁻¹ g

Whitened noise has no memory, so the parts g_b of g from blocks of half a second are independent,
whatever their sizes: a subject who pushes now and then is no other case. The probability of so
large a T is

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
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimate_anew.grid import Array, Complex, Grid

BLOCK_S = 0.5
PINELIS = 2 * np.exp(3) / 9
LEAST_DEGREES = 3.0
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
    courses : array, shape (q, t)
        The instruments in time.
    """

    grid: Grid
    instruments: Complex
    columns: Complex
    target: Complex
    courses: Array


class Score(NamedTuple):
    """Probability by chance, χ², coefficients."""

    p: float
    explained: float
    values: Array


class Fitted(NamedTuple):
    """Coefficients, their covariance, degrees of freedom, and G⁻¹."""

    values: Array
    covariance: Array
    degrees: Array
    inverse: Array

    @property
    def half(self) -> Array:
        """Half the 95 % intervals."""
        t: Array = scipy.special.stdtrit(self.degrees, 0.975)
        return np.asarray(t * np.sqrt(np.diag(self.covariance)))


def real(left: Complex, right: Complex) -> Array:
    """Return Σ Re left* right over lines, shape (l, r), of (l, m) and (r, m)."""
    return np.asarray(
        np.ascontiguousarray(left).view(float) @ np.ascontiguousarray(right).view(float).T
    )


@dataclass(frozen=True, eq=False)
class Sums:
    """Products between places of all epochs.

    Attributes
    ----------
    at : dict
        Where a place is.
    cross : array, shape (s, s + 1)
        Σ Re Dᴴ (C, y).
    own : array, shape (s, s)
        Σ Re DᴴD.
    """

    at: dict[Place, int]
    cross: Array
    own: Array

    def rows(self, places: Sequence[Place]) -> NDArray[np.intp]:
        """Return where places are."""
        return np.array([self.at[one] for one in places], dtype=np.intp)


def sums_of(parts: Sequence[Part], places: Sequence[Place]) -> Sums:
    """Return the products between places."""
    unique = list(dict.fromkeys(places))
    column, epoch = np.array(unique, dtype=np.intp).reshape(-1, 2).T
    cross, own = np.zeros((len(unique), len(unique) + 1)), np.zeros((len(unique),) * 2)
    made: dict[int, Array] = {}
    for e, part in enumerate(parts):
        on = np.flatnonzero((epoch == EVERY) | (epoch == e))
        of = column[on]
        if id(part.instruments) not in made:
            made[id(part.instruments)] = real(part.instruments, part.instruments)
        both = np.concatenate([part.columns, part.target[None]])
        found = real(part.instruments, both)
        cross[on[:, None], np.append(on, -1)] += found[of[:, None], np.append(of, -1)]
        own[on[:, None], on] += made[id(part.instruments)][of[:, None], of]
    return Sums({place: i for i, place in enumerate(unique)}, cross, own)


def residuals(parts: Sequence[Part], places: Sequence[Place], values: Array) -> list[Complex]:
    """Return what coefficients of places leave of each epoch's target."""
    found = []
    for e, part in enumerate(parts):
        on = [i for i, (_, epoch) in enumerate(places) if epoch in (EVERY, e)]
        found.append(part.target - values[on] @ part.columns[[places[i][0] for i in on]])
    return found


def blocks(parts: Sequence[Part], left: Sequence[Complex]) -> list[Array]:
    """Return Σ Re D* r of each block of each epoch, shape (b, q) each."""
    found = []
    for part, residual in zip(parts, left, strict=True):
        course = part.grid.in_time(residual)
        count = max(int(part.grid.duration_s / BLOCK_S), 1)
        at = np.arange(count) * course.size // count
        power = part.grid.coarse_window[0] ** 2
        share = np.add.reduceat(power, np.arange(count) * power.size // count)
        each = np.add.reduceat(part.courses * course, at, axis=1).T
        found.append(each[share > EMPTY * share.mean()])
    return found


def of_places(local: Sequence[Array], places: Sequence[Place]) -> Array:
    """Return the blocks of places, shape (blocks of all epochs, s)."""
    column, epoch = np.array(places, dtype=np.intp).reshape(-1, 2).T
    if np.all(epoch == EVERY):
        return np.concatenate(local)[:, column]
    return np.concatenate(
        [one[:, column] * ((epoch == EVERY) | (epoch == e)) for e, one in enumerate(local)]
    )


def solved(sums: Sums, base: Sequence[Place]) -> tuple[Array, Array]:
    """Return the coefficients of a base, and G⁻¹.

    Raises
    ------
    ValueError
        If the base cannot be told apart.
    """
    at = sums.rows(base)
    gram = sums.cross[at[:, None], at]
    size = np.sqrt(np.abs(np.diag(gram))) + 1e-300
    try:
        inverse = np.linalg.inv(gram / np.outer(size, size)) / np.outer(size, size)
    except np.linalg.LinAlgError:
        raise ValueError("the motion does not tell the terms apart") from None
    return inverse @ sums.cross[at, -1], inverse


def fitted(local: Sequence[Array], base: Sequence[Place], values: Array, inverse: Array) -> Fitted:
    """Return coefficients with their uncertainty, from the blocks of what they leave."""
    own = of_places(local, base) @ inverse.T
    count, p = own.shape
    covariance = own.T @ own * (count / max(count - p, 1))
    fourth = np.maximum(np.sum(own**4, axis=0), 1e-300)
    degrees = np.maximum(3 * np.sum(own**2, axis=0) ** 2 / fourth - p, LEAST_DEGREES)
    return Fitted(values, covariance, degrees, inverse)


def score(
    sums: Sums, local: Sequence[Array], base: Sequence[Place], tested: Sequence[Place]
) -> Score:
    """Return the score test of places beside a base, whose residual `local` is made of."""
    b, t = sums.rows(base), sums.rows(tested)
    g, size, slope = sums.cross[t, -1], sums.own[t[:, None], t], sums.cross[t[:, None], t]
    own = of_places(local, tested)
    if len(base):
        through = np.linalg.solve(sums.cross[b[:, None], b].T, sums.cross[t[:, None], b].T).T
        g = g - through @ sums.cross[b, -1]
        crossed = through @ sums.own[b[:, None], t]
        size = size - crossed - crossed.T + through @ sums.own[b[:, None], b] @ through.T
        slope = slope - through @ sums.cross[b[:, None], t]
        own = own - of_places(local, base) @ through.T
    scale = np.sqrt(np.abs(np.diag(size))) + 1e-300
    one = g / scale
    if one.size == 1:
        return Score(chance(own / scale), 2 * float(one[0] ** 2), g / slope[0])
    precision = np.linalg.pinv(size / np.outer(scale, scale), rcond=1e-8, hermitian=True)
    values = np.linalg.lstsq(slope / scale[:, None], one, rcond=1e-12)[0]
    return Score(chance(own / scale), 2 * float(one @ precision @ one), values)


def explained(
    instruments: Sequence[Complex],
    parts: Sequence[Part],
    base: Sequence[Place],
    left: Sequence[Complex],
) -> Array:
    """Return χ² of each of many single instruments, shape (k, m) an epoch, beside a base."""
    b = [column for column, epoch in base if epoch == EVERY]
    names = ("score", "size", "cross", "own", "gram", "within")
    total: dict[str, Array] = dict.fromkeys(names, np.zeros(()))
    for D, part, residual in zip(instruments, parts, left, strict=True):
        Z, X = part.instruments[b], part.columns[b]
        found = (
            real(D, residual[None])[:, 0], np.sum(np.abs(D) ** 2, axis=1),
            real(D, X), real(D, Z), real(Z, X), real(Z, Z),
        )  # fmt: skip
        total = {name: total[name] + one for name, one in zip(names, found, strict=True)}
    size = total["size"]
    if b:
        through = np.linalg.solve(total["gram"].T, total["cross"].T).T
        size = size - 2 * np.sum(through * total["own"], axis=1)
        size = size + np.sum(through @ total["within"] * through, axis=1)
    return np.asarray(2 * total["score"] ** 2 / size)


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


class FreeFilter(NamedTuple):
    """All that a free linear filter can make of a motion, in stretches of lines.

    Attributes
    ----------
    edges : list of (int, int)
    bases : list of complex array, shape (lines, 3)
        Orthonormal.
    """

    edges: list[tuple[int, int]]
    bases: list[Complex]

    def without(self, lines: Complex) -> Complex:
        """Return what it cannot make of lines, shape (..., m)."""
        found = lines.copy()
        for (first, last), basis in zip(self.edges, self.bases, strict=True):
            part = lines[..., first:last]
            found[..., first:last] = part - (part @ basis.conj()) @ basis.T
        return found

    def power(self, left: Complex) -> Array:
        """Return the noise of a torque of which it left so much, shape (m,)."""
        found = np.empty(left.size)
        for first, last in self.edges:
            free = max(last - first - 3, 1)
            found[first:last] = np.sum(np.abs(left[first:last]) ** 2) / free
        return found


def free_filter(grid: Grid, motion: Complex) -> FreeFilter:
    """Return the filter of a motion, shape (m, 3)."""
    count = grid.line.size
    each = max(round(STRETCH_HZ * grid.duration_s), FEWEST_LINES)
    starts = [k * each for k in range(max(count // each, 1))]
    edges = [*zip(starts, [*starts[1:], count], strict=True)]
    scaled = motion / np.linalg.norm(motion, axis=0)
    return FreeFilter(edges, [np.linalg.qr(scaled[a:b])[0] for a, b in edges])
