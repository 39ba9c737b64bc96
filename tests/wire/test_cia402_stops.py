"""A servo that stops, faults or restarts: it moves again only after it is enabled again."""

from __future__ import annotations

import time

import can
import pytest
from tests.wire.cia402_wire import SLACK, run_loop, wait_until, wire

from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause

__all__ = ["wire"]


def test_a_quick_stop_follows_the_ramp_and_stays(wire, lateness):
    drive = wire.ready(quick_stop_rad_s2=5.0)
    run_loop(drive, 2.0, for_s=0.5)
    began_s = time.monotonic()
    drive.stop()
    drive.stop()
    assert wait_until(lambda: wire.emulator.state()["stop_rest_s"] > began_s)
    stop = wire.emulator.state()
    late_s = lateness.worst_s(began_s)
    assert stop["stop_rest_s"] - stop["stop_began_s"] == pytest.approx(0.4, abs=0.05 + late_s)
    assert drive.write(1.0) == 0.0
    run_loop(drive, 1.0, for_s=0.2, until=lambda _: False)
    assert abs(wire.emulator.state()["velocity_rad_s"]) < 0.01
    assert not wire.emulator.state()["power"]  # option 2: without power once at rest


def test_a_quick_stop_that_keeps_the_power_holds_until_it_is_taken_away(wire):
    drive = wire.ready(quick_stop_option=6)
    run_loop(drive, 1.0, for_s=0.2)
    drive.stop()
    assert run_loop(drive, 1.0, for_s=0.3).cause == Cause.NONE
    assert wire.emulator.state()["state"] == "QUICK_STOP_ACTIVE"
    assert drive.powered
    drive.disable()
    assert drive.powered  # it has not said otherwise
    drive.stop()  # does not give the power back
    assert wait_until(lambda: wire.emulator.state()["state"] == "SWITCH_ON_DISABLED")
    assert run_loop(drive, 1.0, for_s=0.2).cause == Cause.NONE
    assert not drive.powered


def test_a_drive_that_ignores_its_quick_stop_is_named_and_loses_its_power(wire):
    drive = wire.ready()
    run_loop(drive, 1.0, for_s=0.2)
    wire.emulator.misbehave("ignores quick stop")
    drive.stop()
    assert Cause(run_loop(drive, 1.0).cause) is Cause.DRIVE_STATE
    drive.disable()
    assert wait_until(lambda: not wire.emulator.state()["power"])


def test_a_fault_is_reset_by_hand_only_and_gives_no_power(wire):
    drive = wire.ready(enable_timeout_s=0.3)
    wire.emulator.misbehave("fault", 0x2310)
    run_loop(drive)
    assert wait_until(lambda: wire.emulator.state()["state"] == "FAULT")
    with pytest.raises(DeviceError, match="fault, emergency code 0x2310"):
        drive.enable()
    with pytest.raises(DeviceError, match="in fault still"):
        drive.reset_fault()
    time.sleep(0.2)  # a busy machine may still have the last attempt in its queue
    wire.emulator.behave()
    with pytest.raises(DeviceError, match="reset by hand"):
        drive.enable()
    drive.reset_fault()
    assert wire.emulator.state()["state"] == "SWITCH_ON_DISABLED"
    drive.enable()
    assert run_loop(drive, 0.5, for_s=0.2).cause == Cause.NONE


def test_a_drive_that_restarted_must_be_configured_again(wire):
    drive = wire.drive()
    drive.configure()
    wire.emulator.misbehave("reboot")
    with pytest.raises(DeviceError, match=r"reads back|restarted since"):
        drive.enable()
    assert not wire.emulator.state()["power"]
    drive.configure()
    drive.enable()
    assert run_loop(drive, 0.5, for_s=0.2).cause == Cause.NONE


def test_a_restart_is_enough_even_if_the_settings_outlive_it(wire):
    drive = wire.drive()
    drive.configure()
    other = can.Bus(interface="virtual", channel=wire.channel)
    try:
        other.send(can.Message(arbitration_id=0x701, data=[0], is_extended_id=False))
        with pytest.raises(DeviceError, match="restarted since"):
            drive.enable()
        assert not wire.emulator.state()["power"]
    finally:
        other.shutdown()


def test_power_that_was_taken_away_is_not_asked_for_again(wire):
    drive = wire.ready()
    run_loop(drive, 0.5, for_s=0.1)
    drive.disable()
    drive.stop()
    wire.emulator.misbehave("emergency")
    assert Cause(run_loop(drive, 0.5).cause) is Cause.DRIVE_FAULT
    listener = can.Bus(interface="virtual", channel=wire.channel)
    try:
        run_loop(drive, 0.5, for_s=0.05, until=lambda _: False)
        heard = iter(lambda: listener.recv(0), None)
        commands = [bytes(m.data) for m in heard if m.arbitration_id == 0x201]
        assert len(commands) > 3
        assert set(commands) == {bytes(6)}
    finally:
        listener.shutdown()


def test_a_drive_left_running_by_a_killed_program_does_not_move_on_enable(wire):
    first = wire.ready(drive_watchdog_s=5.0, command_deadline_s=0.0)
    run_loop(first, 1.0, for_s=0.2)
    assert wire.emulator.state()["power"]  # and nobody writes any more
    second = wire.drive()
    second.configure()
    assert wait_until(lambda: not wire.emulator.state()["power"])
    time.sleep(0.1)
    at_rad = wire.emulator.state()["angle_rad"]
    second.enable()
    run_loop(second, 0.0, for_s=0.2)
    assert wire.emulator.state()["power"]
    assert wire.emulator.state()["angle_rad"] == pytest.approx(at_rad, abs=1e-4)


@pytest.mark.parametrize(
    ("deadline_s", "reason"), [(0.15, "command deadline passed"), (0.0, "heartbeat lost")]
)
def test_a_loop_that_hangs_leaves_the_drive_to_stop_itself(wire, lateness, deadline_s, reason):
    drive = wire.ready(command_deadline_s=deadline_s)
    run_loop(drive, 1.0, for_s=0.3)
    hung_s = time.monotonic()
    assert wait_until(lambda: not wire.emulator.state()["power"])
    stop = wire.emulator.state()
    assert stop["stop_reason"] == reason
    within_s = deadline_s or SLACK["drive_watchdog_s"]
    assert stop["stop_began_s"] - hung_s < within_s + 0.05 + lateness.worst_s(hung_s)
    print(f"\n{reason}: braking {stop['stop_began_s'] - hung_s:.3f} s after the last command")
    # A loop that comes back learns it, and does not bring the drive back.
    sample = run_loop(drive, 1.0)
    assert Cause(sample.cause) is Cause.DRIVE_FAULT
    run_loop(drive, 1.0, for_s=0.2, until=lambda _: False)
    assert not wire.emulator.state()["power"]


@pytest.mark.parametrize("hears_it", [True, False])
def test_a_loop_that_wakes_up_does_not_cancel_the_drives_own_stop(wire, hears_it):
    drive = wire.ready(quick_stop_rad_s2=5.0)
    run_loop(drive, 2.0, for_s=0.3)
    assert wait_until(lambda: wire.emulator.state()["state"] == "QUICK_STOP_ACTIVE")
    assert wire.emulator.state()["velocity_rad_s"] > 1.0
    if hears_it:
        assert Cause(drive.read().cause) is Cause.DRIVE_FAULT
    assert drive.write(2.0) == 0.0
    assert run_loop(drive, 2.0, for_s=0.3).cause != Cause.NONE
    assert wait_until(lambda: not wire.emulator.state()["power"])
    enabled = [event for _, event in wire.emulator.log if "-> OPERATION_ENABLED" in event]
    assert len(enabled) == 1
