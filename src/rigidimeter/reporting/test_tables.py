"""What was tested across days, as tables: day tests, effects, ratings, methods."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import fields

from scipy.stats import t as t_distribution

from rigidimeter.reporting.measures import condition_name
from rigidimeter.reporting.page_table import Cell, Column, Table
from rigidimeter.statistics import Contrast, contrast, holm
from rigidimeter.study import MEASURES, Cohort, DayTest, RatingsFound, SensitivityRow, Study

__all__ = [
    "compared_pair",
    "day_holm",
    "mean_interval",
    "pair_holm",
    "record_table",
    "sorted_rows",
    "test_tables",
    "tests_by_days",
]


RATING = ("rating", "Examiners' rating", "1")
"""Stored name, name for people and unit of the ratings as a measure."""


def test_tables(cohort: Cohort) -> tuple[Table, ...]:
    """Return the tables of tests; each may have no rows."""
    return (
        _day_tests(cohort),
        _effects(cohort),
        _differences(cohort),
        _ratings(cohort.ratings),
        _examiners(cohort.ratings),
        _rating_contrast(cohort.ratings),
        _sensitivity(cohort),
    )


def record_table(name: str, caption: str, kind: type, rows: Sequence[object]) -> Table:
    """Return records of a dataclass as they are, for the file alone."""
    names = [field.name for field in fields(kind)]
    columns = tuple(Column(each, each) for each in names)
    cells = tuple(tuple(getattr(row, each) for each in names) for row in rows)
    return Table(name, caption, columns, cells)


def compared_pair(study: Study) -> tuple[str, str] | None:
    """Return the names of the two conditions that are compared, the reference first."""
    tests = study.cohort.day_tests if study.cohort is not None else ()
    pairs = [(c.reference, c.other) for c in study.comparisons if c.other]
    pairs += [(test.reference, test.other) for test in tests if test.other]
    return (condition_name(pairs[0][0]), condition_name(pairs[0][1])) if pairs else None


def tests_by_days(cohort: Cohort) -> tuple[DayTest, ...]:
    """Return the day tests with that of the ratings, whose model has examiners' offsets too."""
    found = cohort.ratings
    if found is None or any(test.measure == RATING[0] for test in cohort.day_tests):
        return cohort.day_tests
    c = found.contrast_days
    estimate = low = high = p = df = math.nan
    if c is not None:
        half = float(t_distribution.isf(0.025, c.df_kenward_roger)) * c.se_kenward_roger
        estimate, low, high = c.estimate, c.estimate - half, c.estimate + half
        p, df = c.p_kenward_roger, c.df_kenward_roger
    rating = DayTest(
        measure=RATING[0],
        title=RATING[1],
        unit=RATING[2],
        reference=found.reference,
        other=found.other,
        estimate=estimate,
        low=low,
        high=high,
        p=p,
        df=df,
        days_reference=_days(found, found.reference),
        days_other=_days(found, found.other),
        p_days=math.nan,
        day_share=math.nan,
        remark="" if c is not None else "the ratings do not tell days from the residual",
    )
    return (*cohort.day_tests, rating)


def _days(found: RatingsFound, condition: str) -> int:
    return len({row[2:4] for row in found.rows if row[0] == condition})


def day_holm(cohort: Cohort) -> dict[str, float]:
    """Return for each measure the p of its day test, adjusted for all of them by Holm's method."""
    tests = tests_by_days(cohort)
    adjusted = holm([test.p for test in tests])
    return {test.measure: p for test, p in zip(tests, adjusted, strict=True)}


def pair_holm(cohort: Cohort) -> dict[tuple[str, str], float]:
    """Return for each pair of effects the p of their difference, adjusted for all pairs."""
    adjusted = holm([difference.p for difference in cohort.differences.values()])
    return dict(zip(cohort.differences, adjusted, strict=True))


def mean_interval(found: RatingsFound, condition: str) -> tuple[float, float, float]:
    """Return the model's mean of a condition and its 95 % interval by Kenward and Roger."""
    weights = [float(name == condition) for name in found.fit.conditions]
    one = contrast(found.fit, weights)
    half = float(t_distribution.isf(0.025, one.df_kenward_roger)) * one.se_kenward_roger
    return one.estimate, one.estimate - half, one.estimate + half


def _day_tests(cohort: Cohort) -> Table:
    tests = tests_by_days(cohort)
    table = record_table("day_tests", "Comparisons in which days count", DayTest, tests)
    adjusted = day_holm(cohort)
    rows = tuple(
        (*row, adjusted[test.measure]) for row, test in zip(table.rows, tests, strict=True)
    )
    return Table(table.name, table.caption, (*table.columns, Column("p_holm", "p_holm")), rows)


def _effects(cohort: Cohort) -> Table:
    test = ("n_x", "n_y", "z", "p", "u", "shift", "shift_low", "shift_high")
    size = ("r", "r_low", "r_high", "rank_biserial", "rank_biserial_low", "rank_biserial_high")
    names = ("measure", "title", "unit", *test, "p_holm", *size, "confidence", "method")
    rows = tuple(
        (
            *(e.measure, e.title, e.unit),
            *(getattr(e.effects.test, name) for name in test),
            e.p_holm,
            *(getattr(e.effects, name) for name in (*size, "confidence", "method")),
        )
        for e in cohort.effects
    )
    columns = tuple(Column(name, name) for name in names)
    return Table("effects", "Effect sizes, whole days resampled", columns, rows)


def _differences(cohort: Cohort) -> Table:
    columns = (
        Column("first", "Stored name of the first", "text", on_page=False),
        Column("second", "Stored name of the second", "text", on_page=False),
        Column("first_title", "Effect size of", "text"),
        Column("second_title", "less that of", "text"),
        Column("difference", "Difference [95\xa0%\xa0interval]", ends=("low", "high")),
        Column("low", "From", on_page=False),
        Column("high", "To", on_page=False),
        Column("p", "p", "p"),
        Column("p_holm", "p, Holm", "p"),
        Column("paired", "Same days", "label"),
    )
    titles = {effect.measure: effect.title for effect in cohort.effects}
    adjusted = pair_holm(cohort)
    rows: list[tuple[Cell, ...]] = [
        (
            *(a, b, titles.get(a, a), titles.get(b, b)),
            *(d.estimate, d.low, d.high, d.p, adjusted[a, b], "yes" if d.paired else "no"),
        )
        for (a, b), d in cohort.differences.items()
    ]
    caption = "Differences between effect sizes (sizes of the rank-biserial correlations)"
    return Table("effect_differences", caption, columns, tuple(rows))


def _ratings(found: RatingsFound | None) -> Table:
    columns = (
        Column("condition", "Condition", "condition"),
        Column("examiner", "Examiner", "label"),
        Column("subject", "Subject", "label"),
        Column("day", "Day", "label"),
        Column("score", "Score", "setting"),
        Column("corrected", "Score less offsets"),
    )
    rows: tuple[tuple[Cell, ...], ...] = ()
    if found is not None:
        corrected = found.fit.corrected.tolist()
        rows = tuple((*row, value) for row, value in zip(found.rows, corrected, strict=True))
    return Table("ratings", "Ratings as given, and less the offsets", columns, rows)


def _examiners(found: RatingsFound | None) -> Table:
    columns = (
        Column("grouping", "Offset of", "label"),
        Column("name", "Name", "label"),
        Column("ratings", "Ratings", "count"),
        Column("offset", "Offset"),
        Column("sd", "SD of such offsets"),
    )
    rows: list[tuple[Cell, ...]] = []
    for grouping, offsets in (found.fit.offsets if found is not None else {}).items():
        assert found is not None
        sd = math.sqrt(found.fit.variances[grouping])
        for name, offset in offsets.items():
            own = {"examiner": (name,), "subject": (name,)}.get(grouping)
            count = sum(own is not None and own[0] in row[1:3] for row in found.rows)
            rows.append((grouping, name, count if own else None, offset, sd))
    return Table("rating_offsets", "Offsets (predicted; drawn to zero)", columns, tuple(rows))


def _rating_contrast(found: RatingsFound | None) -> Table:
    columns = (
        Column("freedom", "Degrees of freedom by", "text"),
        Column("estimate", "Difference [95\xa0%\xa0interval]", ends=("low", "high")),
        Column("low", "From", on_page=False),
        Column("high", "To", on_page=False),
        Column("se", "SE"),
        Column("f", "F"),
        Column("df", "df"),
        Column("p", "p", "p"),
    )
    rows: list[tuple[Cell, ...]] = []
    if found is not None:
        rows = _freedoms(found.contrast)
    if found is not None and found.contrast_days is not None:
        of_days = _freedoms(found.contrast_days)[-1]
        rows.append((f"{of_days[0]}, with an offset for each day too", *of_days[1:]))
    between = "" if found is None else f", {found.reference} − {found.other}"
    return Table("rating_contrast", f"Contrast of the ratings{between}", columns, tuple(rows))


def _freedoms(c: Contrast) -> list[tuple[Cell, ...]]:
    choices = (
        ("residual, n − p", c.se, c.f, c.df_residual, c.p_residual),
        ("Satterthwaite", c.se, c.f, c.df_satterthwaite, c.p_satterthwaite),
        (
            "Kenward–Roger",
            c.se_kenward_roger,
            c.f_kenward_roger,
            c.df_kenward_roger,
            c.p_kenward_roger,
        ),
    )
    rows: list[tuple[Cell, ...]] = []
    for name, se, f, df, p in choices:
        half = float(t_distribution.isf(0.025, df)) * se
        rows.append((name, c.estimate, c.estimate - half, c.estimate + half, se, f, df, p))
    return rows


def sorted_rows(rows: Iterable[SensitivityRow]) -> list[SensitivityRow]:
    """Return the rows in the order of measures, then of methods, J fixed before J free."""
    listed = list(rows)
    measures = list(dict.fromkeys([*(m.name for m in MEASURES), *(row.measure for row in listed)]))
    methods = list(dict.fromkeys(row.method for row in listed))
    return sorted(
        listed,
        key=lambda row: (
            measures.index(row.measure),
            methods.index(row.method),
            row.inertia == "free",
        ),
    )


def _sensitivity(cohort: Cohort) -> Table:
    columns = (
        Column("measure", "Stored name", "text", on_page=False),
        Column("title", "Measure", "text"),
        Column("unit", "Unit", "check"),
        Column("method", "Method", "check"),
        Column("inertia", "J", "label"),
        Column("n_reference", "n", "count"),
        Column("n_other", "n, other", "count"),
        Column("shift", "Shift [95\xa0%\xa0interval]", ends=("shift_low", "shift_high")),
        Column("shift_low", "From", on_page=False),
        Column("shift_high", "To", on_page=False),
        Column("r", "r"),
        Column("p", "p, epochs", "p"),
        Column("p_day", "p, days", "p"),
        Column("chosen", "Used here", "label"),
    )
    names = [column.name for column in columns]

    def cells(row: SensitivityRow) -> tuple[Cell, ...]:
        plain = [getattr(row, name) for name in names[:-1]]
        return (*plain, "yes" if row.chosen else "")

    rows = tuple(cells(row) for row in sorted_rows(cohort.sensitivity))
    return Table("sensitivity", "The shift by other roads", columns, rows)
