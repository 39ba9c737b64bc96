"""What epochs of a condition show together: whether they differ, and whether bands do.

**Epochs.** Estimates x_e with standard errors s_e, weights w_e = 1/s_e², W = Σ w_e and the weighted
mean x̄ scatter by

    Q = Σ w_e (x_e − x̄)²

which has a chi-squared distribution with E − 1 degrees if nothing but noise differs and the s_e are
known (Cochran 1954). They are estimated with ν_e degrees of freedom, so that Q is too large; the
test of Welch (1951) takes that into account:

    F = Q / (E − 1) ÷ (1 + 2 (E − 2)/(E² − 1) Λ)      Λ = Σ (1 − w_e/W)² / ν_e

with E − 1 and (E² − 1)/(3 Λ) degrees. The variance beyond the errors is that of DerSimonian and
Laird (1986), and each epoch's estimate is drawn to the mean as far as its error says, so that noise
does not widen the range. Without a perturbation only K is tested, and only as far as it differs
more than J does: what a subject pushes bends least squares in each epoch by another amount, J most.
Inertia is the one thing that does not change, so its scatter shows how large that is.

**Bands.** With instruments Z (the motion that the perturbation causes), motion X and torque Y at
the lines of an epoch, S the power of its noise and E_b = Z/S at the lines of a band b, else 0,

    p_b = G_b⁻¹ Σ Re(E_bᴴ Y)        G_b = Σ_e G_be        G_be = Re(E_bᴴ X)

Epochs of joints that differ weigh otherwise in another band, which moves p_b though no band says
anything else of any of them. So each epoch is compared with its own estimate p_e in the band f of
the fit, and the change is the mean of theirs, with the weights of band b:

    Δ_b = G_b⁻¹ Σ_e G_be (p_be − p_e) = Σ_e Re(D_eᴴ R_e)      D_e = (E_b − E_f G_fe⁻ᵀ G_beᵀ) G_b⁻ᵀ

with R = Y − X p of any p. With one epoch this is p_b − p exactly. Its standard error is that of the
difference, from ½ Σ Re(Dᴴ D) S: what the noise does to both alike is not counted. Where Z is X
without noise and one band holds the other this is the difference of two variances (Hausman 1978).

A half of an epoch is its window times ½ (1 ± sin 2πt/T), which adds up neighbouring lines: H X_k =
½ X_k ± (X_{k−1} − X_{k+1})/4i. H is its own adjoint, so E = H (H Z)/S.

An estimate has the finding where another band moves a parameter by more than chance, over all bands
and parameters together, by more than a share of the parameter, and by more than half of half the
interval of that estimate: then the interval does not hold what other frequencies say.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.estimation.checks import found, half_widths
from rigidimeter.analysis.estimation.grid import Array, Complex
from rigidimeter.analysis.estimation.methods import all_caused
from rigidimeter.analysis.estimation.observation import Observation
from rigidimeter.analysis.estimation.solve import LineNoise, Problem, inverse_of, smoother
from rigidimeter.core.findings import Effect, Fact, Finding
from rigidimeter.core.records import PARAMETERS, BandEstimate, Fit
from rigidimeter.core.settings import FEWEST_LINES, DiagnosticsSettings
from rigidimeter.core.words import epoch_name, short_names

FEWEST_EPOCHS = 3
TREND_P = 0.05
INERTIA, STIFFNESS = 0, 2

BANDS = (*((low, 1.0) for low in (0.5, 2.0, 4.0)), *((1.0, high) for high in (0.5, 0.7, 1.4)))
"""Each edge of the band is moved by these factors, the other one kept."""

LEAST_POWER = 1e-24
"""Of the largest line of the torque: a simulation without noise leaves nothing."""

CHANCE = 0.01
"""Probability of a change by chance, over all bands and parameters of a condition."""

OF_HALF = 0.5
"""A change of less than this share of half an interval is within it."""


class Scatter(NamedTuple):
    """One parameter over the epochs.

    Attributes
    ----------
    parameter : int
        Which of J, B and K.
    p : float
        Probability of so much scatter if the parameter is the same in all.
    sd : float
        Standard deviation beyond the errors.
    drawn : array, shape (e,)
        The estimates, drawn to the mean.
    values : array, shape (e,)
        The estimates, in order.
    mean : float
        Weighted.
    """

    parameter: int
    p: float
    sd: float
    drawn: Array
    values: Array
    mean: float

    @property
    def percent(self) -> float:
        """The range over the epochs, in % of the mean."""
        return 100 * float(np.ptp(self.drawn)) / max(abs(float(np.mean(self.drawn))), 1e-300)

    def trend(self) -> tuple[float, float]:
        """Return what a straight line changes from the first epoch to the last, in %, and its p."""
        count = self.values.size
        line = scipy.stats.linregress(np.arange(count), self.values)
        change = float(line.slope) * (count - 1) / max(abs(self.mean), 1e-300)
        return 100 * change, float(line.pvalue)


def scatter(parameter: int, values: Array, errors: Array, degrees: Array) -> Scatter:
    """Return how one parameter scatters over epochs.

    Parameters
    ----------
    parameter : int
    values, errors, degrees : arrays, shape (e,)
        Estimates, their standard errors, and degrees of freedom for Student's t.
    """
    count = values.size
    weight = errors**-2.0
    total = float(np.sum(weight))
    mean = float(weight @ values) / total
    Q = float(weight @ (values - mean) ** 2)
    unsure = float(np.sum((1 - weight / total) ** 2 / degrees))
    F = Q / (count - 1) / (1 + 2 * (count - 2) / (count**2 - 1) * unsure)
    p = float(scipy.special.fdtrc(count - 1, (count**2 - 1) / (3 * unsure), F))
    beyond = max((Q - (count - 1)) / (total - float(weight @ weight) / total), 0.0)
    weight = 1 / (errors**2 + beyond)
    mean = float(weight @ values / np.sum(weight))
    drawn = mean + np.sqrt(beyond * weight) * (values - mean)
    return Scatter(parameter, p, float(np.sqrt(beyond)), drawn, values, mean)


def between_epochs(
    fits: Sequence[Fit], by_perturbation: bool, settings: DiagnosticsSettings
) -> Finding | None:
    """Return the finding for epochs of one condition that differ by more than chance; else None.

    Parameters
    ----------
    fits : sequence of Fit
        Those that count, in order.
    by_perturbation : bool
        Whether a subject who pushes leaves the estimates unbiased.
    settings : DiagnosticsSettings
    """
    if len(fits) < FEWEST_EPOCHS:
        return None
    values, errors, low, high = (
        np.array([getattr(fit, name) for fit in fits]) for name in ("value", "se", "low", "high")
    )
    if not np.all(np.isfinite(values)) or not np.all(errors > 0):
        return None
    known, quantile = _quantiles()
    degrees = np.interp((low - high) / 2 / errors, -quantile, known)
    scatters = [scatter(j, values[:, j], errors[:, j], degrees[:, j]) for j in range(3)]
    most = settings.max_varying_percent
    sure = scatters[STIFFNESS:]
    if by_perturbation:  # Holm 1979
        sure = sorted(scatters, key=lambda one: one.p)
    elif not scatters[STIFFNESS].percent > scatters[INERTIA].percent:
        sure = []
    tests = range(len(sure), 0, -1)
    within = itertools.takewhile(
        lambda one: one[0].p * one[1] < settings.varying_chance, zip(sure, tests, strict=True)
    )
    large = sorted((one for one, _ in within if one.percent > most), key=lambda one: -one.percent)
    if not large:
        return None
    first, *others = large
    about, more = PARAMETERS[first.parameter], [PARAMETERS[one.parameter].symbol for one in others]
    names = short_names(fit.source for fit in fits)
    called = [epoch_name(fit.epoch, fit.source, names) for fit in fits]
    trend_percent, trend_p = first.trend()
    way = "rising" if trend_percent > 0 else "falling"
    trend = f", {way} by {abs(trend_percent):.0f} % over the epochs" if trend_p < TREND_P else ""
    facts: dict[str, Fact] = {"symbol": about.symbol, "size_unit": about.unit, "sd": first.sd}
    facts |= {"trend_percent": trend_percent, "trend_p": trend_p, "trend": trend}
    facts["others"] = f"; {' and '.join(more)} too" if more else ""
    for name, at in (("low", np.argmin(first.drawn)), ("high", np.argmax(first.drawn))):
        facts |= {name: float(first.drawn[at]), f"{name}_at": called[at]}
    of: dict[str, Any] = {"epochs": tuple(fit.epoch for fit in fits), "p": first.p}
    of |= {"condition": fits[0].condition, "facts": facts}
    return found("varying_between_epochs", settings, first.percent, most, **of)


@lru_cache
def _quantiles() -> tuple[Array, Array]:
    """Return degrees of freedom and Student's quantile for 95 % at each."""
    known = np.geomspace(1.0, 1e4, 400)
    return known, np.asarray(scipy.special.stdtrit(known, 0.975))


class _Lines(NamedTuple):
    """An epoch at the lines of a band wider than that of the fit, where the rate allows it."""

    problem: Problem
    fitted: slice
    power: Array

    def effect(self, within: slice, sign: int = 0) -> Complex:
        """Return E of lines, of a half of the epoch where there is a sign."""
        instruments = self.problem.instruments
        through = _halved(instruments, sign)[within] / self.power[within, None]
        kept = np.zeros_like(instruments)
        kept[within] = through
        return _halved(kept, sign)

    def moved(self, low: float, high: float) -> slice:
        """Return the lines of a band whose edges are these times those of the fit."""
        line = self.problem.observation.grid.line
        # The line below the band belongs to it, as in the fit.
        first = round(low * (line[self.fitted.start] + 1)) - 1
        last = round(high * line[self.fitted.stop - 1])
        start, stop = np.searchsorted(line, [first, last + 1])
        return slice(int(start), int(stop))

    def noise(self, effect: Complex) -> LineNoise:
        """Return what noise does to estimates on which the lines have these effects."""
        return LineNoise(self.problem, self.power, effect, np.eye(3))


def band_estimates(
    observations: Sequence[Observation], values: Sequence[Array], pooled: Fit | None = None
) -> list[BandEstimate]:
    """Return J, B and K of a condition from each band, the band of the fit first.

    There are none where the epochs cannot distinguish J, B and K.

    Parameters
    ----------
    observations : sequence of Observation
        The epochs of the condition, with what the perturbation causes.
    values : sequence of array, shape (3,)
        J, B and K of each by instruments.
    pooled : Fit, optional
        Of all of them by instruments: what the changes are added to.
    """
    try:
        return _estimates(_at_lines(observations, values), pooled) if observations else []
    except ValueError:
        return []  # the fits say why


def _estimates(epochs: Sequence[_Lines], pooled: Fit | None) -> list[BandEstimate]:
    own = [one.effect(one.fitted) for one in epochs]
    grams = [_real(effect, one.problem.regressors) for effect, one in zip(own, epochs, strict=True)]
    moments = [_real(effect, one.problem.target) for effect, one in zip(own, epochs, strict=True)]
    together = inverse_of(np.sum(grams, axis=0)) @ np.sum(moments, axis=0)
    effects = [one @ inverse_of(gram).T for one, gram in zip(own, grams, strict=True)]
    smooths = [smoother(one.problem.observation.grid.line, 1) for one in epochs]
    residuals = [one.problem.residual(together) for one in epochs]
    densities = [
        one.noise(effect).density(residual, smooth)
        for one, effect, residual, smooth in zip(epochs, effects, residuals, smooths, strict=True)
    ]
    at, first = together if pooled is None else pooled.value, epochs[0].problem.observation

    def estimate(lines: slice, part: str, change: Array, se: Array, p: Array) -> BandEstimate:
        vectors: Any = (tuple(one.tolist()) for one in (at + change, change, se, p))
        return BandEstimate(first.epoch.condition, *first.grid.part(lines).band_hz, part, *vectors)

    nothing = np.zeros(3)
    found = [estimate(epochs[0].fitted, "all", nothing, nothing, np.ones(3))]
    for low, high, part, sign in _variants(epochs[0]):
        of_band = [one.effect(one.moved(low, high), sign) for one in epochs]
        grams = [_real(e, one.problem.regressors) for e, one in zip(of_band, epochs, strict=True)]
        inverse = inverse_of(np.sum(grams, axis=0))
        change, variance, squares = np.zeros((3, 3))
        for k, one in enumerate(epochs):
            difference = (of_band[k] - effects[k] @ grams[k].T) @ inverse.T
            noise = one.noise(difference)
            own_variance = np.diag(noise.variance(densities[k]))
            change = change + _real(difference, residuals[k])
            variance = variance + own_variance
            squares = squares + own_variance**2 / noise.degrees(densities[k], smooths[k])
        se = np.asarray(np.sqrt(variance))
        p = 2 * scipy.stats.t.sf(np.abs(change) / se, variance**2 / squares)
        found.append(estimate(epochs[0].moved(low, high), part, change, se, np.asarray(p)))
    return found


def _at_lines(observations: Sequence[Observation], values: Sequence[Array]) -> list[_Lines]:
    found, caused = [], all_caused(observations, np.median(values, axis=0))
    for one, own, by in zip(observations, values, caused, strict=True):
        seen = one.wider or one
        problem = Problem(seen.of_lines(by.lines), seen.motion, seen.torque_nm, seen)
        first = int(one.grid.line[0] - seen.grid.line[0])
        left, least = np.abs(problem.residual(own)) ** 2, np.max(np.abs(problem.target) ** 2)
        power = np.maximum(smoother(seen.grid.line, 1)(left), LEAST_POWER * float(least))
        found.append(_Lines(problem, slice(first, first + one.grid.line.size), power))
    return found


def _variants(epoch: _Lines) -> list[tuple[float, float, str, int]]:
    """Return edges as factors of those of the fit, part and sign of those that differ from it."""
    found: list[tuple[float, float, str, int]] = []
    seen = {(epoch.fitted.start, epoch.fitted.stop)}
    for low, high in BANDS:
        lines = epoch.moved(low, high)
        if lines.stop - lines.start >= FEWEST_LINES and (lines.start, lines.stop) not in seen:
            seen.add((lines.start, lines.stop))
            found.append((low, high, "all", 0))
    return [*found, (1.0, 1.0, "first half", 1), (1.0, 1.0, "second half", -1)]


def _real(effect: Complex, lines: Complex) -> Array:
    """Return Σ Re(Eᴴ x)."""
    return np.asarray((effect.conj().T @ lines).real)


def _halved(lines: Complex, sign: int) -> Complex:
    """Return the lines of signals times ½ (1 ± sin 2πt/T); as they are without a sign."""
    if not sign:
        return lines
    beside = np.zeros_like(lines)
    beside[1:] = lines[:-1]
    beside[:-1] -= lines[1:]
    return np.asarray(0.5 * lines + sign * beside / 4j)


def band_finding(
    fit: Fit, estimates: Sequence[BandEstimate], settings: DiagnosticsSettings
) -> list[Finding]:
    """Return the finding of a fit that another band contradicts; nothing where none does.

    Parameters
    ----------
    fit : Fit
        Of an epoch of the condition, or of all of them.
    estimates : sequence of BandEstimate
        Of its condition, that of the band of the fit first.
    settings : DiagnosticsSettings
    """
    bands = [band for band in estimates if band.part == "all"][1:]
    if not bands:
        return []
    change, p = (np.array([getattr(band, name) for band in bands]) for name in ("change", "p"))
    p = np.minimum(change.size * p, 1.0)  # Bonferroni
    half, most = half_widths(fit), settings.max_band_sensitivity_percent
    percent, of_half = 100 * np.abs(change / fit.value), np.abs(change) / half
    contradicting = (p < CHANCE) & (percent > most) & (of_half > OF_HALF)
    if not np.any(contradicting):
        return []
    at, j = divmod(int(np.argmax(np.where(contradicting, of_half, 0.0))), 3)
    band, own, value = bands[at], estimates[0], float(percent[at, j])
    facts: dict[str, Fact] = {"symbol": PARAMETERS[j].symbol, "of_half": float(of_half[at, j])}
    facts["way"] = "more" if change[at, j] * fit.value[j] > 0 else "less"
    facts["error"] = float(100 * band.change_se[j] / abs(fit.value[j]))
    facts |= {"low_hz": band.low_hz, "high_hz": band.high_hz}
    facts |= {"own_low_hz": own.low_hz, "own_high_hz": own.high_hz}
    effect, chance = Effect.of(-change[at], fit.value, half), float(p[at, j])
    name = "band_sensitivity"
    return [found(name, settings, value, most, p=chance, facts=facts, effect=effect)]
