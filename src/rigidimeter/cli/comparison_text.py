"""A comparison as it is shown on a terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from markupsafe import Markup

from rigidimeter.analysis import report  # what is taken from it is imported when it is used
from rigidimeter.analysis.study import (
    StudyResult,
    deviation_words,
    difference_cells,
    lead,
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


def comparison_blocks(found: StudyResult, *, full: bool = False) -> Iterator[Block]:
    """Yield the first screen: each measure, and what was measured, tested and concluded.

    With `full` every finding, and the tables of the report.
    """
    yield Heading(_about(found))
    for pair in (found, *found.further_pairs):
        yield ""
        yield from difference_blocks(pair)
        yield ""
        yield from statement_blocks(pair)
    analysis = found.analysis
    notes = [*stiffness_notes(analysis), *_plan(found), *_left_out(found)]
    notes += finding_notes(analysis, full)
    if notes:
        yield ""
        yield Table((), notes, "<<", 1)
    if full:
        yield from full_blocks(found)


def _about(found: StudyResult) -> str:
    """Return what was compared, and how much of it."""
    names = [found.reference, *(each.other for each in (found, *found.further_pairs))]
    parts = [" and ".join(condition_name(name) for name in dict.fromkeys(names) if name)]
    if found.virtual or any(epoch.virtual for epoch in found.epochs):
        parts.append("virtual data")
    if found.blinded:
        parts.append("blinded: the conditions are codes")
    groups = {o.group for c in found.comparisons for o in c.observations}
    if len(groups) == 1 and (group := groups.pop()):
        parts.append(f"group {group}")
    if found.sessions:
        parts.append(plural(len({each.subject for each in found.sessions}), "subject"))
        parts.append(plural(len({(s.subject, s.day) for s in found.sessions}), "day"))
    if results := found.analysis.results:
        used = sum(one.outcome.included for one in results)
        parts.append(f"{plural(len(results), 'epoch')}, {used} used")
    return " · ".join(parts)


def difference_blocks(found: StudyResult) -> Iterator[Block]:
    """Yield what was found of each measure; of a virtual study beside what was simulated."""
    if found.other:
        yield Table(*difference_cells(found), "=>>>>>>=", 1)


def statement_blocks(found: StudyResult) -> Iterator[Block]:
    """Yield what was measured, tested and concluded."""
    said = statements(found)
    if said is None:
        yield lead(found)
        return
    rows = [("measured", said.measured), ("tested", said.tested)]
    rows += [("concluded" * (not k), sentence) for k, sentence in enumerate(said.concluded)]
    yield Table((), rows, "<<", 1)


def _plan(found: StudyResult) -> Iterator[tuple[str, str]]:
    """Yield where the study was not carried out as planned."""
    if words := deviation_words(found):
        yield "plan", words


def _left_out(found: StudyResult) -> Iterator[tuple[str, str]]:
    """Yield how many epochs and sessions do not count, and why."""
    counts = Counter((exclusion.by, exclusion.reason) for exclusion in found.exclusions)
    for k, ((by, reason), count) in enumerate(counts.most_common(3)):
        yield "excluded" * (not k), f"{count} epoch{'s' * (count > 1)} {BY[by]}: {reason}"
    if len(counts) > 3:
        yield "", f"{sum(counts.values())} epochs in all; --full has all reasons"
    # A session with a row for each of its conditions is left out once.
    for path, reason in dict.fromkeys((out.path, out.reason) for out in found.left_out):
        yield "left out", f"{path}: {reason}"


def full_blocks(found: StudyResult, *, by_epoch: bool = False) -> Iterator[Block]:
    """Yield the tables of the report; with `by_epoch` also those with a row for each epoch."""
    names = report.source_names(found)
    for table in report.shown_tables(found):
        if by_epoch or not (table.folding and any(c.name == "epoch" for c in table.columns)):
            yield from ("", Heading(table.title), shown_table(table, names))
            if table.note:
                yield Markup(table.note).striptags()
