"""What a study says, as lines for a terminal."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rigidimeter.study import Cohort, DayTest, RatingsFound

__all__ = ["study_lines"]

BY = {
    "protocol": "by the protocol",
    "check": "by a check",
    "estimate": "without an estimate",
    "operator": "by the operator",
}


def study_lines(cohort: Cohort) -> list[str]:
    """Return what a study folder adds to the comparisons of epochs."""
    lines: list[str] = []
    if cohort.blinded:
        codes = ", ".join(condition.name for condition in cohort.conditions)
        lines += ["", f"Blinded: the conditions are the codes {codes}; --key FILE tells them."]
    if cohort.day_tests:
        model = next((test.model for test in cohort.day_tests if test.model), "each day")
        lines += ["", f"Days, not epochs: mixed model with an offset for {model} (Kenward-Roger)"]
        for test in cohort.day_tests:
            lines += _day_test(test)
    lines += _effects(cohort)
    if cohort.ratings is not None:
        lines += _ratings(cohort.ratings)
    if cohort.sensitivity:
        lines += ["", "By other methods (p of epochs, p of days; * as above):"]
        for row in cohort.sensitivity:
            mark = "*" if row.chosen else " "
            lines.append(
                f" {mark}{row.title}, {row.method}, J {row.inertia}: shift {row.shift:.4g}, "
                f"p {_p(row.p)}, by days {_p(row.p_day)}"
            )
    return [*lines, *_exclusions(cohort)]


def _day_test(test: DayTest) -> Iterator[str]:
    yield f"{test.title} ({test.unit}): {test.days_reference} and {test.days_other} days"
    if test.remark:
        yield f"  no test: {test.remark}"
        return
    yield (
        f"  {test.reference} − {test.other}: {test.estimate:.4g} [{test.low:.4g} to "
        f"{test.high:.4g}], p {_p(test.p)} ({test.df:.1f} df), rank-sum of day medians p "
        f"{_p(test.p_days)}"
    )
    if not math.isnan(test.day_share):
        yield f"  of the variance between epochs, {100 * test.day_share:.0f} % is between days"


def _effects(cohort: Cohort) -> Iterator[str]:
    if not cohort.effects:
        return
    yield ""
    yield "Effect sizes, 95 % intervals by resampling whole days; p of the rank-sum by Holm"
    for effect in cohort.effects:
        e = effect.effects
        yield (
            f"  {effect.title}: r {e.r:.3f} [{e.r_low:.3f} to {e.r_high:.3f}], rank-biserial "
            f"{e.rank_biserial:.3f} [{e.rank_biserial_low:.3f} to {e.rank_biserial_high:.3f}] "
            f"({e.method}), p {_p(effect.p_holm)}"
        )
    titles = {effect.measure: effect.title for effect in cohort.effects}
    if cohort.differences:
        yield "Which parts the conditions better (difference of rank-biserial correlations):"
    for (first, second), d in cohort.differences.items():
        how = "paired" if d.paired else "independent"
        pair = f"  {titles[first]} − {titles[second]}: {d.estimate:.3f}"
        if math.isnan(d.p):
            yield f"{pair}, without an interval: resampling changes nothing ({how})"
        else:
            yield f"{pair} [{d.low:.3f} to {d.high:.3f}], p {_p(d.p)} ({how})"


def _ratings(found: RatingsFound) -> Iterator[str]:
    c, fit = found.contrast, found.fit
    yield ""
    yield f"Examiners' ratings ({found.source}): {fit.n} in {len(fit.conditions)} conditions"
    means = ", ".join(
        f"{name} {mean:.3g}" for name, mean in zip(fit.conditions, fit.means, strict=True)
    )
    yield f"  means {means}"
    yield (
        f"  {found.reference} − {found.other}: {c.estimate:.3g}, SE {c.se:.3g}, "
        f"F(1, {c.df_residual:g}) = {c.f:.3g}, p {_p(c.p_residual)}; Kenward-Roger p "
        f"{_p(c.p_kenward_roger)}"
    )
    if found.contrast_days is not None:
        d = found.contrast_days
        yield (
            f"  with an offset for every day: {d.estimate:.3g}, SE {d.se_kenward_roger:.3g}, "
            f"p {_p(d.p_kenward_roger)} ({d.df_kenward_roger:.1f} df)"
        )


def _exclusions(cohort: Cohort) -> Iterator[str]:
    yield ""
    counts = Counter((exclusion.by, exclusion.reason) for exclusion in cohort.exclusions)
    yield f"Epochs that do not count: {len(cohort.exclusions)}"
    for (by, reason), count in counts.most_common():
        yield f"  {count:3d} {BY[by]}: {reason}"
    for out in cohort.left_out:
        yield f"Left out: {out.path}: {out.reason}"


def _p(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.2g}"
