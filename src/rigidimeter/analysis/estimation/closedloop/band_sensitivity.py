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

Of a band Z is zero at the other lines; all are problems of `normal_equations`.

A half of an epoch is its window times ½ (1 ± sin 2πt/T), which adds up neighbouring lines:
X_k becomes ½ X_k ± (X_{k−1} − X_{k+1})/4i. No signal is transformed again.

An estimate has the finding where another band moves a parameter by more than chance, over all bands
and parameters together, by more than a share of the parameter, and by more than half of half the
interval of that estimate: then the interval does not hold what other frequencies say.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.estimation.closedloop.line_noise import Complex, Smoother, Solved
from rigidimeter.analysis.estimation.closedloop.normal_equations import (
    Problem,
    scaled_inverse,
    sums,
)
from rigidimeter.analysis.estimation.closedloop.observation import Observation
from rigidimeter.analysis.estimation.found import found, half_widths
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.findings import Effect, Finding, Three
from rigidimeter.core.records import PARAMETERS, BandEstimate, Fit
from rigidimeter.core.settings import FEWEST_LINES, DiagnosticsSettings

Part = Literal["all", "first half", "second half"]

LOWER, UPPER = (0.5, 2.0, 4.0), (0.5, 0.7, 1.4)
"""Each edge of the band is moved by these factors, the other one kept."""

SMOOTHED, NEIGHBOURS = 4, 0.1
"""The power of the noise is averaged over so many lines, or this share of a line's own number, to
each side."""

LEAST_POWER = 1e-24
"""Of the largest line of the torque: a simulation without noise leaves nothing."""

CHANCE = 0.01
"""Probability of a change by chance, over all bands and parameters of a condition."""

OF_HALF = 0.5
"""A change of less than this share of half an interval is within it."""


class Member(NamedTuple):
    """One epoch.

    Attributes
    ----------
    problem : Problem
        At the lines of a band wider than that of the fit, where the rate allows it. Its instruments
        are the motion that the perturbation causes.
    values : array, shape (3,)
        J, B and K of this epoch, for the power of its noise.
    """

    problem: Problem
    values: Array

    @property
    def seen(self) -> Observation:
        """The epoch at the lines of the problem."""
        return self.problem.observation.wider or self.problem.observation

    @property
    def fitted(self) -> slice:
        """Which of them are those of the fit."""
        line = self.problem.observation.grid.line
        first = int(line[0] - self.seen.grid.line[0])
        return slice(first, first + line.size)


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


class _Epoch(NamedTuple):
    """One epoch, its instruments divided by S, and its lines' effects on its own estimate."""

    problem: Problem
    power: Array
    smoother: Smoother
    spread: float
    own: Complex

    def solved(self, effect: Complex) -> Solved:
        """Return estimates on which the lines have these effects."""
        return Solved(np.eye(3), effect, self.problem.regressors, self.power, self.spread)


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
    epochs = [_weighted(member) for member in members]
    fitted = [
        _only(one.problem, member.fitted) for one, member in zip(epochs, members, strict=True)
    ]
    gram, moment, _ = sums(fitted)
    values = scaled_inverse(gram) @ moment
    residuals = [one.problem.target - one.problem.regressors @ values for one in epochs]
    densities = [
        one.solved(one.own).density(residual, one.smoother)
        for one, residual in zip(epochs, residuals, strict=True)
    ]
    changes = []
    for low, high, part in _variants(members[0]):
        within = [_slice(member, low, high) for member in members]
        change, variance, squares = np.zeros(3), np.zeros(3), np.zeros(3)
        of_band = [_of_band(*one, part) for one in zip(members, epochs, within, strict=True)]
        inverse = scaled_inverse(np.sum([gram for gram, _ in of_band], axis=0))
        for one, (gram, effect), residual, density in zip(
            epochs, of_band, residuals, densities, strict=True
        ):
            difference = (effect - one.own @ gram.T) @ inverse.T
            change += (difference.conj().T @ residual).real
            covariance, degrees = one.solved(difference).covariance(density, one.smoother)
            variance += np.diag(covariance)
            squares += np.diag(covariance) ** 2 / degrees
        se = np.sqrt(variance)
        p = 2 * scipy.stats.t.sf(np.abs(change) / se, variance**2 / squares)
        omega = members[0].seen.grid.omega_rad_s[within[0]]
        edges_hz = float(omega[0] / (2 * np.pi)), float(omega[-1] / (2 * np.pi))
        changes.append(BandChange(*edges_hz, part, change, se, np.asarray(p)))
    return values, changes


def _weighted(member: Member) -> _Epoch:
    problem, grid = member.problem, member.seen.grid
    smoother = Smoother.over(grid.line, SMOOTHED, NEIGHBOURS)
    residual = problem.target - problem.regressors @ member.values
    least = LEAST_POWER * float(np.max(np.abs(problem.target) ** 2))
    power = np.maximum(smoother(np.abs(residual) ** 2), least)
    weighted = problem._replace(instruments=problem.instruments / power[:, None])
    gram, _, (used,) = sums([_only(weighted, member.fitted)])
    own = np.asarray(used @ scaled_inverse(gram).T)
    return _Epoch(weighted, power, smoother, grid.spread, own)


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
    line = member.seen.grid.line
    # The line below the band belongs to it, as in the fit.
    first = round(low * (line[member.fitted.start] + 1)) - 1
    last = round(high * line[member.fitted.stop - 1])
    start, stop = np.searchsorted(line, [first, last + 1])
    return slice(int(start), int(stop))


def _of_band(member: Member, epoch: _Epoch, within: slice, part: Part) -> tuple[Array, Complex]:
    """Return the matrix of a band and part of an epoch, and the effects of the lines by it."""
    sign = {"all": 0, "first half": 1, "second half": -1}[part]
    problem = epoch.problem
    if sign:
        weighted = _halved(member.problem.instruments, sign) / epoch.power[:, None]
        motion = _halved(problem.regressors, sign)
        problem = problem._replace(instruments=weighted, regressors=motion)
    gram, _, (used,) = sums([_only(problem, within)])
    # The half of a window is real: what weights the halved lines is halved in the same way.
    return gram, _halved(used, sign) if sign else used


def _only(problem: Problem, within: slice) -> Problem:
    """Return the problem of some of the lines: at the others the instruments are zero."""
    kept = np.zeros_like(problem.instruments)
    kept[within] = problem.instruments[within]
    return problem._replace(instruments=kept)


def _halved(lines: Complex, sign: int) -> Complex:
    """Return the lines of signals times ½ (1 ± sin 2πt/T)."""
    beside = np.zeros_like(lines)
    beside[1:] = lines[:-1]
    beside[:-1] -= lines[1:]
    return np.asarray(0.5 * lines + sign * beside / 4j)


def band_estimates(
    condition: str, pooled: Fit | None, values: Array, changes: Sequence[BandChange]
) -> list[BandEstimate]:
    """Return what each band gives, the band of the fit first.

    Parameters
    ----------
    condition : str
    pooled : Fit or None
        The fit to all epochs of the condition, where it was made by the perturbation.
    values : array, shape (3,)
        J, B and K in the band of the fit, in its place.
    changes : sequence of BandChange
    """
    if not changes:
        return []
    at = values if pooled is None else pooled.value
    nothing = np.zeros(3)
    # Halves of the epochs are of the band of the fit.
    own = changes[-1]._replace(part="all", change=nothing, change_se=nothing, p=np.ones(3))
    return [
        BandEstimate(
            condition,
            band.low_hz,
            band.high_hz,
            band.part,
            _three(at + band.change),
            _three(band.change),
            _three(band.change_se),
            _three(band.p),
        )
        for band in (own, *changes)
    ]


def band_finding(
    fit: Fit, changes: Sequence[BandChange], settings: DiagnosticsSettings
) -> list[Finding]:
    """Return the finding of a fit that another band contradicts; nothing where none does.

    Parameters
    ----------
    fit : Fit
        Of an epoch of the condition, or of all of them.
    changes : sequence of BandChange
    settings : DiagnosticsSettings
    """
    bands = [band for band in changes if band.part == "all"]
    if not bands:
        return []
    change = np.array([band.change for band in bands])
    p = np.minimum(change.size * np.array([band.p for band in bands]), 1.0)  # Bonferroni
    percent = 100 * np.abs(change / fit.value)
    half = half_widths(fit)
    of_half = np.abs(change) / half
    most = settings.max_band_sensitivity_percent
    contradicting = (p < CHANCE) & (percent > most) & (of_half > OF_HALF)
    if not np.any(contradicting):
        return []
    worst = np.argmax(np.where(contradicting, of_half, 0.0))
    at, j = np.unravel_index(worst, change.shape)
    band, own = bands[int(at)], changes[-1]
    return [
        found(
            "band_sensitivity",
            settings,
            float(percent[at, j]),
            most,
            p=float(p[at, j]),
            effect=Effect.of(-change[at], fit.value, half),
            facts={
                "symbol": PARAMETERS[int(j)].symbol,
                "way": "more" if change[at, j] * fit.value[j] > 0 else "less",
                "low_hz": band.low_hz,
                "high_hz": band.high_hz,
                "error": float(100 * band.change_se[j] / abs(fit.value[j])),
                "own_low_hz": own.low_hz,
                "own_high_hz": own.high_hz,
                "of_half": float(of_half[at, j]),
            },
        )
    ]


def _three(values: Array) -> Three:
    J, B, K = (float(value) for value in values)
    return J, B, K
