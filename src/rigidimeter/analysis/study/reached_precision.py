"""How precise the estimates of a condition are, and how many epochs would make them better.

    N ≈ n (1.96 SE / (0.05 |K|))²,   SE the standard error from n epochs

since it falls with the root of the number of epochs. 1.96 SE is half the 95 % interval of many
epochs; that of few is wider, for their scatter is not well known. A bias, such as that by the
subject's own torque, does not fall.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from rigidimeter.analysis.statistics import summarise
from rigidimeter.analysis.study.compared import measure_names
from rigidimeter.analysis.study.comparison import split_pooled
from rigidimeter.analysis.study.conclusions import conclude
from rigidimeter.analysis.study.measures import MEASURES, Measure
from rigidimeter.analysis.study.results import StudyResult
from rigidimeter.core.records import PARAMETERS, Analysis, Fit

_WIDE = 1.959963984540054
"""97.5 % quantile of the normal distribution."""
WANTED_PERCENT = 5.0
"""Half the interval that is asked for, in per cent of the value."""


@dataclass(frozen=True)
class Precision:
    """One measure of one condition.

    Attributes
    ----------
    measure : Measure
    n : int
        Epochs.
    value, low, high : float
        With a 95 % interval: J, B and K fitted to all epochs together; scores as the mean over
        epochs, with an interval from their scatter.
    se : float
        The standard error of `value`.
    sd_percent : float
        Standard deviation between the epochs, in % of their mean; NaN of one epoch.
    """

    measure: Measure
    n: int
    value: float
    low: float
    high: float
    se: float
    sd_percent: float

    @property
    def percent(self) -> float:
        """Half the interval in per cent of the value."""
        return 100 * (self.high - self.low) / 2 / abs(self.value) if self.value else math.nan

    @property
    def epochs_needed(self) -> int | None:
        """The number of epochs whose interval is ± `WANTED_PERCENT`; None where it is not known."""
        if not self.value:
            return None
        percent = 100 * _WIDE * self.se / abs(self.value)
        epochs = self.n * (percent / WANTED_PERCENT) ** 2
        return math.ceil(epochs - 1e-9) if math.isfinite(epochs) else None

    def row(self) -> dict[str, Any]:
        """Return all numbers as tables have them."""
        return measure_names(self.measure) | {
            "epochs": self.n,
            "value": self.value,
            "low": self.low,
            "high": self.high,
            "se": self.se,
            "half_width_percent": self.percent,
            "sd_percent": self.sd_percent,
            "epochs_for_5_percent": self.epochs_needed,
        }


def precisions(result: StudyResult) -> tuple[Precision, ...]:
    """Return each measure of the only condition that was recorded, with its interval."""
    return () if result.other else _of_epochs(result.analysis, result.reference)


def precisions_untested(result: StudyResult) -> dict[str, tuple[Precision, ...]]:
    """Return each measure of two conditions, if no difference between them could be tested.

    As on a single day: the intervals are of its epochs alone, and hold nothing of other days.
    """
    concluded = conclude(result)
    if concluded is None or concluded.tested:
        return {}
    found = condition_precisions(result)
    return {name: found[name] for name in (result.reference, result.other) if name in found}


def condition_precisions(result: StudyResult) -> dict[str, tuple[Precision, ...]]:
    """Return each measure of each condition, from its epochs alone."""
    analysis, found = result.analysis, {}
    by_condition, _ = split_pooled(analysis)
    for name in result.condition_names or ("",):
        own = replace(
            analysis,
            fits=tuple(fit for fit in analysis.fits if fit.condition == name),
            scores=tuple(score for score in analysis.scores if score.condition == name),
            pooled=(by_condition[name],) if name in by_condition else (),
        )
        found[name] = _of_epochs(own, name)
    return {name: each for name, each in found.items() if each}


def precision_rows(result: StudyResult) -> list[dict[str, Any]]:
    """Return the measures of the only condition, or of each of two without a test, as a table."""
    found = {result.reference: precisions(result)} | precisions_untested(result)
    return [{"condition": name} | one.row() for name, each in found.items() for one in each]


def _of_epochs(analysis: Analysis, condition: str) -> tuple[Precision, ...]:
    counting = [fit for fit in analysis.fits if fit.outcome.included]
    by_condition, overall = split_pooled(analysis)
    fit = by_condition.get(condition) or overall
    if fit is None and len(counting) == 1:
        fit = counting[0]
    symbols = {parameter.name: k for k, parameter in enumerate(PARAMETERS)}
    found = []
    for measure in sorted(MEASURES, key=lambda one: one.place):
        of_fits = measure.name in symbols
        results = counting if of_fits else measure.results(analysis)
        values = [getattr(one, measure.name) for one in results if one.outcome.included]
        if of_fits and fit is not None and fit.outcome.included:
            found.append(_of_fit(measure, fit, symbols[measure.name], values))
        elif values:
            found.append(_of_values(measure, values))
    return tuple(found)


def _of_fit(measure: Measure, fit: Fit, k: int, values: Sequence[float]) -> Precision:
    value, low, high, se = (float(own[k]) for own in (fit.value, fit.low, fit.high, fit.se))
    sd_percent = summarise(values).sd_percent
    return Precision(measure, max(len(values), 1), value, low, high, se, sd_percent)


def _of_values(measure: Measure, values: Sequence[float]) -> Precision:
    n, mean = len(values), float(np.mean(values))
    se = float(np.std(values, ddof=1)) / math.sqrt(n) if n > 1 else math.nan
    half = float(scipy.stats.t.ppf(0.975, n - 1)) * se if n > 1 else math.nan
    sd_percent = summarise(values).sd_percent
    return Precision(measure, n, mean, mean - half, mean + half, se, sd_percent)
