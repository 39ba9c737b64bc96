"""Every driver that comes along, through the checks that any driver must pass."""

from __future__ import annotations

import math
import runpy
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.wire.cia402_wire import GROUP, free_port
from tests.wire.durand_axis import DurandAxis

from rigidimeter.model import JointDynamics
from rigidimeter.rig.devices import AsciiDrive, AtiAnalogue, AtiRdt, Cia402Drive
from rigidimeter.testing import (
    DRIVE_CHECKS,
    SENSOR_CHECKS,
    AsciiEmulator,
    Cia402Emulator,
    ConformanceError,
    DriveFixture,
    EmulatedArm,
    OtherEnd,
    RdtEmulator,
    SensorFixture,
    sensor_samples_flow,
)

JOINT = JointDynamics(0.08, 0.5, 2.0)
CHANNEL = count()
SKELETONS = Path(__file__).parents[2] / "examples" / "drivers"


class FakeReader:
    """Six noisy voltages a millisecond, until it is told to be silent."""

    def __init__(self) -> None:
        self.silent = False
        self._rng = np.random.default_rng(1)
        self._taken_s = time.monotonic()

    def start(self) -> str:
        self._taken_s = time.monotonic()
        return "fake"

    def read(self) -> np.ndarray:
        ready = 0 if self.silent else int((time.monotonic() - self._taken_s) * 1000.0)
        self._taken_s += ready / 1000.0
        return 0.01 * self._rng.standard_normal((ready, 6))

    def stop(self) -> None:
        self.silent = True


@contextmanager
def analogue() -> Iterator[SensorFixture]:
    reader = FakeReader()
    table = Path(__file__).with_name("ati_identity.toml")
    settings = AtiAnalogue.Settings(channels="Dev1/ai0:5", calibration=str(table))

    def make() -> AtiAnalogue:
        reader.silent = False
        return AtiAnalogue(settings, time.monotonic, reader)

    yield SensorFixture(make, time.monotonic, lambda: setattr(reader, "silent", True))


@contextmanager
def rdt() -> Iterator[SensorFixture]:
    with RdtEmulator(EmulatedArm(JOINT)) as emulator:
        settings = AtiRdt.Settings(
            address=emulator.address,
            port=emulator.port,
            http_port=emulator.http_port,
            timeout_s=0.5,
        )
        yield SensorFixture(
            lambda: AtiRdt(settings, time.monotonic),
            time.monotonic,
            lambda: emulator.misbehave("silent"),
        )


@contextmanager
def ascii_fixture(mode: str, **more: float) -> Iterator[DriveFixture]:
    arm = EmulatedArm(JOINT)
    emulator = AsciiEmulator(arm)
    settings = AsciiDrive.Settings(
        port=emulator.port,
        counts_per_turn=360_000.0,
        mode=mode,
        external_watchdog=mode == "velocity",
        lost_s=0.15,
        horizon_s=0.2,  # the cycle is measured on a machine that is shared
        **more,
    )
    try:
        yield DriveFixture(
            lambda: AsciiDrive(settings, time.monotonic),
            time.monotonic,
            lambda: emulator.misbehave("silent"),
            OtherEnd(lambda: bool(emulator.state()["power"]), lambda: arm.motion()[1]),
            settle_s=0.3,
        )
    finally:
        emulator.close()


@contextmanager
def cia402() -> Iterator[DriveFixture]:
    arm = EmulatedArm(JOINT)
    channel = f"conformance {next(CHANNEL)}"
    emulator = Cia402Emulator(arm, interface="virtual", channel=channel)
    settings = Cia402Drive.Settings(
        interface="virtual",
        channel=channel,
        # A busy machine may hold a thread up for longer than a real loop ever is.
        heartbeat_s=0.02,
        drive_watchdog_s=0.3,
        command_deadline_s=0.15,
        lost_s=0.12,
        max_velocity_rad_s=3.0,
    )
    try:
        yield DriveFixture(
            lambda: Cia402Drive(settings, time.monotonic),
            time.monotonic,
            lambda: emulator.misbehave("die"),
            OtherEnd(lambda: bool(emulator.state()["power"]), lambda: arm.motion()[1]),
            tick_s=0.005,
            settle_s=0.3,
        )
    finally:
        emulator.close()


@contextmanager
def cia402_on_another_stack() -> Iterator[DriveFixture]:
    arm = EmulatedArm(JOINT)
    where = {"interface": "udp_multicast", "channel": GROUP, "port": free_port()}
    node = DurandAxis(arm, **where)
    settings = Cia402Drive.Settings(
        drive_watchdog_s=0.3, lost_s=0.12, max_velocity_rad_s=3.0, **where
    )
    try:
        yield DriveFixture(
            lambda: Cia402Drive(settings, time.monotonic),
            time.monotonic,
            node.die,
            OtherEnd(lambda: bool(node.state()["power"]), lambda: arm.motion()[1]),
            tick_s=0.005,
            settle_s=0.3,
        )
    finally:
        node.close()


@contextmanager
def skeleton(name: str) -> Iterator[Any]:
    """The example that people copy."""
    yield runpy.run_path(str(SKELETONS / f"{name}_skeleton.py"))["fixture"]()


SENSORS = {
    "ati-analogue": analogue,
    "ati-rdt": rdt,
    "skeleton": lambda: skeleton("sensor"),
}
DRIVES = {
    "ascii-moves": lambda: ascii_fixture("moves"),
    "ascii-velocity": lambda: ascii_fixture("velocity"),
    "ascii-torque": lambda: ascii_fixture("moves", torque_nm_per_a=1.0),
    "cia402": cia402,
    "cia402-durand": cia402_on_another_stack,
    "skeleton": lambda: skeleton("drive"),
}


@pytest.mark.parametrize("check", SENSOR_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("fixture", SENSORS.values(), ids=SENSORS.keys())
def test_sensor(
    fixture: Callable[[], AbstractContextManager[SensorFixture]],
    check: Callable[[SensorFixture], None],
) -> None:
    with fixture() as made:
        check(made)


@pytest.mark.parametrize("check", DRIVE_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("fixture", DRIVES.values(), ids=DRIVES.keys())
def test_drive(
    fixture: Callable[[], AbstractContextManager[DriveFixture]],
    check: Callable[[DriveFixture], None],
) -> None:
    with fixture() as made:
        check(made)


def test_a_sensor_that_its_driver_calls_frozen_a_little_later_does_not_pass() -> None:
    """The same six counts again and again: `AtiRdt` says so after `frozen_s`, 50 ms."""
    settings = {"address": "127.0.0.1", "timeout_s": 0.5}
    with RdtEmulator(EmulatedArm(JOINT)) as emulator:
        emulator.misbehave("frozen_values")
        ports = {"port": emulator.port, "http_port": emulator.http_port}
        fixture = SensorFixture(
            lambda: AtiRdt(AtiRdt.Settings(**settings, **ports), time.monotonic), time.monotonic
        )
        with pytest.raises(ConformanceError, match="a good sample has no cause; TORQUE_FROZEN"):
            sensor_samples_flow(fixture)


@pytest.mark.parametrize(
    ("torque_nm", "said"),
    [(math.nan, "is a number in N·m at the joint"), (1e3, "at most 33 times rated_torque_nm = 10")],
)
def test_a_drive_that_promises_a_torque_and_has_none_does_not_pass(torque_nm, said) -> None:
    check = next(check for check in DRIVE_CHECKS if "torque" in check.__name__)
    with cia402() as made, pytest.raises(ConformanceError, match=said):
        check(replace(made, make=lambda: Spoiled(made.make(), torque_nm)))


class Spoiled:
    """A drive with another torque in its samples."""

    def __init__(self, drive: Any, torque_nm: float) -> None:
        self._drive, self._torque_nm = drive, torque_nm

    def __getattr__(self, name: str) -> Any:
        return getattr(self._drive, name)

    def read(self) -> Any:
        return self._drive.read()._replace(drive_torque_nm=self._torque_nm)
