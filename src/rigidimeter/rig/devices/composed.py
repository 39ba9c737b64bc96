"""A rig made of an independent torque sensor and velocity drive.

Angles are relative to where the joint was when the drive was enabled: the initial position, to
which the arm returns between epochs.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import asdict
from typing import Any, NamedTuple

from rigidimeter.rig.devices.base import (
    DeviceError,
    DeviceFacts,
    MotionSample,
    Reading,
    TorqueSample,
    TorqueSensor,
    VelocityDrive,
)
from rigidimeter.rig.devices.bounds import BoundFound, Tight
from rigidimeter.rig.devices.enable_line import EnableLine
from rigidimeter.rig.devices.motion_range import require_within
from rigidimeter.rig.guard import REACTIONS, Cause

ATTEMPTS, ATTEMPT_S = 50, 0.002
"""How often, and at what interval, the first samples after enabling are polled."""

BUFFERED_S = 1.0
"""A sensor's samples of a longer time than this may not fit into the buffer of its connection."""


class Home(NamedTuple):
    """Where the joint must be when it is enabled, on the drive's own scale.

    After a stop the joint can be anywhere. Starting there would shift the position limits with it,
    and the torque that holds the joint there would be taken as the sensor's zero.
    """

    angle_rad: float
    tolerance_rad: float

    def check(self, angle_rad: float) -> None:
        """Refuse a joint that is elsewhere.

        Raises
        ------
        DeviceError
            Says where the joint is and where it must be.
        """
        if not abs(angle_rad - self.angle_rad) <= self.tolerance_rad:
            raise DeviceError(
                f"drive: the joint stands at {math.degrees(angle_rad):.1f} deg of the drive's "
                f"scale; it must be within {math.degrees(self.tolerance_rad):.1f} deg of "
                f"{math.degrees(self.angle_rad):.1f} deg, so bring it there by hand when the "
                "drive's power is off, and try again"
            )


class ComposedRig:
    """A sensor, a drive, and optionally the contact in the drive's hardware enable circuit.

    Parameters
    ----------
    sensor : TorqueSensor
    drive : VelocityDrive
    tick_rate_hz : float
        Of the loop; a device that is slower is refused.
    line : EnableLine, optional
        The hardware enable.
    home : Home, optional
        Where the joint must be to be enabled.
    identified : callable
        Called with the facts of the devices by role as soon as they are read; may refuse them.
    range_rad : tuple of float, optional
        The range of motion of the person, on the drive's scale: the joint must be within it to be
        enabled.
    """

    def __init__(
        self,
        sensor: TorqueSensor,
        drive: VelocityDrive,
        tick_rate_hz: float,
        line: EnableLine | None = None,
        home: Home | None = None,
        identified: Callable[[Mapping[str, DeviceFacts]], None] = lambda _: None,
        range_rad: tuple[float, float] | None = None,
    ) -> None:
        self._range_rad = range_rad
        self._sensor, self._drive, self._line, self._home = sensor, drive, line, home
        self._tick_rate_hz, self._identified = tick_rate_hz, identified
        self._bias_nm = 0.0
        self._origin_rad = 0.0

    def connect(self) -> None:
        """Open the connections; if one fails, the others are closed again."""
        try:
            self._sensor.connect()
            self._drive.connect()
        except BaseException:  # also when interrupted: an open line keeps others out
            self.close()
            raise

    def configure(self) -> Mapping[str, Any]:
        """Configure both devices; return their facts.

        Raises
        ------
        DeviceError
            If a device does not answer, does not match the settings, or is too slow for the loop.
        """
        facts = {"torque_sensor": self._sensor.configure(), "drive": self._drive.configure()}
        self._identified(facts)
        for role, found in facts.items():
            if found.fastest_tick_rate_hz < self._tick_rate_hz:
                raise DeviceError(
                    f"{role} ({found.model or 'unknown model'}): keeps up with "
                    f"{found.fastest_tick_rate_hz:.4g} ticks/s at most, but rig.tick_rate_hz = "
                    f"{self._tick_rate_hz:g} Hz; lower rig.tick_rate_hz"
                )
        return {role: asdict(found) for role, found in facts.items()}

    def enable(self) -> None:
        """Close the contact, energise the drive at zero velocity, store where the joint is.

        Raises
        ------
        DeviceError
            If the drive does not start, or a device gives no sample; the drive then has no power.
        """
        try:
            restart = getattr(self._sensor, "restart", None)
            if restart is not None:  # samples piled up while the drive was configured
                restart()
            if self._line is not None:
                self._line.close_contact()
            began_s = time.monotonic()
            self._drive.enable()
            self._origin_rad = self._fresh_angle_rad(time.monotonic() - began_s)
            if self._home is not None:
                self._home.check(self._origin_rad)
            if self._range_rad is not None:
                require_within(self._range_rad, self._origin_rad)
        except BaseException:  # also when interrupted: the drive may have power by now
            self.disable()
            raise

    def _fresh_angle_rad(self, took_s: float) -> float:
        """Return the first finite angle once the torque is fresh too.

        A drive may send its angle only in reply to a command. The sensor's samples piled up while
        the drive was enabled, which took `took_s`, so they are read until a new one arrives.
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
            if torque.cause and took_s > BUFFERED_S:
                raise DeviceError(
                    f"drive: it took {took_s:.1f} s to be enabled, so late are its answers, and "
                    "the torque sensor's samples of that time were lost; it must take less than "
                    f"{BUFFERED_S:g} s, so find what keeps the drive or its bus busy"
                )
            if fresh and math.isfinite(motion.angle_rad):
                return motion.angle_rad
        silent, what = ("drive", "angle") if fresh else ("torque sensor", "new sample")
        raise DeviceError(
            f"{silent}: no {what} within {ATTEMPTS * ATTEMPT_S:g} s after the drive was enabled; "
            "check that its samples flow"
        )

    def read(self, elapsed_ticks: int = 1) -> Reading:
        """Return the newest readings of both devices."""
        torque: TorqueSample = self._sensor.read()
        motion: MotionSample = self._drive.read()
        cause = torque.cause
        if REACTIONS[motion.cause] > REACTIONS[cause] or not cause:
            cause = motion.cause
        drive_nm = motion.drive_torque_nm
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
            drive_nm,
            math.nan if math.isnan(drive_nm) else motion.time_s,
        )

    @property
    def origin_rad(self) -> float:
        """The drive's own angle at which the joint was enabled."""
        return self._origin_rad

    def write(self, velocity_rad_s: float) -> float:
        """Send a velocity; return what was sent."""
        return self._drive.write(velocity_rad_s)

    def zero(self, bias_nm: float) -> None:
        """Subtract `bias_nm` from every torque from now on."""
        self._bias_nm += bias_nm

    @property
    def counts(self) -> Mapping[str, int]:
        """Message counts of both devices."""
        return {
            **{f"torque_{name}": count for name, count in self._sensor.counts.items()},
            **{f"drive_{name}": count for name, count in self._drive.counts.items()},
        }

    @property
    def powered(self) -> bool:
        """Whether the drive has not said that it has no power; False if its driver cannot tell."""
        return bool(getattr(self._drive, "powered", False))

    @property
    def bounds(self) -> tuple[BoundFound, ...]:
        """What came of the drive's own bounds; empty where its driver writes none."""
        return tuple(getattr(self._drive, "bounds", ()))

    def tighten(self, tight: Tight | None) -> None:
        """Have one of the drive's bounds so tight, when it is enabled next, that a move ends."""
        tighten = getattr(self._drive, "tighten", None)
        if tighten is not None:
            tighten(tight)

    def stop(self) -> None:
        """Let the drive brake along its own ramp."""
        self._drive.stop()

    def reset_fault(self) -> None:
        """Reset the drive's fault at the operator's request; the drive stays without power."""
        reset = getattr(self._drive, "reset_fault", None)
        if reset is not None:
            reset()

    def disable(self) -> None:
        """Remove the power both ways: by the contact and by the drive, even if one of them fails.

        The contact comes first because it does not wait for a drive that no longer answers.
        """
        try:
            if self._line is not None:
                self._line.open_contact()
        finally:
            self._drive.disable()

    def close(self) -> None:
        """Remove the power and close all connections, each even if another fails.

        The last error is raised, with the earlier ones as its context.
        """
        with ExitStack() as steps:  # tries all of them, the last one first
            if self._line is not None:
                steps.callback(self._line.close)
            steps.callback(self._sensor.close)
            steps.callback(self._drive.close)
            steps.callback(self.disable)
