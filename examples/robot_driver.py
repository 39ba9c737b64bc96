"""Drivers for a robot of which one library is torque sensor and drive, in a process of its own.

    [torque_sensor]
    driver = "robot_driver:RobotTorque"

    [drive]
    driver = "robot_driver:RobotDrive"

`Robot` stands in for the vendor's library: put yours in its place. Run as it is, it goes through
the checks that every driver must pass:

    python examples/robot_driver.py
"""

from __future__ import annotations

import ctypes
import math
import multiprocessing
import time
from collections.abc import Mapping
from multiprocessing.sharedctypes import RawArray
from typing import Any, ClassVar

from rigidimeter.core.settings import Section, quantity
from rigidimeter.rig.devices.base import DeviceError, DeviceFacts, MotionSample, Now, TorqueSample
from rigidimeter.rig.guard import Cause

START_S, LOST_S, HOLDS_S = 10.0, 0.05, 0.05
"""For the process to start; a sample so old is of a robot that is lost; a command so old ends."""

TAKEN_S, TORQUE, ANGLE, VELOCITY, MOVES = range(1, 6)
"""Places in what the process shows; 0 counts, and is odd while it writes."""

ASKED_S, WANTED, ORDER = range(3)
"""Places in what the loop asks for."""

END, HOLD, BRAKE, MOVE = range(4)


class Robot:
    """Stands in for the vendor's library; it holds the interpreter's lock while it waits."""

    joint = (0.08, 0.5, 2.0)

    def __init__(self, address: str) -> None:
        self.angle_rad = self.velocity_rad_s = self.wanted_rad_s = 0.0
        self.moves = False
        self._wait_us = ctypes.PyDLL(None).usleep

    def wait(self) -> float:
        """Wait for the next millisecond; return the torque in N·m."""
        self._wait_us(1000)
        wanted = self.wanted_rad_s if self.moves else 0.0
        acceleration = (wanted - self.velocity_rad_s) / 0.005
        self.velocity_rad_s += 0.001 * acceleration
        self.angle_rad += 0.001 * self.velocity_rad_s
        inertia, damping, stiffness = self.joint
        noise_nm = 0.001 * math.sin(1e4 * time.monotonic())
        return (
            inertia * acceleration
            + damping * self.velocity_rad_s
            + stiffness * self.angle_rad
            + noise_nm
        )


def serve(address: str, shown: Any, asked: Any) -> None:
    """Run the robot; the only place that calls its library. It holds when nobody asks any more."""
    robot = Robot(address)
    order = HOLD
    while order != END:
        torque_nm = robot.wait()
        taken_s = time.monotonic()
        asked_s, wanted_rad_s, order = asked
        if taken_s - asked_s > HOLDS_S and order != END:
            order = HOLD  # the loop, or its computer, is gone
        robot.moves = order in (MOVE, BRAKE)
        robot.wanted_rad_s = wanted_rad_s if order == MOVE else 0.0
        shown[0] += 1
        motion = robot.angle_rad, robot.velocity_rad_s, float(robot.moves)
        shown[TAKEN_S:] = [taken_s, torque_nm, *motion]
        shown[0] += 1


class Connection:
    """The one connection to a robot, for all drivers that name its address."""

    open_ones: ClassVar[dict[str, Connection]] = {}

    def __init__(self, address: str) -> None:
        self.address, self.users = address, 0
        self.shown, self.asked = RawArray("d", 6), RawArray("d", 3)
        self.asked[ORDER] = HOLD
        context = multiprocessing.get_context("spawn")
        what = (address, self.shown, self.asked)
        self.process = context.Process(target=serve, args=what, daemon=True)
        self.process.start()
        until_s = time.monotonic() + START_S
        while not self.shown[0] and time.monotonic() < until_s:
            time.sleep(0.01)

    @classmethod
    def of(cls, address: str) -> Connection:
        """Return the connection to this address, opened if it is the first."""
        found = cls.open_ones.get(address) or cls(address)
        cls.open_ones[address] = found
        found.users += 1
        return found

    def leave(self) -> None:
        """Close it if no driver uses it any more."""
        self.users -= 1
        if not self.users:
            self.asked[ORDER] = END
            self.process.join(1.0)
            self.process.kill()
            del self.open_ones[self.address]

    def ask(self, order: int, wanted_rad_s: float = 0.0) -> None:
        """Ask for something; the time last, so that what it is the time of is there."""
        self.asked[WANTED], self.asked[ORDER] = wanted_rad_s, order
        self.asked[ASKED_S] = time.monotonic()

    def read(self) -> list[float]:
        """Return the newest of what the process shows, without waiting and never half of it."""
        while True:
            seen = self.shown[:]
            if seen[0] % 2 == 0 and seen[0] == self.shown[0]:
                return seen


class _Part:
    """What both drivers do alike."""

    class Settings(Section):
        address: str = "robot.local"
        emulated: ClassVar[bool] = True  # of the stand-in; leave it out for a robot

    def __init__(self, settings: Any, now: Now) -> None:
        self._settings, self._now = settings, now
        self._robot: Connection | None = None
        self._after_s = 0.0
        self._reads = 0

    def connect(self) -> None:
        """Open the connection, or join the other driver's."""
        if self._robot is None:
            self._robot = Connection.of(self._settings.address)
        # Of the loop's clock the process knows nothing. Both count the seconds of CLOCK_MONOTONIC.
        self._after_s = time.monotonic() - self._now()

    def close(self) -> None:
        """Leave the connection."""
        robot, self._robot = self._robot, None
        if robot is not None:
            robot.leave()

    @property
    def counts(self) -> Mapping[str, int]:
        """Only what the checks ask for: a library hides what its wire loses."""
        return {"received": self._reads} | dict.fromkeys(
            ("lost", "repeated", "reordered", "damaged"), 0
        )

    def _configured(self) -> Connection:
        if self._robot is None:
            raise DeviceError("robot: not connected; call connect first")
        if not self._robot.shown[0]:
            raise DeviceError(f"robot at {self._settings.address}: no answer in {START_S:g} s")
        return self._robot

    def _sample(self, lost: Cause) -> tuple[list[float], float, int]:
        """Return what is shown, its time on the loop's clock, and a cause."""
        seen = self._robot.read() if self._robot is not None else [0.0] * 6
        self._reads += 1
        old = not seen[0] or time.monotonic() - seen[TAKEN_S] > LOST_S
        return seen, seen[TAKEN_S] - self._after_s, int(lost if old else Cause.NONE)


class RobotTorque(_Part):
    """The torque that the robot measures at the joint, of the drive on it."""

    def configure(self) -> DeviceFacts:
        """Say what it is."""
        self._configured()
        return DeviceFacts("stand-in", "", 1000.0)

    def read(self) -> TorqueSample:
        """Return the newest torque."""
        seen, taken_s, cause = self._sample(Cause.TORQUE_STALE)
        return TorqueSample(seen[TORQUE], taken_s, int(seen[0]), cause=cause)


class RobotDrive(_Part):
    """The joint's velocity. Its `disable` holds: without power the robot would fall."""

    class Settings(_Part.Settings):
        """And how fast it may become."""

        max_rad_s: float = quantity(3.0, "rad/s", 0.01, 10.0)

    _ready = _enabled = False

    def configure(self) -> DeviceFacts:
        """Say what it is, and how fast it stops without the loop."""
        self._configured()
        self._ready = True
        return DeviceFacts("stand-in", "", 1000.0, HOLDS_S, {"braking_rad_s2": 200.0})

    def enable(self) -> None:
        """Let it move, from a velocity of zero."""
        if not self._ready:
            raise DeviceError("robot: not configured; call configure first")
        self._configured().ask(MOVE)
        self._enabled = True
        while not self.powered:
            time.sleep(0.001)

    def read(self) -> MotionSample:
        """Return the newest angle and velocity."""
        seen, taken_s, cause = self._sample(Cause.DRIVE_LOST)
        return MotionSample(seen[ANGLE], seen[VELOCITY], taken_s, int(seen[0]), cause=cause)

    def write(self, velocity_rad_s: float) -> float:
        """Ask for a velocity; return what was asked for."""
        if self._robot is None or not self._enabled or not math.isfinite(velocity_rad_s):
            velocity_rad_s = 0.0
        most = self._settings.max_rad_s
        velocity_rad_s = max(-most, min(most, velocity_rad_s))
        if self._robot is not None and self._enabled:
            self._robot.ask(MOVE, velocity_rad_s)
        return velocity_rad_s

    @property
    def powered(self) -> bool:
        """Whether the robot, by its own word, may move: not while it holds."""
        return self._robot is not None and self._robot.read()[MOVES] > 0.0

    def stop(self) -> None:
        """Brake, and stay where that ends."""
        if self._robot is not None and self._enabled:
            self._robot.ask(BRAKE)
        self._enabled = False

    def disable(self) -> None:
        """Hold where it is, by its own position control and its brakes, whatever is asked for."""
        if self._robot is not None:
            self._robot.ask(HOLD)
        self._enabled = False

    def close(self) -> None:
        """Hold, and leave the connection."""
        self.disable()
        self._ready = False
        super().close()


if __name__ == "__main__":
    from rigidimeter.testing import (
        DRIVE_CHECKS,
        SENSOR_CHECKS,
        DriveFixture,
        OtherEnd,
        SensorFixture,
    )

    def make(part: type[Any]) -> Any:
        """Return a driver."""
        return part(part.Settings(), time.monotonic)

    def end() -> OtherEnd:
        """Look at the robot itself where its connection is open."""

        def seen(place: int) -> float:
            robot = Connection.open_ones.get("robot.local")
            return robot.read()[place] if robot is not None else 0.0

        return OtherEnd(lambda: seen(MOVES) > 0.0, lambda: seen(VELOCITY))

    for check in SENSOR_CHECKS:
        check(SensorFixture(lambda: make(RobotTorque), time.monotonic))
        print(f"passed: {check.__name__}")
    for check in DRIVE_CHECKS:
        check(DriveFixture(lambda: make(RobotDrive), time.monotonic, other_end=end()))
        print(f"passed: {check.__name__}")
