"""What the loop knows of a rig, and what a rig knows of its devices.

A device goes one way through its life, and every step may be the last:

    connect    open the wire; nothing is energised
    configure  set what must be set, read back what matters, refuse what does not fit
    enable     (drives) write zero velocity, read it back, then energise
    read, write
    stop, disable, close    safe at any time, in any order, and twice

`read` and `write` run in the real-time loop. They do not wait, do not raise for what a wire can do,
and name a `guard.Cause` instead. Times are in seconds on the loop's clock, which is passed in.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

from rigidimeter.errors import UserError
from rigidimeter.guard import Cause

__all__ = [
    "DeviceError",
    "DeviceFacts",
    "MotionSample",
    "Now",
    "Reading",
    "Rig",
    "TorqueSample",
    "TorqueSensor",
    "VelocityDrive",
]

Now = Callable[[], float]
"""Seconds on the loop's clock, monotonic."""


class DeviceError(UserError):
    """A device cannot be used: the sentence names it, what was found, and what would be right."""


@dataclass(frozen=True)
class DeviceFacts:
    """What a device said of itself when it was configured; stored with the session.

    Parameters
    ----------
    model, serial : str
        As read from the device; empty where it does not say.
    fastest_tick_rate_hz : float
        The fastest loop this device can keep up with.
    watchdog_s : float or None
        After how long without a command the device stops by itself; None if it does not.
    values : mapping
        Everything else that was read back: units, calibration, limits, firmware.
    """

    model: str
    serial: str
    fastest_tick_rate_hz: float
    watchdog_s: float | None = None
    values: Mapping[str, str | float | int] = field(default_factory=dict)


class TorqueSample(NamedTuple):
    """The newest torque: applied by the drive to the joint, positive toward positive angle.

    `time_s` is when it was taken, as far as the driver knows. `sequence` is the device's own count,
    -1 where it has none; `raw` the counts as they came; `status` the device's status word. A
    `cause` other than NONE says why the sample must not be used.
    """

    torque_nm: float
    time_s: float
    sequence: int = -1
    raw: tuple[int, ...] = ()
    status: int = 0
    cause: int = int(Cause.NONE)


class MotionSample(NamedTuple):
    """The newest angle and velocity; fields as in `TorqueSample`."""

    angle_rad: float
    velocity_rad_s: float
    time_s: float
    sequence: int = -1
    raw: tuple[int, ...] = ()
    status: int = 0
    cause: int = int(Cause.NONE)


class TorqueSensor(Protocol):
    """A torque sensor on the joint's axis."""

    def connect(self) -> None:
        """Open the wire."""

    def configure(self) -> DeviceFacts:
        """Set up, read back, start the samples flowing.

        Raises
        ------
        DeviceError
            If the device does not answer, or is not what the settings say.
        """

    def read(self) -> TorqueSample:
        """Return the newest sample without waiting; the one before again if there is none."""

    @property
    def counts(self) -> Mapping[str, int]:
        """How many packets were received, lost, repeated, reordered or damaged, by these names."""

    def close(self) -> None:
        """Stop the samples and close the wire."""


class VelocityDrive(Protocol):
    """A drive that takes velocity commands."""

    def connect(self) -> None:
        """Open the wire."""

    def configure(self) -> DeviceFacts:
        """Set up mode, limits and the drive's own watchdog, and read them back.

        Raises
        ------
        DeviceError
            If the device does not answer, or does not take what it is told.
        """

    def enable(self) -> None:
        """Write zero velocity, read it back, then energise.

        Raises
        ------
        DeviceError
            If the target is not zero or the drive does not come up; it is without power then.
        """

    def read(self) -> MotionSample:
        """Return the newest sample without waiting; the one before again if there is none."""

    def write(self, velocity_rad_s: float) -> float:
        """Send a velocity; return what was really sent, rounded to what the wire carries."""

    @property
    def counts(self) -> Mapping[str, int]:
        """How many messages were received, lost or damaged, by these names."""

    def stop(self) -> None:
        """Tell the drive to brake by its own ramp and stay at rest: its quick stop."""

    def disable(self) -> None:
        """Take the power away at once."""

    def close(self) -> None:
        """Take the power away and close the wire."""


class Reading(NamedTuple):
    """The newest sample of each sensor, with the time it was taken on the loop's clock.

    Sensors have clocks of their own, so a reading may repeat the sample of the tick before; then
    its stamp repeats too. `cause` is what a device reports, NONE if all is well.
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


class Rig(Protocol):
    """A torque sensor and a velocity drive on one joint."""

    def connect(self) -> None:
        """Open the wires; nothing is energised."""

    def configure(self) -> Mapping[str, Any]:
        """Set up the devices; return their facts by role, as plain values.

        Raises
        ------
        DeviceError
            If a device does not fit the settings.
        """

    def enable(self) -> None:
        """Command zero velocity, then energise."""

    def read(self, elapsed_ticks: int = 1) -> Reading:
        """Return the newest readings, so many ticks after the ones before.

        More than one if the loop missed a deadline; a simulated rig lives through them.
        """

    def write(self, velocity_rad_s: float) -> float:
        """Send a velocity command; return what was really sent."""

    def zero(self, bias_nm: float) -> None:
        """Take `bias_nm` off every torque from now on."""

    @property
    def origin_rad(self) -> float:
        """The drive's own angle where the joint stood when it was enabled: angle 0 of the rig."""

    @property
    def counts(self) -> Mapping[str, int]:
        """What the wires counted since they were opened."""

    def stop(self) -> None:
        """Let the drive brake by its own ramp: for when commands no longer reach it."""

    def disable(self) -> None:
        """Take the power away at once. Safe to call at any time, and twice."""

    def close(self) -> None:
        """Take the power away and close the wires. Safe to call at any time, and twice."""
