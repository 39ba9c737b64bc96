"""What the checks on the epochs found: each finding, and each kind of finding once."""

from __future__ import annotations

from rigidimeter.records import Finding, Fit
from rigidimeter.reporting.estimate_tables import WHO
from rigidimeter.reporting.measures import short_names
from rigidimeter.reporting.page_table import Cell, Column, Table
from rigidimeter.study import StudyResult

__all__ = ["finding_kinds", "findings_table"]

GRAVEST_FIRST = ("exclude", "doubt", "note")

MOST_LABELS = 24
"""So many epochs of a kind are named; every one is in the table of all findings."""


def _found(study: StudyResult) -> list[tuple[Fit, Finding]]:
    return [(fit, finding) for fit in study.analysis.fits for finding in fit.findings]


def findings_table(study: StudyResult) -> Table:
    """List every finding, epoch by epoch."""
    columns = (
        *WHO,
        Column("check", "Check", "check"),
        Column("level", "Level", "outcome"),
        Column("value", "Value"),
        Column("threshold", "Threshold"),
        Column("text", "What was found", "reason"),
        Column("remedy", "Remedy", "reason"),
    )
    rows = tuple(
        (
            *(fit.source, fit.epoch, fit.condition, found.name, found.level),
            *(found.value, found.threshold, found.text, found.remedy),
        )
        for fit, found in _found(study)
    )
    return Table("findings", "Findings, epoch by epoch", columns, rows)


def finding_kinds(study: StudyResult) -> Table:
    """List each kind of finding once: the gravest first, then the most frequent."""
    columns = (
        Column("check", "Check", "check"),
        Column("level", "Level", "outcome"),
        Column("epochs", "Epochs", "count"),
        Column("fitted", "Fitted", "count"),
        Column("where", "In epochs", "reason"),
        Column("first", "What was found in the first", "reason"),
        Column("remedy", "Remedy", "reason"),
    )
    kinds: dict[tuple[str, str], list[tuple[Fit, Finding]]] = {}
    for fit, finding in _found(study):
        kinds.setdefault((finding.level, finding.name), []).append((fit, finding))
    order = sorted(kinds, key=lambda kind: (GRAVEST_FIRST.index(kind[0]), -len(kinds[kind])))
    fitted = len(study.analysis.fits)
    rows: list[tuple[Cell, ...]] = []
    for level, name in order:
        members = kinds[level, name]
        first = members[0][1]
        where = _where(study, [fit for fit, _ in members])
        rows.append((name, level, len(members), fitted, where, first.text, first.remedy))
    return Table("finding_kinds", "What the checks found", columns, tuple(rows))


def _where(study: StudyResult, fits: list[Fit]) -> str:
    """Return the epochs by source, as many as can be read."""
    names = short_names(fit.source for fit in study.analysis.fits)
    by_source: dict[str, list[str]] = {}
    for fit in fits[:MOST_LABELS]:
        by_source.setdefault(fit.source, []).append(fit.epoch)
    if len(names) == 1:
        text = ", ".join(fit.epoch for fit in fits[:MOST_LABELS])
    else:
        text = "; ".join(f"{names[key]}: {', '.join(own)}" for key, own in by_source.items())
    more = len(fits) - MOST_LABELS
    return f"{text} and {more} more" if more > 0 else text
