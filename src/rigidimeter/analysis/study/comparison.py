"""Two conditions side by side in every measure: the one comparison that everything goes through.

Columns of a table, conditions of recordings and a study folder differ in where their observations
come from, not in what is computed from them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from rigidimeter.analysis.estimation import Progress
from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.statistics import (
    DayDifference,
    TwoGroups,
    compare_effects,
    day_difference,
    effect_sizes,
    holm,
    ranksum,
    summarise,
    two_groups,
)
from rigidimeter.analysis.study.compared import Comparison, DayMedian
from rigidimeter.analysis.study.families import Primary, adjusted
from rigidimeter.analysis.study.measures import MEASURES, Measure, Observation, conditions
from rigidimeter.analysis.study.provenance import provenance
from rigidimeter.analysis.study.results import EffectPair, SessionEntry, StudyResult
from rigidimeter.core.records import Analysis, Fit, Score

FEWEST_FOR_TEST = 3
"""Below this many values in a condition there is no rank-sum test."""


def compare_analysis(
    analysis: Analysis,
    reference: str | None = None,
    other: str | None = None,
    *,
    seed: int = 1,
    resamples: int = 9999,
    title: str = "",
    further: Sequence[str] = (),
    progress: Progress = lambda _: None,
) -> StudyResult:
    """Compare two conditions of an analysis in J, B, K, impulse and work.

    Every epoch counts as one observation. Without names
    the first condition that `conditions` gives is compared with each other one; an analysis with
    one condition gives its summaries and no test.

    Parameters
    ----------
    analysis : Analysis
    reference, other : str, optional
    seed, resamples : int
        Of the bootstrap; with 0 resamples there are no effect sizes with intervals.
    title : str
    further : sequence of str
        Conditions that are compared with the reference, too, where both names are given.
    progress : callable
        Called with the share of the work that was done since, 1 in all.
    """
    names = conditions(analysis) or ("",)
    first = reference if reference is not None else names[0]
    second = other if other is not None else next((n for n in names if n != first), "")
    comparisons = gathered(analysis, (first, second))
    comparisons, differences = compare_measures(
        comparisons, seed=seed, resamples=resamples, progress=progress
    )
    others = further if other is not None else [n for n in names if n not in (first, second)]
    comparisons, more = with_further(comparisons, against_reference(comparisons, others))
    return StudyResult(
        title,
        first,
        second,
        comparisons,
        differences,
        (),
        seed,
        resamples,
        analysis=analysis,
        further=more,
    )


def recording_result(recording: Recording, analysis: Analysis, command: str = "") -> StudyResult:
    """Return the comparison of a recording's first two conditions, with all that a report shows."""
    return replace(
        compare_analysis(analysis, resamples=0),
        settings=recording.settings,
        epochs=recording.epochs,
        notices=recording.notices,
        own_rig=recording.own_rig,
        provenance=provenance(recording.paths, recording.digests, recording.settings, command),
    )


def gathered(
    analysis: Analysis,
    pair: tuple[str, str],
    sessions: Mapping[str, SessionEntry] | None = None,
) -> tuple[Comparison, ...]:
    """Return every measure of an analysis with its observations, not yet tested.

    `sessions`, by source, give subject and day; then the day is what the bootstrap resamples.
    """
    by_condition, _ = split_pooled(analysis)
    found = []
    for measure in MEASURES:
        results = measure.results(analysis)
        if not results:
            continue
        pooled = by_condition.items() if isinstance(results[0], Fit) else ()
        one = observed(measure, results, pair, sessions)
        estimates = {name: _observation(measure, fit, None) for name, fit in pooled}
        found.append(replace(one, pooled=estimates))
    return tuple(found)


def observed(
    measure: Measure,
    results: Sequence[Fit | Score],
    pair: tuple[str, str],
    sessions: Mapping[str, SessionEntry] | None = None,
) -> Comparison:
    """Return one measure of some fits or scores with its observations, not yet tested."""
    observations = [
        _observation(measure, result, sessions) for result in results if result.outcome.included
    ]
    excluded = {result.condition: 0 for result in results}
    for result in results:
        excluded[result.condition] += not result.outcome.included
    return measured(measure, observations, pair, excluded)


def _observation(
    measure: Measure, result: Fit | Score, sessions: Mapping[str, SessionEntry] | None
) -> Observation:
    value, low, high = (
        float(getattr(result, measure.name + end, math.nan)) for end in ("", "_low", "_high")
    )
    subject, day, group, unit = "", "", "", f"{result.source}/{result.epoch}"
    if sessions is not None:
        session = sessions[result.source]
        subject, day, group = session.subject, session.day, session.group
        unit = f"{subject}/{day}"
    return Observation(
        value, result.condition, subject, day, result.source, result.epoch, unit, low, high, group
    )


def measured(
    measure: Measure,
    observations: Sequence[Observation],
    pair: tuple[str, str],
    excluded: Mapping[str, int] | None = None,
) -> Comparison:
    """Return a measure in all conditions that were observed, the compared ones first."""
    reference, other = pair
    compared = pair if other else (reference,)
    names = dict.fromkeys([*compared, *(excluded or ()), *(o.condition for o in observations)])
    return Comparison(
        measure,
        reference,
        other,
        tuple(observations),
        {name: summarise([o.value for o in observations if o.condition == name]) for name in names},
        {name: (excluded or {}).get(name, 0) for name in names},
    )


def compare_measures(
    comparisons: Sequence[Comparison],
    *,
    seed: int = 1,
    resamples: int = 9999,
    progress: Progress = lambda _: None,
) -> tuple[tuple[Comparison, ...], tuple[EffectPair, ...]]:
    """Test every measure, and compare the effect sizes of every two.

    Every measure and every pair draws from a random stream of its own, so one more measure changes
    no other number. Two measures are resampled together where they share units in both conditions.
    `progress` is called with the share of the work that was done since, 1 in all.
    """
    tested = [rank_test(each) for each in comparisons]
    adjusted = holm([each.test.p if each.test else math.nan for each in tested])
    tested = [replace(each, p_holm=p) for each, p in zip(tested, adjusted, strict=True)]
    groups = {each.measure.name: _groups(each) for each in tested if each.test is not None}
    if not resamples or not groups:
        progress(1.0)
        return tuple(tested), ()
    pairs = list(itertools.combinations(groups, 2))
    share = 1.0 / (len(groups) + len(pairs))
    for place, each in enumerate(tested):
        if (name := each.measure.name) in groups:
            sizes = effect_sizes(groups[name], _stream(seed, name), resamples=resamples)
            tested[place] = replace(each, effects=sizes)
            progress(share)
    differences = []
    for first, second in pairs:
        one, two = groups[first], groups[second]
        paired = not (
            set(one.x_units).isdisjoint(two.x_units) or set(one.y_units).isdisjoint(two.y_units)
        )
        rng = _stream(seed, first, second)
        differences.append(compare_effects(one, two, rng, paired=paired, resamples=resamples))
        progress(share)
    return tuple(tested), tuple(
        EffectPair(*names, difference, p)
        for names, difference, p in zip(
            pairs, differences, holm([found.p for found in differences]), strict=True
        )
    )


def against_reference(
    comparisons: Sequence[Comparison], others: Iterable[str]
) -> tuple[Comparison, ...]:
    """Return the comparisons of other conditions with the reference, not yet tested."""
    return tuple(
        replace(each, other=other, test=None, effects=None, remark="", p_holm=math.nan)
        for other in others
        for each in comparisons
        if other in each.summaries
    )


def with_further(
    comparisons: Sequence[Comparison], further: Sequence[Comparison]
) -> tuple[tuple[Comparison, ...], tuple[Comparison, ...]]:
    """Test further comparisons by ranks, and adjust p of all of them together."""
    if not further:
        return tuple(comparisons), ()
    every = (*comparisons, *map(rank_test, further))
    adjusted = holm([each.test.p if each.test else math.nan for each in every])
    every = tuple(replace(each, p_holm=p) for each, p in zip(every, adjusted, strict=True))
    return every[: len(comparisons)], every[len(comparisons) :]


def rank_test(comparison: Comparison) -> Comparison:
    """Return the comparison with its rank-sum test, or why there is none."""
    if not comparison.other:
        return replace(comparison, remark="only one condition was recorded")
    x, y = (comparison.values[name] for name in comparison.pair)
    if min(len(x), len(y)) < FEWEST_FOR_TEST:
        counts = f"{len(x)} in {comparison.reference} and {len(y)} in {comparison.other}"
        remark = (
            f"a test needs {FEWEST_FOR_TEST} {comparison.measure.counted} in each condition; "
            f"there are {counts}"
        )
        return replace(comparison, remark=remark)
    return replace(comparison, test=ranksum(x, y))


def day_tests(
    comparisons: Sequence[Comparison],
    ready: Mapping[str, DayDifference] | None = None,
    primary: Primary = Primary(),  # noqa: B008
) -> tuple[Comparison, ...]:
    """Return paired comparisons with their tests by days, adjusted in their families, and medians.

    `ready` holds tests that were made elsewhere, by measure: that of the ratings. A comparison that
    has its test keeps it.
    """
    ready = ready or {}
    paired = [each for each in comparisons if each.paired]
    found = [each.days or ready.get(each.measure.name) or day_test(each) for each in paired]
    families = adjusted(
        [(each.measure, each.other, days.p) for each, days in zip(paired, found, strict=True)],
        primary,
    )
    tests = iter(zip(found, families, strict=True))
    done = []
    for each in comparisons:
        days, (p, _) = next(tests) if each.paired else (None, (math.nan, None))
        medians = () if each.measure.name in ready else _day_medians(each)
        done.append(replace(each, days=days, days_p_holm=p, day_medians=medians))
    return tuple(done)


def day_test(comparison: Comparison, called: str = "day") -> DayDifference:
    """Compare the two conditions by days; where that cannot be done, a remark says why.

    `called` is what a day is called.
    """
    x, y = (comparison.of(name) for name in comparison.pair)
    days = len({o.unit for o in x}), len({o.unit for o in y})
    if min(len(x), len(y)) < FEWEST_FOR_TEST:
        return no_days(*days, comparison.remark)
    try:
        return day_difference(
            [o.value for o in x],
            [o.value for o in y],
            [o.day for o in x],
            [o.day for o in y],
            x_subjects=[o.subject for o in x],
            y_subjects=[o.subject for o in y],
            names=(comparison.reference, comparison.other),
            called=called,
        )
    except (ValueError, ArithmeticError) as error:
        return no_days(*days, str(error))


def no_days(days_x: int, days_y: int, remark: str = "") -> DayDifference:
    """Return a test by days without its numbers, for the reason given."""
    return DayDifference(n_days_x=days_x, n_days_y=days_y, remark=remark)


def _day_medians(comparison: Comparison) -> tuple[DayMedian, ...]:
    """Return median and quartiles of every day of every subject and condition."""
    days: dict[tuple[str, str, str], list[float]] = {}
    for o in comparison.observations:
        days.setdefault((o.subject, o.day, o.condition), []).append(o.value)
    return tuple(
        DayMedian(*key, s.n, s.median, s.q1, s.q3)
        for key, values in days.items()
        for s in [summarise(values)]
    )


def split_pooled(analysis: Analysis) -> tuple[dict[str, Fit], Fit | None]:
    """Return the fit to all epochs of each condition, and the one to all epochs if there is one.

    The latter has no condition, as recordings without a name for theirs have none: it comes last.
    """
    recorded = {fit.condition for fit in analysis.fits}
    by_condition: dict[str, Fit] = {}
    overall = None
    for fit in analysis.pooled:
        if fit.condition in by_condition or fit.condition not in recorded:
            overall = fit
        else:
            by_condition[fit.condition] = fit
    return by_condition, overall


def _groups(comparison: Comparison) -> TwoGroups:
    x, y = (comparison.of(name) for name in comparison.pair)
    return two_groups(
        [o.value for o in x], [o.value for o in y], [o.unit for o in x], [o.unit for o in y]
    )


def _stream(seed: int, *names: str) -> np.random.Generator:
    return np.random.default_rng([seed, *" ".join(names).encode()])
