"""A session as it is given to others: samples by clock, and one document with all the rest.

Every format of `rigidimeter.exporting` holds these two, whatever else it shows of them in its own
way. So every format is read back by the same function, with the samples and the settings that the
session folder gives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigidimeter.errors import UserError
from rigidimeter.recording.formats.clocked_table import ROUNDING_S, Stream
from rigidimeter.records import CHANNEL_UNITS, Channel, Epoch, LeftOut, Motion, Notice, Outcome
from rigidimeter.settings import Settings, parse_settings

EXPORT_SCHEMA = "rigidimeter.export/1"
DOCUMENT = "session.json"
"""The name of the document in formats that are folders."""

_TYPES: Mapping[str, type] = {
    "virtual": bool,
    "settings": dict,
    "epochs": list,
    "streams": dict,
}


@dataclass(frozen=True)
class ExportedSession:
    """All that is given away of one session.

    Attributes
    ----------
    about : mapping
        The document (`rigidimeter.export/1`, see docs/reference/files.md).
    streams : tuple of Stream
    """

    about: Mapping[str, Any]
    streams: tuple[Stream, ...]


def exported_settings(about: Mapping[str, Any], source: str) -> Settings:
    """Return the settings with which an exported session was recorded.

    Raises
    ------
    UserError
        If they are damaged.
    """
    return parse_settings(about["settings"], source=f"{source}, settings")


def checked_document(found: Any, source: str) -> dict[str, Any]:
    """Return the document of an exported session.

    Raises
    ------
    UserError
        If it is none, or one of another version.
    """
    schema = found.get("schema") if isinstance(found, dict) else None
    if schema != EXPORT_SCHEMA:
        raise UserError(f"{source}: schema is {schema!r}; this version reads {EXPORT_SCHEMA!r}")
    for key, kind in _TYPES.items():
        if not isinstance(found.get(key), kind):
            raise UserError(
                f"{source}: {key} is missing or damaged in its {EXPORT_SCHEMA} document"
            )
    return dict(found)


def epochs_of_export(session: ExportedSession, source: str) -> tuple[list[Epoch], list[Notice]]:
    """Return the epochs of an exported session, each channel with its own stamps.

    Parameters
    ----------
    session : ExportedSession
    source : str
        The file or folder, as messages and epochs name it.

    Raises
    ------
    UserError
        If the document does not say what an epoch is.
    """
    epochs, notices = [], []
    for facts in session.about["epochs"]:
        try:
            channels, lacking = _channels(session.streams, facts["channels"])
            epoch = _epoch(facts, channels, source, virtual=session.about["virtual"])
        except (KeyError, TypeError, ValueError) as error:
            raise UserError(f"{source}: an epoch of its document is damaged ({error!r})") from None
        if lacking:
            text = f"{epoch.name}: {lacking}; the epoch is left out"
            notices.append(Notice("error", text))
        else:
            epochs.append(epoch)
    return epochs, notices


def extent(channel: Channel) -> list[float | int]:
    """Return first and last stamp and the number of samples: what an epoch has of a stream."""
    return [float(channel.time_s[0]), float(channel.time_s[-1]), len(channel)]


def _channels(
    streams: Sequence[Stream], extents: Mapping[str, Sequence[Any]]
) -> tuple[dict[str, Channel], str]:
    """Cut the channels of an epoch from the streams; the text says what is not there."""
    channels: dict[str, Channel] = {}
    for name, (first_s, last_s, count) in extents.items():
        if name not in CHANNEL_UNITS:
            raise ValueError(f"unknown channel {name}")
        stream = next((each for each in streams if name in each.columns), None)
        if stream is None:
            return {}, f"there is no {name}"
        low = int(np.searchsorted(stream.time_s, float(first_s) - ROUNDING_S, "left"))
        high = int(np.searchsorted(stream.time_s, float(last_s) + ROUNDING_S, "right"))
        if high - low != int(count):
            return {}, f"{name} has {high - low} samples in place of {count}"
        channels[name] = Channel(name, stream.time_s[low:high], stream.columns[name][low:high])
    return channels, ""


def _epoch(
    facts: Mapping[str, Any], channels: Mapping[str, Channel], source: str, *, virtual: bool
) -> Epoch:
    motion, band = facts.get("motion"), facts.get("excitation_hz")
    task = facts.get("task")
    if task not in (None, "prbs", "sinusoid"):
        raise ValueError(f"task {task!r}")
    if facts["outcome"] not in ("included", "excluded", "failed"):
        raise ValueError(f"outcome {facts['outcome']!r}")
    return Epoch(
        source=source,
        label=str(facts["label"]),
        channels=dict(channels),
        condition=str(facts.get("condition", "")),
        task=task,
        motion=None if motion is None else Motion(**motion),
        excitation_hz=None if band is None else (float(band[0]), float(band[1])),
        closed=Outcome(facts["outcome"], str(facts.get("reason", ""))),
        virtual=virtual,
        left_out=tuple(LeftOut(**each) for each in facts.get("left_out", ())),
    )
