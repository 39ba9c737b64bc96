"""The operator's lamps: limits, sensor, drive, lateness, recorder, disk, each with its words.

A lamp has a sign of its own for each level, so that none is told by its colour alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

from rigidimeter.core.settings import Settings
from rigidimeter.rig.acquisition.processes import ROW, Condition, LoopStatus
from rigidimeter.rig.console.limit_distances import LimitDistance
from rigidimeter.rig.console.recent_samples import RecentSamples
from rigidimeter.rig.guard import Cause


class Level(IntEnum):
    """How grave it is."""

    UNKNOWN = 0
    GOOD = 1
    WATCH = 2
    BAD = 3

    @property
    def sign(self) -> str:
        """What is shown beside the colour."""
        return "○●▲■"[self]


@dataclass(frozen=True)
class Lamp:
    """A lamp: what it is about, how grave it is, and its state in words."""

    name: str
    level: Level
    words: str


@dataclass(frozen=True)
class RecorderState:
    """What is known of the recorder and its disk.

    Attributes
    ----------
    condition : Condition
    note : str
        The recorder's last sentence.
    age_s : float
        Since its last heartbeat.
    waiting, unsynced : int
        Samples that are not in the file yet, and those that the disk has not confirmed.
    free_bytes : int or None
        Room where is recorded.
    """

    condition: Condition = Condition.ABSENT
    note: str = ""
    age_s: float = math.inf
    waiting: int = 0
    unsynced: int = 0
    free_bytes: int | None = None


_OF_LAMP = {
    "limits": {
        *(Cause.POSITION_LIMIT_EXCEEDED, Cause.HELD_AT_LIMIT, Cause.OVERSPEED),
        *(Cause.TORQUE_HIGH, Cause.TORQUE_TOO_HIGH, Cause.POWER_HIGH, Cause.ENERGY_HIGH),
    },
    "sensor": {
        *(Cause.TORQUE_NOT_FINITE, Cause.TORQUE_STALE, Cause.TORQUE_FROZEN, Cause.TORQUE_SATURATED),
        *(Cause.TORQUE_STATUS, Cause.TORQUE_PACKETS, Cause.SENSOR_CHANGED, Cause.TORQUE_SILENT),
        *(Cause.TORQUE_SIGN, Cause.SELDOM_FRESH, Cause.STAMP_AHEAD),
    },
    "drive": {
        *(Cause.MOTION_NOT_FINITE, Cause.MOTION_STALE, Cause.NOT_FOLLOWING, Cause.DRIVE_FAULT),
        *(Cause.DRIVE_STATE, Cause.DRIVE_LOST, Cause.MOVED_AT_REST, Cause.VELOCITY_WRONG),
        *(Cause.SELDOM_FRESH, Cause.STAMP_AHEAD, Cause.OVERSPEED),
    },
    "lateness": {Cause.DEADLINES_MISSED, Cause.STALLED},
    "recorder": {Cause.RECORDER_LOST, Cause.RECORD_OVERFLOW},
    "disk": {Cause.RECORD_OVERFLOW},
}
"""The causes that a lamp is about."""


def lamps(
    settings: Settings,
    loop: LoopStatus,
    recent: RecentSamples,
    distances: Sequence[LimitDistance],
    recorder: RecorderState,
    session_left_s: float,
    caution: str = "",
) -> tuple[Lamp, ...]:
    """Return the lamps, in the order in which they are shown."""
    sensor = _reading("sensor", "torque", recent, recent.torque_age_s, settings.guard.stale_s)
    if caution and sensor.level <= Level.WATCH:
        sensor = Lamp("sensor", Level.WATCH, f"{caution}; {sensor.words}")
    made = (
        _limits(recent, distances),
        sensor,
        _reading("drive", "angle", recent, recent.motion_age_s, settings.guard.stale_s),
        _lateness(settings, loop, recent),
        _recorder(settings, recorder),
        _disk(settings, recorder, session_left_s),
    )
    cause = Cause(loop.cause)
    return tuple(
        Lamp(lamp.name, Level.BAD, cause.sentence) if cause in _OF_LAMP[lamp.name] else lamp
        for lamp in made
    )


def _limits(recent: RecentSamples, distances: Sequence[LimitDistance]) -> Lamp:
    known = [distance for distance in distances if math.isfinite(distance.part)]
    if not known:
        return Lamp("limits", Level.UNKNOWN, "nothing measured yet")
    nearest = max(known, key=lambda distance: distance.part)
    words = f"{nearest.name} {nearest.text} ({100 * nearest.part:.0f} %)"
    if recent.held_back:
        return Lamp("limits", Level.WATCH, f"the arm is braked before its angle limit; {words}")
    return Lamp("limits", Level.WATCH if nearest.near else Level.GOOD, words)


def _reading(name: str, what: str, recent: RecentSamples, age_s: float, stale_s: float) -> Lamp:
    if not recent.samples:
        return Lamp(name, Level.UNKNOWN, "no reading yet")
    if not math.isfinite(age_s):
        return Lamp(name, Level.BAD, f"no {what} that is a number")
    words = f"{what} {1e3 * age_s:.0f} ms old, limit {1e3 * stale_s:g} ms"
    return Lamp(name, Level.WATCH if age_s > 0.5 * stale_s else Level.GOOD, words)


def _lateness(settings: Settings, loop: LoopStatus, recent: RecentSamples) -> Lamp:
    if not recent.samples:
        return Lamp("lateness", Level.UNKNOWN, "the loop does not run yet")
    largest_s, tick_s = recent.largest_lateness_s, 1.0 / settings.rig.tick_rate_hz
    words = (
        f"at most {1e3 * largest_s:.1f} ms late, limit {1e3 * settings.loop.stall_s:g} ms; "
        f"{loop.late_ticks} late and {loop.missed_ticks} missed of {loop.tick + 1} ticks"
    )
    return Lamp("lateness", Level.WATCH if largest_s >= tick_s else Level.GOOD, words)


def _recorder(settings: Settings, recorder: RecorderState) -> Lamp:
    condition, limit_s = recorder.condition, settings.loop.recorder_lost_s
    waiting_s = recorder.waiting / settings.rig.tick_rate_hz
    if condition is Condition.FAILED:
        return Lamp("recorder", Level.BAD, recorder.note or "it has given up")
    if condition in (Condition.ABSENT, Condition.STARTING):
        return Lamp("recorder", Level.UNKNOWN, "starts")
    if condition is Condition.DONE:
        return Lamp("recorder", Level.GOOD, "all is in the file")
    words = f"{waiting_s:.1f} s of samples wait, limit {limit_s:g} s"
    if condition is Condition.TROUBLE:
        return Lamp("recorder", Level.BAD, f"the disk takes nothing; {words}")
    if recorder.age_s > 0.5 * limit_s:
        silent = f"not heard of for {recorder.age_s:.1f} s, limit {limit_s:g} s"
        return Lamp("recorder", Level.WATCH, silent)
    return Lamp("recorder", Level.WATCH if waiting_s > 0.5 * limit_s else Level.GOOD, words)


def _disk(settings: Settings, recorder: RecorderState, session_left_s: float) -> Lamp:
    if recorder.note:
        return Lamp("disk", Level.BAD, recorder.note)
    if recorder.free_bytes is None:
        return Lamp("disk", Level.UNKNOWN, "not asked yet")
    unsynced_s = recorder.unsynced / settings.rig.tick_rate_hz
    # Compressed it is less; more than that is never written.
    needed = session_left_s * settings.rig.tick_rate_hz * ROW.itemsize
    words = f"{recorder.free_bytes / 1e9:.1f} GB free, {unsynced_s:.0f} s not yet on the disk"
    if recorder.free_bytes < needed:
        return Lamp(
            "disk", Level.WATCH, f"{words}; the session may need {needed / 1e9:.1f} GB more"
        )
    return Lamp("disk", Level.GOOD, words)
