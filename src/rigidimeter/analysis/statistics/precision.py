"""How precise a mean or an estimate is, and how many values would make it better.

    N ≈ n (1.96 SE / (0.05 |value|))²,   SE the standard error from n values

since it falls with the root of their number. 1.96 SE is half the 95 % interval of many values; that
of few is wider, for their scatter is not well known. A bias does not fall.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.statistics.summary import summarise

_WIDE = 1.959963984540054
"""97.5 % quantile of the normal distribution."""

WANTED_PERCENT = 5.0
"""Half the interval that is asked for, in per cent of the value."""

Estimate = tuple[float, float, float, float]
"""A value, the ends of its 95 % interval, and its standard error."""


class Precision(NamedTuple):
    """A value with its 95 % interval.

    Attributes
    ----------
    n : int
        Values that it is from, such as epochs.
    value, low, high, se : float
        With the standard error; NaN where it is not known.
    sd_percent : float
        Standard deviation of the values, in % of their mean; NaN of one.
    """

    n: int
    value: float
    low: float
    high: float
    se: float
    sd_percent: float

    @property
    def percent(self) -> float:
        """Half the interval in per cent of the value."""
        return 100 * (self.high - self.low) / 2 / (abs(self.value) or math.nan)

    @property
    def needed(self) -> int | None:
        """The number of values whose interval is ± `WANTED_PERCENT`; None if it is not known."""
        percent = 100 * _WIDE * self.se / (abs(self.value) or math.nan)
        count = self.n * (percent / WANTED_PERCENT) ** 2
        return math.ceil(count - 1e-9) if math.isfinite(count) else None

    def row(self) -> dict[str, Any]:
        """Return all numbers as tables have them."""
        return {
            "epochs": self.n,
            "value": self.value,
            "low": self.low,
            "high": self.high,
            "se": self.se,
            "half_width_percent": self.percent,
            "sd_percent": self.sd_percent,
            "epochs_for_5_percent": self.needed,
        }


def precision_of(values: Sequence[float], together: Estimate | None = None) -> Precision:
    """Return how precise an estimate is, or else the mean of the values it is from.

    Parameters
    ----------
    values : sequence of float
        One of each epoch. Without `together` one at least.
    together : (float, float, float, float), optional
        The estimate from all of them.

    Examples
    --------
    >>> found = precision_of([1.0, 2.0, 3.0])
    >>> found.value, round(found.percent), found.needed
    (2.0, 124, 385)
    """
    sd_percent = summarise(values).sd_percent
    return Precision(max(len(values), 1), *(together or _mean(values)), sd_percent)


def _mean(values: Sequence[float]) -> Estimate:
    """Return the mean with the interval from the scatter, and its standard error."""
    n, mean = len(values), float(np.mean(values))
    se = float(np.std(values, ddof=1)) / math.sqrt(n) if n > 1 else math.nan
    half = float(scipy.stats.t.ppf(0.975, n - 1)) * se if n > 1 else math.nan
    return mean, mean - half, mean + half, se
