"""The comparison of two conditions: each epoch counted, and days counted."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from markupsafe import Markup

from rigidimeter.analysis.report.contents import Block, Section, from_study_folder, paragraph
from rigidimeter.analysis.report.method_words import interval_basis, pooled_basis
from rigidimeter.analysis.report.prose_statistics import day_tests_in_words
from rigidimeter.analysis.report.sections.estimate_tables import pooled_table
from rigidimeter.analysis.study import StudyResult, comparison_rows, result_table
from rigidimeter.core.words import Column, Table, condition_name, series

_EPOCHS_NOTE = Markup(
    "All differences are {pair}. Two-sided Wilcoxon rank-sum test, asymptotic (normal "
    "approximation), with tie and continuity correction; <i>r</i> = <i>z</i>/√N, where 0.1 is "
    "called small, 0.3 medium and 0.5 large. Shift: the Hodges–Lehmann estimate, the median of "
    "all differences, with the interval of the same test. SD: between all epochs of the condition, "
    "in % of their mean. In brackets: <i>p</i> "
    "adjusted for all measures by Holm’s method."
)
_DAYS_NOTE = Markup(
    "{tests}. In brackets: <i>p</i> adjusted for all measures by Holm’s method. <i>p</i> of day "
    "medians: "
    "exact rank-sum test of the medians of the days. Between days: the share of the variance "
    "between epochs of one condition that is between days.{ratings}"
)


def _comparison(result: StudyResult) -> Iterator[Block]:
    if not any(c.paired for c in result.comparisons):
        yield paragraph("No two conditions were compared.")
        return
    pairs = (result, *result.further_pairs)
    for number, pair in enumerate(pairs, start=1):
        yield from _epochs(pair, _table_name(number))
    for number, pair in enumerate(pairs, start=1):
        if any(c.days for c in pair.comparisons):
            yield from _by_days(pair, _table_name(number))


def _table_name(number: int) -> str:
    return "comparisons" if number == 1 else f"comparisons_{number}"


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
        f"{_pair(result)}: days counted",
        (
            Column("title", "Measure", "text", below="unit"),
            Column(
                "days_estimate", f"Difference [{percent} interval]", ends=("days_low", "days_high")
            ),
            Column("days_reference", f"Days {condition_name(result.reference)}", "count"),
            Column("days_other", f"Days {condition_name(result.other)}", "count"),
            Column("days_df", "df"),
            Column("days_p", "p (Holm)", "p", below="days_p_holm"),
            Column("days_p_days", "p of day medians", "p"),
            Column("days_day_share", "Between days", "percent"),
            Column("days_remark", "Remark", "reason"),
        ),
        comparison_rows(result.comparisons),
        note=_DAYS_NOTE.format(
            tests="; ".join(text[:1].upper() + text[1:] for text in used), ratings=ratings
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
        Column("shift", f"Shift [{percent} interval]", ends=("shift_low", "shift_high"), digits=3),
        Column("z", "z", digits=3),
        Column("r", "r", digits=2),
        Column("p", "p (Holm)", "p", below="p_holm"),
        Column("remark", "Remark", "reason"),
    ]
    yield Table(
        table,
        f"{_pair(result)}: each epoch counted",
        tuple(columns),
        comparison_rows(result.comparisons),
        note=_EPOCHS_NOTE.format(pair=f"{sides['reference']} − {sides['other']}"),
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


def _pair(result: StudyResult) -> str:
    return f"{condition_name(result.reference)} against {condition_name(result.other)}"


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
    rows = result_table(result, "summaries")
    yield Table("summaries", "Medians and quartiles by condition", columns, rows)
    yield pooled_table(
        result,
        note=(
            "One J, B and K fitted to all epochs of a condition at once. "
            f"{interval_basis(result.analysis.method)}. "
            f"{pooled_basis(result.analysis.method)}. The file also has standard errors and the "
            "smallest standard errors possible."
        ),
    )


COMPARISON = Section("comparison", "Comparison", _comparison, from_study_folder)
ALL_EPOCHS = Section("results", "All epochs together", _all_epochs, from_study_folder)
RESULTS = Section("results", "Results", _results, lambda result: not from_study_folder(result))
