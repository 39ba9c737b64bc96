"""What of the torque, and of a term, no linear filter of the motion explains.

In a closed loop the subject's own torque moves the joint, so that any linear function of the
motion, a delayed velocity too, may predict it. A term that is not linear has a part that does not:

    max(v, 0) = v/2 + |v|/2,    E[M_sub |v(t − τ)|] = 0    where signals are symmetric

and for sign v or θ³ the part left by a free linear filter, if the subject's torque is Gaussian.
So torque and term are taken as spectral lines, and in every stretch of about 1 Hz the angle, the
velocity and the acceleration are projected out of both with free complex gains: a linear filter
with a memory of about a second. What is left of the torque is divided by its own power in the
stretch, so that a coloured residual counts as what it is: where the subject pushes, lines weigh
little. The lines then are independent and of one variance,

    e_k = c z_k + ε_k,    ĉ = Σ Re(z_k* e_k) / Σ |z_k|²,    var ĉ = σ² / (2 Σ |z_k|²)

times Σ w⁴ n / (Σ w²)² for the taper w.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
import scipy

from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.analysis.estimation.terms.catalogue import REFLEXES, term_named
from rigidimeter.analysis.estimation.terms.explained import (
    COLLINEAR,
    Complex,
    Filtered,
    Gains,
    stacked,
)
from rigidimeter.analysis.estimation.terms.reflex import kernel
from rigidimeter.analysis.estimation.window import repetition, tapered_ends

STRETCH_HZ = 1.0
FEWEST_LINES = 9
"""Lines of a stretch, three for each of angle, velocity and acceleration."""

PARTS = (4, 3, 2, 1)
"""Into how many a signal may be split before its spectrum is taken."""

NOTHING = 1e-3
"""A term of which less than this share of the size is left is linear."""


@dataclass(frozen=True)
class Solution:
    """Coefficients of a fit to the lines, shape (p,), their covariance, and what is left."""

    values: Array
    covariance: Array
    residual: Complex


@dataclass(frozen=True, eq=False)
class BeyondLinear:
    """An epoch's torque and terms without what is linear in the motion, white.

    Attributes
    ----------
    motion : Signals
        Wide-band.
    frequency_hz : array, shape (m,)
        Of the lines, as many to each stretch.
    torque : complex array, shape (m,)
        What is left of the torque; the mean of |torque|² is 1.
    torque_lines, linear : complex arrays, shapes (m,) and (m, 3)
        The torque, and acceleration, velocity and angle, as they are.
    """

    motion: Signals
    frequency_hz: Array
    torque: Complex
    torque_lines: Complex
    linear: Complex
    _window: Array
    _first: int
    _basis: Complex
    _size_nm: Array
    _made: dict[Hashable, Complex] = field(default_factory=dict, init=False, repr=False)

    @property
    def line_size_nm(self) -> Array:
        """The size of what is left of the torque, by which each line is divided, shape (m,)."""
        return np.repeat(self._size_nm, self._basis.shape[1])

    @property
    def free_gains(self) -> int:
        """Real numbers that the free filter takes."""
        return int(2 * self._basis.shape[0] * self._basis.shape[2])

    @property
    def free_values(self) -> float:
        """Real numbers that the free filter leaves."""
        return 2 * self.torque.size - self.free_gains

    @cached_property
    def taper_loss(self) -> float:
        """By how much the taper enlarges a variance."""
        return repetition(self._window)

    def columns(self, names: Sequence[str], nonlinear: Sequence[float] = ()) -> Complex:
        """Return what is left of each term, shape (m, p); a column for each linear parameter.

        Parameters
        ----------
        names : sequence of str
        nonlinear : sequence of float
            The parameters inside the reflexes, in the order of the names.
        """
        found: list[tuple[str, tuple[float, ...]]] = []
        used = 0
        for name in names:
            count = len(kernel(name).nonlinear) if name in REFLEXES else 0
            found.append((name, tuple(nonlinear[used : used + count])))
            used += count
        new = [one for one in dict.fromkeys(found) if one not in self._made]
        if new:  # all of them are made white at once
            lines = [self._term(*one) for one in new]
            white = self.white(np.concatenate(lines, axis=1))
            ends = np.cumsum([part.shape[1] for part in lines])
            self._made.update(zip(new, np.split(white, ends[:-1], axis=1), strict=True))
        empty = np.zeros((self.torque.size, 0), dtype=np.complex128)
        return np.concatenate([empty, *(self._made[one] for one in found)], axis=1)

    def term_lines(self, name: str) -> Complex:
        """Return the lines of a term that is no reflex as they are, shape (m, 1)."""
        term = term_named(name)
        assert term is not None  # names are known
        if name not in self._made:
            self._made[name] = self.lines(term.regressor(self.motion))[:, None]
        return self._made[name]

    def reflexes(self, name: str) -> Filtered:
        """Return the lines of a reflex at each point of its grid as they are."""
        (signal,) = self._stretch(name).T
        return Filtered(signal, _gains(kernel(name).kind, *self._span))

    @property
    def _span(self) -> tuple[int, int, float]:
        """The first line, how many there are, and the duration in s that they belong to."""
        duration_s = float(f"{self._window.size / self.motion.rate_hz:.9g}")
        return self._first, self.frequency_hz.size, duration_s

    def _term(self, name: str, inner: tuple[float, ...]) -> Complex:
        if name not in REFLEXES:
            return self.term_lines(name)
        # Its gains change slowly over a stretch, as the filter that is free there.
        return self._stretch(name) * _gain(kernel(name).kind, inner, *self._span)

    def _stretch(self, name: str) -> Complex:
        """Return the lines of the velocity that stretches, that of the damping of one direction."""
        return self.term_lines(f"damping{name[-1]}")

    def not_linear(self, names: Sequence[str]) -> tuple[str, ...]:
        """Return the terms that are more than a linear filter of the motion."""
        return tuple(name for name in names if name in REFLEXES or self._share(name) > NOTHING)

    def series(self, lines: Complex) -> Array:
        """Return white lines, shape (m, ...), as samples in time, shape (n, ...), tapered ends off.

        Their sum of squares over a piece of time is the piece's share of Σ |lines|².
        """
        last = self._first + self.torque.size
        whole = np.zeros((last + 1, *lines.shape[1:]), dtype=np.complex128)
        whole[self._first : last] = lines
        n = 2 * last
        values = scipy.fft.irfft(whole, n, axis=0) * np.sqrt(n / 2)
        edge = round(n * float(np.mean(self._window < 0.5)) / 2)
        return np.asarray(values[edge : n - edge], dtype=np.float64)

    @property
    def series_rate_hz(self) -> float:
        """Samples of a series per second."""
        duration_s = self._window.size / self.motion.rate_hz
        return 2 * (self._first + self.torque.size) / duration_s

    def solve(self, columns: Complex) -> Solution:
        """Fit columns, shape (m, p), to the torque; collinear ones share their coefficient."""
        rows, target = stacked(columns), stacked(self.torque)
        lengths = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
        # By way of R, since the lines are many and the columns few.
        left, upper = np.linalg.qr(rows / lengths)
        inverse = np.linalg.pinv(upper, rcond=COLLINEAR) @ left.T
        values = inverse @ target / lengths
        residual = self.torque - columns @ values
        free = self.free_values - values.size
        variance = float(np.sum(np.abs(residual) ** 2)) / free * self.taper_loss
        root = inverse / lengths[:, None]
        return Solution(values, variance * (root @ root.T), residual)

    def _share(self, name: str) -> float:
        whole = float(np.linalg.norm(self.term_lines(name)[:, 0] / self.line_size_nm))
        return float(np.linalg.norm(self.columns([name]))) / whole if whole > 0 else 0.0

    def lines(self, values: Array) -> Complex:
        """Return the lines of a signal in time, shape (n,)."""
        return _lines(values, self._window, self._first, self.frequency_hz.size)

    def white_sizes(self, columns: Filtered) -> Array:
        """Return Σ |white(column)|², shape (q,), without making the columns."""
        (stretches, each, _), signal = self._basis.shape, columns.signal.reshape(-1, 1)
        turned = self._basis.conj() * signal.reshape(stretches, each, 1)
        rows = np.concatenate([turned.real, turned.imag], axis=2).transpose(0, 2, 1)
        real, imaginary, power = (
            gain.reshape(stretches, each, gain.shape[1]) for gain in columns.gains
        )
        by_real, by_imaginary = rows @ real, rows @ imaginary
        taken = np.sum(
            (by_real[:, :3] - by_imaginary[:, 3:]) ** 2
            + (by_imaginary[:, :3] + by_real[:, 3:]) ** 2,
            axis=1,
        )
        size = (signal.real**2 + signal.imag**2).reshape(stretches, 1, each)
        return np.asarray(self._size_nm**-2.0 @ ((size @ power)[:, 0] - taken))

    def white(self, lines: Complex) -> Complex:
        """Return what is left of lines, shape (m, p), as of the torque."""
        parts = lines.reshape(*self._basis.shape[:2], lines.shape[1])
        left = _without(parts, self._basis) / self._size_nm[:, None, None]
        return np.asarray(left.reshape(lines.shape))


def beyond_linear(
    motion: Signals, band_hz: tuple[float, float], taper_s: float = 1.0
) -> BeyondLinear:
    """Take an epoch's torque and motion to lines, and what is linear out of the torque.

    Parameters
    ----------
    motion : Signals
        Wide-band.
    band_hz : (float, float)
    taper_s : float
        Over which the ends fall off.

    Raises
    ------
    ValueError
        If the band holds too few lines, or the motion explains the torque to the last digit.
    """
    n, rate_hz = motion.time_s.size, motion.rate_hz
    duration_s = n / rate_hz
    # The first line of a record is its drift.
    first = max(int(np.ceil(band_hz[0] * duration_s - 1e-6)), 2)
    count = int(band_hz[1] * duration_s + 1e-6) - first + 1
    each = max(round(STRETCH_HZ * duration_s), FEWEST_LINES)
    stretches = count // each
    if stretches < 1:
        raise ValueError(
            f"{duration_s:.3g} s hold {max(count, 0)} spectral lines from {band_hz[0]:g} to "
            f"{band_hz[1]:g} Hz; at least {each} are needed to tell terms from a linear loop"
        )
    each = count // stretches
    used = each * stretches
    window = tapered_ends(n, rate_hz, taper_s).value
    linear = [
        _lines(values, window, first, used).reshape(stretches, each)
        for values in (motion.acceleration_rad_s2, motion.velocity_rad_s, motion.angle_rad)
    ]
    columns = np.stack(linear, axis=2)
    columns /= np.maximum(np.linalg.norm(columns, axis=1, keepdims=True), 1e-300)
    basis, _ = np.linalg.qr(columns)
    torque = _lines(motion.torque_nm, window, first, used).reshape(stretches, each)
    left = _without(torque[:, :, None], basis)[:, :, 0]
    size_nm = np.sqrt(np.sum(np.abs(left) ** 2, axis=1) / (each - 3))
    if not np.all(size_nm > 1e-12 * float(np.sqrt(np.mean(np.abs(torque) ** 2)))):
        raise ValueError("the motion explains the torque to the last digit")
    return BeyondLinear(
        motion,
        np.arange(first, first + used) / duration_s,
        np.asarray((left / size_nm[:, None]).ravel()),
        torque.ravel(),
        np.stack(linear, axis=2).reshape(used, 3),
        window,
        first,
        np.asarray(basis),
        size_nm,
    )


@lru_cache(maxsize=8)
def _gains(kind: str, first: int, count: int, duration_s: float) -> Gains:
    """Return a reflex of gain 1 at each point of its grid, which epochs of one length share."""
    found = kernel(kind)
    # For each parameter inside a row of its values, shape (1, g).
    inner = np.asarray(found.starts).T[:, None, :]
    (gains,) = found.transfer((np.arange(first, first + count) / duration_s)[:, None], inner)
    return Gains.of(gains)


@lru_cache(maxsize=64)
def _gain(
    kind: str, inner: tuple[float, ...], first: int, count: int, duration_s: float
) -> Complex:
    """Return a reflex with a column for each linear parameter at 1, shape (m, p)."""
    frequency_hz = np.arange(first, first + count) / duration_s
    found = np.stack(kernel(kind).transfer(frequency_hz, np.asarray(inner)), axis=1)
    found.setflags(write=False)
    return found


def _without(parts: Complex, basis: Complex) -> Complex:
    """Return lines of each stretch, shape (b, m, p), without what is in the basis."""
    return np.asarray(parts - basis @ (basis.conj().transpose(0, 2, 1) @ parts))


def _lines(values: Array, window: Array, first: int, count: int) -> Complex:
    """Return a few of the lines of a signal, shape (n,), through a window.

    From r interleaved parts, whose spectra are shorter, in half the time of all lines:

        X_k = Σ_q e^(−j2πkq/n) X_k^(q),    q = 0 … r − 1
    """
    n = values.size
    parts = next(r for r in PARTS if n % r == 0 and n // r // 2 + 1 >= first + count)
    tapered = (window * (values - np.mean(values))).reshape(n // parts, parts)
    spectra = scipy.fft.rfft(tapered, axis=0)[first : first + count]
    return np.asarray(np.einsum("kq,kq->k", spectra, _turns(n, parts, first, count)))


@lru_cache(maxsize=4)
def _turns(n: int, parts: int, first: int, count: int) -> Complex:
    """Return e^(−j2πkq/n), shape (count, parts), which epochs of one length share."""
    line, part = np.arange(first, first + count)[:, None], np.arange(parts)
    turns = np.asarray(np.exp(-2j * np.pi * line * part / n))
    turns.setflags(write=False)
    return turns
