"""Stretches of an epoch whose samples are lost, because a batch of them is damaged or cut off."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rigidimeter.core.records import LOST_SAMPLES, LeftOut
from rigidimeter.core.session.folder import SAMPLES
from rigidimeter.core.session.stored_files import SessionFiles

STAMPS = ("time_s", "torque_time_s", "motion_time_s")


def lost_stretches(
    files: SessionFiles,
    rows: slice,
    started: Mapping[str, Any],
    ended: Mapping[str, Any],
    most_s: float,
) -> tuple[LeftOut, ...]:
    """Return from when to when an epoch has lost its samples, and why.

    Parameters
    ----------
    files : SessionFiles
    rows : slice
        Of the epoch, in the columns of the samples.
    started, ended : mapping
        What the events say of its begin and its end; `ended` is empty where they do not.
    most_s : float
        A sample may be so far from when the events say that the epoch began or ended.

    Returns
    -------
    tuple of LeftOut
        From the last stamp before the loss to the first sample after it.
    """
    columns = files.samples.columns
    first_s = float(columns["time_s"][rows.start])
    last_s = float(columns["time_s"][rows.stop - 1])
    began_s, ended_s = (_seconds(event.get("time_s")) for event in (started, ended))
    found = []
    for lost in files.samples.lost:
        reason = f"{lost} of {SAMPLES} is damaged"
        if rows.start < lost.row < rows.stop:
            start_s = min(float(columns[stamp][lost.row - 1]) for stamp in STAMPS)
            found.append(LeftOut(start_s, float(columns["time_s"][lost.row]), reason, LOST_SAMPLES))
        elif lost.row == rows.start and (began_s is None or first_s - began_s > most_s):
            start_s = first_s if began_s is None else began_s
            found.append(LeftOut(start_s, first_s, reason, LOST_SAMPLES))
        elif lost.row == rows.stop and ended_s is not None and ended_s - last_s > most_s:
            found.append(LeftOut(last_s, ended_s, reason, LOST_SAMPLES))
    if ended_s is not None and max([last_s, *(each.stop_s for each in found)]) < ended_s - most_s:
        reason = f"{SAMPLES} breaks off at {columns['time_s'][-1]:.3f} s"
        found.append(LeftOut(last_s, ended_s, reason, LOST_SAMPLES))
    return tuple(found)


def _seconds(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) else None
