"""A comparison as it is shown on a terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from markupsafe import Markup

from rigidimeter.analysis import report  # what is taken from it is imported when it is used
from rigidimeter.analysis.study import (
    Study,
    StudyResult,
    counting,
    deviation_sentence,
    difference_cells,
    lead,
    measures_of,
    result_table,
    statements,
)
from rigidimeter.cli.notes import finding_notes, stiffness_notes
from rigidimeter.cli.terminal_tables import Block, Heading, Table, shown_table
from rigidimeter.core.words import condition_name, plural

BY = {
    "protocol": "by the protocol",
    "check": "by a check",
    "estimate": "without an estimate",
    "operator": "by the operator",
}


def comparison_blocks(shown: report.Shown, *, full: bool = False) -> Iterator[Block]:
    """Yield the first screen: each measure, and what was measured, tested and concluded.

    With `full` every finding, and the tables of the report.
    """
    found, analysis = shown.result, shown.analysis
    yield Heading(_about(found))
    for other in _others(found):
        yield ""
        yield from difference_blocks(found, other)
        yield ""
        yield from statement_blocks(found, other)
    notes = [*stiffness_notes(analysis), *_plan(found), *_left_out(found.study)]
    notes += finding_notes(analysis, full)
    if notes:
        yield ""
        yield Table((), notes, "<<", 1)
    if full:
        yield from full_blocks(shown)


def _others(found: StudyResult) -> list[str]:
    """Return each condition that was compared with the reference, the main one first."""
    return list(dict.fromkeys([found.study.other, *(one.other for one in found.values)]))


def _about(found: StudyResult) -> str:
    """Return what was compared, and how much of it."""
    study = found.study
    names = [study.reference, *_others(found)]
    parts = [" and ".join(condition_name(name) for name in dict.fromkeys(names) if name)]
    if study.virtual or study.partly_virtual:
        parts.append("virtual data")
    if study.blinded:
        parts.append("blinded: the conditions are codes")
    each = (counting(study.rows, measure.name)["group"] for measure in measures_of(study.rows))
    groups = {group for own in each for group in own}
    if len(groups) == 1 and (group := groups.pop()):
        parts.append(f"group {group}")
    if study.sessions:
        parts.append(plural(len({each.subject for each in study.sessions}), "subject"))
        parts.append(plural(len({(s.subject, s.day) for s in study.sessions}), "day"))
    if results := study.analysis.results:
        used = sum(one.outcome.included for one in results)
        parts.append(f"{plural(len(results), 'epoch')}, {used} used")
    return " · ".join(parts)


def difference_blocks(found: StudyResult, other: str) -> Iterator[Block]:
    """Yield what was found of each measure; of a virtual study beside what was simulated."""
    if other:
        yield Table(*difference_cells(found, other), "=>>>>>>=", 1)


def statement_blocks(found: StudyResult, other: str) -> Iterator[Block]:
    """Yield what was measured, tested and concluded."""
    said = statements(found.study, found.comparisons).get(other)
    if said is None:
        yield lead(found.study, found.comparisons)
        return
    rows = [("measured", said.measured), ("tested", said.tested)]
    rows += [("concluded" * (not k), sentence) for k, sentence in enumerate(said.concluded)]
    yield Table((), rows, "<<", 1)


def _plan(found: StudyResult) -> Iterator[tuple[str, str]]:
    """Yield where the study was not carried out as planned."""
    again = result_table(found, "without_deviating")
    if words := deviation_sentence(found.study, again):
        yield "plan", words


def _left_out(study: Study) -> Iterator[tuple[str, str]]:
    """Yield how many epochs and sessions do not count, and why."""
    counts = Counter((exclusion.by, exclusion.reason) for exclusion in study.exclusions)
    for k, ((by, reason), count) in enumerate(counts.most_common(3)):
        yield "excluded" * (not k), f"{count} epoch{'s' * (count > 1)} {BY[by]}: {reason}"
    if len(counts) > 3:
        yield "", f"{sum(counts.values())} epochs in all; --full has all reasons"
    # A session with a row for each of its conditions is left out once.
    for path, reason in dict.fromkeys((out.path, out.reason) for out in study.left_out):
        yield "left out", f"{path}: {reason}"


def full_blocks(shown: report.Shown, *, by_epoch: bool = False) -> Iterator[Block]:
    """Yield the tables of the report; with `by_epoch` also those with a row for each epoch."""
    names = report.source_names(shown)
    for table in report.shown_tables(shown):
        if by_epoch or not (table.folding and any(c.name == "epoch" for c in table.columns)):
            yield from ("", Heading(table.title), shown_table(table, names))
            if table.note:
                yield Markup(table.note).striptags()
