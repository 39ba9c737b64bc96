"""Sessions beside each other and their plan, and single epochs: what does not count, and why.

No conclusion changes by a deviation from the plan: what deviates is listed, and each primary
measure is tested once more without the sessions that deviate.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rigidimeter.analysis.study.study import Deviation, Exclusion, SessionEntry
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Analysis, Epoch, Notice
from rigidimeter.core.session import session_settings
from rigidimeter.core.settings import Settings, dump_settings, load_settings
from rigidimeter.core.study_files import (
    PlannedBlock,
    RecordedBlock,
    StudyPlan,
    TableRow,
    read_plan,
    recorded_blocks,
)
from rigidimeter.core.words import plural, series

_COMMANDED: Mapping[str, tuple[str, ...]] = {
    "prbs": ("controller", "prbs"),
    "sinusoid": ("controller", "sinusoid"),
}
"""By task, the tables of the settings that say what the rig was commanded."""

TOLERANCE_MIN = 0.5
"""By which a wait may be shorter than planned."""

_OF_PROTOCOL = ("prbs", "sinusoid", "protocol", "controller", "guard")
"""The tables of the settings that a protocol file decides, and not the rig or the seed."""

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


def exclusions_of(
    epochs: Sequence[Epoch],
    analysis: Analysis,
    sessions: Mapping[str, SessionEntry],
    operator: Mapping[tuple[str, str], TableRow],
) -> Iterator[Exclusion]:
    """Yield every epoch that does not count, with who excluded it.

    Parameters
    ----------
    epochs : sequence of Epoch
    analysis : Analysis
    sessions : mapping of str to SessionEntry
        By source.
    operator : mapping of (str, str) to TableRow
        What the operator excluded, by source and label.
    """
    results = {(result.source, result.epoch): result for result in analysis.results}
    for epoch in epochs:
        key = (epoch.source, epoch.label)
        result = results.get(key)
        if result is None or result.outcome.included:
            continue
        entry, row = sessions[epoch.source], operator.get(key)
        where = (entry.subject, entry.day, epoch.condition, *key, epoch.task or "")
        if row is not None:
            yield Exclusion(*where, "operator", row["reason"], row["by"])
        elif not epoch.closed.included:
            yield Exclusion(*where, "protocol", epoch.closed.reason)
        else:
            by = "estimate" if result.outcome.kind == "failed" else "check"
            yield Exclusion(*where, by, result.outcome.reason)  # type: ignore[arg-type]


def deviations(folder: Path, sessions: Sequence[SessionEntry]) -> tuple[Deviation, ...]:
    """Return every deviation of a study from its plan; none where it has no plan.

    Parameters
    ----------
    folder : Path
        Of the study.
    sessions : sequence of SessionEntry
        Those that were analysed.

    Raises
    ------
    UserError
        If the plan or a manifest cannot be read.
    """
    plan = read_plan(folder)
    if plan is None:
        return ()
    recorded = [one for one in recorded_blocks(folder) if one.begun]
    planned = {block.key: block for block in plan.blocks}
    listed = {entry.path: entry for entry in sessions}
    found = list(_of_plan(plan, recorded))
    for one in recorded:
        if one.path in listed:
            block = None if one.key is None else planned.get(one.key)
            found += (
                [_unplanned(listed[one.path])]
                if block is None
                else [
                    _deviation(plan, block, one.path, *how) for how in _of_block(plan, block, one)
                ]
            )
    known = {one.path for one in recorded}
    return (*found, *(_unplanned(entry) for path, entry in listed.items() if path not in known))


def _of_plan(plan: StudyPlan, recorded: Sequence[RecordedBlock]) -> Iterator[Deviation]:
    """Yield what was planned and not done, and what was done in another order than planned."""
    first = {one.key: k for k, one in reversed(list(enumerate(recorded)))}
    for subject in plan.about.subjects:
        latest = -1
        for block in (block for block in plan.blocks if block.subject == subject):
            at = first.get(block.key)
            if at is None:
                how = "not done", "was planned and is not recorded"
                yield _deviation(plan, block, "", *how)
                continue
            if at < latest:
                how = "out of order", "was recorded before a session that is planned before it"
                yield _deviation(plan, block, recorded[at].path, *how)
            latest = max(latest, at)


def _of_block(
    plan: StudyPlan, block: PlannedBlock, one: RecordedBlock
) -> Iterator[tuple[str, str]]:
    """Yield in what a recorded session differs from its place in the plan: kind and detail."""
    since, reason = one.facts["since_change_min"], one.facts["wait_cut_short"]
    because = f" ({reason})" if reason else ""
    if one.facts["sha256"] != plan.sha256:
        yield "plan edited", "plan.csv was changed after this session"
    if since is None and block.wait_min > 0.0:
        planned = f"{block.wait_min:g} min of wait were planned"
        yield "unknown wait", f"{planned}; when it began is unknown{because}"
    elif since is not None and since < block.wait_min - TOLERANCE_MIN:
        begun = f"begun {since:.3g} min after the change"
        yield "short wait", f"{begun}; {block.wait_min:g} planned{because}"
    if one.good < one.planned:
        yield "cut short", f"{one.good} of {plural(one.planned, 'epoch')} ended with success"
    if changed := _changed_settings(plan, block, plan.folder / one.path):
        detail = f"recorded with another {series(changed)} than {block.protocol} has now"
        yield "other protocol", detail


def _changed_settings(plan: StudyPlan, block: PlannedBlock, session: Path) -> list[str]:
    try:
        planned = dump_settings(load_settings(plan.folder / block.protocol))
    except UserError:
        return ["protocol, for its file cannot be read,"]
    run = dump_settings(session_settings(session))
    return [name for name in _OF_PROTOCOL if planned[name] != run[name]]


def _deviation(
    plan: StudyPlan, block: PlannedBlock, path: str, kind: str, detail: str
) -> Deviation:
    condition = plan.shown(block.condition)
    return Deviation(block.subject, block.day, block.order, condition, path, kind, detail)


def _unplanned(entry: SessionEntry) -> Deviation:
    where = entry.subject, entry.day, 0, entry.code, entry.path
    return Deviation(*where, "not planned", "was recorded and was not planned")
