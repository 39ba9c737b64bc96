"""Bounds in an emulated drive: written, obeyed, asleep, absent; and a hand-held stop."""

from __future__ import annotations

import math
import time

import pytest
from tests.wire.cia402_wire import Wire, run_loop, wire

from rigidimeter.model import JointDynamics
from rigidimeter.rig.devices import (
    BOUND_FACT,
    MOTOR_SPEED,
    POSITION,
    SLIPPAGE,
    SPEED,
    TORQUE,
    DriveBounds,
    Tight,
)
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause

pytest.importorskip("canopen")

__all__ = ["wire"]

BOUNDS = DriveBounds(math.radians(40.0), math.radians(2.0), 0.08, 20.0, 0.0045)
INERTIA = {"reflected_inertia_kg_m2": 0.05, "friction_nm": 0.3}
SPEED_RAD_S = 0.3
OBJECTS = {TORQUE: 0x6072, POSITION: 0x607D, SPEED: 0x607F, MOTOR_SPEED: 0x6080, SLIPPAGE: 0x60F8}


def bounded(wire, tight=None, **settings):
    drive = wire.drive(**{**INERTIA, **settings})
    drive.bound(BOUNDS)
    drive.tighten(tight)
    facts = drive.configure()
    drive.enable()
    return drive, facts


def test_bounds_are_written_read_back_and_among_the_facts(wire):
    drive, facts = bounded(wire)
    value = wire.emulator.value
    # 1.25 ((0.05 + 0.08) 120 + 0.3 + 20) N·m of 10 N·m that the emulated motor is rated for
    assert value(0x6072) == 4488
    assert [value(0x607D, k) for k in (1, 2)] == [-95574, 95574]  # 42 deg of 819200 counts
    assert value(0x6080) == math.ceil(1.25 * 3.0 * 100 * 60 / (2 * math.pi))
    assert [found.name for found in drive.bounds if not found.where] == []
    named = {k: v for k, v in facts.values.items() if k.startswith(BOUND_FACT)}
    assert {f"{BOUND_FACT} {name}" for name in OBJECTS} < set(named)
    assert named[f"{BOUND_FACT} max torque (0x6072:00)"] == 4488
    assert "44.88 N·m" in named[f"{BOUND_FACT} torque"]
    assert "-42 to 42 deg" in named[f"{BOUND_FACT} position"]


def test_the_position_is_bounded_about_where_the_joint_stands_when_it_is_enabled(wire):
    drive = wire.drive(**INERTIA)
    drive.bound(BOUNDS)
    drive.configure()
    wire.emulator._arm.place(math.radians(10.0))
    drive.enable()
    ends = [wire.emulator.value(0x607D, k) * 360 / 819_200 for k in (1, 2)]
    assert ends == pytest.approx([-32.0, 52.0], abs=0.01)


def test_a_drive_that_keeps_another_bound_is_not_enabled(wire):
    drive = wire.drive(**INERTIA)
    drive.bound(BOUNDS)
    drive.configure()
    wire.emulator.misbehave("wrong bound", 500)
    with pytest.raises(DeviceError, match=r"max torque \(0x6072:00\) reads back as 500"):
        drive.enable()


def moved(wire, drive, for_s=0.4):
    """Command a slow motion; return how far it went, its greatest speed, and the last sample."""
    start = wire.emulator.state()["angle_rad"]
    fastest = 0.0

    def watched(sample):
        nonlocal fastest
        fastest = max(fastest, abs(sample.velocity_rad_s))
        return bool(sample.cause)

    sample = run_loop(drive, SPEED_RAD_S, for_s=for_s, until=watched)
    return wire.emulator.state()["angle_rad"] - start, fastest, sample


WAY = SPEED_RAD_S * 0.4
"""Of the motion, but for its ramps."""


def tight(name):
    return Tight(name, reach_rad=WAY, speed_rad_s=SPEED_RAD_S)


@pytest.mark.parametrize("name", list(OBJECTS))
def test_a_slow_move_hits_a_tightened_bound(wire, name):
    drive, _ = bounded(wire, tight(name))
    way, fastest, sample = moved(wire, drive)
    if name in (SPEED, MOTOR_SPEED):
        assert fastest == pytest.approx(0.5 * SPEED_RAD_S, rel=0.1)
    elif name == POSITION:
        assert way == pytest.approx(0.5 * WAY, rel=0.05)
    else:
        assert way < 0.1 * WAY
    assert Cause(sample.cause) is (Cause.DRIVE_FAULT if name == SLIPPAGE else Cause.NONE)
    # The next time it is as the settings say.
    drive.tighten(None)
    drive.disable()
    drive.reset_fault()
    drive.enable()
    assert moved(wire, drive)[0] > 0.7 * WAY


@pytest.mark.parametrize("name", list(OBJECTS))
def test_a_bound_that_sleeps_reads_back_and_ends_nothing(wire, name):
    wire.emulator.misbehave("bound sleeps", OBJECTS[name])
    drive, _ = bounded(wire, tight(name))
    assert next(found for found in drive.bounds if found.name == name).where
    way, fastest, sample = moved(wire, drive)
    assert Cause(sample.cause) is Cause.NONE
    assert way > 0.8 * WAY
    assert fastest > 0.9 * SPEED_RAD_S


def stopped_after_s(wire, bounds, **inertia):
    """Return how long a quick stop from 2 rad/s takes with these bounds."""
    drive = wire.drive(**{**INERTIA, **inertia}, quick_stop_rad_s2=60.0)
    drive.bound(bounds)
    drive.configure()
    drive.enable()
    run_loop(drive, 2.0, for_s=1.0, until=lambda s: s.velocity_rad_s > 1.9)
    drive.stop()
    run_loop(drive, for_s=1.5, until=lambda _: not math.isnan(wire.emulator.state()["stop_rest_s"]))
    state = wire.emulator.state()
    return state["stop_rest_s"] - state["stop_began_s"]


def test_a_quick_stop_keeps_to_its_ramp_below_the_bound_of_the_torque(wire):
    """2 rad/s at 60 rad/s² take 33 ms, and a drive of 50 Hz some ms more to be at rest.

    (0.05 + 0.08) 60 + 0.3 = 8.1 N·m of the drive and the arm; the bound is 1.25 (8.1 + 20).
    """
    took_s = stopped_after_s(wire, BOUNDS)
    print(f"\nwith the bound of the settings: at rest after {1e3 * took_s:.0f} ms")
    assert took_s < 2.0 / 60.0 + 0.03


def test_a_bound_for_a_lighter_drive_makes_the_quick_stop_longer(wire):
    """0.9 · 1.25 · 0.01 · 120 = 1.35 N·m and 0.3 of friction brake 0.13 kg·m² by 12.7 rad/s².

    So 1.9 rad/s take 0.15 s. The slippage is let go, which would name it first.
    """
    bounds = BOUNDS._replace(arm_inertia_kg_m2=0.0, stop_torque_nm=0.0)
    wire.emulator._arm.joint = JointDynamics(0.08, 0.0, 0.0)
    wire.emulator.misbehave("bound sleeps", 0x60F8)
    took_s = stopped_after_s(wire, bounds, reflected_inertia_kg_m2=0.01, friction_nm=0.0)
    print(f"\nwith the bound of a lighter drive: at rest after {1e3 * took_s:.0f} ms")
    assert took_s == pytest.approx(1.9 * 0.13 / 1.65, abs=0.03)


@pytest.fixture
def bare():
    """A drive without the optional bounds."""
    made = Wire(without=(0x6072, 0x6073, 0x607D, 0x607F, 0x6080, 0x60F8))
    try:
        yield made
    finally:
        made.close()


def test_a_drive_without_the_objects_says_what_is_lost(bare):
    drive, facts = bounded(bare)
    assert [found.where for found in drive.bounds] == [""] * 5
    words = facts.values[f"{BOUND_FACT} torque"]
    assert words == "the drive has no 0x6072 or 0x6073"
    assert all(found.lost for found in drive.bounds)
    assert moved(bare, drive)[0] > 0.7 * WAY


def test_the_bound_of_the_current_stands_in_for_that_of_the_torque():
    made = Wire(without=(0x6072,))
    try:
        drive, _ = bounded(made, tight(TORQUE))
        assert drive.bounds[0].where == "0x6073"
        assert moved(made, drive)[0] < 0.1 * WAY
    finally:
        made.close()


def test_without_bounds_nothing_of_them_is_written(wire):
    wire.ready()
    assert wire.emulator.value(0x6072) == 0xFFFF
    assert wire.emulator.value(0x607D, 2) == 0


BUTTON = {"button_bit": 0}


def test_a_pressed_button_is_an_emergency_stop_and_its_release_starts_nothing(wire):
    drive = wire.ready(**BUTTON)
    assert run_loop(drive, 0.3, for_s=0.2).cause == Cause.NONE
    wire.emulator.inputs = 0  # a contact that opened, or a wire that broke
    pressed_s = time.monotonic()
    sample = run_loop(drive, 0.3)
    assert Cause(sample.cause) is Cause.EMERGENCY_STOP
    print(f"\nnamed after {1e3 * (time.monotonic() - pressed_s):.1f} ms")
    drive.disable()
    wire.emulator.inputs = 1
    sample = run_loop(drive, 0.3, for_s=0.2, until=lambda _: False)
    assert Cause(sample.cause) is Cause.EMERGENCY_STOP
    assert not wire.emulator.state()["power"]
    assert abs(wire.emulator.state()["velocity_rad_s"]) < 0.01
    drive.enable()
    assert run_loop(drive, 0.3, for_s=0.1).cause == Cause.NONE


def test_a_button_counts_over_a_cause_that_leaves_the_power_on(wire):
    drive = wire.ready(**BUTTON)
    wire.emulator.misbehave("emergency")
    assert run_loop(drive, 0.3).cause == Cause.DRIVE_FAULT
    wire.emulator.inputs = 0
    sample = run_loop(drive, 0.0, until=lambda s: s.cause == Cause.EMERGENCY_STOP)
    assert Cause(sample.cause) is Cause.EMERGENCY_STOP


def test_a_button_that_is_pressed_or_has_the_other_polarity_lets_nothing_start(wire):
    drive = wire.drive(**BUTTON, button_pressed_level=1)
    drive.configure()
    with pytest.raises(DeviceError, match=r"hand-held stop .bit 0 of 0x60FD. is pressed"):
        drive.enable()
    assert not wire.emulator.state()["power"]


def test_a_button_whose_frame_stays_away_is_no_button(wire):
    drive = wire.ready(**BUTTON)
    run_loop(drive, 0.3, for_s=0.1)
    wire.emulator.misbehave("stop inputs")
    assert Cause(run_loop(drive, 0.3).cause) is Cause.DRIVE_LOST


def test_a_drive_without_inputs_takes_no_button():
    made = Wire(without=(0x60FD,))
    try:
        drive = made.drive(**BUTTON)
        with pytest.raises(DeviceError, match=r"digital inputs .0x60FD:00. cannot be read"):
            drive.configure()
    finally:
        made.close()


def test_without_a_button_its_frame_is_off(wire):
    drive = wire.ready()
    assert wire.emulator.value(0x1802, 1) >> 31
    wire.emulator.inputs = 0
    assert run_loop(drive, 0.3, for_s=0.2).cause == Cause.NONE
