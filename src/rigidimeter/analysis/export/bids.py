"""BIDS with its extension for motion: a data set of all sessions.

    dataset_description.json  README.md  participants.tsv
    sub-S1/sub-S1_sessions.tsv     the ratings of each day
    sub-S1/ses-day1/sub-S1_ses-day1_scans.tsv
    sub-S1/ses-day1/motion/sub-S1_ses-day1_task-rigidity_acq-OFF_events.tsv
                           ..._task-rigidity_tracksys-torque_acq-OFF_{motion,channels}
    derivatives/rigidimeter/  estimates, scores, and the document of each session

A clock is a tracking system. Its first channel holds the time stamps (LATENCY); the angle is of
type JNTANG, its velocity VEL, and the rest MISC, for there is no type of torque.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute
import pyarrow.csv

from rigidimeter.analysis.export.document_tables import document_tables, exclusion_reasons
from rigidimeter.analysis.export.exported_sessions import ExportedSession
from rigidimeter.analysis.export.names import ABOUT_SUBJECT, entities, joined, label
from rigidimeter.analysis.reading.formats.clocked_table import Stream
from rigidimeter.core.files import as_written, write_json, write_text

BIDS_VERSION = "1.10.0"
TASK = "rigidity"
_TYPES = {"angle_rad": "JNTANG", "velocity_rad_s": "VEL"}
_SIMULATED = "Simulated by a virtual rig from a model of the joint; there was no living subject."
_MEASURED = "Measured with a robot that perturbs the joint or imposes a motion."
_COUNTED = ("ACCEL", "ANGACCEL", "GYRO", "JNTANG", "LATENCY", "MAGN", "MISC", "ORNT", "POS", "VEL")

_Row = dict[str, Any]


def write_bids(sessions: Sequence[ExportedSession], folder: Path) -> None:
    """Write a data set."""
    about = sessions[0].about
    _write_top(sessions, folder)
    participants: dict[str, _Row] = {}
    scans: dict[Path, list[_Row]] = {}
    days: dict[str, dict[str, _Row]] = {}
    for session, names in zip(sessions, entities(sessions), strict=True):
        own, place = session.about, folder / f"sub-{names['sub']}" / f"ses-{names['ses']}"
        # Before and after the tracking system in the name of a file.
        day_of = joined({key: names[key] for key in ("sub", "ses")})
        head, tail = f"{day_of}_task-{TASK}", f"acq-{names['acq']}" if "acq" in names else ""
        motion = place / "motion"
        motion.mkdir(parents=True, exist_ok=True)
        for stream in session.streams:
            stem = "_".join(filter(None, [head, f"tracksys-{stream.name}", tail]))
            _write_stream(stream, own, motion / stem)
            line = {"filename": f"motion/{stem}_motion.tsv", "acq_time": _started(own)}
            scans.setdefault(place / f"{day_of}_scans.tsv", []).append(line)
        events = "_".join(filter(None, [head, tail]))
        _write_events(own, motion / f"{events}_events")
        derived = folder / "derivatives" / "rigidimeter" / place.relative_to(folder) / "motion"
        derived.mkdir(parents=True, exist_ok=True)
        write_json(derived / f"{events}_session.json", own)
        for name, rows in document_tables(own).items():
            if name in ("estimates", "scores"):
                _write_tsv(derived / f"{events}_{name}.tsv", rows)
        person = own.get("participant", {})
        participants[names["sub"]] = {
            "participant_id": f"sub-{names['sub']}",
            "age": person.get("age_years"),
            "sex": {"U": None}.get(person.get("sex", "U"), person.get("sex")),
            "species": str(person.get("species", "Homo sapiens")).lower(),
            **{key: person[key] for key in ABOUT_SUBJECT if person.get(key) not in (None, "")},
        }
        day = days.setdefault(names["sub"], {}).setdefault(names["ses"], {})
        day["session_id"] = f"ses-{names['ses']}"
        for rating in own.get("ratings", ()):
            who = f"{label(own['condition'], '')}_{label(rating['examiner'], '')}"
            day[f"rating_{who}"] = rating["score"]
    for path, rows in scans.items():
        _write_tsv(path, rows)
    _write_tsv(folder / "participants.tsv", participants.values())
    used = {key for row in participants.values() for key in row}
    described = {key: _PARTICIPANTS[key] for key in _PARTICIPANTS if key in used}
    write_json(folder / "participants.json", described)
    for subject, sessions_of in days.items():
        table = folder / f"sub-{subject}" / f"sub-{subject}_sessions.tsv"
        _write_tsv(table, sessions_of.values())
        write_json(table.with_suffix(".json"), _ratings(about, sessions_of.values()))


_PARTICIPANTS = {
    "age": {"Description": "Age at the time of the study.", "Units": "year"},
    "sex": {"Description": "Sex.", "Levels": {"F": "female", "M": "male", "O": "other"}},
    "species": {"Description": "Species, a Latin binomial."},
    "group": {"Description": "Group of the study."},
    "body_mass_kg": {"Description": "Mass of the body.", "Units": "kg"},
    "forearm_length_m": {"Description": "Length of the forearm.", "Units": "m"},
    "side": {"Description": "Side that was measured.", "Levels": {"L": "left", "R": "right"}},
    "handedness": {
        "Description": "Handedness.",
        "Levels": {"L": "left", "R": "right", "A": "ambidextrous"},
    },
    "diagnosis": {"Description": "Diagnosis."},
    "severity": {"Description": "Severity, with its scale."},
    "medication": {"Description": "Medication at the time of the study."},
    "medication_since_h": {"Description": "Time since the last dose.", "Units": "h"},
    "implant_target": {"Description": "Target of the implanted electrodes."},
    "implant_side": {
        "Description": "Side of the implanted electrodes.",
        "Levels": {"L": "left", "R": "right", "B": "both"},
    },
}
_EVENTS = {
    "trial_type": {
        "Description": "What the robot did.",
        "Levels": {"prbs": "torque perturbation", "sinusoid": "imposed sinusoidal motion"},
    },
    "task": {"Description": "As trial_type."},
    "condition": {"Description": "Condition, or its code where the study is blinded."},
    "epoch": {"Description": "Label of the epoch."},
    "excluded": {"Description": "Whether the epoch does not count."},
    "exclusion_reason": {"Description": "Why it does not count."},
    "stimulation_frequency_hz": {"Description": "Of deep brain stimulation.", "Units": "Hz"},
    "stimulation_amplitude_ma": {"Description": "Of deep brain stimulation.", "Units": "mA"},
    "stimulation_amplitude_v": {"Description": "Of deep brain stimulation.", "Units": "V"},
    "stimulation_pulse_width_us": {"Description": "Of deep brain stimulation.", "Units": "us"},
    "stimulation_electrodes": {"Description": "Electrodes of deep brain stimulation."},
    "stimulation_wash_in_min": {"Description": "Time since it was changed.", "Units": "min"},
}


def _started(about: Mapping[str, Any]) -> str | None:
    """Return when the session began as BIDS has it: UTC is the letter Z."""
    text = str(about["recorded"].get("created_utc", ""))
    return text.replace("+00:00", "Z") if text.endswith(("+00:00", "Z")) else text[:19] or None


def _write_top(sessions: Sequence[ExportedSession], folder: Path) -> None:
    about = sessions[0].about
    archive = about.get("archive", {})
    virtual = any(session.about["virtual"] for session in sessions)
    title = about.get("title") or f"Rigidity of the {about['joint']}"
    name, _, version = str(about["software"]).partition(" ")
    made = {"Name": name, "Version": version}
    folder.mkdir(parents=True)
    described = {
        "Name": f"{title} (simulated)" if virtual else title,
        "BIDSVersion": BIDS_VERSION,
        "DatasetType": "raw",
        "Authors": archive.get("authors"),
        "License": archive.get("license"),
        "Keywords": archive.get("keywords"),
        "GeneratedBy": [made],
    }
    write_json(
        folder / "dataset_description.json",
        {key: value for key, value in described.items() if value},
    )
    derived = folder / "derivatives" / name
    derived.mkdir(parents=True)
    write_json(
        derived / "dataset_description.json",
        {
            "Name": f"Inertia, damping and stiffness: {title}",
            "BIDSVersion": BIDS_VERSION,
            "DatasetType": "derivative",
            "GeneratedBy": [made],
        },
    )
    blinded = "Conditions are codes: the recording is blinded.\n" if about.get("blinded") else ""
    write_text(
        folder / "README.md",
        f"# {described['Name']}\n\n{_SIMULATED if virtual else _MEASURED}\n{blinded}\n"
        "Torque drives the joint toward positive angles where it is positive. Each clock is a "
        "tracking system\nwith its time stamps in its LATENCY channel. `derivatives/rigidimeter` "
        "has inertia, damping and stiffness\nof each epoch with 95 % intervals, and in "
        f"`*_session.json` all settings. Written by {about['software']}.\n",
    )


def _write_stream(stream: Stream, about: Mapping[str, Any], stem: Path) -> None:
    columns = {"time_s": stream.time_s, **stream.columns}
    arrays = [pa.array(values, from_pandas=True) for values in columns.values()]
    arrays = [
        pa.compute.fill_null(array.cast(pa.string()), "n/a") if array.null_count else array
        for array in arrays
    ]
    table = pa.Table.from_arrays(arrays, names=list(columns))
    options = pa.csv.WriteOptions(include_header=False, delimiter="\t", quoting_style="none")
    pa.csv.write_csv(table, f"{stem}_motion.tsv", write_options=options)
    rate_hz = stream.rate_hz
    rows = [_channel(column, about) for column in columns]
    _write_tsv(Path(f"{stem}_channels.tsv"), rows)
    kinds = [row["type"] for row in rows]
    controller = ", ".join(f"{k} = {v}" for k, v in about["settings"]["controller"].items())
    write_json(
        Path(f"{stem}_motion.json"),
        {
            "TaskName": TASK,
            "TaskDescription": f"{_SIMULATED if about['virtual'] else _MEASURED} "
            f"Admittance controller: {controller}.",
            "SamplingFrequency": rate_hz if np.isfinite(rate_hz) else "n/a",
            "TrackingSystemName": stream.name,
            "SoftwareVersions": str(about["software"]),
            "MotionChannelCount": len(rows),
            "RecordingType": "continuous",
            **{f"{kind}ChannelCount": kinds.count(kind) for kind in _COUNTED if kind in kinds},
        },
    )


def _channel(column: str, about: Mapping[str, Any]) -> _Row:
    kind = "LATENCY" if column == "time_s" else _TYPES.get(column, "MISC")
    unit = "s" if column == "time_s" else str(about["units"].get(column, "1"))
    return {
        "name": column,
        "component": "n/a",
        "type": kind,
        "tracked_point": about["joint"],
        "units": "n/a" if unit == "1" else unit.replace("·", "*"),
        "description": about["column_meanings"].get(column),
    }


def _write_events(about: Mapping[str, Any], stem: Path) -> None:
    reasons = exclusion_reasons(about)
    stimulation = about.get("stimulation", {})
    rows = []
    for epoch in sorted(about["epochs"], key=lambda each: each["start_s"]):
        known = {k: v for k, v in stimulation.get(epoch["condition"], {}).items() if k != "title"}
        rows.append(
            {
                "onset": epoch["start_s"],
                "duration": epoch["stop_s"] - epoch["start_s"],
                "trial_type": epoch["task"],
                "task": epoch["task"],
                "condition": epoch["condition"],
                "epoch": epoch["label"],
                "excluded": str(epoch["label"] in reasons).lower(),
                "exclusion_reason": reasons.get(epoch["label"]),
                **{f"stimulation_{name}": value for name, value in known.items()},
            }
        )
    if rows:
        _write_tsv(Path(f"{stem}.tsv"), rows)
        present = {name for row in rows for name in row}
        write_json(
            Path(f"{stem}.json"), {name: text for name, text in _EVENTS.items() if name in present}
        )


def _ratings(about: Mapping[str, Any], days: Iterable[_Row]) -> _Row:
    low, high = about.get("rating_scale", {}).get("scale", (0.0, 0.0))
    text = f"Rating of rigidity, from {low:g} to {high:g}: condition and examiner."
    columns = dict.fromkeys(name for day in days for name in day if name.startswith("rating_"))
    return {name: {"Description": text} for name in columns}


def _write_tsv(path: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    """Write a table as BIDS has it: tabs, and `n/a` where there is nothing."""
    listed = list(rows)
    names = list(dict.fromkeys(name for row in listed for name in row))
    lines = [names, *([_cell(row.get(name)) for name in names] for row in listed)]
    write_text(path, "".join("\t".join(line) + "\n" for line in lines))


def _cell(value: Any) -> str:
    if value is None or value == "" or value != value:
        return "n/a"
    text = " ".join(str(value).split())
    return as_written(text) if isinstance(value, str) else text  # -inf is a number
