"""Which test of a difference, by the days and the subjects that were recorded.

    value of a day = mean of its epochs in a condition
    one subject: δ and Var δ of these values as in `partially_paired`, a day the unit
    three subjects or more with both conditions: the paired t-test of their means over days
    two such subjects, or one of several: δ = mean of δ_s, Var δ = Σ Var δ_s / S², each by its days
    no subject with both conditions: Welch's test of subjects
    two days of a condition: Var δ at least Σ_c s²(epochs within days)/n_c² Σ_days 1/m

Nothing is assumed of how alike the conditions of a day are, nor of equal variances.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rigidimeter.analysis.statistics.partially_paired import PartiallyPaired, partially_paired

Days = dict[str, tuple[list[float], list[float]]]
"""Of each day the values of x and those of y."""
Epochs = dict[str, Days]
"""Of each subject."""
FEWEST_SUBJECTS = 3
"""With fewer subjects that have both conditions, their days are what is compared."""


class Tested(NamedTuple):
    """A difference of two means with its standard error and degrees of freedom, and the test.

    `unit` is what was compared: ``day`` or ``subject``.
    """

    estimate: float
    se: float
    df: float
    words: str
    mean_x: float
    mean_y: float
    unit: str = "day"


def test_by_levels(epochs: Epochs, names: tuple[str, str]) -> Tested:
    """Return the difference of x and y, called by these names, tested by days or subjects.

    Raises
    ------
    ValueError
        If a condition has one day (or one subject), or they do not vary.
    """
    if len(epochs) == 1:
        (days,) = epochs.values()
        return _of_days(days, names)
    means = {subject: _means(own) for subject, own in epochs.items()}
    levels = {
        subject: (_mean([x for x, _ in own.values()]), _mean([y for _, y in own.values()]))
        for subject, own in means.items()
    }
    both = {subject: values for subject, values in levels.items() if not np.isnan(values).any()}
    left_out = f", {_count(len(levels) - len(both), 'subject')} with one condition left out"
    said = left_out if len(both) < len(levels) else ""
    if not both or len(both) >= FEWEST_SUBJECTS:
        tested = _of_units(both or levels, "subject", names)
        return tested._replace(words=tested.words + said) if both else tested
    found = []
    for subject in both:
        try:
            found.append(_of_days(epochs[subject], names))
        except ValueError as error:
            raise ValueError(
                f"subject {subject}: {error} (with three subjects or more that have both "
                "conditions, subjects are compared)"
            ) from None
    n = len(found)
    variances = np.array([each.se**2 for each in found]) / n**2
    df = variances.sum() ** 2 / np.sum(variances**2 / [each.df for each in found])
    told = "; ".join(f"{subject}: {each.words}" for subject, each in zip(both, found, strict=True))
    words = (
        f"mean of {_count(n, 'subject')}, each by its days ({told}){said}; no conclusion on other "
        "subjects"
    )
    mean_x = math.fsum(each.mean_x for each in found) / n
    mean_y = math.fsum(each.mean_y for each in found) / n
    return Tested(mean_x - mean_y, math.sqrt(variances.sum()), float(df), words, mean_x, mean_y)


def _of_days(days: Days, names: tuple[str, str]) -> Tested:
    """Test the days of one subject; two days agree by chance, so their epochs bound the error."""
    tested = _of_units(_means(days), "day", names)
    if min(sum(len(by[k]) > 0 for by in days.values()) for k in (0, 1)) > 2:
        return tested
    least = math.sqrt(sum(_variance_of_epochs(days, k) for k in (0, 1)))
    if tested.se >= least:
        return tested
    words = f"{tested.words}, with the standard error of the epochs alone, which is larger"
    return tested._replace(se=least, words=words)


def _variance_of_epochs(days: Days, k: int) -> float:
    """Return what the scatter of epochs within days gives the unweighted mean of the days."""
    own = [np.array(by[k]) for by in days.values() if by[k]]
    free = sum(day.size - 1 for day in own)
    if not free:
        return 0.0
    within = sum(float(np.sum((day - day.mean()) ** 2)) for day in own) / free
    return within * sum(1 / day.size for day in own) / len(own) ** 2


def _means(days: Days) -> dict[str, tuple[float, float]]:
    return {day: (_mean(x), _mean(y)) for day, (x, y) in days.items()}


def _of_units(
    values: Mapping[str, tuple[float, float]], unit: str, names: tuple[str, str]
) -> Tested:
    """Test units by their values in x and in y, NaN for a condition that one does not have."""
    table = np.array(list(values.values()))
    has = ~np.isnan(table)
    if len(table) == 1:
        raise ValueError(f"there is only one {unit}, so what differs between {unit}s is unknown")
    if len(table) == 2 and not has.all(axis=1).any():
        raise ValueError(
            f"there is one {unit} in each condition, so {unit} and condition cannot be separated"
        )
    for name, known in zip(names, has.T, strict=True):
        if known.sum() < 2:
            raise ValueError(
                f"there is one {unit} of {name}, so how much {name} differs between {unit}s is "
                f"unknown; record two {unit}s or more in each condition"
            )
    both = has.all(axis=1)
    try:
        found = partially_paired(*table[both].T, *(table[~both & has[:, k], k] for k in (0, 1)))
    except ValueError:
        raise ValueError(
            f"the means of the {unit}s do not vary, so there is no error to test against"
        ) from None
    words = _in_words(found, int(both.sum()), unit, names)
    return Tested(found.estimate, found.se, found.df, words, found.mean_x, found.mean_y, unit)


def _in_words(found: PartiallyPaired, both: int, unit: str, names: tuple[str, str]) -> str:
    counts = [found.n_x, found.n_y]
    if not found.n_both:
        of = [f"{_count(n, unit)} of {name}" for n, name in zip(counts, names, strict=True)]
        twice = f" ({_count(both, unit)} with both counted in each)" if both else ""
        return f"Welch's t-test of {of[0]} and {of[1]}{twice}"
    if not any(counts):
        return f"paired t-test of {_count(both, unit)}"
    alone = [
        f"{_count(n, unit)} of {name} alone at weight {weight:.2f}"
        for n, name, weight in zip(counts, names, (found.weight_x, found.weight_y), strict=True)
        if n
    ]
    return f"t-test paired by {_count(both, unit)}, with {' and '.join(alone)}"


def _mean(values: Sequence[float]) -> float:
    """Return the mean of what is known; NaN if nothing is."""
    known = [value for value in values if not math.isnan(value)]
    return math.fsum(known) / len(known) if known else math.nan


def _count(n: int, unit: str) -> str:
    return f"{n} {unit}{'s' * (n != 1)}"
