"""The skeleton of a torque sensor's driver: copy it, and replace `Amplifier` by your device.

It passes every check: python examples/drivers/sensor_skeleton.py
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping

from rigidimeter.core.settings import Section, quantity
from rigidimeter.rig.devices.base import DeviceError, DeviceFacts, Now, TorqueSample
from rigidimeter.rig.guard import Cause
from rigidimeter.testing import SENSOR_CHECKS, SensorFixture


class Amplifier:
    """Stands for the vendor's library: 1000 readings/s, numbered, none while it is silent."""

    rate_hz = 1000.0

    def __init__(self) -> None:
        self.begun_s = time.monotonic()
        self.silent = False

    def newest(self) -> tuple[int, float] | None:
        """Return number and voltage of the newest reading at once; None if there is none."""
        if self.silent:
            return None
        number = int((time.monotonic() - self.begun_s) * self.rate_hz)
        return number, 0.02 + 0.001 * math.sin(0.01 * number)


class OurSensor:
    """A torque sensor on an amplifier with a voltage output."""

    class Settings(Section):
        """The keys of `[torque_sensor]` in RIG.toml beside `driver`."""

        nm_per_v: float = quantity(10.0, "N·m/V", -1e4, 1e4)
        lost_s: float = quantity(0.05, "s", 0.001, 1.0)

    def __init__(self, settings: Settings, now: Now, device: Amplifier | None = None) -> None:
        self._settings, self._now = settings, now
        self._device = device or Amplifier()
        self._connected = self._sampling = False
        self._sample = TorqueSample(math.nan, -math.inf, cause=int(Cause.NONE))
        self._received = self._lost = 0

    def connect(self) -> None:
        self._connected = True

    def configure(self) -> DeviceFacts:
        if not self._connected:
            raise DeviceError("our sensor: configure was called before connect")
        # Write the device's settings here, read them back, and refuse what does not match.
        self._sampling = True
        return DeviceFacts("our sensor", "serial number", fastest_tick_rate_hz=1000.0)

    def read(self) -> TorqueSample:
        found = self._device.newest() if self._sampling else None
        if found is not None and found[0] != self._sample.sequence:
            number, voltage_v = found
            if self._sample.sequence >= 0:
                self._lost += max(0, number - self._sample.sequence - 1)
            self._received += 1
            torque_nm = self._settings.nm_per_v * voltage_v
            self._sample = TorqueSample(torque_nm, self._now(), number)
        elif self._received and self._now() - self._sample.time_s > self._settings.lost_s:
            self._sample = self._sample._replace(cause=int(Cause.TORQUE_STALE))
        return self._sample

    @property
    def counts(self) -> Mapping[str, int]:
        return {
            "received": self._received,
            "lost": self._lost,
            "repeated": 0,
            "reordered": 0,
            "damaged": 0,
        }

    def close(self) -> None:
        self._connected = self._sampling = False


def fixture() -> SensorFixture:
    """Return what the checks take: a new device, and a way to make it fall silent."""
    device = Amplifier()
    return SensorFixture(
        make=lambda: OurSensor(OurSensor.Settings(), time.monotonic, device),
        now=time.monotonic,
        silence=lambda: setattr(device, "silent", True),
    )


if __name__ == "__main__":
    for check in SENSOR_CHECKS:
        check(fixture())
        print("passed:", check.__name__)
