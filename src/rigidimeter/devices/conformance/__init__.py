"""What every torque sensor and every velocity drive must do: checks to run a driver through.

A fixture makes the driver and, where there is one, shows its other end: the emulated device, or the
instruments beside a real one. Each check takes a fixture of its own, with a device fresh from the
shelf, and raises `ConformanceError` with a sentence. They need no test-runner:

    for check in DRIVE_CHECKS:
        with my_bench() as fixture:
            check(fixture)

With pytest, parametrise over `DRIVE_CHECKS` or `SENSOR_CHECKS`. The checks energise the drive and
move it, at up to `DriveFixture.speed_rad_s`: never run them with a person at the rig.
"""

from rigidimeter.devices.conformance.drive_checks import DRIVE_CHECKS
from rigidimeter.devices.conformance.fixture import (
    ConformanceError,
    DriveFixture,
    OtherEnd,
    SensorFixture,
)
from rigidimeter.devices.conformance.sensor_checks import SENSOR_CHECKS

__all__ = [
    "DRIVE_CHECKS",
    "SENSOR_CHECKS",
    "ConformanceError",
    "DriveFixture",
    "OtherEnd",
    "SensorFixture",
]
