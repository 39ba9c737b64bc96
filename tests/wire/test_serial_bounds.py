"""Bounds of a serial drive: written in its registers, obeyed, asleep, or not there."""

from __future__ import annotations

import math
import time

import pytest

from rigidimeter.model import JointDynamics
from rigidimeter.rig.devices import (
    BOUND_FACT,
    LOST,
    MOTOR_SPEED,
    POSITION,
    SLIPPAGE,
    SPEED,
    TORQUE,
    AsciiDrive,
    DriveBounds,
    Tight,
)
from rigidimeter.testing import AsciiEmulator, EmulatedArm

pytest.importorskip("serial")

BOUNDS = DriveBounds(math.radians(40.0), math.radians(2.0), 0.08, 20.0, 0.0045)
DRIVE = {
    "counts_per_turn": 360_000.0,
    "lost_s": 0.3,
    "horizon_s": 0.3,
    "torque_nm_per_a": 1.0,
    "reflected_inertia_kg_m2": 0.05,
    "friction_nm": 0.3,
}
REGISTERS = {TORQUE: 0x21, POSITION: 0xB8, SPEED: 0x3A}
SPEED_RAD_S, FOR_S = 0.3, 0.8
WAY = SPEED_RAD_S * FOR_S


@pytest.fixture
def emulator():
    made = AsciiEmulator(EmulatedArm(JointDynamics(0.08, 0.5, 10.0)))
    try:
        yield made
    finally:
        made.close()


@pytest.fixture
def bounded(emulator):
    drives = []

    def make(tight=None, **settings):
        values = {"port": emulator.port, **DRIVE, **settings}
        drive = AsciiDrive(AsciiDrive.Settings(**values), time.monotonic)
        drives.append(drive)
        drive.bound(BOUNDS)
        drive.tighten(tight)
        drive.connect()
        return drive, drive.configure()

    yield make
    for drive in drives:
        drive.close()


def moved(emulator, drive):
    """Return how far the joint went, and its mean speed."""
    drive.enable()
    start, began_s = emulator.state()["angle_rad"], time.monotonic()
    while time.monotonic() < began_s + FOR_S:
        drive.read()
        drive.write(SPEED_RAD_S)
        time.sleep(0.02)
    way = abs(emulator.state()["angle_rad"] - start)
    return way, way / (time.monotonic() - began_s)


@pytest.mark.parametrize(("sign", "ends"), [(1, (42_000, -42_000)), (-1, (42_000, -42_000))])
def test_bounds_are_in_the_registers_and_among_the_facts(emulator, bounded, sign, ends):
    """1.25 ((0.05 + 0.08) a + 0.3 + 20) N·m, a = 7000 deg/s², of 1 N·m/A; 1000 counts a degree."""
    drive, facts = bounded(sign=sign)
    registers = emulator._registers
    torque_nm = 1.25 * (0.13 * math.radians(7000.0) + 20.3)
    assert registers[0x21] == math.ceil(100.0 * torque_nm)
    assert (registers[0xB8], registers[0xB9]) == ends
    assert registers[0x3A] == 900_000  # 90 deg/s
    assert {k for k in facts.values if k.startswith(BOUND_FACT)} == {
        f"{BOUND_FACT} {name}" for name in LOST
    }
    unbounded = {found.name for found in drive.bounds if not found.where}
    assert unbounded == {MOTOR_SPEED, SLIPPAGE}


def test_an_offset_and_a_sign_move_the_ends(emulator, bounded):
    """The joint stands at 10 deg of its scale where the drive counts 0."""
    drive, _ = bounded(sign=-1, angle_offset_deg=10.0)
    assert "-32 to 52 deg" in drive.bounds[1].words
    assert (emulator._registers[0xB8], emulator._registers[0xB9]) == (42_000, -42_000)


@pytest.mark.parametrize("name", list(REGISTERS))
@pytest.mark.parametrize("asleep", [False, True])
def test_a_tight_bound_ends_a_slow_move_unless_it_sleeps(emulator, bounded, name, asleep):
    if asleep:
        emulator.misbehave("bound_sleeps", REGISTERS[name])
    drive, _ = bounded(Tight(name, WAY, SPEED_RAD_S))
    way, mean_rad_s = moved(emulator, drive)
    if asleep:
        assert mean_rad_s > 0.6 * SPEED_RAD_S
    elif name == SPEED:
        assert mean_rad_s < 0.55 * SPEED_RAD_S
    else:
        assert way < 0.6 * WAY


@pytest.mark.parametrize("register", [0x21, 0x3A, 0xB9])
def test_a_register_that_is_not_there_is_told_and_no_error(emulator, bounded, register):
    emulator.misbehave("no_register", register)
    drive, _ = bounded()
    (lacking,) = [b for b in drive.bounds if f"0x{register:02x} was refused" in b.words]
    assert (lacking.where, lacking.lost) == ("", LOST[lacking.name])


def test_without_the_torque_of_an_ampere_the_torque_is_not_bounded(emulator, bounded):
    drive, _ = bounded(torque_nm_per_a=0.0)
    assert drive.bounds[0].words == "the rig file does not name torque_nm_per_a"
    assert emulator._registers[0x21] == 2**31 - 1
