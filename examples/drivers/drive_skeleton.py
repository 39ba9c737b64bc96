"""The skeleton of a drive's driver: copy it, and replace `Servo` by your device.

It passes every check: python examples/drivers/drive_skeleton.py
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping

from rigidimeter.core.settings import Section, quantity
from rigidimeter.rig.devices.base import DeviceError, DeviceFacts, MotionSample, Now
from rigidimeter.rig.guard import Cause
from rigidimeter.testing import DRIVE_CHECKS, DriveFixture, OtherEnd


class Servo:
    """Stands for the vendor's library: takes a velocity, stops without one for `watchdog_s`."""

    watchdog_s = 0.1

    def __init__(self) -> None:
        self.powered = self.silent = False
        self.target_rad_s = self.angle_rad = 0.0
        self._told_s = self._moved_s = time.monotonic()

    def power(self, on: bool) -> None:
        self.command(0.0)
        self.powered = on

    def command(self, velocity_rad_s: float) -> None:
        self.state()
        self.target_rad_s, self._told_s = velocity_rad_s, time.monotonic()

    def state(self) -> tuple[float, float]:
        """Return angle and velocity at once."""
        now_s = time.monotonic()
        ends_s = min(now_s, max(self._moved_s, self._told_s + self.watchdog_s))
        moving_rad_s = self.target_rad_s if self.powered else 0.0
        self.angle_rad += moving_rad_s * (ends_s - self._moved_s)
        self._moved_s = now_s
        return self.angle_rad, moving_rad_s if ends_s == now_s else 0.0


class OurDrive:
    """A servo drive in velocity mode."""

    class Settings(Section):
        """The keys of `[drive]` in RIG.toml beside `driver`."""

        max_velocity_rad_s: float = quantity(4.0, "rad/s", 0.0, 100.0, above=True)
        lost_s: float = quantity(0.05, "s", 0.001, 1.0)

    def __init__(self, settings: Settings, now: Now, device: Servo | None = None) -> None:
        self._settings, self._now = settings, now
        self._device = device or Servo()
        self._step = 0  # 1 connected, 2 configured, 3 enabled
        self._sample = MotionSample(math.nan, math.nan, -math.inf)
        self._received = 0

    def connect(self) -> None:
        self._step = 1

    def configure(self) -> DeviceFacts:
        if self._step < 1:
            raise DeviceError("our drive: configure was called before connect")
        # Write mode, limits and the drive's watchdog here, and read them back.
        self._step = 2
        braking = {"braking_rad_s2": 100.0}
        return DeviceFacts("our drive", "serial number", 500.0, self._device.watchdog_s, braking)

    def enable(self) -> None:
        if self._step < 2:
            raise DeviceError("our drive: enable was called before configure")
        self._device.command(0.0)
        if self._device.target_rad_s != 0.0:
            raise DeviceError("our drive: its target is not 0 rad/s before it is enabled")
        self._device.power(True)
        self._step = 3

    def read(self) -> MotionSample:
        if self._step >= 2 and not self._device.silent:
            self._received += 1
            self._sample = MotionSample(*self._device.state(), self._now())
        elif self._received and self._now() - self._sample.time_s > self._settings.lost_s:
            self._sample = self._sample._replace(cause=int(Cause.DRIVE_LOST))
        return self._sample

    def write(self, velocity_rad_s: float) -> float:
        if self._step < 3:
            return 0.0
        most = self._settings.max_velocity_rad_s
        finite = math.isfinite(velocity_rad_s)
        sent_rad_s = min(max(velocity_rad_s, -most), most) if finite else 0.0
        self._device.command(sent_rad_s)
        return sent_rad_s

    @property
    def counts(self) -> Mapping[str, int]:
        return {"received": self._received, "lost": 0, "damaged": 0}

    def stop(self) -> None:
        if self._step == 3:
            self._device.command(0.0)
            self._step = 2  # later commands are not sent

    def disable(self) -> None:
        self._device.power(False)
        self._step = min(self._step, 2)

    def close(self) -> None:
        self.disable()
        self._step = 0


def fixture() -> DriveFixture:
    """Return what the checks take: a new device, and its motion without the driver."""
    device = Servo()
    return DriveFixture(
        make=lambda: OurDrive(OurDrive.Settings(), time.monotonic, device),
        now=time.monotonic,
        silence=lambda: setattr(device, "silent", True),
        other_end=OtherEnd(lambda: device.powered, lambda: device.state()[1]),
    )


if __name__ == "__main__":
    for check in DRIVE_CHECKS:
        check(fixture())
        print("passed:", check.__name__)
