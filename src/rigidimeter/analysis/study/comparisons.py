"""Every measure in every pair of conditions: from the rows of a study to rows of comparisons.

Beside the test that is concluded from: the rank-sum test of epochs with its effect size; the same
comparison by other estimators, and with the inertia held or fitted freely; how precise each
condition is by itself.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd

from rigidimeter.analysis.estimation import METHODS
from rigidimeter.analysis.statistics import (
    EffectDifference,
    Effects,
    TwoGroups,
    compare_effects,
    effect_sizes,
    holm,
    precision_of,
    two_groups,
)
from rigidimeter.analysis.study.compared import Compared
from rigidimeter.analysis.study.measures import CHECK, LEVEL, MEASURES, RATING, Measure
from rigidimeter.analysis.study.ratings import FEWEST, rating_test
from rigidimeter.analysis.study.rows import counting, measures_of, recorded
from rigidimeter.analysis.study.study import Study
from rigidimeter.analysis.study.tests import (
    FEWEST_FOR_TEST,
    Pair,
    basis_of,
    by_units,
    by_values,
    of_difference,
    tested,
)
from rigidimeter.core.records import Notice
from rigidimeter.core.words import fixed

Progress = Callable[[float], None]

_FITTED = tuple(one for one in MEASURES if one.origin == "fits")


class EffectPair(NamedTuple):
    """How much larger the effect size of one measure is than that of another, by stored names.

    `p_holm` is adjusted by Holm's method for all pairs.
    """

    first: str
    second: str
    difference: EffectDifference
    p_holm: float


def day_tests(study: Study) -> tuple[Compared, ...]:
    """Return the test of each measure in each pair of conditions, before anything is concluded.

    The test is by days where days are known, and of ratings that of their mixed model; else by
    recordings, or by the values of a table.
    """
    by = basis_of(study.rows)
    found = []
    for measure, pair, rows in _pairs(study):
        if measure == RATING and study.ratings is not None:
            made = rating_test(study.ratings, pair)
            found.append(of_difference(rows, measure, pair, by, made))
        else:
            found.append(tested(rows, measure, pair, by))
    return tuple(found)


def compare_values(study: Study) -> tuple[Compared, ...]:
    """Return the rank-sum test of each measure, in which each epoch counts, adjusted by Holm."""
    beside = basis_of(study.rows) != "values"
    found = [by_values(rows, measure, pair, beside=beside) for measure, pair, rows in _pairs(study)]
    adjusted = holm([one.p for one in found])
    return tuple(replace(one, p_adjusted=p) for one, p in zip(found, adjusted, strict=True))


def _pairs(study: Study) -> Iterator[tuple[Measure, Pair, pd.DataFrame]]:
    """Yield each measure and pair of conditions with the rows that count, the main pair first."""
    of_each = {one: counting(study.rows, one.name) for one in measures_of(study.rows)}
    for other in study.others or ("",):
        pair = study.reference, other
        for measure, rows in of_each.items():
            if other == study.other or _can_be_compared(study, measure, rows, pair):
                yield measure, pair, rows


def _can_be_compared(study: Study, measure: Measure, rows: pd.DataFrame, pair: Pair) -> bool:
    if measure != RATING:
        return bool((recorded(study.rows, measure.name)["condition"] == pair[1]).any())
    counts = [int((rows["condition"] == name).sum()) for name in pair]
    return min(counts) > 0 and sum(counts) >= FEWEST


def without_deviating(study: Study, concluded: Sequence[Compared]) -> list[dict[str, Any]]:
    """Return the test of each primary measure once more, without the sessions not as planned.

    One row for each measure that can still be tested; p is that of this test alone.
    """
    paths = {one.path for one in study.deviations if one.path}
    sources = {entry.source for entry in study.sessions if entry.path in paths}
    main = {one.measure: one for one in concluded if one.other == study.other}
    rows: list[dict[str, Any]] = []
    for measure in measures_of(study.rows) if sources else ():
        one = main.get(measure)
        if one is None or measure == RATING or one.role != "primary":
            continue
        every = counting(study.rows, measure.name)
        left = every[~every["session"].isin(sources)]
        if not {*one.pair} <= {*left["condition"]}:
            continue
        again = tested(left, measure, one.pair, one.by)
        if again.tested:
            percent = again.percent(again.of_test)[0]
            words = f"{measure.short} {fixed(percent, 0, sign=True)} %, {again.p_words}"
            row = {"measure": measure.name, "difference_percent": percent, "p": again.p}
            row |= {"p_with_all": one.p, "words": f"{words}, with them {one.p_words}"}
            rows.append(row)
    return rows


def effects(
    study: Study,
    tests: Sequence[Compared],
    *,
    seed: int = 1,
    resamples: int = 9999,
    progress: Progress = lambda _: None,
) -> tuple[dict[str, Effects], tuple[EffectPair, ...]]:
    """Return the effect size of each measure by its name, and those of every two beside each other.

    Every measure and every pair draws from a random stream of its own, so one more measure changes
    no other number. Two measures are resampled together where they share units in both conditions.

    Parameters
    ----------
    study : Study
    tests : sequence of Compared
        Rank-sum tests of the main pair (`compare_values`); without a test there is no effect size.
    seed, resamples : int
        Of the bootstrap; with 0 resamples there are none.
    progress : callable
        Called with the share of the work that was done since, 1 in all.
    """
    names = [one.measure.name for one in tests if one.tested and one.other == study.other]
    if not resamples or not names:
        progress(1.0)
        return {}, ()
    groups = {name: _groups(study, name) for name in names}
    pairs = list(itertools.combinations(names, 2))
    share = 1.0 / (len(names) + len(pairs))
    sizes = {}
    for name, own in groups.items():
        sizes[name] = effect_sizes(own, _stream(seed, name), resamples=resamples)
        progress(share)
    differences = []
    for first, second in pairs:
        one, two = groups[first], groups[second]
        apart = set(one.x_units).isdisjoint(two.x_units) or set(one.y_units).isdisjoint(two.y_units)
        rng = _stream(seed, first, second)
        differences.append(compare_effects(one, two, rng, paired=not apart, resamples=resamples))
        progress(share)
    adjusted = holm([found.p for found in differences])
    return sizes, tuple(
        EffectPair(*names_of_both, found, p)
        for names_of_both, found, p in zip(pairs, differences, adjusted, strict=True)
    )


def _groups(study: Study, name: str) -> TwoGroups:
    rows = counting(study.rows, name)
    x, y = (rows[rows["condition"] == one] for one in (study.reference, study.other))
    return two_groups(
        x["value"].to_numpy(), y["value"].to_numpy(), list(x["unit"]), list(y["unit"])
    )


def _stream(seed: int, *names: str) -> np.random.Generator:
    return np.random.default_rng([seed, *" ".join(names).encode()])


class OfMethod(NamedTuple):
    """One measure by one method: tested by its epochs as independent values, and by days.

    `inertia` says whether J was held at its median (``fixed``) or fitted with B and K in each epoch
    (``free``); `chosen` whether the study concludes from it.
    """

    method: str
    inertia: Literal["free", "fixed"]
    chosen: bool
    by_values: Compared
    by_days: Compared

    @property
    def p(self) -> float:
        """That by days, or else over epochs."""
        return self.by_days.p if self.by_days.tested else self.by_values.p

    @property
    def difference(self) -> float:
        """The shift that the test of epochs found, other − reference; NaN without a test."""
        return self.by_values.difference if self.by_values.tested else math.nan

    def row(self) -> dict[str, Any]:
        """Return all numbers as documents and tables have them; shifts are reference − other."""
        test = self.by_values.statistic
        names = ("shift", "shift_low", "shift_high", "p", "r")
        n_reference, n_other = self.by_values.n
        return {
            **self.by_values.measure.names,
            "method": self.method,
            "inertia": self.inertia,
            "n_reference": n_reference,
            "n_other": n_other,
            **{name: getattr(test, name, math.nan) for name in names},
            "p_day": self.by_days.p,
            "chosen": self.chosen,
        }


def sensitivity_methods() -> tuple[str, ...]:
    """Return the estimators that a study is analysed with besides the chosen one."""
    return tuple(method.name for method in METHODS if method.in_sensitivity)


def sensitivity(rows: pd.DataFrame, pair: Pair) -> tuple[tuple[OfMethod, ...], tuple[Notice, ...]]:
    """Return each measure by each method, with J free and J held, and why a method is missing.

    Rows are in the order of measures, then of methods, with J free before J held.
    """
    fits = rows[(rows["scope"] == "epoch") & (rows["inertia"] != "")]
    there = [*map(str, fits["method"].drop_duplicates())]
    usable, notices = [], []
    for method in dict.fromkeys([*filter(there.__contains__, sensitivity_methods()), *there]):
        lacking = _lacking(fits[fits["method"] == method], pair)
        if lacking:
            text = f"the sensitivity analysis has no {method}: {lacking}"
            notices.append(Notice("warning", text))
        else:
            usable.append(method)
    stages: tuple[Literal["free", "fixed"], ...] = ("free", "fixed")
    found = []
    for measure in _FITTED:
        for method in usable:
            for inertia in stages[: 1 if measure.name == CHECK else 2]:
                own = fits[(fits["method"] == method) & (fits["inertia"] == inertia)]
                concluded = bool(own["chosen"].any())
                values = counting(own.assign(chosen=True), measure.name)
                ranked = by_values(values, measure, pair, beside=True)
                tests = ranked, by_units(values, measure, pair)
                found.append(OfMethod(method, inertia, concluded, *tests))
    return tuple(found), tuple(notices)


def _lacking(fits: pd.DataFrame, pair: Pair) -> str:
    """Return why these fits give no test, else nothing; a failure says its own reason."""
    one_each = fits[(fits["inertia"] == "free") & (fits["measure"] == CHECK)]
    included = one_each[one_each["outcome"] == "included"]
    counts = {name: int((included["condition"] == name).sum()) for name in pair}
    if min(counts.values()) >= FEWEST_FOR_TEST:
        return ""
    left = " and ".join(
        f"{n} epochs in {name or 'a second condition'}" for name, n in counts.items()
    )
    failed = one_each.loc[one_each["outcome"] == "failed", "reason"]
    return f"it leaves {left}" + (f" ({failed.iloc[0]})" if len(failed) and failed.iloc[0] else "")


def method_caveats(found: Sequence[OfMethod]) -> dict[str, str]:
    """Return for each measure, by name, how its conclusion depends on the method; empty if not.

    A method shows a difference where p by days, or else p over epochs, is below the level.
    """
    signs: dict[str, set[int]] = {}
    for one in found:
        shown = int(math.copysign(1, one.difference)) if one.p < LEVEL and one.difference else 0
        signs.setdefault(one.by_values.measure.name, set()).add(shown)
    return {
        name: "the sign of the difference depends on the method" if {1, -1} <= of_all
        else "not every method shows a difference" if len(of_all) > 1 else ""
        for name, of_all in signs.items()
    }  # fmt: skip


def precisions(rows: pd.DataFrame, condition: str) -> list[dict[str, Any]]:
    """Return how precise each measure of the only condition of some rows is, from its epochs alone.

    J, B and K are those fitted to all epochs together; scores are means over epochs, with an
    interval from their scatter (`precision_of`). Interval and scatter are in % of the value. A
    bias, such as that by the subject's own torque, is not in it.
    """
    found = []
    for measure in sorted(MEASURES, key=lambda one: one.place):
        values = counting(rows, measure.name)
        together = _together(rows, measure, condition)
        if measure.origin == "fits" and not len(together) and len(values) == 1:
            together = values
        if len(values) or len(together):
            numbers = together[["value", "low", "high", "se"]].itertuples(index=False, name=None)
            precision = precision_of(values["value"].to_numpy(), next(numbers, None))
            found.append(measure.names | precision.row())
    return found


def precisions_of_each(rows: pd.DataFrame, conditions: Iterable[str]) -> list[dict[str, Any]]:
    """Return the same of each condition, which is the first cell."""
    return [
        {"condition": name} | one
        for name in conditions
        for one in precisions(rows[rows["condition"] == name], name)
    ]


def _together(rows: pd.DataFrame, measure: Measure, condition: str) -> pd.DataFrame:
    """Return the estimate from all epochs of a condition, else from all epochs; if it counts."""
    mine = rows[rows["chosen"] & (rows["measure"] == measure.name)]
    for scope in ("condition", "all"):
        own = mine[mine["scope"] == scope]
        if scope == "condition":
            own = own[own["condition"] == condition]
        if len(own):
            return own[own["outcome"] == "included"]
    return mine[:0]
