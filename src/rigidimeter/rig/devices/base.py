"""Protocols of a rig, a torque sensor and a velocity drive.

A device goes through these steps in order, and can be closed after any of them:

    connect    open the connection; nothing is energised
    configure  write the settings, read them back, refuse a device that does not match
    enable     (drives) write zero velocity, read it back, then energise
    read, write
    stop, disable, close    safe at any time, in any order, and when repeated

`read` and `write` run in the real-time loop. They do not wait. On a communication error they do not
raise but name a `rig.guard.Cause`. Times are in seconds on the loop's clock, which is passed in.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.errors import UserError
from rigidimeter.rig.guard import Cause

Now = Callable[[], float]
"""Seconds on the loop's clock, monotonic."""


class DeviceError(UserError):
    """A device cannot be used. The message names it, what was found, and what is expected."""


@dataclass(frozen=True)
class DeviceFacts:
    """What a device reported when it was configured; stored with the session.

    Parameters
    ----------
    model, serial : str
        As read from the device; empty if it does not report them.
    fastest_tick_rate_hz : float
        The highest loop rate that this device supports.
    watchdog_s : float or None
        Time without a command after which the device stops by itself; None if it never does.
    values : mapping
        Other values read back: units, calibration, limits, firmware.
    """

    model: str
    serial: str
    fastest_tick_rate_hz: float
    watchdog_s: float | None = None
    values: Mapping[str, str | float | int] = field(default_factory=dict)


class TorqueSample(NamedTuple):
    """The newest torque: applied by the drive to the joint, positive toward positive angle.

    `time_s` is when it was measured, as far as the driver knows. `sequence` is the device's own
    counter, -1 if it has none; `raw` holds the counts as received; `status` is the device's status
    word. A `cause` other than NONE says why the sample must not be used.
    """

    torque_nm: float
    time_s: float
    sequence: int = -1
    raw: tuple[int, ...] = ()
    status: int = 0
    cause: int = int(Cause.NONE)


class MotionSample(NamedTuple):
    """The newest angle and velocity; fields as in `TorqueSample`.

    `drive_torque_nm` is the torque of the motor by the drive's own measurement, taken with angle
    and velocity: at the joint as far as the drive's rated torque and the gear say, friction and
    inertia of motor and gear included, positive toward positive angle. NaN if the drive does not
    report it.
    """

    angle_rad: float
    velocity_rad_s: float
    time_s: float
    sequence: int = -1
    raw: tuple[int, ...] = ()
    status: int = 0
    cause: int = int(Cause.NONE)
    drive_torque_nm: float = nan


class TorqueSensor(Protocol):
    """A torque sensor on the joint's axis."""

    def connect(self) -> None:
        """Open the connection."""

    def configure(self) -> DeviceFacts:
        """Write the settings, read them back and start sampling.

        Raises
        ------
        DeviceError
            If the device does not answer, or does not match the settings.
        """

    def read(self) -> TorqueSample:
        """Return the newest sample without waiting; the previous one if there is no new one."""

    @property
    def counts(self) -> Mapping[str, int]:
        """Numbers of packets, by the names received, lost, repeated, reordered and damaged."""

    def close(self) -> None:
        """Stop sampling and close the connection."""


class VelocityDrive(Protocol):
    """A drive that takes velocity commands."""

    def connect(self) -> None:
        """Open the connection."""

    def configure(self) -> DeviceFacts:
        """Write mode, limits and the drive's own watchdog, and read them back.

        Raises
        ------
        DeviceError
            If the device does not answer, or does not accept a setting.
        """

    def enable(self) -> None:
        """Write zero velocity, read it back, then energise.

        Raises
        ------
        DeviceError
            If the target is not zero or the drive does not start; it then has no power.
        """

    def read(self) -> MotionSample:
        """Return the newest sample without waiting; the previous one if there is no new one."""

    def write(self, velocity_rad_s: float) -> float:
        """Send a velocity; return what was actually sent, rounded to the units of the message."""

    @property
    def counts(self) -> Mapping[str, int]:
        """Numbers of messages, by the names received, lost and damaged."""

    def stop(self) -> None:
        """Make the drive brake along its own ramp and stay at rest: its quick stop."""

    def disable(self) -> None:
        """Remove the power at once."""

    def close(self) -> None:
        """Remove the power and close the connection."""


class Reading(NamedTuple):
    """The newest samples, with their times on the loop's clock.

    Sensors sample by their own clocks, so a reading may repeat the sample of the previous tick,
    with the same time. `cause` is what a device reports, NONE if all is well. `drive_torque_nm` is
    as in `MotionSample`; where it is NaN, its time is too.
    """

    torque_nm: float
    torque_time_s: float
    angle_rad: float
    velocity_rad_s: float
    motion_time_s: float
    torque_sequence: int = -1
    torque_status: int = 0
    motion_sequence: int = -1
    motion_status: int = 0
    cause: int = int(Cause.NONE)
    drive_torque_nm: float = nan
    drive_torque_time_s: float = nan


class Rig(Protocol):
    """A torque sensor and a velocity drive on one joint."""

    def connect(self) -> None:
        """Open the connections; nothing is energised."""

    def configure(self) -> Mapping[str, Any]:
        """Configure the devices; return their facts by role, as plain values.

        Raises
        ------
        DeviceError
            If a device does not match the settings.
        """

    def enable(self) -> None:
        """Command zero velocity, then energise."""

    def read(self, elapsed_ticks: int = 1) -> Reading:
        """Return the newest readings, `elapsed_ticks` ticks after the previous call.

        More than one if the loop missed a deadline; a simulated rig advances by all of them.
        """

    def write(self, velocity_rad_s: float) -> float:
        """Send a velocity command; return what was actually sent."""

    def zero(self, bias_nm: float) -> None:
        """Subtract `bias_nm` from every torque from now on."""

    @property
    def origin_rad(self) -> float:
        """The drive's own angle at which the joint was enabled: angle 0 of the rig."""

    @property
    def counts(self) -> Mapping[str, int]:
        """Message counts since the connections were opened."""

    @property
    def powered(self) -> bool:
        """Whether the drive, by what it said last, may turn the joint by its own power.

        False where the driver has no property `powered`: such a drive is believed.
        """

    def stop(self) -> None:
        """Let the drive brake along its own ramp, for example when commands no longer reach it."""

    def disable(self) -> None:
        """Remove the power at once. Safe at any time and when repeated."""

    def close(self) -> None:
        """Remove the power and close the connections. Safe at any time and when repeated."""


class EmgSamples(NamedTuple):
    """What came since the last call.

    Attributes
    ----------
    source_time_s : array, shape (n,)
        On the source's clock.
    monotonic_offset_s : float
        To be added for CLOCK_MONOTONIC.
    emg_v : array, shape (n, muscles)
    """

    source_time_s: NDArray[np.float64]
    monotonic_offset_s: float
    emg_v: NDArray[np.float64]


class EmgSource(Protocol):
    """A source of EMG, which is read in a process of its own: its calls may wait.

    Attributes
    ----------
    rate_hz : float
        Nominal.
    """

    rate_hz: float

    def read(self) -> EmgSamples:
        """Return the samples since the last call, none if there are none."""

    def close(self) -> None:
        """Let go of it."""
