"""How much J, B and K vary between epochs and days: what is assumed, and what it makes of a day.

With σ_d the SD between days in one condition and ρ the correlation of the two conditions of a day,
what a day does to one condition has the SD σ_b = σ_d √(1 − ρ).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from rigidimeter.core.settings import SubjectSettings

CORRELATION = 0.5
"""ρ where it is not known; chosen, as for the weights of the test by days."""

_OF_EFFECT = 0.5


@dataclass(frozen=True)
class Scatter:
    """How much one measure varies beyond the error of an epoch: SDs in % of a condition's value.

    Attributes
    ----------
    between_epochs_percent : float
        σ_e, within a day and a condition, without the error of the measurement.
    between_days_percent : float
        σ_d, of one condition.
    condition_in_day_percent : float
        σ_b, what remains of σ_d in the difference of two conditions of one day, over √2.
    source : str
        Where the numbers are from.
    between_subjects : float
        τ as a share of the difference.
    source_of_days : str
        Where those of days are from, if from elsewhere.
    """

    between_epochs_percent: float
    between_days_percent: float
    condition_in_day_percent: float
    source: str
    between_subjects: float = _OF_EFFECT
    source_of_days: str = ""

    def __str__(self) -> str:
        """Return what a plan assumes, in words."""
        epochs = f"{self.between_epochs_percent:.2g} % between epochs"
        days = f"{self.condition_in_day_percent:.2g} % of condition by day"
        if self.source_of_days in ("", self.source):
            return f"{epochs}, {days} ({self.source})"
        return f"{epochs} ({self.source}), {days} ({self.source_of_days})"


DAY_CV_PERCENT = {"inertia": 2.0, "damping": 9.0, "stiffness": 12.0}
EPOCH_CV_PERCENT = {"inertia": 2.0, "damping": 12.0, "stiffness": 16.0}
"""Coefficients of variation between days and between epochs of a day.

Table 2 of the paper: r = .35 and .37 with 78 + 23 epochs mean that OFF and DBS differ by 0.92 and
0.98 standard deviations. With B lower by 13 % and K by 18 % that is 15 and 20 % between epochs of
all days. How much of it is between days the paper does not say: a third of the variance is chosen,
and both of J.
"""

ASSUMED: Mapping[str, Scatter] = {
    name: Scatter(
        EPOCH_CV_PERCENT[name],
        DAY_CV_PERCENT[name],
        DAY_CV_PERCENT[name] * math.sqrt(1.0 - CORRELATION),
        "chosen" if name == "inertia" else "Table 2 of the paper",
        source_of_days="chosen",
    )
    for name in DAY_CV_PERCENT
}
"""Where no study of the user's own is named."""


def day_difference_sd(
    scatter: Scatter,
    values: tuple[float, float],
    epoch_se: tuple[float, float],
    epochs: tuple[int, int],
) -> float:
    """Return √v, the SD of the difference of two conditions on one day, in the unit of `values`.

    Parameters
    ----------
    scatter : Scatter
    values, epoch_se : (float, float)
        Of both conditions, and the standard errors of one epoch, in one unit.
    epochs : (int, int)
        Of a day, in each condition.

    Examples
    --------
    >>> round(day_difference_sd(Scatter(10.0, 0.0, 0.0, ""), (1.0, 1.0), (0.0, 0.0), (2, 2)), 3)
    0.1
    """
    of_day = scatter.condition_in_day_percent / 100.0
    of_epoch = scatter.between_epochs_percent / 100.0
    return math.sqrt(
        sum(
            (of_day * value) ** 2 + ((of_epoch * value) ** 2 + se**2) / n
            for value, se, n in zip(values, epoch_se, epochs, strict=True)
        )
    )


def assumed_scatter(parameter: str, condition: str, subject: SubjectSettings) -> Scatter:
    """Return what is assumed, with the SD between epochs of the settings where it is above 0.

    0 is the default of a virtual joint, and no joint of a person.
    """
    assumed, of_epochs = ASSUMED[parameter], float(getattr(subject, f"{parameter}_cv_percent"))
    if of_epochs == 0.0:
        return assumed
    return replace(
        assumed,
        between_epochs_percent=of_epochs,
        source=f"subject.{condition}",
    )
