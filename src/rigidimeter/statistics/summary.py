"""Median and quartiles of a sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["Summary", "summarise"]


@dataclass(frozen=True)
class Summary:
    """Count, median and quartiles (NaN when the sample is empty)."""

    n: int
    median: float
    q1: float
    q3: float


def summarise(values: ArrayLike) -> Summary:
    """Return count, median and quartiles of a one-dimensional sample.

    Quartiles interpolate linearly between order statistics (R's type 7, numpy's default).

    Raises
    ------
    ValueError
        If a value is not finite or the sample is not one-dimensional.
    """
    sample = np.asarray(values, dtype=np.float64)
    if sample.ndim != 1:
        raise ValueError(f"expected a one-dimensional sample, got shape {sample.shape}")
    if not np.all(np.isfinite(sample)):
        raise ValueError("a sample must be finite; leave out what could not be measured")
    if sample.size == 0:
        return Summary(0, float("nan"), float("nan"), float("nan"))
    q1, median, q3 = np.quantile(sample, [0.25, 0.5, 0.75])
    return Summary(int(sample.size), float(median), float(q1), float(q3))
