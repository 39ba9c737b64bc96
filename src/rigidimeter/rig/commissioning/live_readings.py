"""What the sensors read now, without power: to wire a rig, turn a joint or hang a weight by.

Nothing is asked, tried or recorded, and the drive is never enabled. Angles are on the drive's own
scale.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rigidimeter.rig.commissioning.first_steps import SETTLE_S
from rigidimeter.rig.commissioning.static_tests import bad_counts
from rigidimeter.rig.commissioning.trials import (
    Array,
    Readings,
    Setup,
    drop_old_samples,
    listen,
    new_samples,
)
from rigidimeter.rig.guard import Cause

EVERY_S = 0.25
HEADING = (
    " torque, N·m       SD    new/s  angle, deg  velocity, deg/s    new/s   lost  drive's, N·m"
)


class LiveReading(NamedTuple):
    """Means over `EVERY_S`, NaN where nothing was read.

    `torque_sd_nm` is the scatter within that time, `torque_hz` and `motion_hz` are new samples a
    second, `lost` counts packets that were lost, damaged or out of order since the connections were
    opened. `cause` is what a device reported last. The drive's own torque is near 0 without power,
    and NaN where it reports none.
    """

    torque_nm: float
    torque_sd_nm: float
    torque_hz: float
    angle_rad: float
    velocity_rad_s: float
    motion_hz: float
    lost: int
    cause: Cause
    drive_torque_nm: float = math.nan

    @property
    def words(self) -> str:
        """Its values under `HEADING`, then what a device reports."""
        known = math.isfinite(self.drive_torque_nm)
        drive = f"{self.drive_torque_nm:+.3f}" if known else "none"
        line = (
            f"{self.torque_nm:+12.3f}{self.torque_sd_nm:9.3f}{self.torque_hz:9.0f}"
            f"{math.degrees(self.angle_rad):+12.2f}{math.degrees(self.velocity_rad_s):+17.2f}"
            f"{self.motion_hz:9.0f}{self.lost:7d}{drive:>14}"
        )
        return f"{line}  {self.cause.sentence}" if self.cause is not Cause.NONE else line


def live_readings(setup: Setup, show: Callable[[LiveReading], bool]) -> None:
    """Read until `show` returns False; the rig is connected and closed, and never has power.

    Parameters
    ----------
    setup : Setup
    show : callable
        Called every `EVERY_S`; returns whether to go on.

    Raises
    ------
    DeviceError
        If a device does not answer, or does not match the rig file.
    """
    rig = setup.rig
    try:
        rig.connect()
        rig.configure()
        drop_old_samples(setup)
        listen(setup, SETTLE_S)  # a drive that was never asked has nothing to say yet
        go_on = True
        while go_on:
            readings = listen(setup, EVERY_S)
            go_on = show(_live_reading(readings, sum(bad_counts(rig.counts).values())))
    finally:
        rig.close()


def _live_reading(readings: Readings, lost: int) -> LiveReading:
    torque = readings.torque_nm[np.isfinite(readings.torque_nm)]
    return LiveReading(
        _mean(torque),
        float(np.std(torque)) if len(torque) else math.nan,
        _new_a_second(readings.torque_time_s),
        _mean(readings.angle_rad),
        _mean(readings.velocity_rad_s),
        _new_a_second(readings.motion_time_s),
        lost,
        Cause(int(readings.cause[-1])),
        _mean(readings.drive_torque_nm),
    )


def _mean(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.mean(finite)) if len(finite) else math.nan


def _new_a_second(stamps_s: Array) -> float:
    return float(np.count_nonzero(new_samples(stamps_s)[1:])) / EVERY_S
