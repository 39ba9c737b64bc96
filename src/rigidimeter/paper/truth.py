"""Estimates against the joint of Sec. 3.4, which every simulated arm has."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import Check
from rigidimeter.records import Fit

__all__ = ["TRUTH", "Array", "Triple", "errors_percent", "fitted", "signed", "unbiased"]

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

TRUTH = np.array(
    [
        printed.SEC_34.inertia_kg_m2,
        printed.SEC_34.damping_nm_s_rad,
        printed.SEC_34.stiffness_nm_rad,
    ]
)
"""J, B and K, in the units of `JointDynamics`."""


def fitted(fit: Fit) -> Triple:
    """Return J, B and K of a fit."""
    return fit.inertia_kg_m2, fit.damping_nm_s_rad, fit.stiffness_nm_rad


def errors_percent(values: Triple | Array) -> Triple:
    """Return how far J, B and K are from the truth, in percent of it."""
    J, B, K = 100.0 * (np.asarray(values) / TRUTH - 1.0)
    return float(J), float(B), float(K)


def unbiased(errors: Triple, percent: float) -> tuple[Check, ...]:
    """Return a check for each of J, B and K: its error is at most so many percent either way."""
    return tuple(
        Check(f"Error of {name}", "%", 0.0, error, -percent, percent)
        for name, error in zip("JBK", errors, strict=True)
    )


def signed(value: float, decimals: int) -> str:
    """Return a number with its sign, never as a negative zero."""
    return f"{round(value, decimals) + 0.0:+.{decimals}f}".replace("-", "−")
