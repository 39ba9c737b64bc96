"""A difference of two conditions in which days count, not epochs.

    value = β_c + a_s + b_d + c_dc + e,   each but β ~ N(0, σ²) with a σ of its own:
    a_s of a subject, b_d of a day, c_dc of a condition within a day that had both
    estimate = β_x − β_y,   interval and p by Kenward and Roger
    p_days: of all ways to deal the day medians to the conditions, the share whose rank sum lies
    at least as far from its mean as the one that was found

Epochs of one day share what the day was like, so they are no independent draws. If every day has
as many epochs as any other, the test is the t-test of the means of the days: that of two groups
if each day had one condition, the paired one if each had both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import rankdata

from rigidimeter.statistics.contrasts import difference, interval_of
from rigidimeter.statistics.mixed import fit_mixed, nested
from rigidimeter.statistics.summary import checked_sample

Array = NDArray[np.float64]

_X, _Y = "x", "y"
_IN_WORDS = {"condition in day": "condition within a day"}


@dataclass(frozen=True)
class DayDifference:
    """x less y, with days as what was sampled; in the unit of the values where not said.

    Attributes
    ----------
    estimate, se : float
        From the mixed model; the standard error is Kenward and Roger's.
    low, high : float
        The interval at `confidence`.
    p, df : float
        Two-sided, Kenward and Roger's, and its degrees of freedom.
    n_days_x, n_days_y : int
        Days with a value; a day with both conditions counts in both.
    p_days : float
        Exact two-sided rank-sum test of the medians of the days, dealt within each subject. NaN
        where a condition has one day, or no subject has days in both.
    day_share : float
        (σ_d² + σ_dc²)/(σ_d² + σ_dc² + σ²): the share of the variance between epochs of one
        condition and subject that is between days. NaN where every day has one epoch of each.
    offsets : tuple of str
        What had an offset of its own: ``subject``, ``day``, ``condition in day``.
    confidence : float
    remark : str
        Why there is no test, else empty: a test that could not be made has NaN for its numbers.
    """

    estimate: float
    se: float
    low: float
    high: float
    p: float
    df: float
    n_days_x: int
    n_days_y: int
    p_days: float
    day_share: float
    offsets: tuple[str, ...]
    confidence: float = 0.95
    remark: str = ""

    @property
    def model(self) -> str:
        """What the model had offsets for, in words."""
        named = [f"each {_IN_WORDS.get(name, name)}" for name in self.offsets]
        return " and ".join([", ".join(named[:-1]), *named[-1:]][len(named) < 2 :])


def day_difference(
    x: ArrayLike,
    y: ArrayLike,
    x_days: Sequence[str],
    y_days: Sequence[str],
    *,
    x_subjects: Sequence[str] | None = None,
    y_subjects: Sequence[str] | None = None,
    one_offset: bool = False,
    confidence: float = 0.95,
) -> DayDifference:
    """Estimate and test the mean of x less that of y, each day with an offset of its own.

    Parameters
    ----------
    x, y : array_like, shape (m,) and (n,)
        Values of single epochs in the two conditions, finite, in one unit.
    x_days, y_days : sequence of str
        The day of each value. A label in both means one day with both conditions: what they
        share cancels in the difference, what each had to itself that day does not.
    x_subjects, y_subjects : sequence of str, optional
        The subject of each value; none means one subject. A day belongs to its subject.
    one_offset : bool
        Take it that a day with both conditions moves both alike, so that c_dc is nothing. Then
        few common days say much; if it is not so, the test finds what is not there.
    confidence : float
        Of the interval.

    Raises
    ------
    ValueError
        If a sample is empty or not finite, the labels are not as many as the values, `confidence`
        is not between 0 and 1, or days (or subjects) cannot be separated from the conditions: there
        is one, or one in each condition.

    Notes
    -----
    Where every day has one epoch, day and residual are one, and the test is the ordinary t-test
    with equal variances. A component that the data cannot separate from the residual is left to it.

    References
    ----------
    Kenward and Roger, Biometrics 53, 1997. Saravanan, Berman and Sober, Application of the
    hierarchical bootstrap to multi-level data in neuroscience, Neurons Behav. Data Anal. Theory 3,
    2020 (why levels count). van Elteren, Bull. Inst. Int. Stat. 37, 1960 (ranks within strata).

    Examples
    --------
    >>> found = day_difference(
    ...     [3.0, 3.2, 4.0, 4.2, 5.0, 5.2],
    ...     [1.0, 1.2, 2.0, 2.2],
    ...     ["1", "1", "2", "2", "3", "3"],
    ...     ["4", "4", "5", "5"],
    ... )
    >>> round(found.estimate, 3), round(found.df, 3)
    (2.5, 3.0)
    """
    if not 0 < confidence < 1:
        raise ValueError(f"confidence must be between 0 and 1, got {confidence}")
    samples = [checked_sample(_X, x), checked_sample(_Y, y)]
    days = [list(map(str, x_days)), list(map(str, y_days))]
    subjects = [
        [""] * sample.size if given is None else list(map(str, given))
        for sample, given in zip(samples, (x_subjects, y_subjects), strict=True)
    ]
    for name, sample, day, subject in zip((_X, _Y), samples, days, subjects, strict=True):
        if not len(day) == len(subject) == sample.size:
            raise ValueError(
                f"{name} has {sample.size} values, {len(day)} days and {len(subject)} subjects"
            )
    values = np.concatenate(samples)
    conditions = [_X] * samples[0].size + [_Y] * samples[1].size
    whose = subjects[0] + subjects[1]
    units = nested(whose, days[0] + days[1])
    groups = {"subject": whose, "day": units} if len(set(whose)) > 1 else {"day": units}
    for name, labels in groups.items():
        _check_apart(name, labels, conditions)
    visits = nested(units, conditions)
    if len(set(visits)) > len(set(units)) and not one_offset:  # some days had both
        groups["condition in day"] = visits
    fit = fit_mixed(values, conditions, groups)
    found = difference(fit, _X, _Y)
    se, df = found.se_kenward_roger, found.df_kenward_roger
    low, high = interval_of(found.estimate, se, df, confidence)
    # A subject with one day: its offset and the day's are one.
    of_day = "subject" if _same(whose, units) and "subject" in groups else "day"
    between = fit.variances[of_day] + fit.variances.get("condition in day", 0.0)
    single = len(set(visits)) == values.size
    return DayDifference(
        estimate=found.estimate,
        se=se,
        low=low,
        high=high,
        p=found.p_kenward_roger,
        df=df,
        n_days_x=len({*nested(subjects[0], days[0])}),
        n_days_y=len({*nested(subjects[1], days[1])}),
        p_days=_p_of_medians(values, conditions, whose, units),
        day_share=math.nan if single else between / (between + fit.variance_residual),
        offsets=tuple(groups),
        confidence=confidence,
    )


def day_medians(values: ArrayLike, days: Sequence[str]) -> dict[str, float]:
    """Return the median of each day, in order of appearance."""
    sample = np.asarray(values, dtype=np.float64)
    labels = np.asarray(days, dtype=object)
    return {str(day): float(np.median(sample[labels == day])) for day in dict.fromkeys(days)}


def exact_ranksum(strata: Sequence[tuple[ArrayLike, ArrayLike]]) -> float:
    """Return the exact two-sided p of the rank-sum test, ranks and dealing within each stratum.

    Tied values share their mid-rank, and the distribution is that of these ranks. Two-sided: the
    probability of a rank sum at least as far from its mean. NaN if no stratum has both samples.

    Parameters
    ----------
    strata : sequence of (array_like, array_like)
        The two samples of each stratum; a single stratum is the usual test.

    Examples
    --------
    >>> round(exact_ranksum([([4.0, 5.0, 6.0], [1.0, 2.0, 3.0])]), 3)
    0.1
    """
    counts = np.ones(1)  # by twice the rank sum, which is whole with mid-ranks too
    found, mean, known = 0, 0.0, False
    for x, y in strata:
        first, second = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
        if first.size == 0 or second.size == 0:
            continue
        known = True
        twice = np.rint(2 * rankdata(np.concatenate([first, second]))).astype(np.int64)
        counts = np.convolve(counts, _sums(twice, first.size))
        found += int(twice[: first.size].sum())
        mean += first.size * float(twice.mean())
    if not known:
        return math.nan
    far = np.abs(np.arange(counts.size) - mean) >= abs(found - mean) - 1e-9
    return min(float(counts[far].sum() / counts.sum()), 1.0)


def _sums(ranks: NDArray[np.int64], size: int) -> Array:
    """Return how probable each sum of `size` of the ranks is, over all choices of that size."""
    table = np.zeros((size + 1, int(ranks.sum()) + 1))
    table[0, 0] = 1.0
    for k, rank in enumerate(ranks.tolist(), start=1):
        # Of k ranks: taken into j of them with probability j/k, so that nothing overflows.
        for j in range(min(k, size), 0, -1):
            taken = np.zeros_like(table[j])
            taken[rank:] = table[j - 1, : table.shape[1] - rank]
            table[j] = ((k - j) * table[j] if j < k else 0.0) / k + taken * j / k
    return np.asarray(table[size])


def _p_of_medians(
    values: Array, conditions: Sequence[str], subjects: Sequence[str], units: Sequence[str]
) -> float:
    medians: dict[str, tuple[list[float], list[float]]] = {}
    whose = np.asarray(subjects, dtype=object)
    group = np.asarray(conditions, dtype=object)
    unit = np.asarray(units, dtype=object)
    for subject in dict.fromkeys(subjects):
        pair: list[list[float]] = []
        for name in (_X, _Y):
            mine = (whose == subject) & (group == name)
            pair.append(list(day_medians(values[mine], unit[mine].tolist()).values()))
        medians[subject] = (pair[0], pair[1])
    if min(sum(len(pair[k]) for pair in medians.values()) for k in (0, 1)) < 2:
        return math.nan
    return exact_ranksum(list(medians.values()))


def _check_apart(name: str, labels: Sequence[str], conditions: Sequence[str]) -> None:
    """Refuse days that are the conditions: one, or one in each with no other."""
    pairs = {*zip(labels, conditions, strict=True)}
    if len(set(labels)) == 1:
        raise ValueError(f"there is only one {name}, so what differs between {name}s is unknown")
    if len(set(labels)) == 2 == len(pairs):
        raise ValueError(
            f"there is one {name} in each condition, so {name} and condition cannot be separated"
        )


def _same(first: Sequence[str], second: Sequence[str]) -> bool:
    pairs = {*zip(first, second, strict=True)}
    return len(pairs) == len(set(first)) == len(set(second))
