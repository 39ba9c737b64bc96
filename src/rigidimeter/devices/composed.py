"""A rig made of a torque sensor and a velocity drive that know nothing of each other.

The angle counts from where the joint stood when the drive was enabled: that is the initial
position, to which every rest returns.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import asdict
from typing import Any, NamedTuple

from rigidimeter.devices.base import (
    DeviceError,
    DeviceFacts,
    MotionSample,
    Reading,
    TorqueSample,
    TorqueSensor,
    VelocityDrive,
)
from rigidimeter.devices.enable_line import EnableLine
from rigidimeter.guard import REACTIONS, Cause

__all__ = ["ComposedRig", "Home"]

ATTEMPTS, ATTEMPT_S = 50, 0.002
"""How often, and after how long, devices are asked for their first sample once enabled."""


class Home(NamedTuple):
    """Where the joint must stand when it is enabled, on the drive's own scale.

    After a stop the joint stands anywhere. To begin from there would move the position limits with
    it, and take the torque that holds it there for the sensor's zero.
    """

    angle_rad: float
    tolerance_rad: float

    def check(self, angle_rad: float) -> None:
        """Refuse a joint that stands elsewhere.

        Raises
        ------
        DeviceError
            Says where it stands and where it must.
        """
        if not abs(angle_rad - self.angle_rad) <= self.tolerance_rad:
            raise DeviceError(
                f"drive: the joint stands at {math.degrees(angle_rad):.1f} deg of the drive's "
                f"scale; it must be within {math.degrees(self.tolerance_rad):.1f} deg of "
                f"{math.degrees(self.angle_rad):.1f} deg, so bring it there by hand and try again"
            )


class ComposedRig:
    """One sensor, one drive, and where there is one the contact that lets the drive have power.

    Parameters
    ----------
    sensor : TorqueSensor
    drive : VelocityDrive
    tick_rate_hz : float
        Of the loop; a device that cannot keep up is refused.
    line : EnableLine, optional
        The hardware enable.
    home : Home, optional
        Where the joint must stand to be enabled.
    """

    def __init__(
        self,
        sensor: TorqueSensor,
        drive: VelocityDrive,
        tick_rate_hz: float,
        line: EnableLine | None = None,
        home: Home | None = None,
    ) -> None:
        self._sensor, self._drive, self._line, self._home = sensor, drive, line, home
        self._tick_rate_hz = tick_rate_hz
        self._bias_nm = 0.0
        self._origin_rad = 0.0

    def connect(self) -> None:
        """Open the wires; what was opened is closed again if one fails."""
        try:
            self._sensor.connect()
            self._drive.connect()
        except BaseException:
            self.close()
            raise

    def configure(self) -> Mapping[str, Any]:
        """Set up both devices; return their facts.

        Raises
        ------
        DeviceError
            If a device does not answer, does not fit, or is too slow for the loop.
        """
        facts = {"torque_sensor": self._sensor.configure(), "drive": self._drive.configure()}
        for role, found in facts.items():
            self._fast_enough(role, found)
        return {role: asdict(found) for role, found in facts.items()}

    def _fast_enough(self, role: str, facts: DeviceFacts) -> None:
        if facts.fastest_tick_rate_hz < self._tick_rate_hz:
            raise DeviceError(
                f"{role} ({facts.model or 'unknown model'}): keeps up with "
                f"{facts.fastest_tick_rate_hz:.4g} ticks/s at most, but rig.tick_rate_hz = "
                f"{self._tick_rate_hz:g} Hz; lower rig.tick_rate_hz"
            )

    def enable(self) -> None:
        """Close the contact, energise the drive at zero velocity, note where the joint stands.

        Raises
        ------
        DeviceError
            If the drive does not come up, or one of the two gives no sample; the drive is without
            power then.
        """
        try:
            restart = getattr(self._sensor, "restart", None)
            if restart is not None:  # nobody has read for as long as setting up took
                restart()
            if self._line is not None:
                self._line.close_contact()
            self._drive.enable()
            self._origin_rad = self._fresh_angle_rad()
            if self._home is not None:
                self._home.check(self._origin_rad)
        except BaseException:
            self.disable()
            raise

    def _fresh_angle_rad(self) -> float:
        """Return the first angle that is a number, once the torque is fresh too.

        A drive may have to be asked for its angle, and while the drive was set up the sensor's
        samples piled up: they are read until the newest is reached.
        """
        newest_s = self._sensor.read().time_s
        fresh = False
        for _ in range(ATTEMPTS):
            self._drive.write(0.0)
            time.sleep(ATTEMPT_S)
            motion, torque = self._drive.read(), self._sensor.read()
            fresh = fresh or torque.time_s > newest_s
            if motion.cause:
                raise DeviceError(
                    f"drive: {Cause(motion.cause).sentence} as soon as it was enabled; put that "
                    "right first"
                )
            if fresh and math.isfinite(motion.angle_rad):
                return motion.angle_rad
        silent, what = ("drive", "angle") if fresh else ("torque sensor", "new sample")
        raise DeviceError(
            f"{silent}: no {what} within {ATTEMPTS * ATTEMPT_S:g} s after the drive was enabled; "
            "check that its samples flow"
        )

    def read(self, elapsed_ticks: int = 1) -> Reading:
        """Return the newest readings of both."""
        torque: TorqueSample = self._sensor.read()
        motion: MotionSample = self._drive.read()
        cause = torque.cause
        if REACTIONS[motion.cause] > REACTIONS[cause] or not cause:
            cause = motion.cause
        return Reading(
            torque.torque_nm - self._bias_nm,
            torque.time_s,
            motion.angle_rad - self._origin_rad,
            motion.velocity_rad_s,
            motion.time_s,
            torque.sequence,
            torque.status,
            motion.sequence,
            motion.status,
            cause,
        )

    @property
    def origin_rad(self) -> float:
        """The drive's own angle where the joint stood when it was enabled."""
        return self._origin_rad

    def write(self, velocity_rad_s: float) -> float:
        """Send a velocity; return what was sent."""
        return self._drive.write(velocity_rad_s)

    def zero(self, bias_nm: float) -> None:
        """Take `bias_nm` off every torque from now on."""
        self._bias_nm += bias_nm

    @property
    def counts(self) -> Mapping[str, int]:
        """What both wires counted."""
        return {
            **{f"torque_{name}": count for name, count in self._sensor.counts.items()},
            **{f"drive_{name}": count for name, count in self._drive.counts.items()},
        }

    def stop(self) -> None:
        """Let the drive brake by its own ramp."""
        self._drive.stop()

    def reset_fault(self) -> None:
        """Take back the drive's fault, as the operator asks; it stays without power."""
        reset = getattr(self._drive, "reset_fault", None)
        if reset is not None:
            reset()

    def disable(self) -> None:
        """Take the power away by every way there is; one that fails does not spare the others.

        The contact comes first: it does not wait for a drive that no longer answers.
        """
        try:
            if self._line is not None:
                self._line.open_contact()
        finally:
            self._drive.disable()

    def close(self) -> None:
        """Take the power away and close the wires and the contact's port, each even if one fails.

        What fails last is raised, with what failed before it as its context.
        """
        with ExitStack() as steps:  # tries all of them, the last one first
            if self._line is not None:
                steps.callback(self._line.close)
            steps.callback(self._sensor.close)
            steps.callback(self._drive.close)
            steps.callback(self.disable)
