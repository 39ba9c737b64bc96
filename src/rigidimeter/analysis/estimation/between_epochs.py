"""Whether the joint was the same in every epoch: the scatter of estimates against their own errors.

Epochs with estimates x_e and standard errors s_e, weights w_e = 1/s_e², W = Σ w_e and the weighted
mean x̄ scatter by

    Q = Σ w_e (x_e − x̄)²

which has a chi-squared distribution with E − 1 degrees if nothing but noise differs and the s_e are
known (Cochran 1954). They are estimated with ν_e degrees of freedom, so that Q is too large; the
test of Welch (1951) takes that into account:

    F = Q / (E − 1) ÷ (1 + 2 (E − 2)/(E² − 1) Λ)      Λ = Σ (1 − w_e/W)² / ν_e

with E − 1 and (E² − 1)/(3 Λ) degrees. The variance beyond the errors is that of DerSimonian and
Laird (1986), and each epoch's estimate is drawn to the mean as far as its error says, so that noise
does not widen the range.

Without a perturbation only K is tested, and only as far as it differs more than J does: what a
subject pushes bends least squares in each epoch by another amount, J most. Inertia is the one thing
that does not change, so its scatter shows how large that is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy import special, stats

from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.records import PARAMETERS, Finding, Fit
from rigidimeter.core.settings import DiagnosticsSettings

FEWEST_EPOCHS = 3
NAME = "varying_between_epochs"
LEAST_P = 1e-6
INERTIA, STIFFNESS = 0, 2


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
        line = stats.linregress(np.arange(count), self.values)
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
    p = float(special.fdtrc(count - 1, (count**2 - 1) / (3 * unsure), F))
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
    values, errors = (np.array([getattr(fit, of) for fit in fits]) for of in ("value", "se"))
    if not np.all(np.isfinite(values)) or not np.all(errors > 0):
        return None
    half = np.array([fit.high - fit.low for fit in fits]) / 2
    degrees = _degrees(half / errors)
    found = [scatter(j, values[:, j], errors[:, j], degrees[:, j]) for j in range(3)]
    most = settings.max_varying_percent
    if by_perturbation:
        ranked = sorted(found, key=lambda one: one.p)
        sure = []
        for left, one in zip(range(3, 0, -1), ranked, strict=True):  # Holm 1979
            if not one.p * left < settings.varying_chance:
                break
            sure.append(one)
    else:
        K, J = found[STIFFNESS], found[INERTIA]
        sure = [K] if K.p < settings.varying_chance and K.percent > J.percent else []
    large = sorted((one for one in sure if one.percent > most), key=lambda one: -one.percent)
    if not large:
        return None
    return Finding(
        NAME,
        settings.levels.varying_between_epochs,
        large[0].percent,
        most,
        "; ".join(_sentence(one, most) for one in large)
        + f" (at most {most:g} %): the pooled estimate is a mean over a joint that was not the "
        "same in all epochs",
        "look at the epochs in order; state the scatter between them beside the mean",
    )


def _degrees(ratio: Array) -> Array:
    """Return the degrees of freedom of t intervals, half their width over the standard error."""
    known, quantile = _quantiles()
    return np.asarray(np.interp(-ratio, -quantile, known))


@lru_cache
def _quantiles() -> tuple[Array, Array]:
    """Return degrees of freedom and Student's quantile for 95 % at each."""
    known = np.geomspace(1.0, 1e4, 400)
    return known, np.asarray(special.stdtrit(known, 0.975))


def _sentence(one: Scatter, most: float) -> str:
    _, symbol, unit, _ = PARAMETERS[one.parameter]
    low, high = int(np.argmin(one.drawn)), int(np.argmax(one.drawn))
    trend_percent, trend_p = one.trend()
    trend = (
        f"{'rising' if trend_percent > 0 else 'falling'} by {abs(trend_percent):.0f} % "
        f"from the first to the last ({p_text(trend_p)})"
        if trend_p < 0.05
        else "without a trend"
    )
    return (
        f"{symbol} goes from {one.drawn[low]:.3g} {unit} in the {_ordinal(low)} epoch to "
        f"{one.drawn[high]:.3g} {unit} in the {_ordinal(high)}, a range of "
        f"{in_full(one.percent, '.0f', limit=most)} % of the mean, SD {one.sd:.2g} {unit} "
        f"beyond the errors, by chance {p_text(one.p)}, {trend}"
    )


def p_text(p: float) -> str:
    """Return a probability as text, a small one as a limit: no assumption is as good as that."""
    return f"p = {p:.2g}" if p >= LEAST_P else f"p < {LEAST_P:g}"


def in_full(value: float, spec: str = ".2g", *, limit: float = math.nan) -> str:
    """Return a number rounded as `spec` says, without a power of ten for a large one.

    With more digits where it would read as the limit that is shown beside it, and is not.

    Examples
    --------
    >>> in_full(104.2), in_full(7.36), in_full(-290.0, "+.2g"), in_full(2e-9)
    ('104', '7.4', '-290', '2e-09')
    >>> in_full(15.2, limit=15.0), in_full(99.98, ".0f", limit=100.0), in_full(15.0, limit=15.0)
    ('15.2', '99.98', '15')
    """
    text = format(value, spec)
    for digits in range(3, 18):  # 17 tell any two numbers apart
        if value == limit or not math.isclose(float(text), limit, rel_tol=1e-14):
            break
        text = format(value, f".{digits}g")
    whole = "e+" in text and abs(value) < 1e6
    return format(value, f"{'+' if '+' in spec else ''}.0f") if whole else text


def _ordinal(index: int) -> str:
    number = index + 1
    endings = {1: "st", 2: "nd", 3: "rd"}
    teens = 10 < number % 100 < 20
    return f"{number}{'th' if teens else endings.get(number % 10, 'th')}"
