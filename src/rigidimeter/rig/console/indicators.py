"""The operator's indicators: limits, sensor, drive, lateness, recorder, disk, each with its words.

They are of the samples of the last second, which `recent_samples` puts into a few numbers, and of
how far the joint is from each limit of the guard (`limit_distances`). An indicator has a sign of
its own for each level, so that none is told by its colour alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.settings import DoseSettings, GuardSettings, Settings
from rigidimeter.core.units import deg_from_rad
from rigidimeter.planning import NO_DOSE, Dose, dose_part, dose_words
from rigidimeter.rig.acquisition.processes import ROW, LoopStatus, ProcessCondition
from rigidimeter.rig.guard import Cause, Limited

RECENT_S = 1.0

NEAR = 0.8
"""From this part of a limit on, the joint is near it."""


class RecentSamples(NamedTuple):
    """The samples of the last second in a few numbers; NaN where there are none.

    The largest are absolute values. `torque_nm` is the mean of the last 0.1 s, readable where the
    torque itself is not, and so is `drive_torque_nm`, NaN if the drive reports none. Ages are those
    of the last sample. `held_back` says whether the position limit held a command back.
    """

    samples: int = 0
    torque_nm: float = math.nan
    largest_angle_rad: float = math.nan
    largest_velocity_rad_s: float = math.nan
    largest_torque_nm: float = math.nan
    largest_power_w: float = math.nan
    largest_lateness_s: float = math.nan
    torque_age_s: float = math.nan
    motion_age_s: float = math.nan
    torque_status: int = 0
    motion_status: int = 0
    held_back: bool = False
    drive_torque_nm: float = math.nan
    lowest_angle_rad: float = math.nan
    highest_angle_rad: float = math.nan


def recent_samples(rows: NDArray[np.void]) -> RecentSamples:
    """Return what the rows say; all of them count."""
    if not rows.size:
        return RecentSamples()
    last = rows[-1]
    power_w = rows["torque_nm"] * rows["velocity_rad_s"]
    newest = rows[rows["time_s"] > last["time_s"] - 0.1]
    return RecentSamples(
        int(rows.size),
        float(np.mean(newest["torque_nm"])),
        _largest(rows["angle_rad"]),
        _largest(rows["velocity_rad_s"]),
        _largest(rows["torque_nm"]),
        _largest(power_w),
        _largest(rows["lateness_s"]),
        float(last["time_s"] - last["torque_time_s"]),
        float(last["time_s"] - last["motion_time_s"]),
        int(last["torque_status"]),
        int(last["motion_status"]),
        bool(np.any(rows["limited"] == Limited.POSITION)),
        float(np.mean(newest["drive_torque_nm"])),
        -_most(-rows["angle_rad"]),
        _most(rows["angle_rad"]),
    )


def _largest(values: NDArray[np.float64]) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(np.max(finite)) if finite.size else math.nan


def _most(values: NDArray[np.float64]) -> float:
    finite = values[np.isfinite(values)]
    return float(np.max(finite)) if finite.size else math.nan


@dataclass(frozen=True)
class LimitDistance:
    """The largest value of the last second, and the limit.

    Attributes
    ----------
    name, unit : str
    value, limit : float
        In `unit`; NaN where the value is not known.
    """

    name: str
    unit: str
    value: float
    limit: float

    @property
    def part(self) -> float:
        """The value as a part of the limit: 1 at the limit."""
        return self.value / self.limit

    @property
    def text(self) -> str:
        """The value and the limit, as ``14.6 of 40 deg``."""
        digits = max(0, 2 - math.floor(math.log10(self.limit)))  # a hundredth of the limit
        value = f"{self.value:.{digits}f}" if math.isfinite(self.value) else "-"
        return f"{value} of {self.limit:g} {self.unit}"

    @property
    def near(self) -> bool:
        """Whether the joint is near the limit or beyond it."""
        return self.part >= NEAR


def limit_distances(
    guard: GuardSettings,
    recent: RecentSamples,
    energy_j: float,
    range_rad: tuple[float, float] | None = None,
) -> tuple[LimitDistance, ...]:
    """Return the distance to each limit.

    Parameters
    ----------
    guard : GuardSettings
    recent : RecentSamples
    energy_j : float
        What the guard counts as going to and fro within a second.
    range_rad : tuple of float, optional
        Both ends of the person's range of motion, from the start; of the two the nearer counts.
    """
    angle = LimitDistance(
        "angle", "deg", deg_from_rad(recent.largest_angle_rad), guard.position_limit_deg
    )
    if range_rad is not None:
        reached = (
            (-recent.lowest_angle_rad, -range_rad[0]),
            (recent.highest_angle_rad, range_rad[1]),
        )
        ends = [
            LimitDistance(
                "angle",
                "deg",
                max(deg_from_rad(angle_rad), 0.0),
                min(deg_from_rad(end_rad), guard.position_limit_deg),
            )
            for angle_rad, end_rad in reached
        ]
        angle = max(ends, key=lambda end: end.part)
    return (
        angle,
        LimitDistance(
            "speed", "deg/s", deg_from_rad(recent.largest_velocity_rad_s), guard.speed_limit_deg_s
        ),
        LimitDistance("torque", "N·m", recent.largest_torque_nm, guard.torque_limit_nm),
        LimitDistance("power", "W", recent.largest_power_w, guard.power_limit_w),
        LimitDistance("energy", "J", energy_j, guard.energy_limit_j),
    )


class Level(IntEnum):
    """How serious it is."""

    UNKNOWN = 0
    GOOD = 1
    WATCH = 2
    BAD = 3

    @property
    def sign(self) -> str:
        """What is shown beside the colour."""
        return "○●▲■"[self]


@dataclass(frozen=True)
class Indicator:
    """An indicator: what it is about, how serious it is, and its state in words."""

    name: str
    level: Level
    words: str


@dataclass(frozen=True)
class RecorderState:
    """What is known of the recorder and its disk.

    Attributes
    ----------
    condition : ProcessCondition
    note : str
        The recorder's last sentence.
    age_s : float
        Since its last heartbeat.
    waiting, unsynced : int
        Samples that are not in the file yet, and those that the disk has not confirmed.
    free_bytes : int or None
        Room where is recorded.
    """

    condition: ProcessCondition = ProcessCondition.ABSENT
    note: str = ""
    age_s: float = math.inf
    waiting: int = 0
    unsynced: int = 0
    free_bytes: int | None = None


_OF_INDICATOR = {
    "limits": {
        *(Cause.POSITION_LIMIT_EXCEEDED, Cause.HELD_AT_LIMIT, Cause.OVERSPEED),
        *(Cause.TORQUE_HIGH, Cause.TORQUE_TOO_HIGH, Cause.POWER_HIGH, Cause.ENERGY_HIGH),
    },
    "sensor": {
        *(Cause.TORQUE_NOT_FINITE, Cause.TORQUE_STALE, Cause.TORQUE_FROZEN, Cause.TORQUE_SATURATED),
        *(Cause.TORQUE_STATUS, Cause.TORQUE_PACKETS, Cause.SENSOR_CHANGED, Cause.TORQUE_SILENT),
        *(Cause.TORQUE_SIGN, Cause.SELDOM_FRESH, Cause.STAMP_AHEAD, Cause.TORQUE_DISAGREES),
        Cause.TORQUE_WILD,
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
"""The causes that an indicator is about."""


def all_indicators(
    settings: Settings,
    loop: LoopStatus,
    recent: RecentSamples,
    distances: Sequence[LimitDistance],
    recorder: RecorderState,
    session_left_s: float,
    caution: str = "",
    dose: Dose = NO_DOSE,
) -> tuple[Indicator, ...]:
    """Return the indicators, in the order in which they are shown."""
    sensor = _reading("sensor", "torque", recent, recent.torque_age_s, settings.guard.stale_s)
    if caution and sensor.level <= Level.WATCH:
        sensor = Indicator("sensor", Level.WATCH, f"{caution}; {sensor.words}")
    made = (
        _limits(recent, distances),
        sensor,
        _reading("drive", "angle", recent, recent.motion_age_s, settings.guard.stale_s),
        _lateness(settings, loop, recent),
        _recorder(settings, recorder),
        _disk(settings, recorder, session_left_s),
        _dose(settings.dose, dose),
    )
    cause = Cause(loop.cause)
    return tuple(
        Indicator(indicator.name, Level.BAD, cause.sentence)
        if cause in _OF_INDICATOR.get(indicator.name, ())
        else indicator
        for indicator in made
    )


def _limits(recent: RecentSamples, distances: Sequence[LimitDistance]) -> Indicator:
    known = [distance for distance in distances if math.isfinite(distance.part)]
    if not known:
        return Indicator("limits", Level.UNKNOWN, "nothing measured yet")
    nearest = max(known, key=lambda distance: distance.part)
    words = f"{nearest.name} {nearest.text} ({100 * nearest.part:.0f} %)"
    if recent.held_back:
        return Indicator(
            "limits", Level.WATCH, f"the arm is braked before its angle limit; {words}"
        )
    return Indicator("limits", Level.WATCH if nearest.near else Level.GOOD, words)


def _reading(
    name: str, what: str, recent: RecentSamples, age_s: float, stale_s: float
) -> Indicator:
    if not recent.samples:
        return Indicator(name, Level.UNKNOWN, "no reading yet")
    if not math.isfinite(age_s):
        return Indicator(name, Level.BAD, f"no {what} that is a number")
    words = f"{what} {1e3 * age_s:.0f} ms old, limit {1e3 * stale_s:g} ms"
    return Indicator(name, Level.WATCH if age_s > 0.5 * stale_s else Level.GOOD, words)


def _lateness(settings: Settings, loop: LoopStatus, recent: RecentSamples) -> Indicator:
    if not recent.samples:
        return Indicator("lateness", Level.UNKNOWN, "the loop does not run yet")
    largest_s, tick_s = recent.largest_lateness_s, 1.0 / settings.rig.tick_rate_hz
    words = (
        f"at most {1e3 * largest_s:.1f} ms late, limit {1e3 * settings.loop.stall_s:g} ms; "
        f"{loop.late_ticks} late and {loop.missed_ticks} missed of {loop.tick + 1} ticks"
    )
    return Indicator("lateness", Level.WATCH if largest_s >= tick_s else Level.GOOD, words)


def _recorder(settings: Settings, recorder: RecorderState) -> Indicator:
    condition, limit_s = recorder.condition, settings.loop.recorder_lost_s
    waiting_s = recorder.waiting / settings.rig.tick_rate_hz
    if condition is ProcessCondition.FAILED:
        return Indicator("recorder", Level.BAD, recorder.note or "it has given up")
    if condition in (ProcessCondition.ABSENT, ProcessCondition.STARTING):
        return Indicator("recorder", Level.UNKNOWN, "starts")
    if condition is ProcessCondition.DONE:
        return Indicator("recorder", Level.GOOD, "all is in the file")
    words = f"{waiting_s:.1f} s of samples wait, limit {limit_s:g} s"
    if condition is ProcessCondition.TROUBLE:
        return Indicator("recorder", Level.BAD, f"the disk takes nothing; {words}")
    if recorder.age_s > 0.5 * limit_s:
        silent = f"not heard of for {recorder.age_s:.1f} s, limit {limit_s:g} s"
        return Indicator("recorder", Level.WATCH, silent)
    return Indicator("recorder", Level.WATCH if waiting_s > 0.5 * limit_s else Level.GOOD, words)


def _disk(settings: Settings, recorder: RecorderState, session_left_s: float) -> Indicator:
    if recorder.note:
        return Indicator("disk", Level.BAD, recorder.note)
    if recorder.free_bytes is None:
        return Indicator("disk", Level.UNKNOWN, "not asked yet")
    unsynced_s = recorder.unsynced / settings.rig.tick_rate_hz
    # Compressed it is less; more than that is never written.
    needed = session_left_s * settings.rig.tick_rate_hz * ROW.itemsize
    words = f"{recorder.free_bytes / 1e9:.1f} GB free, {unsynced_s:.0f} s not yet on the disk"
    if recorder.free_bytes < needed:
        return Indicator(
            "disk", Level.WATCH, f"{words}; the session may need {needed / 1e9:.1f} GB more"
        )
    return Indicator("disk", Level.GOOD, words)


def _dose(limits: DoseSettings, dose: Dose) -> Indicator:
    level = Level.WATCH if dose_part(limits, dose) >= NEAR else Level.GOOD
    return Indicator("dose", level, dose_words(limits, dose))
