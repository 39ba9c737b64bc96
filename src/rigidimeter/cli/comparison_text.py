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
from rigidimeter.cli.terminal_tables import Block, Heading, Table, paragraph, shown_table
from rigidimeter.core.records import Analysis, notes_text
from rigidimeter.core.words import condition_name, plural

MOST_FINDINGS = 3

NOTE_WIDTH = 67
"""Letters of a line beside the label of a note, of the 80 of a line."""

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


def stiffness_notes(analysis: Analysis) -> Iterator[tuple[str, str]]:
    """Yield which K is given and at what motion, in two lines."""
    if words := analysis.stiffness_words:
        yield "K", two_lines(words, words.partition(", range")[0])


def finding_notes(analysis: Analysis, full: bool) -> Iterator[tuple[str, str]]:
    """Yield each kind of finding once, the most serious first.

    Without `full` the first few that are more than a note, in two lines each: where the epochs'
    names are too long for that, their number; the names of the others; and how many notes change
    nothing.
    """
    groups = analysis.findings
    serious = [group for group in groups if group.finding.level != "note"]
    shown = groups if full else serious[:MOST_FINDINGS]
    for group in shown:
        text = f"{group.finding.name}  {group.finding.headline}"
        wheres = [group.where]
        if not full:
            named = sum(fit.epoch != "pooled" for fit in group.fits)
            wheres += [f"{named} of {plural(len(analysis.fits), 'epoch')}"]
        words = [f"{text}; {where}" for where in wheres]
        yield group.finding.level, words[0] if full else two_lines(*words, text)
    seen = {group.finding.name for group in shown}
    rest = groups[len(shown) :]
    quiet = {one.finding.name for one in rest if one.finding.harmless}
    names = dict.fromkeys(one.finding.name for one in rest if not one.finding.harmless)
    if listed := [name for name in names if name not in seen]:
        text = f"{'and ' * bool(shown)}{', '.join(listed)} (--full)"
        yield "" if shown else "note", two_lines(text, f"{len(listed)} more (--full)")
    if quiet := quiet - seen - names.keys():
        yield "" if listed and not shown else "note", f"{notes_text(quiet)} (--full)"


def two_lines(*texts: str) -> str:
    """Return the first text that two lines beside a label hold; else the last."""
    return next((text for text in texts if len(paragraph(text, NOTE_WIDTH)) <= 2), texts[-1])


def full_blocks(found: StudyResult, *, by_epoch: bool = False) -> Iterator[Block]:
    """Yield the tables of the report; with `by_epoch` also those with a row for each epoch."""
    names = report.source_names(found)
    for table in report.shown_tables(found):
        if by_epoch or not (table.folding and any(c.name == "epoch" for c in table.columns)):
            yield from ("", Heading(table.title), shown_table(table, names))
            if table.note:
                yield Markup(table.note).striptags()
