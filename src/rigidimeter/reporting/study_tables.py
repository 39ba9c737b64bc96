"""What a study folder adds, as tables: conditions, sessions, days, and what does not count."""

from __future__ import annotations

from rigidimeter.reporting.measures import conditions
from rigidimeter.reporting.page_table import Cell, Column, Table
from rigidimeter.reporting.test_tables import record_table, test_tables
from rigidimeter.study import Cohort, DayMedian, Study

__all__ = ["cohort_tables"]


def cohort_tables(study: Study) -> tuple[Table, ...]:
    """Return the tables of a study folder, none without one; tables may have no rows."""
    cohort = study.cohort
    if cohort is None:
        return ()
    return (
        _conditions(cohort),
        _sessions(cohort),
        record_table("day_medians", "Medians of the days", DayMedian, cohort.days),
        *test_tables(cohort),
        _excluded_epochs(cohort),
        _left_out(cohort),
        _account(study, cohort),
        _changes(cohort),
    )


def _conditions(cohort: Cohort) -> Table:
    def known(name: str) -> bool:
        return any(getattr(c, name) not in (None, "") for c in described)

    # A code must not be told by its stimulation.
    described = () if cohort.blinded else cohort.conditions
    columns = (
        Column("condition", "Condition", "condition"),
        Column("title", "What it is", "text", on_page=known("title")),
        Column("frequency_hz", "Frequency (Hz)", "setting", on_page=known("frequency_hz")),
        Column("amplitude", "Amplitude", "setting", on_page=known("amplitude")),
        Column("amplitude_unit", "in", "label", on_page=known("amplitude_unit")),
        Column("pulse_width_us", "Pulse width (µs)", "setting", on_page=known("pulse_width_us")),
        Column("electrodes", "Electrodes", "text", on_page=known("electrodes")),
        Column("wash_in_min", "Wash-in (min)", "setting", on_page=known("wash_in_min")),
        Column("days", "Days", "count"),
        Column("sessions", "Sessions", "count"),
    )
    rows: list[tuple[Cell, ...]] = []
    for c in cohort.conditions:
        mine = [s for s in cohort.sessions if s.condition == c.name]
        days = len({(s.subject, s.day) for s in mine})
        about: tuple[Cell, ...] = (None,) * 7
        if not cohort.blinded:
            about = (c.title, c.frequency_hz, c.amplitude, c.amplitude_unit, c.pulse_width_us)
            about += (c.electrodes, c.wash_in_min)
        rows.append((c.name, *about, days, len(mine)))
    return Table("conditions", "Conditions", columns, tuple(rows))


def _sessions(cohort: Cohort) -> Table:
    columns = (
        Column("subject", "Subject", "label"),
        Column("day", "Day", "label"),
        Column("condition", "Condition", "condition"),
        Column(
            "code", "Code", "label", on_page=any(s.code != s.condition for s in cohort.sessions)
        ),
        Column("path", "Path", "text"),
        Column("source", "Source", "text", on_page=False),
    )
    names = [column.name for column in columns]
    rows = tuple(tuple(getattr(s, name) for name in names) for s in cohort.sessions)
    return Table("sessions", "Sessions, in the order of the study's table", columns, rows)


def _excluded_epochs(cohort: Cohort) -> Table:
    columns = (
        Column("subject", "Subject", "label"),
        Column("day", "Day", "label"),
        Column("condition", "Condition", "condition"),
        Column("source", "Session", "source"),
        Column("epoch", "Epoch", "label"),
        Column("task", "Task", "check"),
        Column("by", "Who said so", "label"),
        Column("who", "by name", "label", on_page=any(e.who for e in cohort.exclusions)),
        Column("reason", "Why", "reason"),
    )
    names = [column.name for column in columns]
    rows = tuple(tuple(getattr(e, name) for name in names) for e in cohort.exclusions)
    caption = "Epochs that do not count: who said so, and why"
    return Table("excluded_epochs", caption, columns, rows)


def _left_out(cohort: Cohort) -> Table:
    columns = (
        Column("path", "Path", "text"),
        Column("subject", "Subject", "label"),
        Column("day", "Day", "label"),
        Column("condition", "Condition", "condition"),
        Column("reason", "Why", "reason"),
    )
    names = [column.name for column in columns]
    rows = tuple(tuple(getattr(one, name) for name in names) for one in cohort.left_out)
    return Table("left_out", "Whole recordings that do not count", columns, rows)


BY = ("protocol", "check", "estimate", "operator")


def _account(study: Study, cohort: Cohort) -> Table:
    """Count what was recorded, what counts, and who left out the rest."""
    columns = (
        Column("task", "Task", "check"),
        Column("condition", "Condition", "condition"),
        Column("recorded", "Recorded", "count"),
        Column("included", "Included", "count"),
        *(Column(f"by_{by}", f"Left out by {by}", "count") for by in BY),
        Column("unlisted", "Neither", "count"),
    )
    rows: list[tuple[Cell, ...]] = []
    analysis = study.analysis
    counted = {
        "prbs": {(f.source, f.epoch) for f in analysis.fixed_inertia if f.outcome.included},
        "sinusoid": {(s.source, s.epoch) for s in analysis.scores if s.outcome.included},
    }
    fitted = {(fit.source, fit.epoch) for fit in analysis.fits}
    for task in ("prbs", "sinusoid"):
        for condition in conditions(study):
            recorded = {
                who
                for epoch in study.epochs
                if epoch.condition == condition
                and (
                    epoch.task or ("prbs" if (epoch.source, epoch.label) in fitted else "sinusoid")
                )
                == task
                for who in [(epoch.source, epoch.label)]
            }
            out: dict[tuple[str, str], str] = {}
            for e in cohort.exclusions:
                if (e.source, e.epoch) in recorded:
                    out.setdefault((e.source, e.epoch), e.by)
            if not recorded:
                continue
            included = (recorded & counted[task]) - set(out)
            by = [sum(who == name for who in out.values()) for name in BY]
            rest = len(recorded) - len(included) - len(out)
            rows.append((task, condition, len(recorded), len(included), *by, rest))
    return Table("account", "Every recorded epoch, counted once", columns, tuple(rows))


def _changes(cohort: Cohort) -> Table:
    columns = (Column("change", "Since the last run", "reason"),)
    return Table("changes", "Changes", columns, tuple((text,) for text in cohort.changes))
