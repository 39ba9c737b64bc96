"""Epochs that do not count: what the operator takes out, and who said so of every other."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from rigidimeter.analysis.study.results import Exclusion, SessionEntry
from rigidimeter.analysis.study.sessions import Gathered, place_of, source_of
from rigidimeter.core.records import Analysis, Epoch, Fit, Notice, Outcome, Score
from rigidimeter.core.study_files import StudyFolder, TableRow


def operators_exclusions(
    read: StudyFolder, gathered: Gathered
) -> tuple[tuple[Epoch, ...], dict[tuple[str, str], TableRow], list[Notice]]:
    """Return epochs with the operator's exclusions, the rows that met one, and what met none."""
    epochs = {(epoch.source, epoch.label): epoch for epoch in gathered.epochs}
    labels: dict[str, list[str]] = {}
    for source, label in epochs:
        labels.setdefault(source, []).append(label)
    places = {place_of(read.folder / s.entry.path): s.entry.source for s in gathered.sessions}
    left_out = {place_of(read.folder / out.path) for out in gathered.left_out}
    operator: dict[tuple[str, str], TableRow] = {}
    notices = []
    for row in read.exclusions:
        place = place_of(read.folder / row["path"])
        key = (places.get(place, ""), row["epoch"])
        if key in operator:
            text = (
                f"{row.where}: epoch {row['epoch']} of {row['path']} is out already "
                f"(line {operator[key].line}); the first reason counts"
            )
            notices.append(Notice("warning", text))
        elif key in epochs:
            operator[key] = row
            by = f" ({row['by']})" if row["by"] else ""
            epochs[key] = replace(epochs[key], closed=Outcome("excluded", f"{row['reason']}{by}"))
        elif place in places:
            text = (
                f"{row.where}: {row['path']} has no epoch {row['epoch']}; its epochs are "
                f"{', '.join(labels.get(places[place], [])) or 'none'}"
            )
            notices.append(Notice("error", text))
        elif place not in left_out:
            near = difflib.get_close_matches(source_of(row["path"]), labels, n=1, cutoff=0.5)
            hint = f"; the nearest is {near[0]}" if near else ""
            text = f"{row.where}: {row['path']} is no session of {read.about.sessions}{hint}"
            notices.append(Notice("error", text))
    return tuple(epochs.values()), operator, notices


def exclusions_of(
    epochs: Sequence[Epoch],
    analysis: Analysis,
    sessions: Mapping[str, SessionEntry],
    operator: Mapping[tuple[str, str], TableRow],
) -> Iterator[Exclusion]:
    """Yield every epoch that does not count, with who said so; `sessions` are by source."""
    everything: list[Fit | Score] = [*analysis.fits, *analysis.scores]
    results = {(result.source, result.epoch): result for result in everything}
    for epoch in epochs:
        key = (epoch.source, epoch.label)
        result = results.get(key)
        if result is None or result.outcome.included:
            continue
        entry, row = sessions[epoch.source], operator.get(key)
        reason, who = result.outcome.reason, ""
        if row is not None:
            by, reason, who = "operator", row["reason"], row["by"]
        elif not epoch.closed.included:
            by, reason = "protocol", epoch.closed.reason
        else:
            by = "estimate" if result.outcome.kind == "failed" else "check"
        yield Exclusion(
            entry.subject,
            entry.day,
            epoch.condition,
            epoch.source,
            epoch.label,
            epoch.task or "",
            by,  # type: ignore[arg-type]
            reason,
            who,
        )
