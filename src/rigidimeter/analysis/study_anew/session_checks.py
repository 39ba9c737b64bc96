"""Sessions beside each other, and single epochs: which do not count, who said so, and why."""

from __future__ import annotations

import difflib
import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from rigidimeter.analysis.study_anew.study import Exclusion, SessionEntry
from rigidimeter.core.records import Analysis, Epoch, Notice, Outcome
from rigidimeter.core.settings import Settings, dump_settings
from rigidimeter.core.study_files import TableRow

_COMMANDED: Mapping[str, tuple[str, ...]] = {
    "prbs": ("controller", "prbs"),
    "sinusoid": ("controller", "sinusoid"),
}
"""By task, the tables of the settings that say what the rig was commanded."""

_ANALYSED = ("guard", "rig", "estimation", "scores", "diagnostics")
"""The tables of the settings that an analysis uses or shows."""


@dataclass(frozen=True, eq=False)
class Session:
    """One recording that was read: its row in the table, its epochs, its settings if it has any."""

    row: TableRow
    entry: SessionEntry
    epochs: tuple[Epoch, ...]
    settings: Settings | None


def twice(sessions: Sequence[Session]) -> Iterator[tuple[TableRow, str]]:
    """Yield a day of a subject that is there twice with the same condition, task and part."""
    seen: dict[tuple[str, ...], TableRow] = {}
    for session in sessions:
        row, entry = session.row, session.entry
        for task in dict.fromkeys(epoch.task or "" for epoch in session.epochs):
            key = (entry.subject, entry.day, entry.condition, task, row["part"])
            if key in seen:
                part = f", part {row['part']}" if row["part"] else ""
                yield (
                    row,
                    f"subject {entry.subject}, day {entry.day}, {entry.condition}, {task}{part} "
                    f"is in the table already (line {seen[key].line}); if both are parts of one "
                    "day, give each a name in the column part",
                )
                break
            seen[key] = row


def commanded_otherwise(sessions: Sequence[Session]) -> Iterator[tuple[TableRow, str]]:
    """Yield the sessions that were commanded otherwise than most of their task, and in what.

    Epochs of two versions of a protocol are two measurements, and must not be pooled. Where no
    version has more sessions than any other, the one that comes first in the table stays.
    """
    found: list[TableRow] = []
    for task, tables in _COMMANDED.items():
        versions = [
            (session, _values(session.settings, tables))
            for session in sessions
            if session.settings is not None
            and any(epoch.task == task for epoch in session.epochs)
            and not any(session.row is row for row in found)
        ]
        # A recording of two conditions has two rows, and is one all the same.
        recordings = {session.entry.source: _key(values) for session, values in versions}
        counts = Counter(recordings.values())
        if len(counts) < 2:
            continue
        ((most, count),) = counts.most_common(1)
        usual = json.loads(most)
        example = next(s.entry for s, values in versions if _key(values) == most)
        for session, values in versions:
            differing = [name for name in usual if usual[name] != values.get(name)]
            if not differing:
                continue
            found.append(session.row)
            own = "; ".join(f"{name} = {values.get(name)}" for name in differing)
            wanted = "; ".join(f"{name} = {usual[name]}" for name in differing)
            yield (
                session.row,
                f"{session.entry.path} is of another version of the protocol: it was recorded "
                f"with {own}, but {count} of {len(recordings)} sessions, such as {example.path}, "
                f"with {wanted}",
            )


def _values(settings: Settings, tables: Sequence[str]) -> dict[str, Any]:
    dumped = dump_settings(settings)
    return {f"{table}.{name}": value for table in tables for name, value in dumped[table].items()}


def _key(values: Mapping[str, Any]) -> str:
    return json.dumps(values, sort_keys=True)


def other_settings(sessions: Sequence[Session]) -> Iterator[Notice]:
    """Yield where sessions were recorded with other settings that the analysis uses or shows."""
    known = [(s.entry.path, s.settings) for s in sessions if s.settings is not None]
    for path, settings in known[1:]:
        first_path, first = known[0]
        differing = [n for n in _ANALYSED if getattr(settings, n) != getattr(first, n)]
        if differing:
            text = (
                f"{path}: was recorded with other settings than {first_path} in "
                f"{', '.join(differing)}; those of {first_path} are used for all"
            )
            yield Notice("warning", text)


class Taken(NamedTuple):
    """The operator's exclusions: epochs with them, the rows that met one, what met none."""

    epochs: tuple[Epoch, ...]
    rows: Mapping[tuple[str, str], TableRow]
    notices: tuple[Notice, ...]


def without_excluded(
    rows: Sequence[TableRow],
    epochs: Sequence[Epoch],
    sources: Mapping[str, str],
    left_out: Sequence[str],
    table: str,
) -> Taken:
    """Return the epochs less those that the operator takes out.

    Parameters
    ----------
    rows : sequence of TableRow
        Of the study's table of exclusions.
    epochs : sequence of Epoch
    sources : mapping of str to str
        By path as `rows` write it: the source of its epochs; other paths are absent.
    left_out : sequence of str
        Paths of sessions that do not count anyhow.
    table : str
        The table of sessions, for messages.
    """
    known = {(epoch.source, epoch.label): epoch for epoch in epochs}
    labels: dict[str, list[str]] = {}
    for source, label in known:
        labels.setdefault(source, []).append(label)
    met: dict[tuple[str, str], TableRow] = {}
    notices = []
    for row in rows:
        path = row["path"]
        key = (sources.get(path, ""), row["epoch"])
        if key in met:
            text = f"epoch {row['epoch']} of {path} is out already (line {met[key].line}); the "
            notices.append(Notice("warning", f"{row.where}: {text}first reason counts"))
        elif key in known:
            met[key] = row
            by = f" ({row['by']})" if row["by"] else ""
            known[key] = replace(known[key], closed=Outcome("excluded", f"{row['reason']}{by}"))
        elif path in sources:
            there = ", ".join(labels.get(sources[path], [])) or "none"
            text = f"{path} has no epoch {row['epoch']}; its epochs are {there}"
            notices.append(Notice("error", f"{row.where}: {text}"))
        elif path not in left_out:
            near = difflib.get_close_matches(path.removeprefix("./"), labels, n=1, cutoff=0.5)
            hint = f"; the nearest is {near[0]}" if near else ""
            notices.append(Notice("error", f"{row.where}: {path} is no session of {table}{hint}"))
    return Taken(tuple(known.values()), met, tuple(notices))


def exclusions_of(
    taken: Taken, analysis: Analysis, sessions: Mapping[str, SessionEntry]
) -> Iterator[Exclusion]:
    """Yield every epoch that does not count, with who said so; `sessions` are by source."""
    results = {(result.source, result.epoch): result for result in analysis.results}
    for epoch in taken.epochs:
        key = (epoch.source, epoch.label)
        result = results.get(key)
        if result is None or result.outcome.included:
            continue
        entry, row = sessions[epoch.source], taken.rows.get(key)
        where = (entry.subject, entry.day, epoch.condition, *key, epoch.task or "")
        if row is not None:
            yield Exclusion(*where, "operator", row["reason"], row["by"])
        elif not epoch.closed.included:
            yield Exclusion(*where, "protocol", epoch.closed.reason)
        elif result.outcome.kind == "failed":
            yield Exclusion(*where, "estimate", result.outcome.reason)
        else:
            yield Exclusion(*where, "check", result.outcome.reason)
