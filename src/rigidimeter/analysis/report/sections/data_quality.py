"""What the checks found in the epochs, and which epochs are excluded and why."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from markupsafe import Markup

from rigidimeter.analysis.report.contents import Block, Section, from_study_folder, paragraph
from rigidimeter.analysis.report.sections.estimate_tables import HOW, WHO
from rigidimeter.analysis.study import StudyResult, result_table
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Fit, Outcome
from rigidimeter.core.words import SESSION, Column, Table, plural

BY = ("protocol", "check", "estimate", "operator")


UNFOLDING = Markup(
    '<details class="finding">\n<summary><span class="outcome is-{level}">{level}</span> '
    "<strong>{name}</strong> {headline}; {where}</summary>\n"
    "<p>{details}</p>\n<p>{remedy}</p>\n</details>"
)


def _findings(result: StudyResult) -> Iterator[Block]:
    groups, n_fitted = result.analysis.findings, len(result.analysis.fits)
    if groups:
        yield paragraph(
            Markup(
                "Every epoch was checked. <em>note</em>: the estimate is not affected. "
                "<em>caution</em>: check the epoch. <em>exclude</em>: its numbers mean nothing. "
                "Every finding with its value and limit is in "
                "<code>tables/findings.csv</code>."
            )
        )
    else:
        yield paragraph("The checks found nothing." if n_fitted else "No epoch was fitted.")
    for one, _, where in result.findings:
        yield UNFOLDING.format(level=one.level, name=one.name, where=where, **one.words._asdict())
    yield Table(
        "finding_kinds",
        "Findings by kind",
        (),
        [
            {
                "check": one.name,
                "level": one.level,
                "epochs": sum(fit.epoch != "pooled" for fit in fits),
                "fitted": n_fitted,
                "where": where,
                **one.words._asdict(),
            }
            for one, fits, where in groups
        ],
    )
    yield Table(
        "findings",
        "Findings, epoch by epoch",
        (),
        [
            {
                "source": fit.source,
                "epoch": fit.epoch,
                "condition": fit.condition,
                "check": finding.name,
                "level": finding.level,
                "value": finding.value,
                "unit": finding.unit,
                "limit": finding.limit,
                "p": finding.p,
                **{
                    f"effect_{name}_{of}": getattr(finding.effect, of)[i]
                    for of in finding.effect._fields
                    for i, name in enumerate("JBK")
                },
                **finding.words._asdict(),
            }
            for fit, finding in _of_fits(result)
        ],
    )


def _of_fits(result: StudyResult) -> list[tuple[Fit, Finding]]:
    """Return every finding of an epoch, and of epochs together what no epoch carries."""
    analysis = result.analysis
    found = [(fit, finding) for fit in analysis.fits for finding in fit.findings]
    carried = {finding for _, finding in found}
    return found + [
        (fit, finding)
        for fit in analysis.pooled
        for finding in fit.findings
        if finding not in carried
    ]


def _stages(result: StudyResult, *, on_page: bool) -> Table:
    """Return whatever is excluded or failed, once for each reason."""
    return Table(
        "exclusions",
        "Excluded epochs by stage of the analysis",
        (*WHO, Column("stage", "Stage", "text"), *HOW) if on_page else (),
        list(_by_stage(result)),
        empty="No epoch was excluded." if on_page else "",
        folding=True,
    )


def _by_stage(result: StudyResult) -> Iterator[dict[str, Any]]:
    """Yield what each stage excluded, and the epochs from which nothing was estimated."""
    analysis = result.analysis
    stages = (
        ("fit", analysis.fits),
        ("fit at fixed inertia", analysis.fixed_inertia),
        ("score", analysis.scores),
    )
    keys = ("source", "epoch", "condition", "stage", "outcome", "reason")
    seen: set[tuple[str, str, Outcome]] = set()
    analysed: set[tuple[str, str]] = set()
    for stage, results in stages:
        for one in results:
            who = (one.source, one.epoch)
            analysed.add(who)
            if one.outcome.included or (*who, one.outcome) in seen:
                continue
            seen.add((*who, one.outcome))
            row = (*who, one.condition, stage, one.outcome.kind, one.outcome.reason)
            yield dict(zip(keys, row, strict=True))
    for epoch in result.epochs:
        if (epoch.source, epoch.label) not in analysed:
            reason = epoch.closed.reason or "nothing was estimated from it"
            row = (epoch.source, epoch.label, epoch.condition, "none", "failed", reason)
            yield dict(zip(keys, row, strict=True))


def _exclusions(result: StudyResult) -> Iterator[Block]:
    yield _stages(result, on_page=True)


def _study_exclusions(result: StudyResult) -> Iterator[Block]:
    account = result_table(result, "account")
    yield Table(
        "account",
        "All recorded epochs",
        (
            Column("task", "Task", "check"),
            Column("condition", "Condition", "condition"),
            Column("recorded", "Recorded", "count"),
            Column("included", "Included", "count"),
            *(Column(f"by_{by}", f"Excluded by {by}", "count") for by in BY),
            Column("unlisted", "Not accounted for", "count"),
        ),
        account,
    )
    unlisted = sum(row["unlisted"] for row in account)
    if unlisted:
        yield paragraph(
            Markup(
                "<strong>{} {} neither included nor listed as excluded</strong>; "
                "<code>tables/exclusions.csv</code> says what the analysis made of each."
            ).format(plural(unlisted, "recorded epoch"), "is" if unlisted == 1 else "are"),
            "banner",
        )
    yield Table(
        "excluded_epochs",
        "Excluded epochs: by whom and why",
        (
            *SESSION,
            Column("source", "Session", "source"),
            Column("epoch", "Epoch", "label"),
            Column("task", "Task", "check"),
            Column("by", "Excluded by", "label"),
            *([Column("who", "Name", "label")] if any(e.who for e in result.exclusions) else []),
            Column("reason", "Reason", "reason"),
        ),
        result_table(result, "excluded_epochs"),
        empty="No epoch was excluded.",
        folding=True,
    )
    yield Table(
        "left_out",
        "Recordings left out completely",
        (
            Column("path", "Path", "text"),
            *SESSION,
            Column("reason", "Reason", "reason"),
        ),
        result_table(result, "left_out"),
    )
    yield _stages(result, on_page=False)


FINDINGS = Section("findings", "Findings", _findings)
EXCLUSIONS = Section(
    "exclusions", "Exclusions", _exclusions, lambda result: not from_study_folder(result)
)
STUDY_EXCLUSIONS = Section("exclusions", "Exclusions", _study_exclusions, from_study_folder)
