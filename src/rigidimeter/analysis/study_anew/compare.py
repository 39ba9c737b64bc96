"""Every measure in every pair of conditions: from the rows of a study to rows of comparisons."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from rigidimeter.analysis.statistics import (
    EffectDifference,
    Effects,
    TwoGroups,
    compare_effects,
    effect_sizes,
    holm,
    two_groups,
)
from rigidimeter.analysis.study_anew.compared import Compared
from rigidimeter.analysis.study_anew.measures import RATING, Measure
from rigidimeter.analysis.study_anew.ratings import FEWEST, rating_test
from rigidimeter.analysis.study_anew.rows import counting, measures_of, recorded
from rigidimeter.analysis.study_anew.study import Study
from rigidimeter.analysis.study_anew.tests import (
    Pair,
    basis_of,
    by_values,
    of_difference,
    tested,
)

Progress = Callable[[float], None]


class EffectPair(NamedTuple):
    """How much larger the effect size of one measure is than that of another, by stored names.

    `p_holm` is adjusted by Holm's method for all pairs.
    """

    first: str
    second: str
    difference: EffectDifference
    p_holm: float


def compare(study: Study) -> tuple[Compared, ...]:
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
    found = [by_values(rows, measure, pair) for measure, pair, rows in _pairs(study)]
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
