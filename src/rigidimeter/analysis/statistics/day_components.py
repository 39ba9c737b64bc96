"""How much of the variance of epochs is within days, between days, and of a condition in its day.

    x_cdk = μ_c + a_d + b_cd + e_cdk

within: σ_e², the mean square of epochs about the mean of their day and condition. Between days:
Var(a + b), by mean squares of days in one condition and subject. Condition in day: Var b, from the
differences δ_d of the two conditions of a day, whose squares about their mean add up to

    E Σ_d (δ_d − δ̄)² = (n − 1) (2 Var b + σ_e² mean_d(1/n_x + 1/n_y))

over the n days with both, in each subject. A variance that would be negative is zero.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np

from rigidimeter.analysis.statistics.day_levels import SubjectEpochs


@dataclass(frozen=True)
class DayComponents:
    """Components of variance, in the squared unit of the values; NaN where they are unknown.

    Attributes
    ----------
    within : float
        Between epochs of one day and condition; NaN where no such day has two epochs.
    between_days : float
        Between days of one condition, NaN with one day in each, or without `within`.
    condition_in_day : float
        What a day does to one condition; NaN where no subject has two days with both.
    days_both : int
        Days with both conditions.
    """

    within: float
    between_days: float
    condition_in_day: float
    days_both: int

    @property
    def day_share(self) -> float:
        """The share of the variance of one condition that is between days; NaN if unknown."""
        total = self.between_days + self.within
        return self.between_days / total if total else math.nan


def day_components(epochs: SubjectEpochs) -> DayComponents:
    """Return the components of variance of epochs in two conditions.

    Parameters
    ----------
    epochs : dict
        Of each subject and day the values of both conditions.

    Examples
    --------
    >>> days = {"1": ([1.0, 3.0], [2.0, 2.0]), "2": ([4.0, 6.0], [5.0, 5.0])}
    >>> found = day_components({"": days})
    >>> found.within, found.between_days, found.condition_in_day
    (1.0, 4.0, 0.0)
    """
    within = between = size = 0.0
    df_within = df_between = 0
    for own, k in itertools.product(epochs.values(), (0, 1)):
        days = [np.array(by[k]) for by in own.values() if by[k]]
        if not days:
            continue
        n = np.array([day.size for day in days])
        means = np.array([day.mean() for day in days])
        between += float(n @ (means - n @ means / n.sum()) ** 2)
        within += sum(float(np.sum((day - day.mean()) ** 2)) for day in days)
        size += n.sum() - n @ n / n.sum()
        df_between += n.size - 1
        df_within += int(n.sum()) - n.size
    of_epochs = within / df_within if df_within else math.nan
    of_days = max((between - df_between * of_epochs) / size, 0.0) if df_between else math.nan
    squares = of_means = 0.0
    df = days_both = 0
    for own in epochs.values():
        both = [
            (np.mean(x) - np.mean(y), 1 / len(x) + 1 / len(y)) for x, y in own.values() if x and y
        ]
        days_both += len(both)
        if len(both) > 1:
            differences, shares = np.array(both).T
            squares += float(np.sum((differences - differences.mean()) ** 2))
            of_means += (len(both) - 1) * float(shares.mean())
            df += len(both) - 1
    of_condition = max((squares - of_means * of_epochs) / (2 * df), 0.0) if df else math.nan
    return DayComponents(of_epochs, float(of_days), of_condition, days_both)
