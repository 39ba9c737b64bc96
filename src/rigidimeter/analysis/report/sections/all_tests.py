"""All tests: differences with each epoch and with days counted, effect sizes, every value."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from markupsafe import Markup

from rigidimeter.analysis.figures import (
    Values,
    condition_colours,
    distribution_size,
    draw_effects,
    draw_values,
    drawn,
    drawn_values,
    effect_rows,
    effect_words,
    effects_label,
    effects_size,
    epoch_keys,
)
from rigidimeter.analysis.report.contents import (
    Block,
    Figure,
    Section,
    from_result,
    from_study_folder,
    paragraph,
    part,
)
from rigidimeter.analysis.report.methods import (
    method_of,
)
from rigidimeter.analysis.report.sections.every_epoch import pooled_table
from rigidimeter.analysis.report.sections.examiners import RATINGS, RELATION
from rigidimeter.analysis.report.shown import Shown
from rigidimeter.analysis.statistics import summarise
from rigidimeter.analysis.study import RATING, Rows, result_table
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


def _comparison(shown: Shown) -> Iterator[Block]:
    every = result_table(shown.result, "comparisons")
    if not every or not shown.study.other:
        yield paragraph("No two conditions were compared.")
        return
    pairs = []
    for place, other in enumerate(shown.study.others, start=1):
        name = "comparisons" if place == 1 else f"comparisons_{place}"
        pairs.append((name, [row for row in every if row["other"] == other]))
    for name, rows in pairs:
        yield from _epochs(name, rows)
    for name, rows in pairs:
        if any("days_estimate" in row for row in rows):
            yield from _by_days(shown, name, rows)


def _by_days(shown: Shown, name: str, rows: Rows) -> Iterator[Block]:
    tests = [row.get("days_test") for row in rows if row["measure"] != RATING.name]
    used = dict.fromkeys(filter(None, tests)) or ("No test by days could be made",)
    ratings = (
        " Ratings are those less the examiners’ offsets; their model has an offset for each "
        "examiner too."
        if shown.study.ratings is not None
        else ""
    )
    signs = _signs(rows)
    yield Table(
        name,
        f"{signs['pair']}: days counted",
        (
            Column("title", "Measure", "text", below="unit"),
            Column(
                "days_estimate",
                f"Difference [{_percent(rows, 'days_confidence')} interval]",
                ends=("days_low", "days_high"),
                page_factor=TURNED,
            ),
            Column("days_reference", f"Days {signs['reference']}", "count"),
            Column("days_other", f"Days {signs['other']}", "count"),
            Column("days_df", "df"),
            Column("days_p", "p (adjusted)", "p", below="days_p_holm"),
            Column("days_p_days", "p of day medians", "p"),
            Column("days_day_share", "Between days", "percent"),
            Column("days_remark", "Remark", "reason"),
        ),
        rows,
        note=_DAYS_NOTE.format(
            tests="; ".join(text[:1].upper() + text[1:] for text in used),
            ratings=ratings,
            **signs,
        ),
    )


def _epochs(table: str, rows: Rows) -> Iterator[Block]:
    """Yield the comparison over epochs, as it is in every report."""
    signs = _signs(rows)
    columns = [Column("title", "Measure", "text", below="unit")]
    for side in ("reference", "other"):
        name = signs[side]
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
            f"Shift [{_percent(rows, 'confidence')} interval]",
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
        f"{signs['pair']}: each epoch counted",
        tuple(columns),
        rows,
        note=_EPOCHS_NOTE.format(**signs),
    )
    yield paragraph(
        "This test treats every epoch as an independent observation. Epochs of one day are not, so "
        "where days differ its p is too small.",
        "remark",
    )
    unbounded = [row["title"] for row in rows if row["shift_bounded"] is False]
    if unbounded:
        yield paragraph(
            f"{series(unbounded)}: too few values for an interval at this confidence. The interval "
            "shown goes from the smallest to the largest difference.",
            "remark",
        )


def _signs(rows: Rows) -> dict[str, str]:
    """Return the two conditions, and what differences are on the page and in the file."""
    reference, other = (condition_name(rows[0][side]) for side in ("reference", "other"))
    signs = {"pair": f"{other} − {reference}", "turned": f"{reference} − {other}"}
    return {"reference": reference, "other": other} | signs


def _percent(rows: Rows, name: str) -> str:
    known = [row[name] for row in rows if row.get(name) is not None]
    return " and ".join(dict.fromkeys(f"{100 * each:g} %" for each in known)) or "95 %"


def _results(shown: Shown) -> Iterator[Block]:
    """Yield the results of recordings that are no study folder."""
    yield from _comparison(shown)
    yield from _all_epochs(shown)


def _all_epochs(shown: Shown) -> Iterator[Block]:
    """Yield medians where not all conditions are compared, and the fits to all epochs."""
    columns: tuple[Column, ...] = ()
    if not shown.study.other or len(shown.condition_names) > 2:
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
    yield from_result(shown, "summaries", "Medians and quartiles by condition", *columns)
    method = method_of(shown.analysis.method)
    yield pooled_table(
        shown,
        note=(
            "One J, B and K fitted to all epochs of a condition at once. "
            f"{method.intervals_text}. {method.pooled_text}. The file also has standard errors "
            "and the smallest standard errors possible."
        ),
    )


def _effects(shown: Shown) -> Iterator[Block]:
    found = effect_rows(shown.result)
    if not found:
        return
    percent = _percent(found[:1], "confidence")
    words = "; ".join(f"{row['title']} {effect_words(row)}" for row in found)
    yield Figure(
        "effects",
        f"Effect sizes r with {percent} intervals from resampling {shown.result.resampled}. Dotted "
        "lines: small (0.1), medium (0.3) and large (0.5) effects. Grey ticks: the largest r that "
        "these group sizes allow, which differs between measures.",
        f"Effect sizes r with {percent} intervals. {words}.",
        partial(drawn, effects_size(len(found)), draw_effects, found, effects_label(shown.result)),
    )
    without_overlap = [row["title"] for row in found if row["interval_method"] == "Newcombe"]
    if without_overlap:
        yield paragraph(
            f"{', '.join(without_overlap)}: the two conditions do not overlap, so resampling would "
            "give an interval of no width. The interval is Newcombe’s, which treats all values as "
            "independent.",
            "remark",
        )
    if shown.result.effect_pairs:
        yield paragraph(
            "Does one measure separate the conditions better than another? r cannot answer that, "
            "because the group sizes limit it. The rank-biserial correlation can: it is the share "
            "of pairs of values that differ in one direction less the share that differ in the "
            "other. Its size is compared here."
        )
    yield from_result(
        shown,
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


def _distributions(shown: Shown) -> Iterator[Block]:
    found = drawn_values(shown.result)
    if not found:
        return
    yield paragraph(
        "Each point is an included epoch; the thin line through it is its 95 % interval. The bar "
        "goes from the lower to the upper quartile, and the diamond is the median. An open square "
        "is the estimate from all epochs of the condition together, with its 95 % interval. "
        "J, B and K were estimated together, in the points and in the squares."
    )
    colours = condition_colours(shown.condition_names)
    for v in found:
        size = distribution_size(len(v.names), pooled=bool(v.pooled))
        yield Figure(
            f"distribution_{v.measure.name}",
            f"{v.measure.title}.",
            f"{v.measure.title}, every included epoch a point. {_in_words(v)}",
            partial(drawn, size, draw_values, v, colours),
            "small",
            marks={f"epochs-{k}": epoch_keys(v.of(name)) for k, name in enumerate(v.names)},
        )


def _in_words(v: Values) -> str:
    parts = []
    for condition in v.names:
        s = summarise(v.of(condition)["value"].to_numpy())
        text = f"{condition_name(condition)}: n = {s.n}"
        if s.n:
            text += f", median {number(s.median)}, quartiles {number(s.q1)} to {number(s.q3)}"
        if condition in v.pooled:
            value, low, high = v.pooled[condition]
            text += f", all epochs {number(value)} {interval(low, high)}"
        parts.append(text)
    return f"{'; '.join(parts)} ({v.measure.unit})."


SECTIONS = part(
    "All tests",
    Section("comparison", "Comparison", _comparison, from_study_folder),
    Section("results", "Results", _results, lambda shown: not from_study_folder(shown)),
    Section("effects", "Effect sizes", _effects, from_study_folder),
    Section("distributions", "Every epoch", _distributions),
    Section("results", "All epochs together", _all_epochs, from_study_folder),
    RATINGS,
    RELATION,
    printed=4,
)
