"""An emulated servo and drivers on one virtual bus."""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from rigidimeter.model import JointDynamics
from rigidimeter.rig.devices import Cia402Drive, Cia402Settings
from rigidimeter.rig.devices.base import MotionSample
from rigidimeter.testing import Cia402Emulator, EmulatedArm

# Wide enough for a machine that is busy with other things; the drive's own limits are measured.
SLACK = {
    "heartbeat_s": 0.02,
    "drive_watchdog_s": 0.4,
    "command_deadline_s": 0.25,
    "lost_s": 0.2,
    "max_velocity_rad_s": 3.0,
}
GROUP = "239.74.163.2"
_channels = itertools.count()


def emulated_arm() -> EmulatedArm:
    return EmulatedArm(JointDynamics(0.08, 0.5, 10.0))


def free_port() -> int:
    return 43200 + os.getpid() % 10000


class Wire:
    """An emulator and, on the same bus, as many drivers as a test wants."""

    def __init__(self, **options: Any) -> None:
        self.channel = f"cia402-{next(_channels)}"
        where = {"interface": "virtual", "channel": self.channel}
        self.emulator = Cia402Emulator(emulated_arm(), **where, **options)
        self.drives: list[Cia402Drive] = []

    def drive(self, **settings: object) -> Cia402Drive:
        values = {"interface": "virtual", "channel": self.channel, **SLACK, **settings}
        drive = Cia402Drive(Cia402Settings(**values), time.monotonic)
        self.drives.append(drive)
        drive.connect()
        return drive

    def ready(self, **settings: object) -> Cia402Drive:
        drive = self.drive(**settings)
        drive.configure()
        drive.enable()
        return drive

    def close(self) -> None:
        for drive in self.drives:
            drive.close()
        self.emulator.close()


@pytest.fixture
def wire() -> Iterator[Wire]:
    made = Wire()
    try:
        yield made
    finally:
        made.close()


def run_loop(
    drive: Cia402Drive,
    velocity_rad_s: float = 0.0,
    *,
    for_s: float = 2.0,
    until: Callable[[MotionSample], bool] = lambda sample: bool(sample.cause),
) -> MotionSample:
    """Run a loop until something is wrong or the time is out."""
    end_s = time.monotonic() + for_s
    while True:
        sample = drive.read()
        drive.write(velocity_rad_s)
        if until(sample) or time.monotonic() > end_s:
            return sample
        time.sleep(0.002)


def wait_until(true: Callable[[], bool], for_s: float = 2.0) -> bool:
    end_s = time.monotonic() + for_s
    while not true():
        if time.monotonic() > end_s:
            return False
        time.sleep(0.002)
    return True
