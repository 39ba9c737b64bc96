"""A recorded session through the guard once more, by the function that the loop calls.

    row of the record → ages by its stamps → `decide` → cause, limit, command

The guard's memory is its own from the first tick on. Taken from the record are what it was given:
readings, stamps, the request, the perturbation, ticks that were missed, what loop and devices
reported, holds that the operator ended and ways back; and, after each tick, the velocity in force:
what the drive made of the command, if it rounds it.

Causes and limits must be those of the record at the same ticks. A command must be the one that was
sent to the bit, but for three things that drives do to it: they round it, by at most half of the
smallest step between any two commands of the record; a busy line sends the one before once more;
without power nothing is sent.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.session import EVENTS, SAMPLES, read_session_files, session_settings
from rigidimeter.core.settings import Settings
from rigidimeter.rig.acquisition.decision import decide, late_cause, stronger
from rigidimeter.rig.guard import (
    Cause,
    DriveModel,
    Limited,
    Reaction,
    consistency_limits,
    consistency_state,
    drive_torque_limits,
    drive_torque_state,
    drive_torque_step,
    guard_limits,
    guard_state,
    released,
    within_range,
    zeroed,
)

ROUNDED = 1.0 + 1e-6
"""Half a step of a drive's unit, and what floats add."""

LOOP = frozenset(
    {
        *(Cause.DEADLINES_MISSED, Cause.STALLED, Cause.CONSOLE_LOST, Cause.RECORDER_LOST),
        *(Cause.RECORD_OVERFLOW, Cause.SOFTWARE, Cause.SIGNAL, Cause.OPERATOR_HALT),
        Cause.EMERGENCY_STOP,
    }
)
DEVICES = frozenset(
    {
        *(Cause.TORQUE_FROZEN, Cause.TORQUE_SATURATED, Cause.TORQUE_STATUS, Cause.TORQUE_PACKETS),
        *(Cause.SENSOR_CHANGED, Cause.DRIVE_FAULT, Cause.DRIVE_STATE, Cause.DRIVE_LOST),
    }
)
"""Causes that the guard is told and does not find; of records that do not say what was told."""

_INPUTS = (
    *("tick", "time_s", "lateness_s", "velocity_request_rad_s", "perturbation_nm", "torque_nm"),
    *("angle_rad", "velocity_rad_s", "motion_time_s", "torque_time_s"),
    *("velocity_command_rad_s", "limited", "cause", "reported_cause"),
    *("drive_torque_nm", "drive_torque_time_s"),
)
_NONE = int(Cause.NONE)


class NamedCause(NamedTuple):
    """A cause, and the tick at which it came first."""

    tick: int
    time_s: float
    cause: Cause


class Difference(NamedTuple):
    """A tick at which record and replay differ; `what` is cause, limit or command."""

    tick: int
    time_s: float
    what: str
    recorded: str
    replayed: str

    def __str__(self) -> str:
        """Say it in a line."""
        return (
            f"tick {self.tick} ({self.time_s:.3f} s): {self.what} {self.recorded} in the record, "
            f"{self.replayed} in the replay"
        )


class Replay(NamedTuple):
    """What the guard made of a record.

    Attributes
    ----------
    ticks : int
        That were replayed.
    duration_s : float
        Of the session, from the first of them to the last.
    found : tuple of NamedCause
        What the guard latched for, in the replay.
    reported : tuple of NamedCause
        What loop and devices reported, which is not found here.
    differences : tuple of Difference
        The first of each kind.
    differing_ticks : int
    not_run : tuple of str
        Laws that did not run, and why, each a clause.
    left_out : str
        What of the record was not replayed, and why; empty if all of it was.
    rounded_ticks : int
        At which another command was sent than the guard allowed, within what a drive does to it.
    rounded_rad_s : float
        By how much at most.
    """

    ticks: int
    duration_s: float
    found: tuple[NamedCause, ...]
    reported: tuple[NamedCause, ...]
    differences: tuple[Difference, ...]
    differing_ticks: int
    not_run: tuple[str, ...]
    left_out: str
    rounded_ticks: int
    rounded_rad_s: float


def replay_session(folder: Path) -> Replay:
    """Replay a session folder, also one that was interrupted.

    Raises
    ------
    UserError
        If a file of it is missing, unreadable or of another session.
    """
    files = read_session_files(folder, _INPUTS)
    samples = files.samples
    whole = samples.lost[0].row if samples.lost else len(samples.columns["tick"])
    columns = {name: column[:whole] for name, column in samples.columns.items()}
    recorded = files.manifest["channel_units"]
    found = replay(session_settings(folder), columns, files.log.events, recorded)
    left_out = [found.left_out] if found.left_out else []
    if samples.lost and not left_out:
        left_out.append(f"from {samples.lost[0]} on: its samples are lost")
    if files.ended and not samples.stream.closed:
        left_out.append(f"the end of {SAMPLES} is damaged or missing")
    left_out += [
        f"line {n} of {EVENTS} is damaged, so what it says of range, zero or drive is not known"
        for n in files.log.damaged
    ]
    return found._replace(left_out="; ".join(left_out))


def replay(
    settings: Settings,
    columns: Mapping[str, NDArray[Any]],
    events: Sequence[Mapping[str, Any]],
    recorded: Collection[str],
) -> Replay:
    """Run guard and laws of agreement over the columns of a session.

    Parameters
    ----------
    settings : Settings
        That the session ran with.
    columns : mapping of str to array, shape (n,)
        As they were recorded; one that was not has its default.
    events : sequence of mappings
        Of the session; `guard_latched` tells of a hold that came again at once.
    recorded : collection of str
        The columns that were recorded. An old record does not say what was reported: a cause that
        the guard does not find itself was reported as long as it stands in the record.
    """
    rate_hz, loop = settings.rig.tick_rate_hz, settings.loop
    stall_ticks = loop.stall_s * rate_hz
    limits, agreement = guard_limits(settings), consistency_limits(settings)
    for event in events:  # the range of motion of the person, from where the joint began
        if event.get("event") == "rig_enabled" and event.get("range_rad"):
            limits = within_range(limits, *event["range_rad"])
    guard, consistency = guard_state(limits), consistency_state(agreement)
    torques = drive_torque_limits(settings, _drive_model(events))
    compared = drive_torque_state(torques)
    zeroings = [
        (float(event["time_s"]), float(event["bias_nm"]))
        for event in events
        if event.get("event") == "sensor_zeroed" and not event.get("refused")
    ]
    knows_cause, knows_reported = "cause" in recorded, "reported_cause" in recorded
    latched_s = {event.get("time_s") for event in events if event.get("event") == "guard_latched"}
    halted_s = min(
        (
            float(event["time_s"])
            for event in events
            if event.get("event") == "order" and event.get("command") == "halt"
        ),
        default=math.inf,
    )
    step_rad_s = _smallest_step(columns["velocity_command_rad_s"])
    found: list[NamedCause] = []
    reports: dict[Cause, NamedCause] = {}
    differences: dict[str, Difference] = {}
    differing = rounded = ticks = in_a_row = 0
    rounded_rad_s, left_out = 0.0, ""
    cause_before, sent_before, tick_before = _NONE, 0.0, -1
    first_tick = -1
    for row in zip(*(columns[name].tolist() for name in _INPUTS), strict=True):
        tick, time_s, lateness_s, request, perturbation_nm, torque_nm, angle, velocity = row[:8]
        motion_s, torque_s, sent, limited, cause, reported, drive_nm, drive_s = row[8:]
        missed, late = 0, _NONE
        if lateness_s >= 1.0 / rate_hz:
            missed, in_a_row = int(lateness_s * rate_hz), in_a_row + 1
            late = late_cause(missed, in_a_row, stall_ticks, loop.missed_in_a_row)
        else:
            in_a_row = 0
        if first_tick < 0:
            first_tick = tick
        elif tick != tick_before + 1 + missed:
            left_out = (
                f"from tick {tick} on: a tick before it ran and is not in the record, so what the "
                "guard remembered is not known"
            )
            break
        if not knows_reported:
            reported = cause if cause in LOOP or cause in DEVICES else _NONE
        due_s = tick / rate_hz
        again = cause_before != _NONE and (cause == _NONE or time_s in latched_s)
        if again and guard.reaction <= Reaction.HOLD and guard.velocity_rad_s == 0.0:
            guard = released(guard)
        before = guard.cause
        while zeroings and due_s >= zeroings[0][0]:
            torques, compared = zeroed(torques, compared, zeroings.pop(0)[1])
        compared, apart_cause = drive_torque_step(
            torques,
            compared,
            torque_nm,
            due_s - torque_s,
            angle,
            velocity,
            due_s - motion_s,
            drive_nm,
            due_s - drive_s,
            missed + 1,
        )
        guard, consistency, allowed, limit = decide(
            limits,
            agreement,
            guard,
            consistency,
            request,
            perturbation_nm,
            torque_nm,
            angle,
            velocity,
            due_s - motion_s,
            due_s - torque_s,
            stronger(late, reported),
            missed + 1,
            apart_cause,
        )
        ticks += 1
        if reported != _NONE:
            reports.setdefault(Cause(reported), NamedCause(tick, due_s, Cause(reported)))
        if guard.cause not in (before, _NONE):
            found.append(NamedCause(tick, due_s, Cause(guard.cause)))
        apart = []
        if knows_cause and guard.cause != cause:
            apart.append(("cause", Cause(cause).name, Cause(guard.cause).name))
        if limit != limited:
            apart.append(("limit", Limited(limited).name, Limited(limit).name))
        if sent != allowed and math.isfinite(sent):
            by_rad_s = abs(sent - allowed)
            no_power = sent == 0.0 and (guard.reaction != Reaction.NONE or due_s >= halted_s)
            if by_rad_s <= 0.5 * ROUNDED * step_rad_s or sent == sent_before or no_power:
                rounded, rounded_rad_s = rounded + 1, max(rounded_rad_s, by_rad_s)
            else:
                apart.append(("command", f"{sent:.6g} rad/s", f"{allowed:.6g} rad/s"))
            guard = guard._replace(velocity_rad_s=sent)
        for what, one, other in apart:
            differences.setdefault(what, Difference(tick, due_s, what, one, other))
        differing += bool(apart)
        cause_before, sent_before, tick_before = cause, sent, tick
    return Replay(
        ticks=ticks,
        duration_s=(tick_before - first_tick) / rate_hz if ticks else 0.0,
        found=tuple(found),
        reported=tuple(reports.values()),
        differences=tuple(differences.values()),
        differing_ticks=differing,
        not_run=tuple(_not_run(recorded, has_model=_drive_model(events) is not None)),
        left_out=left_out,
        rounded_ticks=rounded,
        rounded_rad_s=rounded_rad_s,
    )


def _smallest_step(sent_rad_s: NDArray[np.float64]) -> float:
    """Return the smallest difference between two commands: at least the unit of the drive."""
    steps = np.diff(np.unique(sent_rad_s[np.isfinite(sent_rad_s)]))
    return float(steps.min()) if steps.size else 0.0


def _drive_model(events: Sequence[Mapping[str, Any]]) -> DriveModel | None:
    """Return the model of the drive's side that the session went by."""
    for event in events:
        if event.get("event") == "drive_model":
            return DriveModel(*(float(event[name]) for name in DriveModel._fields))
    return None


def _not_run(recorded: Collection[str], *, has_model: bool) -> list[str]:
    """Return which laws did not run."""
    not_run = []
    if "cause" not in recorded:
        not_run.append("no cause is compared: the record does not name them")
    elif "reported_cause" not in recorded:
        not_run.append(
            "of two causes that loop and devices reported the second is not known: the record does "
            "not name it"
        )
    if "drive_torque_nm" not in recorded:
        not_run.append(
            "the torque sensor is not compared with the drive's torque: that was not recorded"
        )
    elif not has_model:
        not_run.append(
            "the torque sensor is not compared with the drive's torque: nor was it in the session, "
            "which had no model of the drive"
        )
    return not_run
