"""From recordings and studies to what is given away of each session.

A session folder gives every sample that was recorded, rests included. A file of another program
gives the channels of its epochs. In a blinded study, or of a recording whose conditions are codes,
nothing is given that tells the condition: not the path, the planned protocol, or the joint of a
simulated subject.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path, PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.reading import Recording, estimates_document
from rigidimeter.analysis.reading.formats.clocked_table import Stream
from rigidimeter.analysis.study import Condition, Loaded, Session
from rigidimeter.core.files import plain_values
from rigidimeter.core.records import CHANNEL_UNITS, EMG_CHANNELS, Analysis, Delay, Epoch, Fit, Score
from rigidimeter.core.session import (
    NO_CODE,
    SAMPLE_UNITS,
    codes_of,
    is_session,
    read_emg,
    read_manifest,
    read_session_files,
    session_settings,
)
from rigidimeter.core.settings import Settings, dump_settings
from rigidimeter.core.study_files import SubjectTable
from rigidimeter.core.units import named_unit
from rigidimeter.core.version import __version__

_CLOCKS = {
    "torque": ("torque_time_s", ("torque_nm", "torque_sequence", "torque_status")),
    "motion": (
        "motion_time_s",
        ("angle_rad", "velocity_rad_s", "motion_sequence", "motion_status"),
    ),
}
_STREAM_OF = {
    "torque_nm": "torque",
    "angle_rad": "motion",
    "velocity_rad_s": "velocity",
    "velocity_command_rad_s": "control",
    "perturbation_nm": "perturbation",
    **dict.fromkeys(EMG_CHANNELS, "emg"),
}
_TELLS_CONDITION = ("true_joint",)
EXPORT_SCHEMA = "rigidimeter.export/1"


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


@dataclass(frozen=True)
class Described:
    """What is known of a recording beside its samples.

    Attributes
    ----------
    subject, day, condition, part : str
        Empty where unknown.
    joint : str
        Such as ``elbow``; empty where unknown.
    started_utc : str
        When the recording began, ISO 8601, where it does not say so itself.
    facts : mapping
        Of its study, as the document holds them.
    blinded : bool
        Whether the condition is a code that must stay one.
    codes : mapping of str to str
        The code of each condition that a blinded session names.
    """

    subject: str = ""
    day: str = ""
    condition: str = ""
    part: str = ""
    joint: str = ""
    started_utc: str = ""
    facts: Mapping[str, Any] | None = None
    blinded: bool = False
    codes: Mapping[str, str] = field(default_factory=dict)


def sessions_of_recording(
    recording: Recording,
    analysis: Analysis | None,
    *,
    subject: str = "",
    day: str = "",
    joint: str = "",
    started_utc: str = "",
    blinded: bool = False,
) -> list[ExportedSession]:
    """Return what is given away of each source of a recording.

    Parameters
    ----------
    recording : Recording
    analysis : Analysis or None
        The estimates that travel along.
    subject, day, joint : str
        What they are called; empty where unknown.
    started_utc : str
        When recordings began that do not say so themselves, ISO 8601.
    blinded : bool
        Whether the recording is of blinded sessions and has their codes (`with_codes`).
    """
    found = []
    for source, epochs in _by_source(recording.epochs).items():
        path = Path(source)
        settings = session_settings(path) if is_session(path) else recording.settings
        conditions = {epoch.condition for epoch in epochs}
        condition = conditions.pop() if len(conditions) == 1 else ""
        described = Described(subject, day, condition, "", joint, started_utc)
        if blinded:
            codes = codes_of(read_manifest(path).get("about", {}))
            described = replace(described, facts={"blinded": True}, blinded=True, codes=codes)
        found.append(_exported(path, source, epochs, settings, analysis, described))
    return found


def sessions_of_study(loaded: Loaded, analysis: Analysis | None) -> list[ExportedSession]:
    """Return what is given away of each session of a study."""
    epochs = _by_source(loaded.epochs)
    about, names = loaded.folder.about, loaded.names
    found = []
    rows: dict[str, list[Session]] = {}
    for session in loaded.recordings.sessions:
        rows.setdefault(session.entry.source, []).append(session)
    for session, *more in rows.values():
        entry = session.entry
        conditions = [entry.condition, *(other.entry.condition for other in more)]
        ratings = [
            {"examiner": row["examiner"], "score": row.number("score")}
            | ({"condition": names.named(row["condition"])} if more else {})
            for row in loaded.folder.ratings
            if (row["subject"], row["day"]) == (entry.subject, entry.day)
            and names.named(row["condition"]) in conditions
        ]
        exclusions = [
            {"epoch": label, "by": row["by"], "reason": row["reason"]}
            for (source, label), row in loaded.operator.items()
            if source == entry.source
        ]
        facts = {
            "title": about.title,
            "blinded": names.blinded,
            "stimulation": {each.name: _stimulation(each) for each in names.conditions},
            "ratings": ratings,
            "rating_scale": about.rating.model_dump(mode="json"),
            "operator_exclusions": exclusions,
            "participant": about.subjects.get(entry.subject, SubjectTable()).model_dump(
                mode="json"
            ),
            "archive": about.archive.model_dump(mode="json"),
        }
        described = Described(
            entry.subject,
            entry.day,
            "" if more else entry.condition,
            session.row["part"],
            about.archive.joint,
            facts=facts,
            blinded=names.blinded,
        )
        path = loaded.folder.folder / entry.path
        settings = session.settings or loaded.settings
        own = epochs.get(entry.source, [])
        found.append(_exported(path, entry.source, own, settings, analysis, described))
    return found


def _by_source(epochs: Iterable[Epoch]) -> dict[str, list[Epoch]]:
    found: dict[str, list[Epoch]] = {}
    for epoch in epochs:
        found.setdefault(epoch.source, []).append(epoch)
    return found


def _stimulation(condition: Condition) -> dict[str, Any]:
    facts = {name: value for name, value in asdict(condition).items() if value not in (None, "")}
    del facts["name"], facts["simulated"]
    unit = facts.pop("amplitude_unit", "")
    if "amplitude" in facts:
        facts[f"amplitude_{unit.lower()}"] = facts.pop("amplitude")
    return facts


def _exported(
    path: Path,
    source: str,
    epochs: Sequence[Epoch],
    settings: Settings,
    analysis: Analysis | None,
    described: Described,
) -> ExportedSession:
    name = "" if described.blinded else PurePath(source).name
    dumped = dump_settings(settings)
    if described.blinded:  # both name the conditions
        del dumped["protocol"], dumped["subject"]
    recorded: dict[str, Any] = {}
    if is_session(path):
        files = read_session_files(path)
        streams = _recorded_streams(files.samples.columns)
        emg = read_emg(path)
        if emg is not None:
            streams = (*streams, Stream("emg", emg.time_s, emg.emg_v))
        manifest = files.manifest
        kept = ("session_id", "created_utc", "versions", "seeds")
        recorded = {key: manifest[key] for key in kept if key in manifest}
        if not described.blinded:
            recorded["protocol"] = manifest["protocol"]
        recorded["events"] = [_event(each, described) for each in files.log.events]
    else:
        streams = _epoch_streams(epochs)
    if "created_utc" not in recorded and described.started_utc:
        recorded["created_utc"] = described.started_utc
    about = {
        "schema": EXPORT_SCHEMA,
        "software": f"rigidimeter {__version__}",
        "source": name,
        "virtual": any(epoch.virtual for epoch in epochs),
        **{key: getattr(described, key) for key in ("subject", "day", "condition", "part")},
        "joint": described.joint or ("elbow" if "session_id" in recorded else "joint"),
        **(described.facts or {}),
        "recorded": recorded,
        "settings": dumped,
        "epochs": [_epoch(epoch) for epoch in epochs],
        "streams": {each.name: list(each.columns) for each in streams},
        "units": {
            column: named_unit(column)[1] or "1" for each in streams for column in each.columns
        },
        "column_meanings": {
            column: SAMPLE_UNITS[column]
            for each in streams
            for column in each.columns
            if column in SAMPLE_UNITS and not named_unit(column)[1]
        },
        "estimates": None if analysis is None else _estimates(analysis, source, name),
    }
    return ExportedSession(plain_values(about), streams)


def _event(event: Mapping[str, Any], described: Described) -> dict[str, Any]:
    kept = dict(event)
    if described.blinded:
        kept = {key: value for key, value in kept.items() if key not in _TELLS_CONDITION}
    if "condition" in kept and described.codes:
        kept["condition"] = described.codes.get(kept["condition"], NO_CODE)
    elif "condition" in kept and described.condition:
        kept["condition"] = described.condition
    return kept


def _epoch(epoch: Epoch) -> dict[str, Any]:
    # What all channels have: a reading that the first tick found is older than the epoch. EMG may
    # break off where torque and motion go on.
    channels = [one for name, one in epoch.channels.items() if name not in EMG_CHANNELS]
    begins = max(channel.time_s[0] for channel in channels)
    ends = min(channel.time_s[-1] for channel in channels)
    return {
        "label": epoch.label,
        "task": epoch.task,
        "condition": epoch.condition,
        "start_s": float(begins),
        "stop_s": float(ends),
        "outcome": epoch.closed.kind,
        "reason": epoch.closed.reason,
        "motion": None if epoch.motion is None else asdict(epoch.motion),
        "excitation_hz": epoch.excitation_hz,
        "left_out": [each._asdict() for each in epoch.left_out],
        "ticks": None if epoch.ticks is None else epoch.ticks._asdict(),
    }


def _estimates(analysis: Analysis, source: str, name: str) -> dict[str, Any]:
    """Return the estimates of one source; the pooled ones are of all epochs analysed together."""

    def own(results: Iterable[Any]) -> tuple[Any, ...]:
        return tuple(replace(each, source=name) for each in results if each.source == source)

    fits: tuple[Fit, ...] = own(analysis.fits)
    scores: tuple[Score, ...] = own(analysis.scores)
    delays: tuple[Delay, ...] = own(analysis.delays)
    fixed: tuple[Fit, ...] = own(analysis.fixed_inertia)
    pooled = tuple(replace(fit, source=name) for fit in analysis.pooled)
    return estimates_document(
        replace(
            analysis, fits=fits, fixed_inertia=fixed, scores=scores, delays=delays, pooled=pooled
        )
    )


def _recorded_streams(samples: Mapping[str, NDArray[Any]]) -> tuple[Stream, ...]:
    """Return the samples of a session by clock; a held reading repeats its stamp and goes once."""
    streams = []
    taken = {"time_s", "epoch"}  # its number, which every format says in its own way
    for name, (stamp, columns) in _CLOCKS.items():
        stamps = samples[stamp]
        fresh = np.concatenate(([True], np.diff(stamps) > 0))[: stamps.size]
        fresh &= np.isfinite(stamps)
        values = {column: samples[column][fresh] for column in columns}
        streams.append(Stream(name, stamps[fresh], values))
        taken |= {stamp, *columns}
    rest = {name: samples[name] for name in samples if name not in taken}
    return (*streams, Stream("control", samples["time_s"], rest))


def _epoch_streams(epochs: Sequence[Epoch]) -> tuple[Stream, ...]:
    """Put the channels of epochs together that have the same stamps throughout."""
    streams: list[Stream] = []
    for name in CHANNEL_UNITS:
        channels = [epoch.channels[name] for epoch in epochs if name in epoch.channels]
        if not channels:
            continue
        time_s = np.concatenate([channel.time_s for channel in channels])
        values = np.concatenate([channel.values for channel in channels])
        for k, stream in enumerate(streams):
            if np.array_equal(stream.time_s, time_s):
                streams[k] = replace(stream, columns={**stream.columns, name: values})
                break
        else:
            streams.append(Stream(_STREAM_OF[name], time_s, {name: values}))
    return tuple(streams)
