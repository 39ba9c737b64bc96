"""A difference of two conditions in which days count, not epochs.

Epochs of one day share what the day was like, so they are no independent draws. The test is that of
`day_levels`, chosen by which days and subjects have which conditions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy
from numpy.typing import ArrayLike

from rigidimeter.analysis.statistics.contrasts import interval_of
from rigidimeter.analysis.statistics.day_components import day_components
from rigidimeter.analysis.statistics.day_levels import DayWeights, SubjectEpochs, test_by_levels
from rigidimeter.analysis.statistics.ranks import exact_ranksum
from rigidimeter.analysis.statistics.summary import checked_sample


@dataclass(frozen=True)
class DayDifference:
    """x less y, with days as what was sampled; in the unit of the values where not said.

    Attributes
    ----------
    estimate, se : float
    low, high : float
        The interval at `confidence`.
    p, df : float
        Two-sided, of t = estimate/se with these degrees of freedom.
    n_days_x, n_days_y : int
        Days with a value; a day with both conditions counts in both.
    p_days : float
        Exact two-sided rank-sum test of the medians of the days, dealt within each subject; a day
        with both conditions counts as two. NaN where a condition has one day, or no subject has
        days in both.
    day_share : float
        The share of the variance between epochs of one condition and subject that is between days,
        by mean squares. NaN where every day has one epoch of each, or no condition of a subject
        has two days.
    offsets : tuple of str
        What may differ in level: ``subject``, ``day``, ``condition in day``.
    confidence : float
    remark : str
        Why there is no test, else empty: a test that could not be made has NaN for its numbers.
    n_days_both : int
        Days with both conditions.
    test : str
        The test in words, without its degrees of freedom; empty where there is none.
    mean_x, mean_y : float
        The means that `estimate` is the difference of.
    unit : str
        What was compared: ``day``, or ``subject`` where there were enough.
    weights : pair of mappings from (str, str) to float
        Of the mean of each day, by subject and day, in `mean_x` and in `mean_y`.
    """

    estimate: float = math.nan
    se: float = math.nan
    low: float = math.nan
    high: float = math.nan
    p: float = math.nan
    df: float = math.nan
    n_days_x: int = 0
    n_days_y: int = 0
    p_days: float = math.nan
    day_share: float = math.nan
    offsets: tuple[str, ...] = ()
    confidence: float = 0.95
    remark: str = ""
    n_days_both: int = 0
    test: str = ""
    mean_x: float = math.nan
    mean_y: float = math.nan
    unit: str = "day"
    weights: DayWeights = field(default=({}, {}), repr=False)


def day_difference(
    x: ArrayLike,
    y: ArrayLike,
    x_days: Sequence[str],
    y_days: Sequence[str],
    *,
    x_subjects: Sequence[str] | None = None,
    y_subjects: Sequence[str] | None = None,
    names: tuple[str, str] = ("x", "y"),
    confidence: float = 0.95,
    called: str = "day",
) -> DayDifference:
    """Estimate and test the mean of x less that of y, with days as what was sampled.

    Parameters
    ----------
    x, y : array_like, shape (m,) and (n,)
        Values of single epochs in the two conditions, finite, in one unit.
    x_days, y_days : sequence of str
        The day of each value. A label in both means one day with both conditions: what they
        share cancels in the difference, what each had to itself that day does not.
    x_subjects, y_subjects : sequence of str, optional
        The subject of each value; none means one subject. A day belongs to its subject.
    names : (str, str)
        Of the conditions, for the words.
    confidence : float
        Of the interval.
    called : str
        What a day is called, such as ``recording`` where days are not known.

    Raises
    ------
    ValueError
        If a sample is empty or not finite, the labels are not as many as the values, `confidence`
        is not between 0 and 1, a condition has one day (or one subject), or days do not vary.

    References
    ----------
    Saravanan, Berman and Sober, Application of the hierarchical bootstrap to multi-level data in
    neuroscience, Neurons Behav. Data Anal. Theory 3, 2020 (why levels count); those of
    `partially_paired`.

    Examples
    --------
    >>> found = day_difference(
    ...     [3.0, 3.2, 4.0, 4.2, 5.0, 5.2],
    ...     [1.0, 1.2, 2.0, 2.2],
    ...     ["1", "1", "2", "2", "3", "3"],
    ...     ["4", "4", "5", "5"],
    ... )
    >>> round(found.estimate, 3), found.test
    (2.5, "Welch's t-test of 3 days of x and 2 days of y")
    """
    if not 0 < confidence < 1:
        raise ValueError(f"confidence must be between 0 and 1, got {confidence}")
    samples = [checked_sample("x", x), checked_sample("y", y)]
    days = [list(map(str, x_days)), list(map(str, y_days))]
    subjects = [
        [""] * sample.size if given is None else list(map(str, given))
        for sample, given in zip(samples, (x_subjects, y_subjects), strict=True)
    ]
    for name, sample, own_days, own in zip(("x", "y"), samples, days, subjects, strict=True):
        if not len(own_days) == len(own) == sample.size:
            raise ValueError(
                f"{name} has {sample.size} values, {len(own_days)} days and {len(own)} subjects"
            )
    epochs: SubjectEpochs = {}
    for k, columns in enumerate(zip(samples, subjects, days, strict=True)):
        for value, subject, day in zip(*columns, strict=True):
            epochs.setdefault(subject, {}).setdefault(day, ([], []))[k].append(float(value))
    tested = test_by_levels(epochs, names, called)
    estimate, se, df = tested.estimate, tested.se, tested.df
    low, high = interval_of(estimate, se, df, confidence)
    have = [sum(len(by[k]) > 0 for own in epochs.values() for by in own.values()) for k in (0, 1)]
    both = sum(all(map(len, by)) for own in epochs.values() for by in own.values())
    parts = [("subject", len(epochs) > 1), ("day", True), ("condition in day", both > 0)]
    return DayDifference(
        estimate=estimate,
        se=se,
        low=low,
        high=high,
        p=2 * float(scipy.stats.t.sf(abs(estimate) / se, df)),
        df=df,
        n_days_x=have[0],
        n_days_y=have[1],
        p_days=_p_of_medians(epochs),
        day_share=day_components(epochs).day_share,
        offsets=tuple(name for name, there in parts if there),
        confidence=confidence,
        n_days_both=both,
        test=tested.words,
        mean_x=tested.mean_x,
        mean_y=tested.mean_y,
        unit=tested.unit,
        weights=tested.weights,
    )


def day_medians(values: ArrayLike, days: Sequence[str]) -> dict[str, float]:
    """Return the median of each day, in order of appearance."""
    sample = np.asarray(values, dtype=np.float64)
    labels = np.asarray(days, dtype=object)
    return {str(day): float(np.median(sample[labels == day])) for day in dict.fromkeys(days)}


def _p_of_medians(epochs: SubjectEpochs) -> float:
    medians = [
        tuple([float(np.median(by[k])) for by in own.values() if by[k]] for k in (0, 1))
        for own in epochs.values()
    ]
    if min(sum(len(pair[k]) for pair in medians) for k in (0, 1)) < 2:
        return math.nan
    return exact_ranksum([(pair[0], pair[1]) for pair in medians])
