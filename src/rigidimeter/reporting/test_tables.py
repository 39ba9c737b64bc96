"""The tables of conclusions, laid out: `study` gives the rows, here are headings and captions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from rigidimeter.reporting.page_table import Column, Table
from rigidimeter.study import StudyResult, result_tables

__all__ = ["conclusion_tables", "laid_out"]

_INTERVAL = "[95\xa0%\xa0interval]"
_WHO = (
    Column("subject", "Subject", "label"),
    Column("day", "Day", "label"),
    Column("condition", "Condition", "condition"),
)
_LAYOUTS: Mapping[str, tuple[str, tuple[Column, ...]]] = {
    "comparisons": (
        "Comparisons of two conditions; shifts are reference − other, in the unit of the row",
        (),
    ),
    "summaries": (
        "Medians and quartiles by condition",
        (
            Column("title", "Measure", "text"),
            Column("unit", "Unit", "text"),
            Column("condition", "Condition", "condition"),
            Column("n", "n", "count"),
            Column("excluded", "Excluded", "count"),
            Column("median", "Median"),
            Column("q1", "Lower quartile"),
            Column("q3", "Upper quartile"),
        ),
    ),
    "scores": (
        "Scores of the sinusoidal epochs",
        (
            Column("source", "Source", "source"),
            Column("epoch", "Epoch", "label"),
            Column("condition", "Condition", "condition"),
            Column("outcome", "Outcome", "outcome"),
            Column("reason", "Reason", "reason"),
            Column("impulse_nm_s", "Angular impulse per cycle (N·m·s)"),
            Column("work_j", "Work per cycle (J)"),
            Column("frequency_hz", "Frequency (Hz)"),
            Column("n_cycles", "Cycles", "count"),
        ),
    ),
    "days": ("Medians of the days", ()),
    "effect_differences": (
        "Differences between effect sizes (sizes of the rank-biserial correlations)",
        (
            Column("first_title", "Effect size of", "text"),
            Column("second_title", "less that of", "text"),
            Column("estimate", f"Difference {_INTERVAL}", ends=("low", "high")),
            Column("p", "p", "p"),
            Column("p_holm", "p, Holm", "p"),
            Column("paired", "Same days", "label"),
        ),
    ),
    "ratings": (
        "Ratings as given, and less the offsets",
        (
            Column("condition", "Condition", "condition"),
            Column("examiner", "Examiner", "label"),
            Column("subject", "Subject", "label"),
            Column("day", "Day", "label"),
            Column("score", "Score", "setting"),
            Column("corrected", "Score less offsets"),
        ),
    ),
    "rating_offsets": (
        "Offsets (predicted, shrunken)",
        (
            Column("grouping", "Offset of", "label"),
            Column("name", "Name", "label"),
            Column("ratings", "Ratings", "count"),
            Column("offset", "Offset"),
            Column("sd", "SD of such offsets"),
        ),
    ),
    "rating_contrast": (
        "Contrast of the ratings",
        (
            Column("freedom", "Degrees of freedom by", "text"),
            Column("estimate", f"Difference {_INTERVAL}", ends=("low", "high")),
            Column("se", "SE"),
            Column("f", "F"),
            Column("df", "df"),
            Column("p", "p", "p"),
        ),
    ),
    "sensitivity": (
        "The shift by other methods",
        (
            Column("title", "Measure", "text"),
            Column("unit", "Unit", "check"),
            Column("method", "Method", "check"),
            Column("inertia", "J", "label"),
            Column("n_reference", "n", "count"),
            Column("n_other", "n, other", "count"),
            Column("shift", f"Shift {_INTERVAL}", ends=("shift_low", "shift_high")),
            Column("r", "r"),
            Column("p", "p, epochs", "p"),
            Column("p_day", "p, days", "p"),
            Column("chosen", "Used here", "label"),
        ),
    ),
    "conditions": (
        "Conditions",
        (
            Column("name", "Condition", "condition"),
            Column("title", "What it is", "text"),
            Column("frequency_hz", "Frequency (Hz)", "setting"),
            Column("amplitude", "Amplitude", "setting"),
            Column("amplitude_unit", "in", "label"),
            Column("pulse_width_us", "Pulse width (µs)", "setting"),
            Column("electrodes", "Electrodes", "text"),
            Column("wash_in_min", "Wash-in (min)", "setting"),
            Column("days", "Days", "count"),
            Column("sessions", "Sessions", "count"),
        ),
    ),
    "sessions": (
        "Sessions, in the order of the study's table",
        (*_WHO, Column("code", "Code", "label"), Column("path", "Path", "text")),
    ),
    "excluded_epochs": (
        "Epochs that do not count: who said so, and why",
        (
            *_WHO,
            Column("source", "Session", "source"),
            Column("epoch", "Epoch", "label"),
            Column("task", "Task", "check"),
            Column("by", "Who said so", "label"),
            Column("reason", "Why", "reason"),
            Column("who", "by name", "label"),
        ),
    ),
    "left_out": (
        "Recordings that do not count at all",
        (Column("path", "Path", "text"), *_WHO, Column("reason", "Why", "reason")),
    ),
    "account": (
        "Every recorded epoch, counted once",
        (
            Column("task", "Task", "check"),
            Column("condition", "Condition", "condition"),
            Column("recorded", "Recorded", "count"),
            Column("included", "Included", "count"),
            Column("by_protocol", "Left out by protocol", "count"),
            Column("by_check", "Left out by check", "count"),
            Column("by_estimate", "Left out by estimate", "count"),
            Column("by_operator", "Left out by operator", "count"),
            Column("unlisted", "Neither", "count"),
        ),
    ),
}
_ALWAYS = ("comparisons", "summaries", "scores")
"""The tables of recordings; the others are those of a study folder."""


def conclusion_tables(study: StudyResult) -> tuple[Table, ...]:
    """Return the tables of conclusions; they may have no rows."""
    rows = result_tables(study)
    pair = f", {study.reference} − {study.other}"
    tables = [
        laid_out(name, caption + (pair if name == "rating_contrast" else ""), rows[name], columns)
        for name, (caption, columns) in _LAYOUTS.items()
        if study.sessions or name in _ALWAYS
    ]
    if study.sessions:
        column = Column("change", "Since the last run", "reason")
        changes = tuple((text,) for text in study.changes)
        tables.append(Table("changes", "Changes", (column,), changes))
    return tuple(tables)


def laid_out(
    name: str, caption: str, rows: Sequence[Mapping[str, Any]], columns: Sequence[Column]
) -> Table:
    """Return rows as a table: all their columns in the file, on the page those with a heading.

    On the page a column is left out where it says nothing in any row, as is a code that is the
    name of the condition.
    """
    known = {column.name: column for column in columns}
    names = dict.fromkeys([*(key for row in rows for key in row), *(known if not rows else ())])
    shown = [
        replace(known[each], on_page=not rows or _says_something(each, rows))
        if each in known
        else Column(each, each, on_page=False)
        for each in names
    ]
    cells = tuple(tuple(_cell(row.get(each)) for each in names) for row in rows)
    return Table(name, caption, tuple(shown), cells)


def _says_something(name: str, rows: Sequence[Mapping[str, Any]]) -> bool:
    if name == "code":
        return any(row["code"] != row["condition"] for row in rows)
    return any(row.get(name) not in (None, "") for row in rows)


def _cell(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
