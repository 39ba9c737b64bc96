"""How precise the estimates of a condition are, and how many epochs would make them better.

    N ≈ n (1.96 SE / (0.05 |K|))²,   SE the standard error from n epochs

since it falls with the root of the number of epochs. 1.96 SE is half the 95 % interval of many
epochs; that of few is wider, for their scatter is not well known. A bias, such as that by the
subject's own torque, does not fall.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import scipy

from rigidimeter.analysis.statistics import summarise
from rigidimeter.analysis.study_anew.measures import MEASURES, Measure
from rigidimeter.analysis.study_anew.rows import counting

_WIDE = 1.959963984540054
"""97.5 % quantile of the normal distribution."""
WANTED_PERCENT = 5.0
"""Half the interval that is asked for, in per cent of the value."""


class Precision(NamedTuple):
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
        return self.measure.names | {
            "epochs": self.n,
            "value": self.value,
            "low": self.low,
            "high": self.high,
            "se": self.se,
            "half_width_percent": self.percent,
            "sd_percent": self.sd_percent,
            "epochs_for_5_percent": self.epochs_needed,
        }


def precisions(rows: pd.DataFrame, condition: str) -> tuple[Precision, ...]:
    """Return each measure of the only condition of some rows, from their epochs alone."""
    found = []
    for measure in sorted(MEASURES, key=lambda one: one.place):
        values = counting(rows, measure.name)
        together = _together(rows, measure, condition)
        if measure.origin == "fits" and not len(together) and len(values) == 1:
            together = values
        if len(together):
            sd_percent = summarise(values["value"].to_numpy()).sd_percent
            value, low, high, se = together.iloc[0][["value", "low", "high", "se"]].astype(float)
            n = max(len(values), 1)
            found.append(Precision(measure, n, value, low, high, se, sd_percent))
        elif len(values):
            found.append(_of_values(measure, values["value"].to_numpy()))
    return tuple(found)


def precisions_of_each(
    rows: pd.DataFrame, conditions: Iterable[str]
) -> dict[str, tuple[Precision, ...]]:
    """Return each measure of each condition that has any, from its epochs alone."""
    found = {name: precisions(rows[rows["condition"] == name], name) for name in conditions}
    return {name: each for name, each in found.items() if each}


def _together(rows: pd.DataFrame, measure: Measure, condition: str) -> pd.DataFrame:
    """Return the estimate from all epochs of a condition, else from all epochs; if it counts."""
    mine = rows[rows["chosen"] & (rows["measure"] == measure.name)]
    for scope in ("condition", "all"):
        own = mine[mine["scope"] == scope]
        if scope == "condition":
            own = own[own["condition"] == condition]
        if len(own):
            return own[own["outcome"] == "included"]
    return mine[:0]


def _of_values(measure: Measure, values: np.ndarray[tuple[int], np.dtype[Any]]) -> Precision:
    n, mean = len(values), float(np.mean(values))
    se = float(np.std(values, ddof=1)) / math.sqrt(n) if n > 1 else math.nan
    half = float(scipy.stats.t.ppf(0.975, n - 1)) * se if n > 1 else math.nan
    sd_percent = summarise(values).sd_percent
    return Precision(measure, n, mean, mean - half, mean + half, se, sd_percent)
