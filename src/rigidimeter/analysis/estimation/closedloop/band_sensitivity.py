"""How J, B and K depend on the band, and on the part of the epochs, that they are estimated from.

With instruments Z, motion Φ and torque Y at the lines of all epochs of a condition and S the power
of their noise, the lines of a band b give

    p_b = G_b⁻¹ Σ_b Re(Zᴴ Y)/S        G_b = Σ_b Re(Zᴴ Φ)/S

Epochs of joints that differ weigh otherwise in another band, which moves p_b though no band says
anything else of any of them. So each epoch e is compared with itself, p_e being its estimate in the
band of the fit, and the change is the mean of theirs, with the weights of band b:

    Δ_b = G_b⁻¹ Σ_e G_be (p_be − p_e) = Σ_k Re(D_kᴴ R_k)
    D_k = (Z_k [k in b] − Z_k [k in fit] G_e⁻ᵀ G_beᵀ) G_b⁻ᵀ/S_k

with R = Y − Φ p of any p. With one epoch this is p_b − p exactly. The change has its own standard
error, from ½ Σ Re(Dᴴ D) S: what the noise does to both alike is not counted. Where Z is Φ without
noise and one band holds the other this is the difference of the two variances (Hausman 1978).

A half of an epoch is its window times ½ (1 ± sin 2πt/T), which adds up neighbouring lines:
X_k becomes ½ X_k ± (X_{k−1} − X_{k+1})/4i. No signal is transformed again.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.estimation.closedloop.line_noise import Complex, Smoother, Solved
from rigidimeter.analysis.estimation.closedloop.normal_equations import scaled_inverse
from rigidimeter.analysis.estimation.closedloop.spectral_lines import Lines
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.settings import FEWEST_LINES

Part = Literal["all", "first half", "second half"]

LOWER, UPPER = (0.5, 2.0, 4.0), (0.5, 0.7, 1.4)
"""Each edge of the band is moved by these factors, the other one kept."""

SMOOTHED, NEIGHBOURS = 4, 0.1
"""The power of the noise is averaged over so many lines, or this share of a line's own number, to
each side."""

LEAST_POWER = 1e-24
"""Of the largest line of the torque: a simulation without noise leaves nothing."""


class Member(NamedTuple):
    """One epoch.

    Attributes
    ----------
    lines : Lines
        Of a band wider than that of the fit, where the rate allows it.
    instruments : complex array, shape (m, 3)
        The motion that the perturbation causes, at these lines.
    fitted : slice
        The lines of the fit.
    values : array, shape (3,)
        J, B and K of this epoch, for the power of its noise.
    """

    lines: Lines
    instruments: Complex
    fitted: slice
    values: Array


class BandChange(NamedTuple):
    """J, B and K of all epochs together from one band and part of the epochs.

    Attributes
    ----------
    low_hz, high_hz : float
        The first and the last line.
    part : str
    change : array, shape (3,)
        From the estimate in the band of the fit.
    change_se : array, shape (3,)
    p : array, shape (3,)
        Probability of as large a change by chance.
    """

    low_hz: float
    high_hz: float
    part: Part
    change: Array
    change_se: Array
    p: Array


class _Weighted(NamedTuple):
    member: Member
    power: Array
    instruments: Complex  # divided by the power
    smoother: Smoother
    residual: Complex
    density: Array  # the power of the noise, without the power that the fit has taken


def band_changes(members: Sequence[Member]) -> tuple[Array, list[BandChange]]:
    """Return J, B and K in the band of the fit, and how they change in others.

    Parameters
    ----------
    members : sequence of Member
        The epochs of one condition.

    Raises
    ------
    ValueError
        If the epochs cannot distinguish J, B and K.
    """
    weighted = [_weighted(member) for member in members]
    gram, moment = np.zeros((3, 3)), np.zeros(3)
    for one in weighted:
        lines, fitted = one.member.lines, one.member.fitted
        used = one.instruments[fitted].conj().T
        gram += (used @ lines.motion[fitted]).real
        moment += (used @ lines.torque_nm[fitted]).real
    inverse = scaled_inverse(gram)
    values = inverse @ moment
    own = [_own(one) for one in weighted]
    left = []
    for one, effect in zip(weighted, own, strict=True):
        residual = one.member.lines.torque_nm - one.member.lines.motion @ values
        density = _solved(one, effect).density(residual, one.smoother)
        left.append(one._replace(residual=residual, density=density))
    first = left[0].member
    changes = []
    for low, high, part in _variants(first):
        within = [_slice(one.member, low, high) for one in left]
        found = _change(left, own, within, part)
        grid = first.lines.grid
        low_hz, high_hz = grid.omega_rad_s[[within[0].start, within[0].stop - 1]] / (2 * np.pi)
        changes.append(BandChange(float(low_hz), float(high_hz), part, *found))
    return values, changes


def _weighted(member: Member) -> _Weighted:
    lines = member.lines
    residual = lines.torque_nm - lines.motion @ member.values
    smoother = Smoother.over(lines.grid.line, SMOOTHED, NEIGHBOURS)
    least = LEAST_POWER * float(np.max(np.abs(lines.torque_nm) ** 2))
    power = np.maximum(smoother(np.abs(residual) ** 2), least)
    return _Weighted(member, power, member.instruments / power[:, None], smoother, residual, power)


def _variants(member: Member) -> list[tuple[float, float, Part]]:
    """Return the edges as factors of those of the fit, and the part; those that differ from it."""
    found: list[tuple[float, float, Part]] = []
    seen = {(member.fitted.start, member.fitted.stop)}
    for low, high in [*((factor, 1.0) for factor in LOWER), *((1.0, factor) for factor in UPPER)]:
        lines = _slice(member, low, high)
        if lines.stop - lines.start >= FEWEST_LINES and (lines.start, lines.stop) not in seen:
            seen.add((lines.start, lines.stop))
            found.append((low, high, "all"))
    return [*found, (1.0, 1.0, "first half"), (1.0, 1.0, "second half")]


def _slice(member: Member, low: float, high: float) -> slice:
    """Return the lines of a band whose edges are these times those of the fit."""
    line = member.lines.grid.line
    # The line below the band belongs to it, as in the fit.
    first = round(low * (line[member.fitted.start] + 1)) - 1
    last = round(high * line[member.fitted.stop - 1])
    start, stop = np.searchsorted(line, [first, last + 1])
    return slice(int(start), int(stop))


def _change(
    weighted: Sequence[_Weighted], own: Sequence[Complex], lines: Sequence[slice], part: Part
) -> tuple[Array, Array, Array]:
    """Return change, standard error and probability."""
    sign = {"all": 0, "first half": 1, "second half": -1}[part]
    grams, effects = [], []
    for one, within in zip(weighted, lines, strict=True):
        if sign:
            halved = _halved(one.member.instruments, sign) / one.power[:, None]
            used = _only(halved, within)
            grams.append((used.conj().T @ _halved(one.member.lines.motion, sign)).real)
            effects.append(_halved_adjoint(used, sign))
        else:
            used = one.instruments[within]
            grams.append((used.conj().T @ one.member.lines.motion[within]).real)
            effects.append(_only(one.instruments, within))
    inverse = scaled_inverse(np.sum(grams, axis=0))
    change, variance, squares = np.zeros(3), np.zeros(3), np.zeros(3)
    for one, effect, of_epoch, gram in zip(weighted, effects, own, grams, strict=True):
        difference = (effect - of_epoch @ gram.T) @ inverse.T
        change += (difference.conj().T @ one.residual).real
        solved = _solved(one, difference)
        covariance, degrees = solved.covariance(one.density, one.smoother)
        variance += np.diag(covariance)
        squares += np.diag(covariance) ** 2 / degrees
    se = np.sqrt(variance)
    p = 2 * scipy.stats.t.sf(np.abs(change) / se, variance**2 / squares)
    return change, se, np.asarray(p, dtype=np.float64)


def _solved(one: _Weighted, effect: Complex) -> Solved:
    """Return estimates on which the lines have these effects."""
    lines = one.member.lines
    return Solved(np.eye(3), effect, lines.motion, one.power, lines.grid.spread)


def _own(one: _Weighted) -> Complex:
    """Return the effects of the lines on the epoch's own estimate in the band of the fit."""
    used = _only(one.instruments, one.member.fitted)
    return np.asarray(used @ scaled_inverse((used.conj().T @ one.member.lines.motion).real).T)


def _only(values: Complex, within: slice) -> Complex:
    kept = np.zeros_like(values)
    kept[within] = values[within]
    return kept


def _halved(lines: Complex, sign: int) -> Complex:
    """Return the lines of signals times ½ (1 ± sin 2πt/T)."""
    beside = np.zeros_like(lines)
    beside[1:] = lines[:-1]
    beside[:-1] -= lines[1:]
    return np.asarray(0.5 * lines + sign * beside / 4j)


def _halved_adjoint(weights: Complex, sign: int) -> Complex:
    """Return weights of the lines that are equal to these weights of the halved lines."""
    beside = np.zeros_like(weights)
    beside[:-1] = weights[1:]
    beside[1:] -= weights[:-1]
    return np.asarray(0.5 * weights - sign * beside / 4j)
