"""Whether all sessions of a study were commanded alike.

What the rig was commanded is in the manifest of a session: the controller and the perturbation.
Epochs of two versions of a protocol are two measurements, and must not be pooled.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from rigidimeter.recording.study_folder import Row
from rigidimeter.records import Epoch
from rigidimeter.settings import Settings, dump_settings
from rigidimeter.study.results import SessionEntry

__all__ = ["COMMANDED", "commanded_otherwise"]

COMMANDED: Mapping[str, tuple[str, ...]] = {
    "prbs": ("controller", "prbs"),
    "sinusoid": ("controller", "sinusoid"),
}
"""By task, the tables of the settings that say what the rig was commanded."""

_Read = tuple[Row, SessionEntry, tuple[Epoch, ...], Settings | None]


def commanded_otherwise(sessions: Sequence[_Read]) -> list[tuple[Row, str]]:
    """Return the sessions that were commanded otherwise than most of their task, and in what.

    Where no version has more sessions than any other, the one that comes first in the table stays.
    """
    found: list[tuple[Row, str]] = []
    for task, tables in COMMANDED.items():
        versions = [
            (row, entry, _values(settings, tables))
            for row, entry, epochs, settings in sessions
            if settings is not None
            and any(epoch.task == task for epoch in epochs)
            and not any(row is other for other, _ in found)
        ]
        counts = Counter(json.dumps(values, sort_keys=True) for *_, values in versions)
        if len(counts) < 2:
            continue
        most = counts.most_common(1)[0][0]
        usual = json.loads(most)
        example = next(e for _, e, v in versions if json.dumps(v, sort_keys=True) == most)
        for row, entry, values in versions:
            differing = [name for name in usual if usual[name] != values.get(name)]
            if not differing:
                continue
            told = "; ".join(f"{name} = {values.get(name)}" for name in differing)
            wanted = "; ".join(f"{name} = {usual[name]}" for name in differing)
            found.append(
                (
                    row,
                    f"{entry.path} is of another version of the protocol: it was recorded with "
                    f"{told}, but {counts[most]} of {len(versions)} sessions, such as "
                    f"{example.path}, with {wanted}",
                )
            )
    return found


def _values(settings: Settings, tables: Sequence[str]) -> dict[str, Any]:
    dumped = dump_settings(settings)
    return {f"{table}.{name}": value for table in tables for name, value in dumped[table].items()}
