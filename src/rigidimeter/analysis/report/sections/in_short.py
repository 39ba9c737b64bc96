"""The summary below the first screen: the days, findings, subjects and conditions."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from markupsafe import Markup

from rigidimeter.analysis.figures import (
    day_groups,
    day_rows,
    draw_days,
    drawn,
    longest_day,
    values_of,
)
from rigidimeter.analysis.report.contents import (
    Block,
    Figure,
    Section,
    bullets,
    from_study_folder,
    paragraph,
    part,
)
from rigidimeter.analysis.report.shown import Shown
from rigidimeter.analysis.study import Rows, measures_of, result_table, traffic_light
from rigidimeter.core.findings import Finding
from rigidimeter.core.records import Analysis, FindingGroup, Fit, notes_text
from rigidimeter.core.words import (
    Column,
    Kind,
    Table,
    condition_name,
    number,
    plural,
    series,
)

DAYS_WIDTH = 9.6
"""In inches, between the width of the page on a screen and that of a sheet of paper."""

UNFOLDING = Markup(
    '<details class="finding">\n<summary><span class="outcome is-{level}">{level}</span> '
    "<strong>{name}</strong> {headline}; {where}</summary>\n"
    "<p>{details}</p>\n{todo}</details>"
)
QUIET = Markup(
    '<details class="finding">\n<summary><span class="outcome is-note">note</span> {}</summary>\n'
)

_STIMULATION: tuple[tuple[str, str, Kind], ...] = (
    ("title", "Description", "text"),
    ("frequency_hz", "Frequency (Hz)", "setting"),
    ("amplitude", "Amplitude", "setting"),
    ("amplitude_unit", "in", "label"),
    ("pulse_width_us", "Pulse width (µs)", "setting"),
    ("electrodes", "Electrodes", "text"),
    ("wash_in_min", "Wash-in (min)", "setting"),
)


def _numbers(shown: Shown) -> Iterator[Block]:
    """Yield the numbers of the first screen as files."""
    for name, title in (
        ("conclusion", "What is concluded of each measure"),
        ("precision", "Precision of each measure"),
    ):
        if rows := result_table(shown.result, name):
            yield Table(name, title, (), rows)
    light = traffic_light(shown.study, shown.result.comparisons)
    if light is not None:
        yield Table("quality", "Quality of the data", (), [light])


def _days(shown: Shown) -> Iterator[Block]:
    result = shown.result
    medians = result_table(result, "days")
    yield Table("days", "Medians of the days", (), medians)
    if not medians:
        return
    yield paragraph(
        "Each small point is an included epoch. Beside the points of a day are their median and, "
        "as a bar, their quartiles; a line joins the medians of a day that has both conditions."
    )
    order = [condition_name(name) for name in shown.condition_names]
    for measure in sorted(measures_of(result.study.rows), key=lambda one: one.place):
        own = [row for row in medians if row["measure"] == measure.name]
        if not own:
            continue
        words = "; ".join(
            f"{row['subject']} day {row['day']} {condition_name(row['condition'])}: median "
            f"{number(row['median'])}, n = {row['n']}"
            for row in own
        )
        values = values_of(result, measure)
        groups = day_groups(values)
        count = sum(map(len, groups.values()))
        n_days = len({(row["subject"], row["day"]) for row in own})
        rows = len(day_rows(values))
        size = DAYS_WIDTH, 0.35 + (2.1 + 0.5 * (longest_day(values) > 3)) * rows
        yield Figure(
            f"days_{measure.name}",
            f"{measure.title}: {plural(count, 'included epoch')} of {plural(n_days, 'day')}.",
            f"{measure.title} by day. {words} ({measure.unit}).",
            partial(drawn, size, draw_days, values, order, rows=rows, sharey=True),
            "page",
            marks=groups,
        )


def _findings(shown: Shown) -> Iterator[Block]:
    groups, n_fitted = shown.analysis.findings, len(shown.analysis.fits)
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
    found = shown.result.findings
    yield from (_unfolding(group) for group in found if not group.finding.harmless)
    if quiet := [group for group in found if group.finding.harmless]:
        inner = Markup("\n").join(map(_unfolding, quiet))
        text = notes_text(group.finding.name for group in quiet)
        yield QUIET.format(text) + inner + Markup("\n</details>")
    kinds = [
        {
            "check": one.name,
            "level": one.level,
            "epochs": sum(fit.epoch != "pooled" for fit in fits),
            "fitted": n_fitted,
            "where": where,
            **one.words._asdict(),
        }
        for one, fits, where in groups
    ]
    yield Table("finding_kinds", "Findings by kind", (), kinds)
    of_whom, of_finding = ("source", "epoch", "condition"), ("level", "value", "unit", "limit", "p")
    rows = [
        {name: getattr(fit, name) for name in of_whom}
        | {"check": finding.name}
        | {name: getattr(finding, name) for name in of_finding}
        | {
            f"effect_{name}_{of}": getattr(finding.effect, of)[i]
            for of in finding.effect._fields
            for i, name in enumerate("JBK")
        }
        | finding.words._asdict()
        for fit, finding in _of_fits(shown.analysis)
    ]
    yield Table("findings", "Findings, epoch by epoch", (), rows)


def _unfolding(group: FindingGroup) -> Markup:
    one, _, where = group
    remedy = one.words.remedy
    todo = Markup("<p>{}</p>\n").format(remedy) if remedy else ""
    shown = {"level": one.level, "name": one.name, "headline": one.headline, "where": where}
    return UNFOLDING.format(**shown, details=one.details, todo=todo)


def _of_fits(analysis: Analysis) -> list[tuple[Fit, Finding]]:
    """Return every finding of an epoch, and of epochs together what no epoch carries."""
    found = [(fit, finding) for fit in analysis.fits for finding in fit.findings]
    carried = {finding for _, finding in found}
    together = [(fit, finding) for fit in analysis.pooled for finding in fit.findings]
    return found + [(fit, finding) for fit, finding in together if finding not in carried]


def _overview(shown: Shown) -> Iterator[Block]:
    rows = result_table(shown.result, "conditions")
    items = Markup("\n").join(
        Markup("<dt>{}</dt><dd>{}</dd>").format(name, value) for name, value in _facts(shown, rows)
    )
    yield Markup('<dl class="facts">\n{}\n</dl>').format(items)
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


def _facts(shown: Shown, conditions: Rows) -> Iterator[tuple[str, str]]:
    study, n_epochs = shown.study, len(shown.epochs)
    subjects = list(dict.fromkeys(s.subject for s in study.sessions))
    days = {(s.subject, s.day) for s in study.sessions}
    counts = {row["name"]: row["days"] for row in conditions}
    both = sum(counts.values()) - len(days)
    split = series([f"{count} in {condition_name(name)}" for name, count in counts.items()])
    named = f": {', '.join(subjects)}" if any(subjects) and len(subjects) <= 24 else ""
    partly = ", some of it virtual" if study.partly_virtual else ""
    blinded = "blinded: conditions are codes, and no key was given"
    virtual = "virtual: every session was recorded on the virtual rig"
    yield "Subjects", f"{len(subjects)}{named}"
    yield "Days", f"{len(days)}: {split}" + (f", {both} in both" if both > 0 else "")
    yield "Sessions", f"{len(study.sessions)}, with {plural(n_epochs, 'epoch')}"
    yield "Blinding", blinded if study.blinded else "not blinded"
    yield "Data", virtual if study.virtual else f"recorded{partly}"


def _changes(shown: Shown) -> Iterator[Block]:
    yield Table("changes", "Changes", (), [{"change": text} for text in shown.changes])
    if shown.changes:
        yield bullets(shown.changes)


SECTIONS = part(
    "Summary",
    Section("numbers", "Numbers of the first screen", _numbers),
    Section("days", "Day by day", _days, from_study_folder),
    Section("findings", "Findings", _findings),
    Section("study", "The study", _overview, from_study_folder),
    Section("changes", "Since the last analysis", _changes, from_study_folder),
    printed=4,
)
