"""Neurodata Without Borders: one session, one HDF5 file.

    acquisition              what was measured: torque, motion, lateness of the loop, EMG
    stimulus                 what was commanded: torque perturbation, angle
    processing/recording     counts and status words of the loop and its devices
    intervals/trials         a row for each epoch and each rest
    intervals/dbs_settings   the stimulation, where it is known
    events                   what happened, by time
    processing/rigidimeter   tables of estimates, scores and ratings
    scratch                  the controller's settings, and the whole document, as JSON

Time stamps are explicit unless they are even to 1e-9 s, for which NWB asks for a rate.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from hashlib import blake2b
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidimeter.analysis.export.document_tables import (
    columns_of,
    document_tables,
    exclusion_reasons,
)
from rigidimeter.analysis.export.exported_sessions import ExportedSession
from rigidimeter.analysis.export.names import ABOUT_SUBJECT, label, subject_label
from rigidimeter.analysis.reading.formats.clocked_table import ROUNDING_S, Stream
from rigidimeter.core.files import json_text
from rigidimeter.core.records import EMG_CHANNELS

if TYPE_CHECKING:
    from pynwb import NWBFile, TimeSeries
if TYPE_CHECKING:
    from pynwb import NWBFile

SIMULATED = (
    "Simulated: computed by a virtual rig from a model of the joint; there was no living subject."
)
UNKNOWN_START = datetime(1900, 1, 1, tzinfo=UTC)
UNKNOWN_AGE = "P0D/"
"""ISO 8601, from 0 days on."""

_SERIES: Mapping[str, tuple[str, str, str, str]] = {
    "torque_nm": (
        "acquisition", "TorqueMeasured", "N·m",
        "Torque applied to the joint, positive when it drives the joint toward positive angles.",
    ),
    "angle_rad": ("acquisition", "{joint}Angle", "radians", "Angle of the joint."),
    "velocity_rad_s": ("acquisition", "{joint}AngularVelocity", "rad/s", "Measured velocity."),
    "velocity_command_rad_s": (
        "acquisition", "AngularVelocityCommand", "rad/s", "Velocity sent to the drive.",
    ),
    "lateness_s": (
        "acquisition", "ControlLoopLateness", "s", "How late each tick of the loop was.",
    ),
    # Only a column with its standard name is EMG without being named by the user.
    **{
        name: ("acquisition", name, "V", "Raw electromyogram of one muscle.")
        for name in EMG_CHANNELS
    },
    "perturbation_nm": (
        "stimulus", "TorquePerturbation", "N·m", "Torque that the perturbation commanded.",
    ),
    "target_angle_rad": (
        "stimulus", "AngleCommand", "radians", "Angle that was commanded; NaN where none was.",
    ),
}  # fmt: skip


def write_nwb(session: ExportedSession, path: Path) -> None:
    """Write one session.

    Raises
    ------
    ImportError
        If pynwb is not installed.
    """
    from pynwb import NWBHDF5IO

    file = _file(session.about)
    _add_streams(file, session)
    _add_trials(file, session.about)
    _add_stimulation(file, session.about)
    _add_events(file, session.about)
    _add_tables(file, session.about)
    file.add_scratch(
        json_text(session.about["settings"]["controller"]),
        name="controller_settings",
        description="Settings of the admittance controller, JSON, units in the names.",
    )
    file.add_scratch(
        json_text(session.about),
        name="rigidimeter_document",
        description=f"All that is known of the session, JSON, {session.about['schema']}.",
    )
    with NWBHDF5IO(path, "w") as io:
        io.write(file)


def _file(about: Mapping[str, Any]) -> NWBFile:
    from pynwb import NWBFile
    from pynwb.file import Subject

    archive, recorded = about.get("archive", {}), about["recorded"]
    participant = about.get("participant", {})
    joint, virtual = about["joint"], about["virtual"]
    tasks = sorted({str(epoch["task"]) for epoch in about["epochs"] if epoch["task"]})
    condition = f" Condition {about['condition']}." if about["condition"] else ""
    coded = " The condition is a blinded code." if about.get("blinded") else ""
    started_utc = recorded.get("created_utc", "")
    started = datetime.fromisoformat(started_utc) if started_utc else UNKNOWN_START
    age_years, mass_kg = participant.get("age_years"), participant.get("body_mass_kg")
    name, _, version = str(about["software"]).partition(" ")
    digest = blake2b(json_text(about).encode(), digest_size=16).hexdigest()
    return NWBFile(
        session_description=(
            f"{SIMULATED + ' ' if virtual else ''}Rigidity of the {joint}: torque and motion under "
            f"a robot's perturbation ({', '.join(tasks) or 'task unknown'}).{condition}{coded}"
        ),
        identifier=str(recorded.get("session_id") or digest),
        session_start_time=started if started.tzinfo else started.replace(tzinfo=UTC),
        session_id=label(f"{about['day']}{about['condition']}{about['part']}", "1"),
        experiment_description=about.get("title") or f"Rigidity of the {joint}",
        experimenter=[_surname_first(author) for author in archive.get("authors", ())] or None,
        institution=archive.get("institution") or None,
        lab=archive.get("lab") or None,
        keywords=[*archive.get("keywords", ()), "joint rigidity", joint]
        + (["simulated"] if virtual else []),
        notes=" ".join(
            [SIMULATED] * virtual
            + ["The time of recording is unknown; 1900 stands in for it."] * (not started_utc)
        )
        or None,
        was_generated_by=[[name, version]],
        subject=Subject(
            subject_id=subject_label(about),
            age=UNKNOWN_AGE if age_years is None else f"P{age_years:g}Y",
            sex=participant.get("sex", "U"),
            species=participant.get("species", "Homo sapiens"),
            weight=None if mass_kg is None else f"{mass_kg:g} kg",
            description=SIMULATED if virtual else subject_text(about),
        ),
    )


def subject_text(about: Mapping[str, Any]) -> str:
    """Return a subject's code with what NWB has no field for, as ``S1; side: R; …``."""
    own = about.get("participant", {})
    told = (f"{key}: {own[key]}" for key in ABOUT_SUBJECT if own.get(key) not in (None, ""))
    return "; ".join([about["subject"] or "unknown", *told])


def _surname_first(author: str) -> str:
    """Return `Doe, Jane` for `Jane Doe`, as NWB asks."""
    given, _, surname = author.strip().rpartition(" ")
    return author if "," in author or not given else f"{surname}, {given}"


def _add_streams(file: NWBFile, session: ExportedSession) -> None:
    joint = label(session.about["joint"].title(), "Joint")
    status = None
    for stream in session.streams:
        first: TimeSeries | None = None
        for column, values in stream.columns.items():
            if not np.isfinite(values).any():
                continue  # an angle that was never commanded
            place, name, unit, text = _SERIES.get(column, ("recording", column, "n/a", ""))
            name = name.format(joint=joint)
            text = text or str(session.about["column_meanings"].get(column, column))
            series = _series(stream, column, name, unit, text, first)
            first = first or series
            if place == "acquisition":
                file.add_acquisition(series)
            elif place == "stimulus":
                file.add_stimulus(series)
            else:
                if status is None:
                    status = file.create_processing_module(
                        "recording", "Counts and status words of the loop and its devices."
                    )
                status.add(series)


def _series(
    stream: Stream, column: str, name: str, unit: str, text: str, first: TimeSeries | None
) -> TimeSeries:
    from hdmf.backends.hdf5 import H5DataIO
    from pynwb import TimeSeries
    from pynwb.behavior import SpatialSeries

    time: dict[str, Any] = {"timestamps": first if first is not None else stream.time_s}
    step_s = 1.0 / stream.rate_hz
    even_s = stream.time_s[0] + step_s * np.arange(stream.time_s.size)
    if stream.time_s.size > 1 and np.max(np.abs(even_s - stream.time_s)) < ROUNDING_S / 2:
        time = {"starting_time": float(stream.time_s[0]), "rate": 1.0 / step_s}
    elif first is None:
        time = {"timestamps": H5DataIO(stream.time_s, compression="gzip", shuffle=True)}
    data = H5DataIO(np.asarray(stream.columns[column]), compression="gzip", shuffle=True)
    if unit == "radians":
        zero = "0 where the session began, positive as the torque is"
        return SpatialSeries(
            name=name, data=data, unit=unit, description=text, reference_frame=zero, **time
        )
    return TimeSeries(name=name, data=data, unit=unit, description=text, **time)


def _add_trials(file: NWBFile, about: Mapping[str, Any]) -> None:
    """Add a row for each epoch, and for each rest between two."""
    for name, text in {
        "task": "prbs (torque perturbation) or sinusoid (imposed motion).",
        "condition": "Condition, or its code where blinded.",
        "epoch": "Label of the epoch.",
        "excluded": "Whether the epoch does not count.",
        "exclusion_reason": "Why, empty if it counts.",
        "rest": "Whether this is a rest between epochs.",
    }.items():
        file.add_trial_column(name, text)
    rest = {"task": "", "condition": "", "epoch": "", "excluded": False, "exclusion_reason": ""}
    reasons = exclusion_reasons(about)
    before_s: float | None = None
    for epoch in sorted(about["epochs"], key=lambda each: each["start_s"]):
        start_s, stop_s = epoch["start_s"], epoch["stop_s"]
        if before_s is not None and start_s > before_s:
            file.add_trial(start_time=before_s, stop_time=start_s, rest=True, **rest)
        reason = reasons.get(epoch["label"], "")
        file.add_trial(
            start_time=start_s,
            stop_time=stop_s,
            task=epoch["task"] or "",
            condition=epoch["condition"],
            epoch=epoch["label"],
            excluded=bool(reason),
            exclusion_reason=reason,
            rest=False,
        )
        before_s = stop_s


def _add_stimulation(file: NWBFile, about: Mapping[str, Any]) -> None:
    """Add the stimulation of the session's condition, where it is known."""
    from pynwb.epoch import TimeIntervals

    known = about.get("stimulation", {}).get(about["condition"], {})
    columns = {
        "frequency_hz": (known.get("frequency_hz"), "Frequency of the stimulation, Hz."),
        "amplitude_ua": (
            None if known.get("amplitude_ma") is None else 1000.0 * known["amplitude_ma"],
            "Amplitude of the stimulation, µA.",
        ),
        "amplitude_v": (known.get("amplitude_v"), "Amplitude of the stimulation, V."),
        "pulse_width_us": (known.get("pulse_width_us"), "Width of a pulse, µs."),
        "electrodes": (known.get("electrodes"), "Electrodes."),
        "washin_s": (
            None if known.get("wash_in_min") is None else 60.0 * known["wash_in_min"],
            "Time between the change of the stimulation and the session, s.",
        ),
    }
    given = {name: pair for name, pair in columns.items() if pair[0] not in (None, "")}
    if not given or not about["epochs"]:
        return
    table = TimeIntervals(name="dbs_settings", description="Deep brain stimulation in the session.")
    for name, (_, text) in given.items():
        table.add_column(name, text)
    table.add_row(
        start_time=min(epoch["start_s"] for epoch in about["epochs"]),
        stop_time=max(epoch["stop_s"] for epoch in about["epochs"]),
        **{name: value for name, (value, _) in given.items()},
    )
    file.add_time_intervals(table)


def _add_events(file: NWBFile, about: Mapping[str, Any]) -> None:
    """Add what happened at a time that is known."""
    from pynwb.event import EventsTable

    events = [
        event
        for event in about["recorded"].get("events", ())
        if isinstance(event.get("time_s"), int | float)
    ]
    if not events:
        return
    table = EventsTable(name="session_events", description="Events of the session, as recorded.")
    for name in ("event", "epoch", "outcome", "reason"):
        table.add_column(name, f"{name.capitalize()}; empty where it has none.")
    for event in sorted(events, key=lambda each: each["time_s"]):
        table.add_row(
            timestamp=float(event["time_s"]),
            event=str(event["event"]),
            epoch=str(event.get("epoch", "")),
            outcome=str(event.get("outcome", "")),
            reason=str(event.get("reason", "")),
        )
    file.add_events_table(table)


def _add_tables(file: NWBFile, about: Mapping[str, Any]) -> None:
    """Add estimates, scores and ratings, where there are any."""
    from hdmf.common import DynamicTable, VectorData

    texts = {
        "estimates": "Inertia, damping and stiffness of each epoch, with standard errors and 95 % "
        "intervals; fixed_inertia: fitted again with the median inertia held. Units in the names.",
        "scores": "Impulse and work of each imposed sinusoid, per cycle. Units in the names.",
        "ratings": "Scores of examiners on this day.",
    }
    tables = {name: rows for name, rows in document_tables(about).items() if name in texts}
    if not tables:
        return
    module = file.create_processing_module("rigidimeter", f"Results of {about['software']}.")
    for name, rows in tables.items():
        columns = [
            VectorData(name=column, description=column.replace("_", " "), data=cells)
            for column, cells in columns_of(rows).items()
            if any(cell != "" and cell == cell for cell in cells)
        ]
        module.add(DynamicTable(name=name, description=texts[name], columns=columns))
