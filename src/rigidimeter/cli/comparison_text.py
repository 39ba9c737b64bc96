"""A comparison as lines for a terminal."""

from __future__ import annotations

import math
import textwrap
from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING

from rigidimeter.cli.table_lines import number_text

if TYPE_CHECKING:
    from rigidimeter.study import Comparison, RatingsFound, StudyResult

BY = {
    "protocol": "by the protocol",
    "check": "by a check",
    "estimate": "without an estimate",
    "operator": "by the operator",
}
INDENTED = textwrap.TextWrapper(100, initial_indent="  ", subsequent_indent="    ")
UNBOUNDED = (
    "",
    "† Too few values for an interval at this confidence: the smallest and the largest",
    "  difference stand in its place.",
)


def comparison_lines(found: StudyResult) -> list[str]:
    """Return everything that was concluded."""
    from rigidimeter.reporting.verdict_text import verdict_sentence
    from rigidimeter.study import TEST

    lines = [*textwrap.wrap(verdict_sentence(found), 100), *_first_screen(found), ""]
    if found.source:
        lines.append(f"{found.source} by {found.by}: {found.reference} − {found.other}")
    lines += [TEST, ""]
    several = sum(c.test is not None for c in found.comparisons) > 1
    for c in found.comparisons:
        lines += _epochs(c, several)
    if any(c.test is not None and not c.test.shift_bounded for c in found.comparisons):
        lines += UNBOUNDED
    if found.blinded:
        codes = ", ".join(condition.name for condition in found.conditions)
        lines += ["", f"Blinded: the conditions are the codes {codes}; give the key with --key."]
    lines += [*_days(found), *_effects(found)]
    if found.ratings is not None:
        lines += _ratings(found.ratings)
    if found.sensitivity:
        lines += ["", "By other methods (p of epochs, p of days; * as above):"]
        for row in found.sensitivity:
            mark = "*" if row.chosen else " "
            lines.append(
                f" {mark}{row.measure.title}, {row.method}, J {row.inertia}: shift "
                f"{row.shift:.4g}, p {number_text(row.p)}, by days {number_text(row.p_day)}"
            )
    return [*lines, *_exclusions(found)] if found.sessions else lines


def _first_screen(found: StudyResult) -> Iterator[str]:
    """Yield what the first screen of the report shows."""
    from rigidimeter.reporting.first_screen import (
        LIGHTS,
        difference_words,
        gravest_words,
        light_words,
    )
    from rigidimeter.study import conclude, traffic_light

    light, concluded = traffic_light(found), conclude(found)
    if light is not None:
        words = f"Data quality: {LIGHTS[light.level][1]}. {light_words(light)} "
        yield from textwrap.wrap(words + gravest_words(light), 100)
    if concluded is None:
        return
    yield ""
    for one in concluded.each:
        d, measure = one.difference, one.comparison.measure
        yield f"{measure.label}: {found.reference} {d.reference:.4g}, {found.other} {d.other:.4g}"
        yield f"  {found.other} {difference_words(d, measure.unit)}"
        yield f"  {one.verdict}: p {number_text(d.p)}, by Holm {number_text(one.p)}"


def _epochs(c: Comparison, several: bool) -> Iterator[str]:
    yield c.measure.label
    for name in c.pair:
        s = c.summaries[name]
        excluded = f", excluded {c.excluded[name]:2d}" if c.measure.counted == "epochs" else ""
        yield f"  {name:>10}: n {s.n:3d}{excluded}, median {_interval(s.median, s.q1, s.q3)}"
    if c.test is None:
        yield f"  no test: {c.remark}"
        return
    t = c.test
    adjusted = f" (by Holm {c.p_holm:.2g})" if several else ""
    yield (
        f"  {c.reference} − {c.other}: shift {_interval(t.shift, t.shift_low, t.shift_high)}"
        f"{'' if t.shift_bounded else ' †'}, z {t.z:.3f}, "
        f"p {t.p:.2g}{adjusted}, r {t.r:.3f}"
    )


def _days(found: StudyResult) -> Iterator[str]:
    tested = [(c, c.days) for c in found.comparisons if c.days is not None]
    if not tested:
        return
    yield ""
    yield "Days, not epochs:"
    for c, d in tested:
        both = f", {d.n_days_both} of them in both" if d.n_days_both else ""
        yield f"{c.measure.label}: {d.n_days_x} and {d.n_days_y} days{both}"
        if d.remark:
            yield from INDENTED.wrap(f"no test: {d.remark}")
            continue
        medians = (
            "" if math.isnan(d.p_days) else f", rank-sum of day medians p {number_text(d.p_days)}"
        )
        yield (
            f"  {c.reference} − {c.other}: {_interval(d.estimate, d.low, d.high)}, "
            f"p {number_text(d.p)} (by Holm {number_text(c.days_p_holm)}; {d.df:.1f} df){medians}"
        )
        for sentence in filter(None, (d.test, d.few)):
            yield from INDENTED.wrap(sentence)
        if not math.isnan(d.day_share):
            yield f"  of the variance between epochs, {100 * d.day_share:.0f} % is between days"


def _effects(found: StudyResult) -> Iterator[str]:
    sized = [(c.measure, c.effects) for c in found.comparisons if c.effects is not None]
    if not sized:
        return
    resampled = "whole days" if found.sessions else "sessions or single values"
    yield ""
    yield f"Effect sizes, 95 % intervals by resampling {resampled}"
    for measure, e in sized:
        r = _interval(e.r, e.r_low, e.r_high, ".3f")
        biserial = _interval(e.rank_biserial, e.rank_biserial_low, e.rank_biserial_high, ".3f")
        yield f"  {measure.title}: r {r}, rank-biserial {biserial} ({e.method})"
    titles = {measure.name: measure.title for measure, _ in sized}
    if found.differences:
        yield "Which separates the conditions better (difference of rank-biserial correlations):"
    for each in found.differences:
        d = each.difference
        how = "paired" if d.paired else "independent"
        pair = f"  {titles[each.first]} − {titles[each.second]}"
        if math.isnan(d.p):
            yield f"{pair}: {d.estimate:.3f}, no interval: every resample gives the same ({how})"
        else:
            size = _interval(d.estimate, d.low, d.high, ".3f")
            p, adjusted = number_text(d.p), number_text(each.p_holm)
            yield f"{pair}: {size}, p {p}, by Holm {adjusted} ({how})"


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
        f"F(1, {c.df_residual:g}) = {c.f:.3g}, p {number_text(c.p_residual)}; Kenward-Roger p "
        f"{number_text(c.p_kenward_roger)}"
    )
    if found.contrast_days is not None:
        d = found.contrast_days
        yield (
            f"  with an offset for every day: {d.estimate:.3g}, SE {d.se_kenward_roger:.3g}, "
            f"p {number_text(d.p_kenward_roger)} ({d.df_kenward_roger:.1f} df)"
        )


def _exclusions(found: StudyResult) -> Iterator[str]:
    yield ""
    counts = Counter((exclusion.by, exclusion.reason) for exclusion in found.exclusions)
    yield f"Epochs that do not count: {len(found.exclusions)}"
    for (by, reason), count in counts.most_common():
        yield f"  {count:3d} {BY[by]}: {reason}"
    for out in found.left_out:
        yield f"Left out: {out.path}: {out.reason}"


def _interval(value: float, low: float, high: float, digits: str = ".4g") -> str:
    return f"{value:{digits}} [{low:{digits}} to {high:{digits}}]"
