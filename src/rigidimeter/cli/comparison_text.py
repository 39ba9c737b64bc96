"""A comparison as it is shown on a terminal."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from rigidimeter.cli.terminal_tables import Block, Heading, Table, number_text

if TYPE_CHECKING:
    from rigidimeter.analysis.study import RatingsFound, StudyResult

BY = {
    "protocol": "by the protocol",
    "check": "by a check",
    "estimate": "without an estimate",
    "operator": "by the operator",
}
UNBOUNDED = (
    "† Too few values for an interval at this confidence: the smallest and the largest difference "
    "stand in its place."
)


def comparison_blocks(found: StudyResult) -> Iterator[Block]:
    """Yield everything that was concluded, the verdict first."""
    from rigidimeter.analysis.report.verdict_text import verdict

    said = verdict(found)
    yield Heading(said.lead)
    if said.rest:
        yield " ".join(said.rest)
    yield from _first_screen(found)
    yield ""
    yield from _epochs(found)
    if found.blinded:
        codes = ", ".join(condition.name for condition in found.conditions)
        yield ""
        yield f"Blinded: the conditions are the codes {codes}; give the key with --key."
    for pair in (found, *found.further_pairs):
        yield from _days(pair)
    yield from _effects(found)
    if found.ratings is not None:
        yield from _ratings(found.ratings)
    yield from _sensitivity(found)
    if found.sessions:
        yield from _exclusions(found)


def _first_screen(found: StudyResult) -> Iterator[Block]:
    """Yield what the first screen of the report shows."""
    from rigidimeter.analysis.report.first_screen import LIGHTS, light_words, main_finding
    from rigidimeter.analysis.study import traffic_light

    light = traffic_light(found)
    if light is not None:
        words = f"Data quality: {LIGHTS[light.level][1]}. {light_words(light)} "
        yield words + main_finding(light)
    for pair in (found, *found.further_pairs):
        if rows := list(short_table(pair)):
            yield from ("", *rows)


def short_table(found: StudyResult) -> Iterator[Block]:
    """Yield what was found of each measure; of a virtual study beside what was simulated."""
    from rigidimeter.analysis.report.first_screen import strip, tested_words

    rows = strip(found)
    if not rows:
        return
    virtual = any(row.simulated for row in rows)
    cells: list[Sequence[str] | str] = []
    for row in rows:
        cells.append(f"{', '.join(filter(None, (row.title, row.unit)))}: {row.verdict}")
        size = (row.difference, row.percent, row.interval)
        if virtual:
            percent = (row.percent, row.percent_interval)
            of_found, interval = percent if row.percent else (row.difference, row.interval)
            size = (of_found, row.simulated or "–", interval)
        cells.append((row.reference, row.other, *size, row.p, row.p_holm))
    headings = (
        *(found.reference, found.other, f"{found.other} is", "simulated" if virtual else ""),
        *("95 % interval", "p", "by Holm"),
    )
    yield from (Heading(f"In short: {tested_words(found)}"), Table(headings, cells, ">>==<>>"))


def _epochs(found: StudyResult) -> Iterator[Block]:
    """Yield each condition in each measure, and the rank-sum tests."""
    if found.source:
        yield f"{found.source} by {found.by}: {found.reference} − {found.other}"
    groups: list[Sequence[str] | str] = []
    for c in found.comparisons:
        groups.append(c.measure.label)
        compared = {*c.pair, *(each.other for each in found.further)} & c.summaries.keys()
        for name in (name for name in found.condition_names if name in compared):
            s = c.summaries[name]
            excluded = f"{c.excluded[name]}" if c.measure.counted == "epochs" else ""
            quartiles = f"{s.q1:.4g} to {s.q3:.4g}"
            sd = number_text(s.sd_percent, ".2g")
            groups.append((name, f"{s.n}", excluded, f"{s.median:.4g}", quartiles, sd))
    yield Heading("Each condition")
    of = ("condition", "n", "excluded", "median", "quartiles", "SD, %\nof mean")
    yield Table(of, groups, "<>>>=>")
    for pair in (found, *found.further_pairs):
        yield ""
        yield from _rank_tests(pair)


def _rank_tests(found: StudyResult) -> Iterator[Block]:
    from rigidimeter.analysis.study import TEST

    tested = [(c, c.test) for c in found.comparisons if c.test is not None]
    if tested:
        yield Heading(f"{found.reference} − {found.other}, {TEST}")
        rows = [
            (
                c.measure.title,
                f"{t.shift:.4g}",
                f"{t.shift_low:.4g} to {t.shift_high:.4g}{'' if t.shift_bounded else ' †'}",
                f"{t.z:.3f}",
                f"{t.p:.2g}",
                number_text(c.p_holm),
                f"{t.r:.3f}",
            )
            for c, t in tested
        ]
        headings = ("", "shift", "95 % interval", "z", "p", "by\nHolm", "r")
        yield Table(headings, rows, "<>=>>>>")
    for c in found.comparisons:
        if c.test is None:
            yield f"  {c.measure.title}: no test: {c.remark}"
    if any(not t.shift_bounded for _, t in tested):
        yield UNBOUNDED


def _days(found: StudyResult) -> Iterator[Block]:
    tested = [(c, c.days) for c in found.comparisons if c.days is not None]
    if not tested:
        return
    yield ""
    units = " and ".join(dict.fromkeys(f"{d.unit}s" for _, d in tested))
    yield Heading(f"{found.reference} − {found.other}: {units}, not epochs")
    rows: list[Sequence[str] | str] = []
    for c, d in tested:
        rows.append(c.measure.label)
        rows.append(
            (
                f"{d.n_days_x}, {d.n_days_y} ({d.n_days_both})",
                number_text(d.estimate, ".4g"),
                "" if math.isnan(d.low) else f"{d.low:.4g} to {d.high:.4g}",
                number_text(d.p),
                number_text(c.days_p_holm),
                number_text(d.df, ".1f"),
                number_text(d.p_days),
                number_text(100 * d.day_share, ".0f"),
            )
        )
    headings = ("days\n(both)", "estimate", "95 % interval", "p", "by\nHolm", "df",
                "p of\nmedians", "variance\nof days %")  # fmt: skip
    yield Table(headings, rows, "=>=>>>>>")
    said: dict[str, list[str]] = {}
    for c, d in tested:
        sentences = (f"no test: {d.remark}",) if d.remark else (d.test, d.few)
        for sentence in filter(None, sentences):
            said.setdefault(sentence, []).append(c.measure.title)
    for sentence, titles in said.items():
        yield f"  {'all' if len(titles) == len(tested) else ', '.join(titles)}: {sentence}"
    yield "  p of medians: rank-sum test of the days' medians"


def _effects(found: StudyResult) -> Iterator[Block]:
    sized = [(c.measure, c.effects) for c in found.comparisons if c.effects is not None]
    if not sized:
        return
    yield ""
    yield Heading(f"Effect sizes, 95 % intervals by resampling {found.resampled}")
    effects = [
        (
            measure.title,
            f"{e.r:.3f}",
            f"{e.r_low:.3f} to {e.r_high:.3f}",
            f"{e.rank_biserial:.3f}",
            f"{e.rank_biserial_low:.3f} to {e.rank_biserial_high:.3f}",
            e.method,
        )
        for measure, e in sized
    ]
    headings = ("", "r", "95 % interval", "rank-\nbiserial", "95 % interval", "")
    yield Table(headings, effects, "<>=>=<")
    titles = {measure.name: measure.title for measure, _ in sized}
    if not found.differences:
        return
    yield ""
    yield Heading("Which separates the conditions better: difference of rank-biserial correlations")
    rows = []
    for each in found.differences:
        d = each.difference
        how = "paired" if d.paired else "independent"
        ends = f"{d.low:.3f} to {d.high:.3f}"
        if math.isnan(d.p):
            how, ends = f"{how}; no interval: every resample gives the same", ""
        rows.append(
            (
                f"{titles[each.first]} − {titles[each.second]}",
                f"{d.estimate:.3f}",
                ends,
                number_text(d.p),
                number_text(each.p_holm),
                how,
            )
        )
    yield Table(("", "", "95 % interval", "p", "by Holm", ""), rows, "<>=>><")


def _ratings(found: RatingsFound) -> Iterator[Block]:
    c, fit = found.contrast, found.fit
    yield ""
    yield Heading(
        f"Examiners' ratings ({found.source}): {fit.n} in {len(fit.conditions)} conditions"
    )
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


def _sensitivity(found: StudyResult) -> Iterator[Block]:
    if not found.sensitivity:
        return
    rows = [
        (
            "*" if row.chosen else "",
            row.measure.title,
            row.method,
            row.inertia,
            f"{row.shift:.4g}",
            number_text(row.p),
            number_text(row.p_day),
        )
        for row in found.sensitivity
    ]
    yield ""
    yield Heading("By other methods (* as above)")
    headings = ("", "", "method", "J", "shift", "p of\nepochs", "p of\ndays")
    yield Table(headings, rows, "<<<<>>>")


def _exclusions(found: StudyResult) -> Iterator[Block]:
    yield ""
    yield Heading(f"Epochs that do not count: {len(found.exclusions)}")
    counts = Counter((exclusion.by, exclusion.reason) for exclusion in found.exclusions)
    for (by, reason), count in counts.most_common():
        yield f"  {count:3d} {BY[by]}: {reason}"
    for out in found.left_out:
        yield f"Left out: {out.path}: {out.reason}"
