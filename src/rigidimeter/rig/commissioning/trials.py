"""Short stretches on a rig: listening without power, and motions through loop and guard.

The loop that commissions a rig is the one that moves a person in it. A trial enables the drive at
zero velocity, runs its stretches on end, stops and takes the power away again, whatever happens;
nothing stays energised while an operator is asked or numbers are looked at. A command that takes
the power away may be lost, so the drive's own word is waited for, and required before hands are
asked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.session import Sample
from rigidimeter.core.settings import CommissioningSettings, Settings
from rigidimeter.rig.acquisition import (
    ControlLoop,
    NoSupervision,
    Supervision,
    control_modes,
    ramp_to_rest,
)
from rigidimeter.rig.devices.base import DeviceError, Now, Reading, Rig
from rigidimeter.rig.guard import Cause, Reaction

Array = NDArray[np.float64]
Stretch = Callable[[ControlLoop], object]

DROP_S = 2.5
FRESH_S = 0.03
MAX_READS = 400
"""A read empties at most a part of what piled up while a question waited."""

PILED_UP = {int(Cause.TORQUE_STALE), int(Cause.TORQUE_PACKETS), int(Cause.TORQUE_FROZEN)}
"""What a sensor says when nobody has listened for a while."""

POWER_OFF_S = 1.0
"""For so long a drive may take to say that it has no power."""

DURING_TRIAL = -1
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
"""Multiples of it fill an interval evenly."""


@dataclass(frozen=True)
class Timebase:
    """The clock of the devices, and how to wait on it.

    Parameters
    ----------
    now : callable
        Seconds, the same that the drivers were given.
    wait_until : callable
        Returns at a time of that clock, or at once when it has passed; gives the time it then is.
    """

    now: Now
    wait_until: Callable[[float], float]


@dataclass(frozen=True)
class Operator:
    """Who is asked and told.

    Parameters
    ----------
    ask : callable
        Puts a question; True is consent, or yes. Nothing has power while it waits.
    say : callable
        Is told what comes next.
    present : bool
        Whether somebody is there. If not, what only a person can do or tell is not asked.
    known_torque_nm, known_angle_deg : float or None
        A torque that hands or a weight put on the joint, toward positive angles; an angle by which
        hands turn the joint.
    seen_ns : callable or None
        When somebody was last known to be there, in nanoseconds of CLOCK_MONOTONIC; None where a
        terminal's signals say that somebody has gone.
    """

    ask: Callable[[str], bool]
    say: Callable[[str], None] = lambda _: None
    present: bool = True
    known_torque_nm: float | None = None
    known_angle_deg: float | None = None
    seen_ns: Callable[[], int] | None = None


@dataclass(frozen=True)
class Setup:
    """What is tried, with which settings and clock, and by whom.

    Parameters
    ----------
    rig : Rig
        Not connected yet.
    settings : Settings
        Of the protocol that will run on it.
    time : Timebase
        Of the same clock that the drivers have.
    operator : Operator
    supervise : callable
        Gives each trial what is asked at every tick of it: somebody must be there while the rig may
        move.
    """

    rig: Rig
    settings: Settings
    time: Timebase
    operator: Operator
    supervise: Callable[[], Supervision] = NoSupervision

    @property
    def limits(self) -> CommissioningSettings:
        """What is tried, and what it must come to."""
        return self.settings.commissioning

    @property
    def rate_hz(self) -> float:
        """Ticks a second."""
        return self.settings.rig.tick_rate_hz


class Readings(NamedTuple):
    """Readings, one a tick, as arrays of the same length.

    `time_s` is when the tick ran, `lateness_s` how late. `sent_rad_s` is what was in force after
    the tick. `cause` holds what the devices reported at each tick. The drive's own torque is NaN
    where it reports none.
    """

    time_s: Array
    lateness_s: Array
    torque_nm: Array
    torque_time_s: Array
    angle_rad: Array
    velocity_rad_s: Array
    motion_time_s: Array
    sent_rad_s: Array
    cause: NDArray[np.int64]
    drive_torque_nm: Array = np.empty(0)
    drive_torque_time_s: Array = np.empty(0)


@dataclass(frozen=True)
class TrialResult:
    """What a trial gave; `cause` is why the guard ended it, `Cause.NONE` if it did not."""

    readings: Readings
    cause: Cause


class _Shifted:
    """Rig and clock of a loop that begins now: the times of the readings count from there."""

    def __init__(self, setup: Setup, origin_s: float, spread: float) -> None:
        self._rig, self._time, self._origin_s = setup.rig, setup.time, origin_s
        self._spread_s, self._written = spread / setup.rate_hz, 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._rig, name)

    def read(self, elapsed_ticks: int = 1) -> Reading:
        reading = self._rig.read(elapsed_ticks)
        return reading._replace(
            torque_time_s=reading.torque_time_s - self._origin_s,
            motion_time_s=reading.motion_time_s - self._origin_s,
            drive_torque_time_s=reading.drive_torque_time_s - self._origin_s,
        )

    def write(self, velocity_rad_s: float) -> float:
        if self._spread_s:
            self._written += 1
            wait_s = self._spread_s * (GOLDEN * self._written % 1.0)
            self._time.wait_until(self._time.now() + wait_s)
        return self._rig.write(velocity_rad_s)

    def wait_until(self, deadline_s: float) -> float:
        return self._time.wait_until(self._origin_s + deadline_s) - self._origin_s


def trial(setup: Setup, *stretches: Stretch, spread: float = 0.0) -> TrialResult:
    """Enable the rig at zero velocity, run the stretches, take the power away.

    Parameters
    ----------
    setup : Setup
    stretches : callables
        Run one after the other, until the guard ends one.
    spread : float
        Each command is sent later in its tick, by up to this share of it. A drive answers within a
        few ms of a command, and the loop reads just before the next: at a low tick rate it would
        never see the torque of the acceleration. With the commands spread over the tick, it sees
        all of its parts alike.

    Raises
    ------
    DeviceError
        If the drive does not come up; it is without power then.
    """
    rig, settings = setup.rig, setup.settings
    # No correction by the reading: what is commanded is known exactly.
    controller = settings.controller.model_copy(update={"tracking_gain_per_s": 0.0})
    settings = settings.model_copy(update={"controller": controller})
    samples: list[Sample] = []
    drop_old_samples(setup)
    try:
        rig.enable()
        _empty(setup)
        here: Any = _Shifted(setup, setup.time.now() + 1.0 / setup.rate_hz, spread)
        loop = ControlLoop(settings, here, here, samples.append, supervision=setup.supervise())
        try:
            for stretch in stretches:
                stretch(loop)
                if loop.cause is not Cause.NONE:
                    break
            cause = loop.cause
        finally:
            ramp_to_rest(loop)
            if loop.cause in (Cause.DRIVE_LOST, Cause.DRIVE_STATE):
                rig.stop()
    finally:
        rig.disable()
    if rig.powered:
        listen(setup, POWER_OFF_S, until=lambda _: not rig.powered)
    return TrialResult(_readings([_OF_SAMPLE(sample) for sample in samples]), cause)


def follow_stretch(velocity_rad_s: Array, rate_hz: float) -> Stretch:
    """Return the stretch that commands velocities, one a tick; their sum is for the record."""
    angle = (np.cumsum(velocity_rad_s) / rate_hz).tolist()
    velocity = velocity_rad_s.tolist()
    return lambda loop: control_modes.follow(loop, DURING_TRIAL, angle, velocity)


def hold_stretch(duration_s: float) -> Stretch:
    """Return the stretch that stands still."""
    return lambda loop: control_modes.hold(loop, duration_s)


def listen(
    setup: Setup,
    duration_s: float,
    *,
    write_rad_s: float | None = 0.0,
    until: Callable[[Reading], bool] = lambda _: False,
) -> Readings:
    """Read at every tick without loop and guard, and write one velocity or nothing at all.

    For a rig without power, for one that is not written to, and for one that must not move; it ends
    early when `until` says so.
    """
    rig, time, rate_hz = setup.rig, setup.time, setup.rate_hz
    rows: list[tuple[float, ...]] = []
    start_s = time.now() + 1.0 / rate_hz
    for k in range(round(duration_s * rate_hz)):
        due_s = start_s + k / rate_hz
        now_s = time.wait_until(due_s)
        reading = rig.read()
        sent = rig.write(write_rad_s) if write_rad_s is not None else 0.0
        drive = reading.drive_torque_nm, reading.drive_torque_time_s
        rows.append((now_s, now_s - due_s, *reading[:5], sent, reading.cause, *drive))
        if until(reading):
            break
    return _readings(rows)


def require_no_power(setup: Setup) -> None:
    """Refuse to go on after a trial unless the drive said that it has no power.

    Raises
    ------
    DeviceError
        If its last word is another one.
    """
    if setup.rig.powered:
        raise DeviceError(
            f"drive: it has not reported within {POWER_OFF_S:g} s that its power is off; keep "
            "hands off the joint, press the emergency stop, and check the wiring to the drive"
        )


def drop_old_samples(setup: Setup) -> None:
    """Read away what piled up while nobody listened, without power, until the news are new."""
    _empty(setup)
    listen(setup, DROP_S, until=lambda reading: reading.cause not in PILED_UP)


def _empty(setup: Setup) -> None:
    for _ in range(MAX_READS):
        if setup.time.now() - setup.rig.read().torque_time_s < FRESH_S:
            return


def new_samples(stamps_s: Array) -> NDArray[np.bool_]:
    """Return which ticks brought a sample that no tick before had."""
    newest = np.maximum.accumulate(np.where(np.isfinite(stamps_s), stamps_s, -math.inf))
    fresh = np.zeros(len(newest), dtype=bool)
    fresh[:1] = True
    fresh[1:] = newest[1:] > newest[:-1]
    return fresh


def stopped_for(cause: Cause) -> str:
    """Return the words for a trial that the guard ended."""
    how = "stopped" if cause.reaction > Reaction.HOLD else "held"
    return f"the guard {how} the rig: {cause.sentence}"


_OF_SAMPLE = attrgetter(
    *("time_s", "lateness_s", "torque_nm", "torque_time_s", "angle_rad", "velocity_rad_s"),
    *("motion_time_s", "velocity_command_rad_s", "cause"),
    *("drive_torque_nm", "drive_torque_time_s"),
)
"""The values of `Readings`, in its order."""


def _readings(rows: Sequence[tuple[float, ...]]) -> Readings:
    columns = np.array(rows, dtype=np.float64).reshape(-1, len(Readings._fields)).T
    found = Readings._make(columns)
    return found._replace(cause=found.cause.astype(np.int64))
