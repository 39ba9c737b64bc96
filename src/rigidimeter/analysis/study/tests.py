"""Two conditions of one measure, tested: by days, subjects, blocks or recordings, or by values.

What counts as one decides the test. Values of one day share what the day was like, so days are the
default where they are known (and subjects, where there are enough: `day_difference`). Recordings
stand in their place where days are not known. Values of a table without days are independent.

What was measured holds for these recordings alone. With the weights w_e of the test and half the
95 % interval h_e of each epoch,

    half the interval of the difference = √(Σ w_e² h_e²) over the epochs of both conditions

and never less than what the instrument is accurate to.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import scipy

from rigidimeter.analysis.statistics import DayDifference, day_difference, ranksum
from rigidimeter.analysis.study.compared import By, Compared, Weights
from rigidimeter.analysis.study.measures import Measure
from rigidimeter.analysis.study.rows import grouped
from rigidimeter.core.errors import UserError

FEWEST_FOR_TEST = 3
"""Below this many values in a condition there is no test."""

ACCURACY = 0.001
"""As a share: the mean error of J, B and K of relaxed epochs is below it (accuracy.md)."""

Pair = tuple[str, str]

_CALLED = {"days": "day", "recordings": "recording", "blocks": "block"}


def basis_of(rows: pd.DataFrame) -> By:
    """Return what is tested by default: days where any is known, else recordings, else values.

    Parameters
    ----------
    rows : pandas.DataFrame
        Of all measures that are compared.
    """
    chosen = rows[rows["chosen"]]
    if (chosen["day"] != "").any():
        return "days"
    return "recordings" if (chosen["method"] != "").any() else "values"


def tested(rows: pd.DataFrame, measure: Measure, pair: Pair, by: By) -> Compared:
    """Return the test of a measure.

    Parameters
    ----------
    rows : pandas.DataFrame
        Those of the measure that count (`counting`), of any conditions.
    measure : Measure
    pair : (str, str)
        Reference and other; differences are other − reference.
    by : str
    """
    return by_values(rows, measure, pair) if by == "values" else by_units(rows, measure, pair, by)


def by_values(
    rows: pd.DataFrame, measure: Measure, pair: Pair, *, beside: bool = False
) -> Compared:
    """Return the medians, and the shift and p of the rank-sum test: each value counts as one.

    Parameters
    ----------
    rows : pandas.DataFrame
    measure : Measure
    pair : (str, str)
    beside : bool
        Whether it is shown beside the test that counts: too many values are then a remark.

    Raises
    ------
    UserError
        If there are too many pairs of values.
    """
    x, y = (_values(rows, name) for name in pair)
    first, second = (float(np.median(one)) if one.size else math.nan for one in (x, y))
    untested = Compared(
        measure,
        *pair,
        "values",
        (x.size, y.size),
        unit="value",
        units=(x.size, y.size),
        value_reference=first,
        value_other=second,
        difference=second - first,
        ratio=is_ratio(rows, measure),
        remark=too_few(rows, measure, pair),
    )
    if untested.remark:
        return untested
    try:
        test = ranksum(x, y)
    except UserError as error:
        if beside:
            return replace(untested, remark=str(error))
        raise
    # All differences of too few values are no interval of this confidence.
    ends = (-test.shift_high, -test.shift_low) if test.shift_bounded else (math.nan, math.nan)
    counts = " and ".join(f"{n} values of {name}" for n, name in zip(untested.n, pair, strict=True))
    return replace(
        untested,
        test=f"rank-sum test of {counts}",
        difference=-test.shift,
        low=ends[0],
        high=ends[1],
        p=test.p,
        sign=-test.z,
        statistic=test,
    )


def by_units(rows: pd.DataFrame, measure: Measure, pair: Pair, by: By = "days") -> Compared:
    """Return the test by days, or by recordings or blocks in their place; see `day_difference`."""
    if by == "recordings":
        rows = rows.assign(day=rows["session"])
    elif by == "blocks":
        rows = rows.assign(day=rows["session"] + "/" + rows["block"])
    x, y = (rows[rows["condition"] == name] for name in pair)
    if remark := too_few(rows, measure, pair):
        return of_difference(rows, measure, pair, by, _no_days(x, y, remark))
    try:
        found = day_difference(
            x["value"].to_numpy(),
            y["value"].to_numpy(),
            list(x["day"]),
            list(y["day"]),
            x_subjects=list(x["subject"]),
            y_subjects=list(y["subject"]),
            names=pair,
            called=_CALLED[by],
        )
    except (ValueError, ArithmeticError) as error:
        found = _no_days(x, y, str(error))
    return of_difference(rows, measure, pair, by, found)


def of_difference(
    rows: pd.DataFrame, measure: Measure, pair: Pair, by: By, found: DayDifference
) -> Compared:
    """Return a difference by days as a row of a comparison.

    Without a test it is that of the means over days, and has no interval of a test.
    """
    of_each = [rows[rows["condition"] == name] for name in pair]
    known = not math.isnan(found.p)
    weights = found.weights if known else tuple(map(_alike, of_each))
    weighed = [_weighed(own, of_days) for own, of_days in zip(of_each, weights, strict=True)]
    first, second = found.mean_x, found.mean_y
    if not known:
        first, second = (
            math.fsum(each["weight"] * each["value"]) if len(each) else math.nan for each in weighed
        )
    counts = [_units(of_days, found.unit) for of_days in found.weights]
    return Compared(
        measure,
        *pair,
        by,
        (len(of_each[0]), len(of_each[1])),
        test=found.test,
        unit=found.unit,
        units=(counts[0] or found.n_days_x, counts[1] or found.n_days_y),
        value_reference=first,
        value_other=second,
        difference=-found.estimate if known else second - first,
        se=found.se,
        df=found.df,
        low=-found.high,
        high=-found.low,
        p=found.p,
        sign=-found.estimate,
        measured_half=_measured_half(pd.concat(weighed), measure),
        ratio=is_ratio(rows, measure),
        weights=found.weights,
        remark=found.remark,
        statistic=found,
    )


def too_few(rows: pd.DataFrame, measure: Measure, pair: Pair) -> str:
    """Return that a condition has too few values for any test; empty if not."""
    if not pair[1]:
        return "only one condition was recorded"
    counts = [_values(rows, name).size for name in pair]
    if min(counts) >= FEWEST_FOR_TEST:
        return ""
    return (
        f"a test needs {FEWEST_FOR_TEST} {measure.counted} in each condition; there are "
        f"{counts[0]} in {pair[0]} and {counts[1]} in {pair[1]}"
    )


def is_ratio(rows: pd.DataFrame, measure: Measure) -> bool:
    """Whether differences of a measure have a meaning in per cent."""
    if measure.origin == "column":
        return bool((rows["value"] >= 0).all())
    return measure.origin != "ratings"


def half_width(rows: pd.DataFrame, one: Compared, level: float) -> float:
    """Return half the interval whose ends a test at a level tells from the estimate.

    A difference of this size is found in one study of two. NaN without a test, infinite where so
    few values cannot reach the level.
    """
    if not one.tested:
        return math.nan
    if one.by != "values":
        return float(scipy.stats.t.isf(level / 2, one.df)) * one.se
    test = ranksum(*(_values(rows, name) for name in one.pair), confidence=1 - level)
    return (test.shift_high - test.shift_low) / 2 if test.shift_bounded else math.inf


def _no_days(x: pd.DataFrame, y: pd.DataFrame, remark: str) -> DayDifference:
    n_x, n_y = (own["unit"].nunique() for own in (x, y))
    return DayDifference(n_days_x=n_x, n_days_y=n_y, remark=remark)


def _values(rows: pd.DataFrame, condition: str) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.asarray(rows.loc[rows["condition"] == condition, "value"], dtype=np.float64)


def _units(of_days: Weights, unit: str) -> int:
    return len({subject for subject, _ in of_days} if unit == "subject" else of_days)


def _alike(rows: pd.DataFrame) -> Weights:
    """Return the same weight for each day."""
    days = dict.fromkeys(zip(rows["subject"], rows["day"], strict=True))
    return dict.fromkeys(days, 1 / len(days)) if days else {}


def _weighed(rows: pd.DataFrame, of_days: Weights) -> pd.DataFrame:
    """Return the rows of days that have a weight, each with its own as `weight`."""
    keys = list(zip(rows["subject"], rows["day"], strict=True))
    weights = pd.Series([of_days.get(key, math.nan) for key in keys], rows.index, dtype=float)
    counts = grouped(rows, "subject", "day")["value"].transform("size")
    return rows.assign(weight=weights / counts)[weights.notna()]


def _measured_half(weighed: pd.DataFrame, measure: Measure) -> float:
    if not len(weighed) or measure.origin != "fits":
        return math.nan
    weight, value, low, high = (
        weighed[name].to_numpy() for name in ("weight", "value", "low", "high")
    )
    half = math.sqrt(math.fsum((weight * (high - low) / 2) ** 2))
    return max(half, ACCURACY * math.fsum(weight * np.abs(value)) / 2)
