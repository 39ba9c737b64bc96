"""Conformance checks that every driver of a torque sensor or velocity drive must pass.

A fixture makes the driver and, if possible, gives access to its other end: the emulated device, or
instruments on a real one. Each check takes a new fixture, with a device in its initial state, and
raises `ConformanceError` with a message. No test runner is needed:

    for check in DRIVE_CHECKS:
        with my_bench() as fixture:
            check(fixture)

With pytest, parametrise over `DRIVE_CHECKS` or `SENSOR_CHECKS`. The checks energise the drive and
move it, at up to `DriveFixture.speed_rad_s`: never run them with a person at the rig.
"""

from rigidimeter.testing.conformance.drive_checks import DRIVE_CHECKS
from rigidimeter.testing.conformance.fixture import (
    DriveFixture,
    OtherEnd,
    SensorFixture,
)
from rigidimeter.testing.conformance.sensor_checks import SENSOR_CHECKS

__all__ = [
    "DRIVE_CHECKS",
    "SENSOR_CHECKS",
    "DriveFixture",
    "OtherEnd",
    "SensorFixture",
]
