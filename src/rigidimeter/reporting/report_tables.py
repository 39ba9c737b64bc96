"""The tables of a report, from a study."""

from __future__ import annotations

from rigidimeter.records import Outcome
from rigidimeter.reporting.estimate_tables import HOW, WHO, delays_table, fits_table, pooled_table
from rigidimeter.reporting.finding_tables import finding_kinds, findings_table
from rigidimeter.reporting.page_table import Cell, Column, Table
from rigidimeter.reporting.protocol_tables import (
    design_table,
    epoch_counts,
    epoch_duration_s,
    settings_table,
)
from rigidimeter.reporting.test_tables import conclusion_tables
from rigidimeter.study import StudyResult

__all__ = ["all_tables"]


def all_tables(study: StudyResult) -> dict[str, Table]:
    """Return every table of the report by name; tables may have no rows."""
    analysis = study.analysis
    fixed = f"Fits with the inertia fixed at its median ({analysis.inertia_kg_m2:.4g} kg·m²)"
    tables = (
        epoch_counts(study),
        design_table(study),
        settings_table(study.settings),
        _epochs(study),
        delays_table(study),
        pooled_table(study),
        fits_table("fits", "Fits of inertia, damping and stiffness, epoch by epoch", analysis.fits),
        fits_table("fixed_inertia", f"{fixed}, epoch by epoch", analysis.fixed_inertia),
        finding_kinds(study),
        findings_table(study),
        _exclusions(study),
        _notices(study),
        _provenance(study),
        *conclusion_tables(study),
    )
    return {table.name: table for table in tables}


def _epochs(study: StudyResult) -> Table:
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


def _exclusions(study: StudyResult) -> Table:
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


def _notices(study: StudyResult) -> Table:
    columns = (Column("level", "Level", "outcome"), Column("text", "Notice", "reason"))
    rows = tuple((notice.level, notice.text) for notice in study.notices)
    return Table("notices", "What was noticed while reading", columns, rows)


def _provenance(study: StudyResult) -> Table:
    columns = (Column("key", "What", "text"), Column("value", "Value", "reason"))
    return Table("provenance", "Where this came from", columns, tuple(study.provenance.items()))
