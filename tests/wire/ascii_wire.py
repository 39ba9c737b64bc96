"""An emulated serial drive and its drivers."""

from __future__ import annotations

import time

import pytest

from rigidimeter.model import JointDynamics
from rigidimeter.rig.devices import AsciiDrive
from rigidimeter.rig.guard import Cause
from rigidimeter.testing import AsciiEmulator, EmulatedArm

COUNTS_PER_TURN = 360_000.0
TICK_S = 0.02
SPEED_RAD_S = 0.5
HORIZON_S = 0.2  # a loop on a busy machine is late by half of that
DECELERATION_DEG_S2 = 500.0


class Wire:
    """An emulator, its arm, and as many drivers as a test wants, one after the other."""

    def __init__(self) -> None:
        self.arm = EmulatedArm(JointDynamics(0.08, 0.5, 2.0))
        self.emulator = AsciiEmulator(self.arm, counts_per_turn=COUNTS_PER_TURN)
        self.drives: list[AsciiDrive] = []

    def drive(self, **settings):
        values = {
            "port": self.emulator.port,
            "counts_per_turn": COUNTS_PER_TURN,
            "horizon_s": HORIZON_S,
            "deceleration_deg_s2": DECELERATION_DEG_S2,
            "lost_s": 0.15,
        }
        drive = AsciiDrive(AsciiDrive.Settings(**(values | settings)), time.monotonic)
        for before in self.drives:
            before.close()  # one program at a time has the port
        self.drives.append(drive)
        drive.connect()
        return drive

    def enabled(self, **settings):
        drive = self.drive(**settings)
        drive.configure()
        drive.enable()
        return drive

    def run(self, drive, velocity_rad_s, for_s, tick_s=TICK_S):
        """Run a loop; return the sample and what was sent last."""
        end_s = time.monotonic() + for_s
        while True:
            sample = drive.read()
            sent = drive.write(velocity_rad_s)
            if time.monotonic() > end_s:
                return sample, sent
            time.sleep(tick_s)

    def cause(self, drive, velocity_rad_s=0.0, for_s=0.5):
        """Run a loop until a cause is named; return it."""
        end_s = time.monotonic() + for_s
        while time.monotonic() < end_s:
            sample = drive.read()
            if sample.cause:
                return Cause(sample.cause)
            drive.write(velocity_rad_s)
            time.sleep(TICK_S)
        return Cause.NONE

    def close(self):
        for drive in self.drives:
            drive.close()
        self.emulator.close()


@pytest.fixture
def wire():
    made = Wire()
    yield made
    made.close()
