"""When the stimulation of a subject was switched: `stimulation.csv` of a study.

A wait runs from the last change, not from the moment at which somebody says that it is over.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, tzinfo
from pathlib import Path

from rigidimeter.core.errors import UserError
from rigidimeter.core.study_files.tables import add_rows, checked_table

STIMULATION_TABLE = "stimulation.csv"
NOT_YET = timedelta(hours=2)
"""A time of day that is less ahead is a slip; one that is more is of the day before."""

_STATES = ("on", "off")
_CLOCK = re.compile(r"(on|off)(?:\s+since\s+(\d{1,2}):(\d{2}))?")


@dataclass(frozen=True)
class StimulationChange:
    """One change: whose, when, to what, and who says so."""

    subject: str
    changed_utc: datetime
    stimulation: str
    by: str = ""

    def minutes_until(self, when: datetime) -> float:
        """Return the minutes from the change to a time."""
        return (when - self.changed_utc).total_seconds() / 60.0

    def is_ahead_of(self, now: datetime) -> bool:
        """Whether it was written down for a time more than 1 min ahead."""
        return self.minutes_until(now) < -1.0


def parse_change(
    text: str, subject: str, now: datetime, by: str = "", zone: tzinfo | None = None
) -> StimulationChange:
    """Return the change that ``on``, ``off`` or ``off since 10:42`` says.

    Parameters
    ----------
    text : str
        The clock is that of the laboratory, within the last 24 hours.
    subject : str
    now : datetime
        With its zone.
    by : str
    zone : tzinfo or None
        Of the laboratory; None for that of this computer.

    Raises
    ------
    UserError
        If it cannot be read.

    Examples
    --------
    >>> now = datetime(2026, 1, 5, 11, 0, tzinfo=UTC)
    >>> parse_change("off since 10:42", "S01", now, zone=UTC).minutes_until(now)
    18.0
    """
    found = _CLOCK.fullmatch(text.strip().lower())
    hour, minute = (int(part) for part in found.groups()[1:]) if found and found[2] else (0, 0)
    if found is None or hour > 23 or minute > 59:
        raise UserError(
            f"stimulation {text.strip()!r}: write on or off, or since when on the clock, such as "
            "off since 10:42"
        )
    changed = now
    if found[2]:
        local = now.astimezone(zone)
        changed = local.replace(hour=hour, minute=minute, second=0, microsecond=0)
        if local < changed < local + NOT_YET:
            raise UserError(
                f"stimulation {text.strip()!r}: {changed:%H:%M} has not come yet, it is "
                f"{local:%H:%M}; write a time that is over"
            )
        if changed > local:
            changed -= timedelta(days=1)
    return StimulationChange(subject, changed.astimezone(UTC), found[1], by)


def read_changes(study: Path) -> tuple[StimulationChange, ...]:
    """Return all changes that were written down, the oldest first.

    Raises
    ------
    UserError
        If the table cannot be read; names the line and the value.
    """
    path = study / STIMULATION_TABLE
    if not path.exists():
        return ()
    table = checked_table(path, "stimulation")
    found = []
    for k, line in enumerate(table.lines):
        when, subject, state = (
            table.columns[column][k] for column in ("changed_utc", "subject", "stimulation")
        )
        by = table.columns["by"][k] if "by" in table.columns else ""
        try:
            changed = datetime.fromisoformat(when)
        except ValueError:
            changed = None
        if changed is None or changed.tzinfo is None or state not in _STATES:
            raise UserError(
                f"{path}, line {line}: {when!r}, {state!r}; changed_utc must be a time with its "
                "zone, such as 2026-01-05T10:42:00+00:00, and stimulation on or off"
            )
        found.append(StimulationChange(subject, changed.astimezone(UTC), state, by))
    return tuple(sorted(found, key=lambda one: one.changed_utc))


def add_change(study: Path, change: StimulationChange) -> None:
    """Write a change down behind those that are there.

    Raises
    ------
    UserError
        If the table cannot be read or written, or the change is older than the last one of the
        subject.
    """
    last = last_change([one for one in read_changes(study) if one.subject == change.subject])
    if last is not None and change.changed_utc < last.changed_utc:
        raise UserError(
            f"stimulation of {change.subject}: {change.changed_utc:%Y-%m-%d %H:%M} UTC is before "
            f"its last change, {last.stimulation} at {last.changed_utc:%Y-%m-%d %H:%M} UTC; "
            f"correct {study / STIMULATION_TABLE} if that is wrong"
        )
    row = {
        "changed_utc": change.changed_utc.isoformat(timespec="seconds"),
        "subject": change.subject,
        "stimulation": change.stimulation,
        "by": change.by,
    }
    add_rows(study / STIMULATION_TABLE, "stimulation", [row])


def last_change(changes: Sequence[StimulationChange]) -> StimulationChange | None:
    """Return the last change of one subject, None without one.

    A state that was reported again, unchanged, counts from its first report.
    """
    first = len(changes) - 1
    while first > 0 and changes[first - 1].stimulation == changes[-1].stimulation:
        first -= 1
    return changes[first] if changes else None
