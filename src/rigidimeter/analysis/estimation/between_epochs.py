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

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.estimation.found import found
from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.core.findings import Fact, Finding
from rigidimeter.core.records import PARAMETERS, Fit
from rigidimeter.core.settings import DiagnosticsSettings
from rigidimeter.core.words import epoch_name, short_names

FEWEST_EPOCHS = 3
NAME = "varying_between_epochs"
TREND_P = 0.05
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
    values, errors = (np.array([getattr(fit, of) for fit in fits]) for of in ("value", "se"))
    if not np.all(np.isfinite(values)) or not np.all(errors > 0):
        return None
    half = np.array([fit.high - fit.low for fit in fits]) / 2
    known, quantile = _quantiles()
    degrees = np.interp(-half / errors, -quantile, known)
    scatters = [scatter(j, values[:, j], errors[:, j], degrees[:, j]) for j in range(3)]
    most = settings.max_varying_percent
    if by_perturbation:
        ranked = sorted(scatters, key=lambda one: one.p)
        sure = []
        for left, one in zip(range(3, 0, -1), ranked, strict=True):  # Holm 1979
            if not one.p * left < settings.varying_chance:
                break
            sure.append(one)
    else:
        K, J = scatters[STIFFNESS], scatters[INERTIA]
        sure = [K] if K.p < settings.varying_chance and K.percent > J.percent else []
    large = sorted((one for one in sure if one.percent > most), key=lambda one: -one.percent)
    if not large:
        return None
    first, *others = large
    labels, about = [fit.epoch for fit in fits], PARAMETERS[first.parameter]
    names = short_names(fit.source for fit in fits)
    called = [epoch_name(fit.epoch, fit.source, names) for fit in fits]
    low, high = int(np.argmin(first.drawn)), int(np.argmax(first.drawn))
    trend_percent, trend_p = first.trend()
    way = "rising" if trend_percent > 0 else "falling"
    trend = f", {way} by {abs(trend_percent):.0f} % over the epochs" if trend_p < TREND_P else ""
    facts: dict[str, Fact] = {
        "symbol": about.symbol,
        "size_unit": about.unit,
        "low": float(first.drawn[low]),
        "low_at": called[low],
        "high": float(first.drawn[high]),
        "high_at": called[high],
        "sd": first.sd,
        "trend_percent": trend_percent,
        "trend_p": trend_p,
        "trend": trend,
        "others": also([PARAMETERS[one.parameter].symbol for one in others]),
    }
    return found(
        NAME,
        settings,
        first.percent,
        most,
        p=first.p,
        epochs=tuple(labels),
        condition=fits[0].condition,
        facts=facts,
    )


def also(symbols: Sequence[str]) -> str:
    """Return which of J, B and K change too, to end a sentence."""
    return f"; {' and '.join(symbols)} too" if symbols else ""


@lru_cache
def _quantiles() -> tuple[Array, Array]:
    """Return degrees of freedom and Student's quantile for 95 % at each."""
    known = np.geomspace(1.0, 1e4, 400)
    return known, np.asarray(scipy.special.stdtrit(known, 0.975))
