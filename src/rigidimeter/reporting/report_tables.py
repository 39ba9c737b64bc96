"""The tables of a report, from a study."""

from __future__ import annotations

from collections.abc import Iterable

from rigidimeter.records import Outcome
from rigidimeter.reporting.estimate_tables import HOW, WHO, delays_table, fits_table, pooled_table
from rigidimeter.reporting.finding_tables import finding_kinds, findings_table
from rigidimeter.reporting.measures import measures
from rigidimeter.reporting.page_table import Cell, Column, Table
from rigidimeter.reporting.protocol_tables import (
    design_table,
    epoch_counts,
    epoch_duration_s,
    settings_table,
)
from rigidimeter.reporting.study_tables import cohort_tables
from rigidimeter.statistics import summarise
from rigidimeter.study import Comparison, Study

__all__ = ["all_tables", "results_table"]


def all_tables(study: Study) -> dict[str, Table]:
    """Return every table of the report by name; tables may have no rows."""
    analysis = study.analysis
    fixed = f"Fits with the inertia fixed at its median ({analysis.inertia_kg_m2:.4g} kg·m²)"
    tables = (
        epoch_counts(study),
        design_table(study),
        settings_table(study.settings),
        _epochs(study),
        results_table(study.comparisons),
        _summaries(study),
        delays_table(study),
        pooled_table(study),
        fits_table("fits", "Fits of inertia, damping and stiffness, epoch by epoch", analysis.fits),
        fits_table("fixed_inertia", f"{fixed}, epoch by epoch", analysis.fixed_inertia),
        finding_kinds(study),
        findings_table(study),
        _scores(study),
        _exclusions(study),
        _notices(study),
        _provenance(study),
        *cohort_tables(study),
    )
    return {table.name: table for table in tables}


def _epochs(study: Study) -> Table:
    columns = (
        *WHO,
        Column("task", "Task", "label"),
        Column("duration_s", "Duration (s)"),
        Column("virtual", "Virtual", "label"),
        Column("closed", "Recording ended", "outcome"),
        Column("reason", "Reason", "reason"),
        Column("channels", "Channels", "reason"),
    )
    rows = tuple(
        (
            epoch.source,
            epoch.label,
            epoch.condition,
            epoch.task,
            epoch_duration_s(epoch),
            "yes" if epoch.virtual else "no",
            epoch.closed.kind,
            epoch.closed.reason,
            ", ".join(f"{c.name} at {c.rate_hz:.4g} Hz" for c in epoch.channels.values()),
        )
        for epoch in study.epochs
    )
    return Table("epochs", "Epochs as they were recorded", columns, rows)


def results_table(comparisons: Iterable[Comparison]) -> Table:
    """Return the comparisons, one row a measure."""
    sides = ("reference", "other")
    columns = [Column("measure", "Measure", "text"), Column("title", "Title", "text")]
    columns += [Column("unit", "Unit", "text")]
    columns += [Column(side, side.capitalize(), "condition") for side in sides]
    for side in sides:
        columns += [
            Column(f"n_{side}", f"n {side}", "count"),
            Column(f"excluded_{side}", f"Excluded {side}", "count"),
            Column(f"median_{side}", f"Median {side}"),
            Column(f"q1_{side}", f"q1 {side}"),
            Column(f"q3_{side}", f"q3 {side}"),
        ]
    tested: tuple[str, ...] = ("shift", "shift_low", "shift_high", "shift_bounded", "confidence")
    tested += ("u", "z", "p", "r", "z_uncorrected", "p_uncorrected")
    columns += [Column(name, name) for name in tested]
    columns += [Column("remark", "Remark", "text")]
    rows = []
    for c in comparisons:
        row: list[Cell] = [c.measure, c.title, c.unit, c.reference, c.other]
        for condition in (c.reference, c.other) if c.paired else (c.reference,):
            s = c.summaries[condition]
            row += [s.n, c.excluded[condition], s.median, s.q1, s.q3]
        row += [None] * (0 if c.paired else 5)
        t = c.test
        row += [None if t is None else getattr(t, name) for name in tested]
        rows.append((*row, c.remark))
    caption = "Comparisons of two conditions; shifts are reference − other, in the unit of the row"
    return Table("results", caption, tuple(columns), tuple(rows))


def _summaries(study: Study) -> Table:
    columns = (
        Column("measure", "Stored name", "text", on_page=False),
        Column("title", "Measure", "text"),
        Column("unit", "Unit", "text"),
        Column("condition", "Condition", "condition"),
        Column("n", "n", "count"),
        Column("excluded", "Excluded", "count"),
        Column("median", "Median"),
        Column("q1", "Lower quartile"),
        Column("q3", "Upper quartile"),
    )
    rows: list[tuple[Cell, ...]] = []
    for measure in measures(study):
        for condition, values in measure.values.items():
            s = summarise(values)
            who = (measure.name, measure.title, measure.unit, condition)
            rows.append((*who, s.n, measure.excluded[condition], s.median, s.q1, s.q3))
    return Table("summaries", "Medians and quartiles by condition", columns, tuple(rows))


def _scores(study: Study) -> Table:
    columns = (
        *WHO,
        *HOW,
        Column("impulse_nm_s", "Angular impulse per cycle (N·m·s)"),
        Column("work_j", "Work per cycle (J)"),
        Column("n_cycles", "Cycles", "count"),
        Column("frequency_hz", "Frequency (Hz)"),
    )
    rows = tuple(
        (
            *(s.source, s.epoch, s.condition, s.outcome.kind, s.outcome.reason),
            *(s.impulse_nm_s, s.work_j, s.n_cycles, s.frequency_hz),
        )
        for s in study.analysis.scores
    )
    return Table("scores", "Scores of the sinusoidal epochs", columns, rows)


def _exclusions(study: Study) -> Table:
    """List whatever does not count, once for each reason; and epochs of which nothing was made."""
    analysis = study.analysis
    stages = (
        ("fit", analysis.fits),
        ("fit at fixed inertia", analysis.fixed_inertia),
        ("score", analysis.scores),
    )
    seen: set[tuple[str, str, Outcome]] = set()
    analysed: set[tuple[str, str]] = set()
    rows: list[tuple[Cell, ...]] = []
    for stage, results in stages:
        for result in results:
            who = (result.source, result.epoch)
            analysed.add(who)
            if result.outcome.included or (*who, result.outcome) in seen:
                continue
            seen.add((*who, result.outcome))
            how = (result.outcome.kind, result.outcome.reason)
            rows.append((*who, result.condition, stage, *how))
    for epoch in study.epochs:
        if (epoch.source, epoch.label) not in analysed:
            reason = epoch.closed.reason or "nothing was estimated from it"
            rows.append((epoch.source, epoch.label, epoch.condition, "none", "failed", reason))
    columns = (*WHO, Column("stage", "Stage", "text"), *HOW)
    return Table("exclusions", "Epochs that do not count, and why", columns, tuple(rows))


def _notices(study: Study) -> Table:
    columns = (Column("level", "Level", "outcome"), Column("text", "Notice", "reason"))
    rows = tuple((notice.level, notice.text) for notice in study.notices)
    return Table("notices", "What was noticed while reading", columns, rows)


def _provenance(study: Study) -> Table:
    columns = (Column("key", "What", "text"), Column("value", "Value", "reason"))
    return Table("provenance", "Where this came from", columns, tuple(study.provenance.items()))
