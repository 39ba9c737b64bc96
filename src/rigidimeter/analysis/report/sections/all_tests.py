"""All tests: differences with each epoch and with days counted, effect sizes, every value."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial

from markupsafe import Markup

from rigidimeter.analysis.report.contents import (
    Block,
    Figure,
    Section,
    from_result,
    from_study_folder,
    paragraph,
    part,
)
from rigidimeter.analysis.report.interval_rows import (
    draw_effects,
    effect_words,
    effects_label,
    effects_size,
)
from rigidimeter.analysis.report.methods_prose import (
    day_tests_in_words,
    method_of,
)
from rigidimeter.analysis.report.points import distribution_size, draw_comparison
from rigidimeter.analysis.report.sections.every_epoch import pooled_table
from rigidimeter.analysis.report.sections.examiners import RATINGS, RELATION
from rigidimeter.analysis.report.style import condition_colours, drawn
from rigidimeter.analysis.study import Comparison, StudyResult, comparison_rows
from rigidimeter.core.words import (
    INTERVAL,
    TURNED,
    Column,
    Table,
    condition_name,
    interval,
    number,
    series,
)

_EPOCHS_NOTE = Markup(
    "All differences are {pair}; the file has shift, z and r as {turned}. Two-sided Wilcoxon "
    "rank-sum test, asymptotic (normal approximation), with tie and continuity correction; "
    "<i>r</i> = <i>z</i>/√N, where 0.1 is called small, 0.3 medium and 0.5 large. Shift: the "
    "Hodges–Lehmann estimate, the median of all differences, with the interval of the same test. "
    "SD: between all epochs of the condition, in % of their mean. In brackets: <i>p</i> adjusted "
    "for all measures by Holm’s method."
)
_DAYS_NOTE = Markup(
    "{tests}. In brackets: <i>p</i> adjusted in its family. <i>p</i> of day medians: exact "
    "rank-sum test of the medians of the days. Between days: the share of the variance between "
    "epochs of one condition that is between days.{ratings} Differences are {pair}; the file has "
    "them as {turned}."
)


def _comparison(result: StudyResult) -> Iterator[Block]:
    if not any(c.paired for c in result.comparisons):
        yield paragraph("No two conditions were compared.")
        return
    pairs = (result, *result.further_pairs)
    for place, pair in enumerate(pairs, start=1):
        yield from _epochs(pair, _table_name(place))
    for place, pair in enumerate(pairs, start=1):
        if any(c.days for c in pair.comparisons):
            yield from _by_days(pair, _table_name(place))


def _table_name(place: int) -> str:
    return "comparisons" if place == 1 else f"comparisons_{place}"


def _by_days(result: StudyResult, name: str) -> Iterator[Block]:
    used = dict.fromkeys(day_tests_in_words(result)) or ("No test by days could be made",)
    ratings = (
        " Ratings are those less the examiners’ offsets; their model has an offset for each "
        "examiner too."
        if result.ratings is not None
        else ""
    )
    percent = _percent(c.days.confidence for c in result.comparisons if c.days)
    yield Table(
        name,
        f"{_signs(result)['pair']}: days counted",
        (
            Column("title", "Measure", "text", below="unit"),
            Column(
                "days_estimate",
                f"Difference [{percent} interval]",
                ends=("days_low", "days_high"),
                page_factor=TURNED,
            ),
            Column("days_reference", f"Days {condition_name(result.reference)}", "count"),
            Column("days_other", f"Days {condition_name(result.other)}", "count"),
            Column("days_df", "df"),
            Column("days_p", "p (adjusted)", "p", below="days_p_holm"),
            Column("days_p_days", "p of day medians", "p"),
            Column("days_day_share", "Between days", "percent"),
            Column("days_remark", "Remark", "reason"),
        ),
        comparison_rows(result.comparisons),
        note=_DAYS_NOTE.format(
            tests="; ".join(text[:1].upper() + text[1:] for text in used),
            ratings=ratings,
            **_signs(result),
        ),
    )


def _epochs(result: StudyResult, table: str) -> Iterator[Block]:
    """Yield the comparison over epochs, as it is in every report."""
    percent = _percent(c.test.confidence for c in result.comparisons if c.test)
    sides = {"reference": condition_name(result.reference), "other": condition_name(result.other)}
    columns = [Column("title", "Measure", "text", below="unit")]
    for side, name in sides.items():
        columns += [
            Column(f"n_{side}", "n (excluded)", "count", group=name, below=f"excluded_{side}"),
            Column(
                f"median_{side}",
                "median [quartiles]",
                ends=(f"q1_{side}", f"q3_{side}"),
                digits=3,
                group=name,
            ),
            Column(f"sd_percent_{side}", "SD (%)", digits=2, group=name),
        ]
    columns += [
        Column(
            "shift",
            f"Shift [{percent} interval]",
            ends=("shift_low", "shift_high"),
            page_factor=TURNED,
            digits=3,
        ),
        Column("z", "z", page_factor=TURNED, digits=3),
        Column("r", "r", page_factor=TURNED, digits=2),
        Column("p", "p (Holm)", "p", below="p_holm"),
        Column("remark", "Remark", "reason"),
    ]
    yield Table(
        table,
        f"{_signs(result)['pair']}: each epoch counted",
        tuple(columns),
        comparison_rows(result.comparisons),
        note=_EPOCHS_NOTE.format(**_signs(result)),
    )
    yield paragraph(
        "This test treats every epoch as an independent observation. Epochs of one day are not, so "
        "where days differ its p is too small.",
        "remark",
    )
    unbounded = [c.measure.title for c in result.comparisons if c.test and not c.test.shift_bounded]
    if unbounded:
        yield paragraph(
            f"{series(unbounded)}: too few values for an interval at this confidence. The interval "
            "shown goes from the smallest to the largest difference.",
            "remark",
        )


def _signs(result: StudyResult) -> dict[str, str]:
    """Return what differences are on the page, and in the file."""
    reference, other = condition_name(result.reference), condition_name(result.other)
    return {"pair": f"{other} − {reference}", "turned": f"{reference} − {other}"}


def _percent(confidences: Iterable[float]) -> str:
    return " and ".join(dict.fromkeys(f"{100 * each:g} %" for each in confidences)) or "95 %"


def _results(result: StudyResult) -> Iterator[Block]:
    """Yield the results of recordings that are no study folder."""
    yield from _comparison(result)
    yield from _all_epochs(result)


def _all_epochs(result: StudyResult) -> Iterator[Block]:
    """Yield medians where not all conditions are compared, and the fits to all epochs."""
    columns: tuple[Column, ...] = ()
    if not result.other or len(result.condition_names) > 2:
        columns = (
            Column("title", "Measure", "text"),
            Column("unit", "Unit", "check"),
            Column("condition", "Condition", "condition"),
            Column("n", "n", "count"),
            Column("excluded", "Excluded", "count"),
            Column("median", "Median"),
            Column("q1", "Lower quartile"),
            Column("q3", "Upper quartile"),
            Column("sd_percent", "SD (% of the mean)", digits=2),
        )
    yield from_result(result, "summaries", "Medians and quartiles by condition", *columns)
    method = method_of(result.analysis.method)
    yield pooled_table(
        result,
        note=(
            "One J, B and K fitted to all epochs of a condition at once. "
            f"{method.intervals_text}. {method.pooled_text}. The file also has standard errors "
            "and the smallest standard errors possible."
        ),
    )


def _effects(result: StudyResult) -> Iterator[Block]:
    found = [(c, c.effects) for c in result.comparisons if c.effects is not None]
    if not found:
        return
    percent = f"{100 * found[0][1].confidence:g} %"
    yield Figure(
        "effects",
        f"Effect sizes r with {percent} intervals from resampling {result.resampled}. Dotted "
        "lines: small (0.1), medium (0.3) and large (0.5) effects. Grey ticks: the largest r that "
        "these group sizes allow, which differs between measures.",
        f"Effect sizes r with {percent} intervals. "
        f"{'; '.join(f'{c.measure.title} {effect_words(effects)}' for c, effects in found)}.",
        partial(drawn, effects_size(len(found)), draw_effects, found, effects_label(result)),
    )
    without_overlap = [c.measure.title for c, effects in found if effects.method == "Newcombe"]
    if without_overlap:
        yield paragraph(
            f"{', '.join(without_overlap)}: the two conditions do not overlap, so resampling would "
            "give an interval of no width. The interval is Newcombe’s, which treats all values as "
            "independent.",
            "remark",
        )
    if result.differences:
        yield paragraph(
            "Does one measure separate the conditions better than another? r cannot answer that, "
            "because the group sizes limit it. The rank-biserial correlation can: it is the share "
            "of pairs of values that differ in one direction less the share that differ in the "
            "other. Its size is compared here."
        )
    yield from_result(
        result,
        "effect_differences",
        "Differences between effect sizes (sizes of the rank-biserial correlations)",
        Column("first_title", "Effect size of", "text"),
        Column("second_title", "less that of", "text"),
        Column("estimate", f"Difference {INTERVAL}", ends=("low", "high")),
        Column("p", "p", "p"),
        Column("p_holm", "p, Holm", "p"),
        Column("paired", "Same days", "label"),
        folding=True,
    )


def _distributions(result: StudyResult) -> Iterator[Block]:
    shown = [c for c in result.comparisons if c.measure.origin != "ratings" and c.observations]
    if not shown:
        return
    yield paragraph(
        "Each point is an included epoch; the thin line through it is its 95 % interval. The bar "
        "goes from the lower to the upper quartile, and the diamond is the median. An open square "
        "is the estimate from all epochs of the condition together, with its 95 % interval. "
        "J, B and K were estimated together, in the points and in the squares."
    )
    colours = condition_colours(result.condition_names)
    for c in shown:
        yield Figure(
            f"distribution_{c.measure.name}",
            f"{c.measure.title}.",
            f"{c.measure.title}, every included epoch a point. {_values(c)}",
            partial(
                drawn,
                distribution_size(len(c.summaries), pooled=bool(c.pooled)),
                draw_comparison,
                c,
                colours,
            ),
            "small",
            marks={
                f"epochs-{place}": [(o.source, o.epoch) for o in c.of(key)]
                for place, key in enumerate(c.summaries)
            },
        )


def _values(c: Comparison) -> str:
    parts = []
    for condition, s in c.summaries.items():
        text = f"{condition_name(condition)}: n = {s.n}"
        if s.n:
            text += f", median {number(s.median)}, quartiles {number(s.q1)} to {number(s.q3)}"
        if condition in c.pooled:
            pooled = c.pooled[condition]
            text += f", all epochs {number(pooled.value)} {interval(pooled.low, pooled.high)}"
        parts.append(text)
    return f"{'; '.join(parts)} ({c.measure.unit})."


SECTIONS = part(
    "All tests",
    Section("comparison", "Comparison", _comparison, from_study_folder),
    Section("results", "Results", _results, lambda result: not from_study_folder(result)),
    Section("effects", "Effect sizes", _effects, from_study_folder),
    Section("distributions", "Every epoch", _distributions),
    Section("results", "All epochs together", _all_epochs, from_study_folder),
    RATINGS,
    RELATION,
    printed=4,
)
