"""A sample, checked; its median, quartiles and scatter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Summary:
    """Count, median and quartiles (NaN when the sample is empty), and scatter.

    `sd_percent` is the standard deviation in % of the mean; NaN with fewer than two values, or a
    mean that is not positive.
    """

    n: int
    median: float
    q1: float
    q3: float
    sd_percent: float = float("nan")


def summarise(values: ArrayLike) -> Summary:
    """Return count, median, quartiles and scatter of a one-dimensional sample.

    Quartiles interpolate linearly between order statistics (R's type 7, numpy's default).

    Raises
    ------
    ValueError
        If a value is not finite or the sample is not one-dimensional.
    """
    sample = checked_sample("a sample", values, min_size=0)
    if sample.size == 0:
        return Summary(0, float("nan"), float("nan"), float("nan"))
    q1, median, q3 = np.quantile(sample, [0.25, 0.5, 0.75])
    mean = float(np.mean(sample))
    sd_percent = float("nan")
    if sample.size > 1 and mean > 0:
        with np.errstate(over="ignore"):
            sd_percent = 100.0 * float(np.std(sample / mean, ddof=1))
    return Summary(int(sample.size), float(median), float(q1), float(q3), sd_percent)


def checked_sample(name: str, values: ArrayLike, *, min_size: int = 1) -> Array:
    """Return values as an array; `name` is what a message calls them.

    Raises
    ------
    ValueError
        If they are not one-dimensional, not finite, or fewer than `min_size`.
    """
    sample = np.asarray(values, dtype=np.float64)
    if sample.ndim != 1:
        raise ValueError(f"{name} must be one-dimensional, got shape {sample.shape}")
    if sample.size < min_size:
        raise ValueError(f"{name} is empty; at least {min_size} value is needed")
    if not np.all(np.isfinite(sample)):
        raise ValueError(f"{name} must be finite; leave out what could not be measured")
    return sample
