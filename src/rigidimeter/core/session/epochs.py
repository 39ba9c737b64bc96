"""From a session folder to epochs, closed or not; lost samples are stretches left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.core.records import (
    LATE_TICK,
    LOST_SAMPLES,
    Channel,
    Epoch,
    LeftOut,
    Motion,
    Notice,
    Outcome,
    Ticks,
)
from rigidimeter.core.session.emg_log import EMG, StoredEmg, read_emg
from rigidimeter.core.session.folder import (
    EVENTS,
    MANIFEST,
    SAMPLES,
    SessionFiles,
    check_session,
    read_manifest,
    read_session_files,
)
from rigidimeter.core.settings import Settings, recorded_settings

CHANNELS = ("torque_nm", "angle_rad", "velocity_rad_s", "velocity_command_rad_s", "perturbation_nm")
"""The columns of samples that an epoch has."""
_STAMPS = ("time_s", "torque_time_s", "motion_time_s")


def is_session(path: Path) -> bool:
    """Whether the path is a folder with a manifest, regular or not: reading it says what it is."""
    return (path / MANIFEST).exists()


def session_settings(folder: Path) -> Settings:
    """Return the settings a session was recorded with."""
    return _settings(folder, read_manifest(folder))


def _settings(folder: Path, manifest: Mapping[str, Any]) -> Settings:
    return recorded_settings(manifest["settings"], source=f"{folder}/{MANIFEST}, settings")


def read_session(folder: Path) -> tuple[list[Epoch], list[Notice]]:
    """Return the epochs of a session folder, in order.

    An interrupted session gives what was written. An epoch that was not closed with success
    carries the reason in `closed`, and so does not count in summaries.

    Raises
    ------
    UserError
        If a file of the folder is missing or unreadable.
    """
    files = read_session_files(folder, (*CHANNELS, *_STAMPS, "epoch", "limited", "lateness_s"))
    manifest, samples, events = files.manifest, files.samples.columns, files.log.events
    settings = _settings(folder, manifest)
    notices: list[Notice] = []
    notices += _damage(folder, files)
    if files.ended is None:
        notices.append(
            Notice(
                "warning",
                f"{folder}: the session was interrupted; what was written is read. "
                f"`rigidimeter recover {folder}` closes it",
            )
        )
    emg, found = _emg(folder, manifest, settings)
    notices += found
    ended = {event["epoch"]: event for event in events if event.get("event") == "epoch_ended"}
    first, last = epoch_extents(samples["epoch"])
    epochs = []
    seen: set[int] = set()
    for event in events:
        if event.get("event") != "epoch_started":
            continue
        number = event["epoch"]
        if number in seen:
            notices.append(
                Notice("error", f"{folder}/{EVENTS}: epoch {number} starts twice; the first counts")
            )
            continue
        seen.add(number)
        closed_well = ended.get(number, {}).get("outcome") == "success"
        if number not in first:
            level: Literal["warning", "error"] = "error" if closed_well else "warning"
            notices.append(
                Notice(level, f"{folder}, epoch {event['label']}: no sample was written")
            )
            continue
        rows = slice(first[number], last[number] + 1)
        tolerance_s = 1.5 / settings.rig.tick_rate_hz
        left_out = _lost_stretches(files, rows, event, ended.get(number, {}), tolerance_s)
        notices += [
            Notice(
                "error",
                f"{folder}, epoch {event['label']}: {lost.start_s:.3f} to {lost.stop_s:.3f} s are "
                f"left out: {lost.reason}",
            )
            for lost in left_out
        ]
        if number not in ended and files.ended and files.log.damaged:
            line = f"line {files.log.damaged[0]} of {EVENTS} is damaged"
            ended[number] = {"outcome": "fail", "reason": f"how it ended is not known: {line}"}
        closed = _closed(samples["time_s"][rows], ended.get(number))
        virtual = bool(manifest["virtual"])
        epoch = epoch_of_samples(
            str(folder), settings, samples, rows, event, closed, virtual=virtual
        )
        muscles = emg.between(*samples["time_s"][rows][[0, -1]]) if emg else ()
        if emg and not muscles:
            text = f"{folder}, epoch {event['label']}: no EMG was recorded"
            notices.append(Notice("warning", text))
        channels = {**epoch.channels, **{channel.name: channel for channel in muscles}}
        since_min = since_change_min(manifest, float(samples["time_s"][rows][0]))
        epochs.append(
            replace(epoch, left_out=left_out, channels=channels, since_change_min=since_min)
        )
    notices += [
        Notice("error", f"{folder}/{EVENTS}: does not say what epoch {number} of the samples was")
        for number in first
        if number not in seen
    ]
    cut = files.ended and not files.samples.stream.closed
    if cut and not any(notice.level == "error" for notice in notices):
        text = f"{folder}/{SAMPLES}: its end is damaged or missing, but no sample of an epoch is"
        notices.append(Notice("warning", text))
    return epochs, notices


def _emg(
    folder: Path, manifest: Mapping[str, Any], settings: Settings
) -> tuple[StoredEmg | None, list[Notice]]:
    """Return the EMG of a session; what is wrong with it leaves torque and motion as they are."""
    if not settings.emg.channels:
        return None, []
    try:
        emg = read_emg(folder)
        if emg is None:
            return None, [Notice("warning", f"{folder}: no EMG was recorded, there is no {EMG}")]
        check_session(folder, manifest, {EMG: emg.session_ids})
    except UserError as error:
        return None, [Notice("error", str(error))]
    if not emg.damaged:
        return emg, []
    text = f"{folder}/{EMG}: {emg.damaged} stretches are damaged and left out"
    return emg, [Notice("error", text)]


def _damage(folder: Path, files: SessionFiles) -> list[Notice]:
    """Name what is damaged; the rest is read."""
    said = [f"{SAMPLES}: {lost} is damaged and left out" for lost in files.samples.lost]
    stream = files.samples.stream
    if stream.gaps and not said:
        damaged = sum(gap.stop - gap.start for gap in stream.gaps)
        said = [f"{SAMPLES}: {damaged} bytes are damaged, but no sample is lost"]
    said += [f"{EVENTS}: line {n} is damaged and left out" for n in files.log.damaged]
    return [Notice("error", f"{folder}/{text}") for text in said]


def _lost_stretches(
    files: SessionFiles,
    rows: slice,
    started: Mapping[str, Any],
    ended: Mapping[str, Any],
    tolerance_s: float,
) -> tuple[LeftOut, ...]:
    """Return from when to when an epoch has lost its samples, and why.

    A stretch goes from the last stamp before the loss to the first sample after it. A sample may
    lie `tolerance_s` from when the events say that the epoch began or ended; `ended` is empty where
    they do not say it.
    """
    columns = files.samples.columns
    first_s = float(columns["time_s"][rows.start])
    last_s = float(columns["time_s"][rows.stop - 1])
    began_s, ended_s = (
        float(event["time_s"]) if isinstance(event.get("time_s"), int | float) else None
        for event in (started, ended)
    )
    found = []
    for lost in files.samples.lost:
        reason = f"{lost} of {SAMPLES} is damaged"
        if rows.start < lost.row < rows.stop:
            start_s = min(float(columns[stamp][lost.row - 1]) for stamp in _STAMPS)
            found.append(LeftOut(start_s, float(columns["time_s"][lost.row]), reason, LOST_SAMPLES))
        elif lost.row == rows.start and (began_s is None or first_s - began_s > tolerance_s):
            start_s = first_s if began_s is None else began_s
            found.append(LeftOut(start_s, first_s, reason, LOST_SAMPLES))
        elif lost.row == rows.stop and ended_s is not None and ended_s - last_s > tolerance_s:
            found.append(LeftOut(last_s, ended_s, reason, LOST_SAMPLES))
    if (
        ended_s is not None
        and max([last_s, *(each.stop_s for each in found)]) < ended_s - tolerance_s
    ):
        reason = f"{SAMPLES} breaks off at {columns['time_s'][-1]:.3f} s"
        found.append(LeftOut(last_s, ended_s, reason, LOST_SAMPLES))
    return tuple(found)


def epoch_extents(number: NDArray[Any]) -> tuple[dict[int, int], dict[int, int]]:
    """Return the first and the last row of every epoch; the rows of one epoch are contiguous."""
    if number.size == 0:
        return {}, {}
    edges = np.flatnonzero(np.diff(number)) + 1
    starts, stops = np.concatenate(([0], edges)), np.concatenate((edges, [number.size]))
    first = {int(number[i]): int(i) for i in starts if number[i] >= 0}
    last = {int(number[i]): int(j) - 1 for i, j in zip(starts, stops, strict=True)}
    return first, last


def _closed(time_s: NDArray[Any], ended: dict[str, Any] | None) -> Outcome:
    """Return how an epoch ended."""
    if ended is None:
        duration_s = time_s[-1] - time_s[0]
        return Outcome("excluded", f"the session was interrupted {duration_s:.3g} s into it")
    if ended["outcome"] == "success":
        return Outcome()
    return Outcome("excluded", str(ended["reason"]))


def epoch_of_samples(
    source: str,
    settings: Settings,
    samples: Mapping[str, NDArray[Any]],
    rows: slice,
    started: Mapping[str, Any],
    closed: Outcome,
    *,
    virtual: bool,
) -> Epoch:
    """Return an epoch of a session.

    Parameters
    ----------
    source : str
        Where it was read.
    settings : Settings
        Those of the session.
    samples : mapping of str to array
        The columns of the session.
    rows : slice
        Those of the epoch.
    started : mapping
        Its label, task and condition.
    closed : Outcome
        How it ended.
    virtual : bool
        Whether a simulation made it.

    Raises
    ------
    UserError
        If its task is unknown.
    """
    time_s = samples["time_s"][rows]
    channels = [
        *_sampled(samples, rows, "torque_time_s", ("torque_nm",)),
        *_sampled(samples, rows, "motion_time_s", ("angle_rad", "velocity_rad_s")),
        Channel("velocity_command_rad_s", time_s, samples["velocity_command_rad_s"][rows]),
    ]
    task = started["task"]
    if task not in ("prbs", "sinusoid"):
        raise UserError(f"{source}: task is {task!r}; it must be 'prbs' or 'sinusoid'")
    sine = settings.sinusoid
    late = samples["lateness_s"][rows] * settings.rig.tick_rate_hz  # in ticks
    counts = np.sum(late > LATE_TICK), np.sum(np.floor(late)), np.sum(samples["limited"][rows] > 0)
    if task == "prbs":
        channels.append(Channel("perturbation_nm", time_s, samples["perturbation_nm"][rows]))
    return Epoch(
        source=source,
        label=str(started["label"]),
        channels={channel.name: channel for channel in channels},
        condition=str(started["condition"]),
        task=task,
        motion=(
            Motion(sine.frequency_hz, float(time_s[0]), sine.motion_s)
            if task == "sinusoid"
            else None
        ),
        excitation_hz=(
            (settings.prbs.wanted_low_hz, settings.prbs.wanted_high_hz) if task == "prbs" else None
        ),
        closed=closed,
        virtual=virtual,
        ticks=Ticks(late.size, *map(int, counts)),
    )


def since_change_min(manifest: Mapping[str, Any], time_s: float) -> float | None:
    """Return the minutes from the change of the stimulation to a time of a planned session.

    On the clock of its plan, which may run faster in a rehearsal. Of a session that is continued
    from its own beginning, so by the times of both. None where it is not known.
    """
    place = manifest.get("about", {}).get("plan", {})
    changed = place.get("stimulation_changed_utc")
    if changed is None:
        return None
    begun = datetime.fromisoformat(manifest["created_utc"]) - datetime.fromisoformat(changed)
    return float(place["clock_speed"]) * (begun.total_seconds() + time_s) / 60.0


def _sampled(
    samples: Mapping[str, NDArray[Any]], rows: slice, stamp: str, names: tuple[str, ...]
) -> list[Channel]:
    """Return channels with one entry for each sample: a held reading repeats its stamp."""
    stamps = samples[stamp][rows]
    fresh = np.concatenate(([True], np.diff(stamps) > 0))
    return [Channel(name, stamps[fresh], samples[name][rows][fresh]) for name in names]
