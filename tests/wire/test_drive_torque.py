"""The drive's own torque, from the object 0x6077 to a reading, and what is without it."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from tests.wire.cia402_wire import SLACK, run_loop
from tests.wire.durand_axis import DurandAxis

from rigidimeter.core.settings import DriveSideSettings
from rigidimeter.model import JointDynamics
from rigidimeter.rig.devices import Cia402Drive, Cia402Settings
from rigidimeter.rig.guard import Cause
from rigidimeter.testing import Cia402Emulator, EmulatedArm

SIDE = DriveSideSettings(friction_nm=0.0, torque_scale=1.0)
_channels = itertools.count()


@contextmanager
def driven(side: DriveSideSettings = SIDE, peer: Any = Cia402Emulator, **settings: Any) -> Iterator:
    """Yield arm, emulator, driver and the facts of a drive that is enabled."""
    channel = f"torque-{next(_channels)}"
    arm = EmulatedArm(JointDynamics(0.08, 0.5, 10.0), drive_side=side)
    emulator = peer(arm, interface="virtual", channel=channel)
    values = {"interface": "virtual", "channel": channel, **SLACK, **settings}
    drive = Cia402Drive(Cia402Settings(**values), time.monotonic)
    try:
        drive.connect()
        facts = drive.configure()
        drive.enable()
        yield arm, emulator, drive, facts
    finally:
        drive.close()
        emulator.close()


@pytest.mark.parametrize("sign", [1, -1])
def test_a_load_at_rest_is_read_at_the_joint_with_its_sign(sign):
    with driven(sign=sign) as (arm, _, drive, facts):
        arm.voluntary_nm = lambda _: -sign * 2.0  # the drive holds against it
        sample = run_loop(drive, for_s=0.2, until=lambda s: abs(s.drive_torque_nm) > 1.9)
        assert sample.drive_torque_nm == pytest.approx(2.0, abs=0.011)
        assert facts.values["rated_torque_nm"] == pytest.approx(10.0)
        assert sample.cause == Cause.NONE


def test_in_motion_it_has_the_friction_and_the_scale_of_the_drive():
    side = SIDE.model_copy(update={"friction_nm": 3.0, "friction_ripple_percent": 0.0})
    with driven(side.model_copy(update={"torque_scale": 0.8})) as (arm, _, drive, _):
        arm.joint = JointDynamics(0.08, 0.0, 0.0)
        sample = run_loop(drive, 0.3, for_s=0.3)
        assert sample.drive_torque_nm == pytest.approx(3.0 / 0.8, abs=0.02)


def test_a_torque_that_is_frozen_is_passed_on():
    with driven() as (arm, emulator, drive, _):
        arm.voluntary_nm = lambda _: -2.0
        held = run_loop(drive, for_s=0.1).drive_torque_nm
        emulator.misbehave("torque frozen")
        arm.voluntary_nm = lambda _: 3.0
        assert run_loop(drive, for_s=0.1).drive_torque_nm == held
        emulator.behave()
        assert run_loop(drive, for_s=0.1).drive_torque_nm == pytest.approx(-3.0, abs=0.011)


def test_it_is_zero_without_power():
    with driven() as (arm, _, drive, _):
        arm.voluntary_nm = lambda _: -2.0
        run_loop(drive, for_s=0.1)
        drive.disable()
        sample = run_loop(drive, for_s=0.5, until=lambda s: s.drive_torque_nm == 0.0)
        assert sample.drive_torque_nm == 0.0


class SmallFrames(Cia402Emulator):
    """Takes one entry in its second measurement frame: more are refused as CiA 301 has it."""

    entry_refused = 0x06040042

    def _on_write(self, index: int, subindex: int, data: bytes, **more: Any) -> None:
        if index == 0x1A01 and subindex > 1:
            raise self._abort(self.entry_refused)
        if index == 0x1A01 and subindex == 0 and data[0] > 1:
            raise self._abort(0x06040042)
        super()._on_write(index, subindex, data, **more)


class NoSecondEntry(SmallFrames):
    """Has no second entry to write."""

    entry_refused = 0x06090011


MUTE = SIDE.model_copy(update={"reports_torque": False})


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"side": MUTE}, "the drive has no 0x6076"),
        ({"peer": SmallFrames}, "not taken into the velocity frame"),
        ({"peer": NoSecondEntry}, "not taken into the velocity frame"),
        ({"peer": DurandAxis}, "the drive has no 0x6076"),
        ({"reads_torque": False}, "reads_torque is false"),
    ],
)
def test_a_drive_without_it_works_and_the_facts_say_so(how, said):
    with driven(**how) as (_, _, drive, facts):
        sample = run_loop(drive, 0.2, for_s=0.3)
        assert sample.cause == Cause.NONE
        assert sample.velocity_rad_s == pytest.approx(0.2, abs=0.02)
        assert math.isnan(sample.drive_torque_nm)
        assert said in facts.values["drive's torque"]
        assert "rated_torque_nm" not in facts.values


def test_a_frame_without_the_torque_that_was_mapped_is_damaged():
    with driven() as (_, emulator, drive, _):
        run_loop(drive, for_s=0.1)
        before = drive.counts["damaged"]
        emulator._node.data_store[0x1A01][0] = bytes([1])  # someone else changed the mapping
        sample = run_loop(drive, for_s=2.0)
        assert drive.counts["damaged"] > before
        assert sample.cause == Cause.DRIVE_LOST
