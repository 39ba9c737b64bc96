"""Which test of a difference, by the days and the subjects that were recorded.

    value of a day = mean of its epochs in a condition
    one subject: δ and Var δ of these values as in `partially_paired`, a day the unit
    three subjects or more with both conditions: the paired t-test of their means over days
    two such subjects, or one of several: δ = mean of δ_s, Var δ = Σ Var δ_s / S², each by its days
    no subject with both conditions: Welch's test of subjects
    two days of a condition: Var δ at least Σ_c s²(epochs within days)/n_c² Σ_days 1/m

`partially_paired` is the difference of two means where some units have both conditions and others
have one. A unit is what was sampled: a day, or a subject.

    δ = α X̄_only + (1 − α) X̄_both − β Ȳ_only − (1 − β) Ȳ_both
    Var δ = α² s²(x_only)/n_x + β² s²(y_only)/n_y + s²((1 − α) x − (1 − β) y over units with both)/n

Given the weights each part of the variance is unbiased, whatever the two variances and the
correlation within a unit: nothing is assumed of how alike the conditions of a day are, nor of equal
variances. The weights are those of least squares at equal variances and a correlation of ½, so that
they follow from the numbers of units alone: weights that follow the values choose a variance that
is too small.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rigidimeter.analysis.statistics.summary import Array

CORRELATION = 0.5
"""Of two conditions in one unit, for the weights only."""
_MIN_BOTH = 3
"""With fewer units that have both, and others beside them, each counts as two units."""

Days = dict[str, tuple[list[float], list[float]]]
"""Of each day the values of x and those of y."""
SubjectEpochs = dict[str, Days]
"""Of each subject."""
Weights = tuple[dict[str, float], dict[str, float]]
"""Of each unit in the mean of x and in that of y; those of a mean sum to one."""
DayWeights = tuple[dict[tuple[str, str], float], dict[tuple[str, str], float]]
"""The same of each day of each subject."""
_MIN_SUBJECTS = 3
"""With fewer subjects that have both conditions, their days are what is compared."""


@dataclass(frozen=True)
class PartiallyPaired:
    """A difference of means with its standard error.

    Attributes
    ----------
    estimate, se : float
        In the unit of the values.
    df : float
        Degrees of freedom of t.
    n_both, n_x, n_y : int
        Units that counted as pairs, and those that counted for one condition.
    weight_x, weight_y : float
        α and β: the share of units with x (or y) alone in the mean of x (or y).
    mean_x, mean_y : float
        With these weights; their difference is `estimate`.
    """

    estimate: float
    se: float
    df: float
    n_both: int
    n_x: int
    n_y: int
    weight_x: float
    weight_y: float
    mean_x: float
    mean_y: float


@dataclass(frozen=True)
class _Part:
    """A part of the variance, what it would be at unit variances, its degrees of freedom."""

    variance: float
    expected: float
    df: int


def partially_paired(
    x_both: ArrayLike, y_both: ArrayLike, x_only: ArrayLike, y_only: ArrayLike
) -> PartiallyPaired:
    """Estimate the mean of x less that of y from units with both and units with one.

    Parameters
    ----------
    x_both, y_both : array_like, shape (n,)
        Values of the units with both, in the same order.
    x_only, y_only : array_like, shape (n_x,) and (n_y,)
        Values of the units with one.

    Raises
    ------
    ValueError
        If a condition has fewer than two units, or the values do not vary.

    Notes
    -----
    Units with both only: the paired t-test. None with both: Welch's test. One unit or two with
    both beside others count as separate units, which makes the test conservative if the conditions
    of a unit are alike. A single unit with one condition takes its variance from those with both.

    Degrees of freedom are Welch and Satterthwaite's, with the estimated shares v_j/V of the
    variance drawn toward those m_j/M at equal variances, for shares from few values make them too
    many: 1/ν = Σ (w_j²/k_j), w_j = (1 − 1/k) v_j/V + (1/k) m_j/M with k the smallest k_j, and never
    more than Welch's. With equal numbers that is Welch's test exactly.

    References
    ----------
    Welch, Biometrika 34, 1947. Satterthwaite, Biometrics Bull. 2, 1946. Looney and Jones, A method
    for comparing two normal means using combined samples of correlated and uncorrelated data,
    Stat. Med. 22, 2003.

    Examples
    --------
    >>> found = partially_paired([3.0, 4.0, 6.0], [1.0, 3.0, 4.0], [5.0, 6.0], [])
    >>> round(found.estimate, 3), round(found.weight_x, 3), round(found.df, 2)
    (1.9, 0.2, 2.25)
    """
    both = np.array([x_both, y_both], dtype=np.float64)
    only = [np.asarray(values, dtype=np.float64) for values in (x_only, y_only)]
    if both.shape[1] < (_MIN_BOTH if only[0].size or only[1].size else 2):
        only = [np.concatenate([*pair]) for pair in zip(both, only, strict=True)]
        both = both[:, :0]
        if min(each.size for each in only) < 2:
            raise ValueError("a condition has one value, so its variance is unknown")
    n, n_x, n_y = both.shape[1], only[0].size, only[1].size
    weights = _weights(n, n_x, n_y)
    means = [
        (weight * each.mean() if each.size else 0.0) + ((1 - weight) * pair.mean() if n else 0.0)
        for weight, each, pair in zip(weights, only, both, strict=True)
    ]
    parts = list(_parts(both, only, weights))
    variance = sum(part.variance for part in parts)
    if (
        variance
        <= 1e-20 * max(float(np.max(np.abs(each), initial=0)) for each in (both, *only)) ** 2
    ):
        raise ValueError("the values do not vary, so there is no error to test against")
    return PartiallyPaired(
        float(means[0] - means[1]),
        math.sqrt(variance),
        _df(parts),
        n,
        n_x,
        n_y,
        *weights,
        *map(float, means),
    )


def _weights(n: int, n_x: int, n_y: int) -> tuple[float, float]:
    """Return α and β of generalised least squares at a correlation of `CORRELATION`."""
    pairs = n / (1 - CORRELATION**2)
    information = [[n_x + pairs, -CORRELATION * pairs], [-CORRELATION * pairs, n_y + pairs]]
    first, second = np.linalg.solve(information, [1.0, -1.0])
    return float(n_x * first), float(-n_y * second)


def _parts(both: Array, only: list[Array], weights: tuple[float, float]) -> Iterator[_Part]:
    n = both.shape[1]
    variance = expected = 0.0
    if n:
        a, b = (1 - weight for weight in weights)
        variance = float(np.var(a * both[0] - b * both[1], ddof=1)) / n
        expected = (a * a + b * b - 2 * CORRELATION * a * b) / n
    for weight, own, pair in zip(weights, only, both, strict=True):
        if own.size > 1:
            scale = weight**2 / own.size
            yield _Part(scale * float(np.var(own, ddof=1)), scale, own.size - 1)
        elif own.size:  # of the same units as the pairs, so of the same degrees of freedom
            variance += weight**2 * float(np.var(pair, ddof=1))
            expected += weight**2
    if n:
        yield _Part(variance, expected, n - 1)


def _df(parts: list[_Part]) -> float:
    df = np.array([part.df for part in parts])
    found, expected = (
        np.array(values) / sum(values)
        for values in ([p.variance for p in parts], [p.expected for p in parts])
    )
    trusted = 1 - 1 / df.min()
    drawn = trusted * found + (1 - trusted) * expected
    return float(min(1 / np.sum(found**2 / df), 1 / np.sum(drawn**2 / df)))


class Tested(NamedTuple):
    """A difference of two means with its standard error and degrees of freedom, and the test.

    `unit` is what was compared: ``day`` or ``subject``; `weights` are those of the days.
    """

    estimate: float
    se: float
    df: float
    words: str
    mean_x: float
    mean_y: float
    unit: str
    weights: DayWeights


def test_by_levels(epochs: SubjectEpochs, names: tuple[str, str], day: str) -> Tested:
    """Return the difference of x and y, called by these names, tested by days or subjects.

    `day` is what a day is called.

    Raises
    ------
    ValueError
        If a condition has one day (or one subject), or they do not vary.
    """
    if len(epochs) == 1:
        ((subject, days),) = epochs.items()
        return _of_days(subject, days, names, day)
    means = {subject: _means(own) for subject, own in epochs.items()}
    levels = {
        subject: (_mean([x for x, _ in own.values()]), _mean([y for _, y in own.values()]))
        for subject, own in means.items()
    }
    both = {subject: values for subject, values in levels.items() if not np.isnan(values).any()}
    left_out = f", {_count(len(levels) - len(both), 'subject')} with one condition left out"
    remark = left_out if len(both) < len(levels) else ""
    if not both or len(both) >= _MIN_SUBJECTS:
        compared, of_subjects, words = _of_units(both or levels, "subject", names)
        words += remark * bool(both)
        return _tested(compared, words, "subject", _by_days(of_subjects, epochs))
    found = []
    for subject in both:
        try:
            found.append(_of_days(subject, epochs[subject], names, day))
        except ValueError as error:
            raise ValueError(
                f"subject {subject}: {error} (with three subjects or more that have both "
                "conditions, subjects are compared)"
            ) from None
    n = len(found)
    variances = np.array([each.se**2 for each in found]) / n**2
    df = variances.sum() ** 2 / np.sum(variances**2 / [each.df for each in found])
    tests = "; ".join(f"{subject}: {each.words}" for subject, each in zip(both, found, strict=True))
    words = f"mean of {_count(n, 'subject')}, each by its {day}s ({tests}){remark}"
    mean_x = math.fsum(each.mean_x for each in found) / n
    mean_y = math.fsum(each.mean_y for each in found) / n
    weights: DayWeights = {}, {}
    for each in found:
        for own, of_days in zip(weights, each.weights, strict=True):
            own.update({day: weight / n for day, weight in of_days.items()})
    se = math.sqrt(variances.sum())
    return Tested(mean_x - mean_y, se, float(df), words, mean_x, mean_y, day, weights)


def _of_days(subject: str, days: Days, names: tuple[str, str], called: str) -> Tested:
    """Test the days of one subject; two days agree by chance, so their epochs bound the error."""
    compared, weights, words = _of_units(_means(days), called, names)
    x, y = ({(subject, day): weight for day, weight in own.items()} for own in weights)
    tested = _tested(compared, words, called, (x, y))
    if min(sum(len(by[k]) > 0 for by in days.values()) for k in (0, 1)) > 2:
        return tested
    smallest = math.sqrt(sum(_variance_of_epochs(days, k) for k in (0, 1)))
    if tested.se >= smallest:
        return tested
    words = f"{tested.words}, with the standard error of the epochs alone, which is larger"
    return tested._replace(se=smallest, words=words)


def _tested(found: PartiallyPaired, words: str, unit: str, weights: DayWeights) -> Tested:
    return Tested(
        found.estimate, found.se, found.df, words, found.mean_x, found.mean_y, unit, weights
    )


def _by_days(weights: Weights, epochs: SubjectEpochs) -> DayWeights:
    """Return the weights of days that count alike within each subject."""
    found: DayWeights = {}, {}
    for k, of_subjects in enumerate(weights):
        for subject, weight in of_subjects.items():
            days = [day for day, values in epochs[subject].items() if values[k]]
            found[k].update({(subject, day): weight / len(days) for day in days})
    return found


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
) -> tuple[PartiallyPaired, Weights, str]:
    """Compare units by their values in x and in y, NaN for a condition that one does not have.

    Returns
    -------
    (PartiallyPaired, Weights, str)
        The last is the test in words.
    """
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
    weights: Weights = {}, {}
    alone = (found.weight_x, found.n_x), (found.weight_y, found.n_y)
    for k, (weight, n) in enumerate(alone):
        for key, has_both, known in zip(values, both, has[:, k], strict=True):
            if known:
                paired = has_both and found.n_both
                weights[k][key] = (1 - weight) / found.n_both if paired else weight / n
    return found, weights, _in_words(found, int(both.sum()), unit, names)


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
