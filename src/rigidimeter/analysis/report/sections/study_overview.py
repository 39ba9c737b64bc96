"""A study folder: subjects, days and conditions, and what changed since it was last analysed."""

from __future__ import annotations

from collections.abc import Iterator

from markupsafe import Markup

from rigidimeter.analysis.report.contents import Block, Section, bullets, from_study_folder
from rigidimeter.analysis.study import StudyResult, result_table, traffic_light
from rigidimeter.core.words import Column, Kind, Table, condition_name, plural, series

_STIMULATION: tuple[tuple[str, str, Kind], ...] = (
    ("title", "Description", "text"),
    ("frequency_hz", "Frequency (Hz)", "setting"),
    ("amplitude", "Amplitude", "setting"),
    ("amplitude_unit", "in", "label"),
    ("pulse_width_us", "Pulse width (µs)", "setting"),
    ("electrodes", "Electrodes", "text"),
    ("wash_in_min", "Wash-in (min)", "setting"),
)


def _overview(result: StudyResult) -> Iterator[Block]:
    items = Markup("\n").join(
        Markup("<dt>{}</dt><dd>{}</dd>").format(name, value) for name, value in _facts(result)
    )
    yield Markup('<dl class="facts">\n{}\n</dl>').format(items)
    rows = result_table(result, "conditions")
    known = [row for row in _STIMULATION if any(cells[row[0]] not in (None, "") for cells in rows)]
    yield Table(
        "conditions",
        "Conditions",
        (
            Column("name", "Condition", "condition"),
            *(Column(*row) for row in known),
            Column("days", "Days", "count"),
            Column("sessions", "Sessions", "count"),
        ),
        rows,
    )


def _facts(result: StudyResult) -> list[tuple[str, str]]:
    subjects = list(dict.fromkeys(s.subject for s in result.sessions))
    days = {(s.subject, s.day) for s in result.sessions}
    each = {
        c.name: {(s.subject, s.day) for s in result.sessions if s.condition == c.name}
        for c in result.conditions
    }
    both = sum(len(own) for own in each.values()) - len(days)
    split = series([f"{len(own)} in {condition_name(name)}" for name, own in each.items()])
    named = f": {', '.join(subjects)}" if any(subjects) and len(subjects) <= 24 else ""
    partly = ", some of it virtual" if any(e.virtual for e in result.epochs) else ""
    return [
        ("Subjects", f"{len(subjects)}{named}"),
        ("Days", f"{len(days)}: {split}" + (f", {both} in both" if both > 0 else "")),
        ("Sessions", f"{len(result.sessions)}, with {plural(len(result.epochs), 'epoch')}"),
        (
            "Blinding",
            "blinded: conditions are codes, and no key was given"
            if result.blinded
            else "not blinded",
        ),
        (
            "Data",
            "virtual: every session was recorded on the virtual rig"
            if result.virtual
            else f"recorded{partly}",
        ),
    ]


def _changes(result: StudyResult) -> Iterator[Block]:
    yield Table("changes", "Changes", (), [{"change": text} for text in result.changes])
    if result.changes:
        yield bullets(result.changes)


def _numbers(result: StudyResult) -> Iterator[Block]:
    """Yield the numbers of the first screen as files."""
    for name, title in (
        ("conclusion", "What is concluded of each measure"),
        ("precision", "Precision of each measure"),
    ):
        if rows := result_table(result, name):
            yield Table(name, title, (), rows)
    light = traffic_light(result)
    if light is not None:
        yield Table("quality", "Quality of the data", (), [light.row()])


NUMBERS = Section("numbers", "Numbers of the first screen", _numbers)
OVERVIEW = Section("study", "The study", _overview, from_study_folder)
CHANGES = Section("changes", "Since the last analysis", _changes, from_study_folder)
