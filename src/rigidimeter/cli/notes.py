"""Notes below the tables of a screen: at what motion K is given, and what the checks found."""

from __future__ import annotations

from collections.abc import Iterator

from rigidimeter.cli.terminal_tables import paragraph
from rigidimeter.core.records import Analysis, notes_text
from rigidimeter.core.words import plural

MOST_FINDINGS = 3

NOTE_WIDTH = 67
"""Letters of a line beside the label of a note, of the 80 of a line."""


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
