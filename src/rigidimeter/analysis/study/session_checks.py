"""What is wrong with sessions beside each other: one is there twice, or was commanded otherwise."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rigidimeter.analysis.study.results import SessionEntry
from rigidimeter.core.records import Epoch, Notice
from rigidimeter.core.settings import Settings, dump_settings
from rigidimeter.core.study_files import TableRow

_COMMANDED: Mapping[str, tuple[str, ...]] = {
    "prbs": ("controller", "prbs"),
    "sinusoid": ("controller", "sinusoid"),
}
"""By task, the tables of the settings that say what the rig was commanded."""


@dataclass(frozen=True)
class Session:
    """One recording that was read: its row in the table, its epochs, its settings if it has any."""

    row: TableRow
    entry: SessionEntry
    epochs: tuple[Epoch, ...]
    settings: Settings | None


def twice(sessions: Sequence[Session]) -> list[tuple[TableRow, str]]:
    """Find a day of a subject that is there twice with the same condition, task and part."""
    seen: dict[tuple[str, ...], TableRow] = {}
    found = []
    for session in sessions:
        row, entry = session.row, session.entry
        for task in dict.fromkeys(epoch.task or "" for epoch in session.epochs):
            key = (entry.subject, entry.day, entry.condition, task, row["part"])
            if key in seen:
                part = f", part {row['part']}" if row["part"] else ""
                found.append(
                    (
                        row,
                        f"subject {entry.subject}, day {entry.day}, {entry.condition}, {task}"
                        f"{part} is in the table already (line {seen[key].line}); if both are "
                        "parts of one day, give each a name in the column part",
                    )
                )
                break
            seen[key] = row
    return found


def commanded_otherwise(sessions: Sequence[Session]) -> list[tuple[TableRow, str]]:
    """Return the sessions that were commanded otherwise than most of their task, and in what.

    Epochs of two versions of a protocol are two measurements, and must not be pooled.
    Where no version has more sessions than any other, the one that comes first in the table stays.
    """
    found: list[tuple[TableRow, str]] = []
    for task, tables in _COMMANDED.items():
        versions = [
            (session, _values(session.settings, tables))
            for session in sessions
            if session.settings is not None
            and any(epoch.task == task for epoch in session.epochs)
            and not any(session.row is other for other, _ in found)
        ]
        # A recording of two conditions has two rows, and is one all the same.
        recordings = {session.entry.source: values for session, values in versions}
        counts = Counter(json.dumps(values, sort_keys=True) for values in recordings.values())
        if len(counts) < 2:
            continue
        most = counts.most_common(1)[0][0]
        usual = json.loads(most)
        example = next(s.entry for s, v in versions if json.dumps(v, sort_keys=True) == most)
        for session, values in versions:
            differing = [name for name in usual if usual[name] != values.get(name)]
            if not differing:
                continue
            told = "; ".join(f"{name} = {values.get(name)}" for name in differing)
            wanted = "; ".join(f"{name} = {usual[name]}" for name in differing)
            found.append(
                (
                    session.row,
                    f"{session.entry.path} is of another version of the protocol: it was recorded "
                    f"with {told}, but {counts[most]} of {len(recordings)} sessions, such as "
                    f"{example.path}, with {wanted}",
                )
            )
    return found


def _values(settings: Settings, tables: Sequence[str]) -> dict[str, Any]:
    dumped = dump_settings(settings)
    return {f"{table}.{name}": value for table in tables for name, value in dumped[table].items()}


def other_settings(sessions: Sequence[Session]) -> list[Notice]:
    """Say where sessions were recorded with other settings that the analysis uses or shows."""
    with_settings = [(s.entry, s.settings) for s in sessions if s.settings is not None]
    said = []
    for entry, settings in with_settings[1:]:
        first_entry, first = with_settings[0]
        differing = [
            name
            for name in ("guard", "rig", "estimation", "scores", "diagnostics")
            if getattr(settings, name) != getattr(first, name)
        ]
        if differing:
            text = (
                f"{entry.path}: was recorded with other settings than {first_entry.path} in "
                f"{', '.join(differing)}; those of {first_entry.path} are used for all"
            )
            said.append(Notice("warning", text))
    return said
