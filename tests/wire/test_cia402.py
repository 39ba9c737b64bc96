"""The driver of CANopen servos against an emulated one: motion, causes, what is refused."""

from __future__ import annotations

import threading
import time

import can
import canopen
import pytest
from tests.wire.cia402_wire import SLACK, emulated_arm, run_loop, wait_until, wire

from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause
from rigidimeter.testing import CIA402_MISBEHAVIOURS, Cia402Emulator

__all__ = ["wire"]


def test_connecting_and_configuring_give_no_power(wire):
    drive = wire.drive()
    facts = drive.configure()
    run_loop(drive, 1.0, for_s=0.1)
    assert not wire.emulator.state()["power"]
    assert drive.write(1.0) == 0.0
    assert facts.model == "emulated servo"
    assert facts.serial == "1001"
    assert facts.watchdog_s == pytest.approx(SLACK["command_deadline_s"])
    assert facts.values["heartbeat watchdog (0x1016:01)"] == 127 << 16 | 400
    assert facts.values["firmware (0x100A)"] == "1.0"
    assert facts.values["unused frame (0x1401:01)"] == "absent"


def test_it_moves_as_told_and_reports_it(wire):
    drive = wire.ready()
    sample = run_loop(drive, 0.7, for_s=0.5)
    assert sample.cause == Cause.NONE
    sent = drive.write(0.7)
    assert sent == pytest.approx(0.7, abs=1e-5)
    assert sent != 0.7  # what the wire carries, not what was asked for
    assert sample.velocity_rad_s == pytest.approx(0.7, abs=0.01)
    truth = wire.emulator.state()
    assert abs(sample.angle_rad - truth["angle_rad"]) < 0.05
    assert truth["angle_rad"] == pytest.approx(0.35, abs=0.1)
    assert drive.counts["received"] > 50
    assert drive.counts["damaged"] == drive.counts["unsent"] == 0
    again = drive.read()
    run_loop(drive, 0.7, for_s=0.1)
    assert drive.read().time_s > again.time_s
    assert drive.read().sequence > again.sequence


def test_the_first_reading_after_enabling_is_a_true_one_and_all_of_it_works_twice(wire):
    wire.emulator._arm.place(0.25)
    drive = wire.ready()
    for _ in range(2):
        sample = drive.read()
        assert sample.cause == Cause.NONE
        assert sample.angle_rad == pytest.approx(0.25, abs=0.01)
        assert 0 <= time.monotonic() - sample.time_s < 0.1
        run_loop(drive, 0.0, for_s=0.1)
        drive.disable()
        drive.close()
        drive.close()
        drive.connect()
        drive.connect()
        drive.configure()
        drive.enable()


def test_a_drive_mounted_the_other_way_round_has_the_other_sign(wire):
    drive = wire.ready(sign=-1, zero_counts=1000)
    sample = run_loop(drive, 0.7, for_s=0.3)
    assert sample.velocity_rad_s == pytest.approx(0.7, abs=0.01)
    assert sample.raw[1] < 0
    assert wire.emulator.state()["velocity_rad_s"] == pytest.approx(-0.7, abs=0.01)
    assert sample.angle_rad == pytest.approx((sample.raw[0] - 1000) * -7.66990e-6, rel=1e-4)


def test_a_command_beyond_the_limit_or_not_finite_is_not_sent_as_it_is(wire):
    drive = wire.ready()
    assert drive.write(100.0) == pytest.approx(3.0, abs=1e-5)
    assert drive.write(-100.0) == pytest.approx(-3.0, abs=1e-5)
    assert drive.write(float("nan")) == 0.0


CAUSES = {
    "fault": Cause.DRIVE_FAULT,
    "emergency": Cause.DRIVE_FAULT,
    "reboot": Cause.DRIVE_FAULT,
    "leave operation": Cause.DRIVE_STATE,
    "fall to switched on": Cause.DRIVE_STATE,
    "change mode": Cause.DRIVE_STATE,
    "stop measurements": Cause.DRIVE_LOST,
    "stop heartbeat": Cause.DRIVE_LOST,
    "die": Cause.DRIVE_LOST,
}
REFUSED = {
    "refuse enable": "switched on",
    "stale target": "target velocity .* must be 0",
    "slow answers": "no answer about",
    "wrong watchdog": "heartbeat watchdog .* reads back as 0",
}
PASSED_ON = {
    *("does not follow", "runs away", "drifts"),
    *("encoder frozen", "encoder jump", "encoder sign", "velocity gain"),
}


BOUNDS, BUTTON = {"bound sleeps", "wrong bound"}, {"press button", "stop inputs"}


def test_every_misbehaviour_has_its_test():
    # Those of torque, bounds and button in files of their own.
    others = {"ignores quick stop", "short emergency", "torque frozen", *BOUNDS, *BUTTON}
    assert set(CIA402_MISBEHAVIOURS) == {*CAUSES, *REFUSED, *PASSED_ON, *others}


@pytest.mark.parametrize("name", CAUSES)
def test_what_the_drive_does_wrong_is_named(wire, name):
    drive = wire.ready()
    assert run_loop(drive, 0.5, for_s=0.1).cause == Cause.NONE
    wire.emulator.misbehave(name)
    sample = run_loop(drive, 0.5)
    assert Cause(sample.cause) is CAUSES[name]
    if name in ("stop measurements", "die"):
        # Told to stop by a driver that no longer knows, or by its own watchdog.
        run_loop(drive, 0.5, until=lambda _: abs(wire.emulator.state()["velocity_rad_s"]) < 0.01)
        assert abs(wire.emulator.state()["velocity_rad_s"]) < 0.01
    # The first cause stays, and nothing the driver sends brings the drive back.
    wire.emulator.behave()
    assert Cause(run_loop(drive, 0.5, for_s=0.2, until=lambda _: False).cause) is CAUSES[name]
    if name in ("fault", "reboot", "leave operation", "fall to switched on"):
        assert not wire.emulator.state()["power"]
        assert drive.write(0.5) == 0.0


def test_the_code_of_an_emergency_is_kept(wire):
    drive = wire.ready()
    wire.emulator.misbehave("emergency", 0x4310)
    sample = run_loop(drive)
    assert sample.status >> 16 == 0x4310
    assert drive.counts["emergencies"] == 1


@pytest.mark.parametrize(("length", "code"), [(0, 0x1000), (3, 0x4210), (7, 0x4210)])
def test_an_emergency_of_another_length_ends_the_run(wire, length, code):
    drive = wire.ready()
    wire.emulator.misbehave("short emergency", length)
    sample = run_loop(drive, 0.5)
    assert Cause(sample.cause) is Cause.DRIVE_FAULT
    assert sample.status >> 16 == code
    assert (drive.counts["emergencies"], drive.counts["damaged"]) == (1, 1)


@pytest.mark.parametrize("code", [0x8130, 0x8250])
def test_a_node_that_missed_our_frames_before_it_was_enabled_has_no_fault(wire, code):
    """A watchdog that ends with one session speaks while the next is being configured."""
    drive = wire.drive()
    drive.configure()
    wire.emulator.misbehave("emergency", code)
    assert run_loop(drive, for_s=0.1, until=lambda _: False).cause == Cause.NONE
    assert drive.counts["emergencies"] == 1
    drive.enable()
    assert run_loop(drive, for_s=0.1).cause == Cause.NONE
    wire.emulator.misbehave("emergency", code)
    assert run_loop(drive).cause == Cause.DRIVE_FAULT


@pytest.mark.parametrize("name", REFUSED)
def test_a_drive_that_is_not_as_it_should_be_is_not_enabled(wire, name):
    drive = wire.drive(sdo_timeout_s=0.1, enable_timeout_s=0.3)
    drive.configure()
    wire.emulator.misbehave(name)
    with pytest.raises(DeviceError, match=REFUSED[name]):
        drive.enable()
    assert not wire.emulator.state()["power"]
    assert wire.emulator.state()["angle_rad"] == 0.0
    assert drive.write(1.0) == 0.0
    if name != "refuse enable":
        with pytest.raises(DeviceError, match=REFUSED[name]):
            drive.configure()


@pytest.mark.parametrize("name", sorted(PASSED_ON))
def test_what_only_a_comparison_shows_is_passed_on_to_the_guard(wire, name):
    drive = wire.ready()
    before = run_loop(drive, 0.5, for_s=0.2)
    wire.emulator.misbehave(name)
    after = run_loop(drive, 0.5, for_s=0.2)
    assert after.cause == Cause.NONE
    truth = wire.emulator.state()
    if name == "does not follow":
        assert after.velocity_rad_s == pytest.approx(0.0, abs=0.01)
    elif name == "runs away":
        assert after.velocity_rad_s == pytest.approx(6.0, abs=0.1)
    elif name == "drifts":
        assert after.velocity_rad_s == pytest.approx(0.58, abs=0.01)
        assert run_loop(drive, 0.0, for_s=0.2).velocity_rad_s == pytest.approx(0.08, abs=0.01)
    elif name == "encoder frozen":
        assert after.angle_rad - before.angle_rad < truth["angle_rad"] - before.angle_rad - 0.05
        assert run_loop(drive, 0.5, for_s=0.05).raw == after.raw
    elif name == "velocity gain":
        assert after.velocity_rad_s == 0.0
        assert after.angle_rad - before.angle_rad == pytest.approx(0.1, abs=0.03)
    elif name == "encoder jump":
        assert after.angle_rad - truth["angle_rad"] == pytest.approx(1.0, abs=0.05)
    else:
        assert after.velocity_rad_s == pytest.approx(-0.5, abs=0.01)


def test_the_loop_shares_its_process_with_no_thread_of_the_driver(wire):
    def receivers() -> int:
        return sum("Notifier" in thread.name for thread in threading.enumerate())

    before = receivers()
    drive = wire.ready()
    run_loop(drive, 0.5, for_s=0.1)
    assert receivers() == before


def test_a_neighbour_on_the_bus_is_left_alone(wire):
    neighbour = Cia402Emulator(emulated_arm(), interface="virtual", channel=wire.channel, node_id=2)
    try:
        patient = {"drive_watchdog_s": 3.0, "command_deadline_s": 2.0}
        second = wire.ready(node_id=2, master_id=126, **patient)
        second.write(-0.8)
        first = wire.ready()
        assert run_loop(first, 0.4, for_s=0.4).cause == Cause.NONE
        assert first.read().velocity_rad_s == pytest.approx(0.4, abs=0.01)
        assert neighbour.state()["velocity_rad_s"] == pytest.approx(-0.8, abs=0.01)
        first.disable()
        assert wait_until(lambda: not wire.emulator.state()["power"])
        assert neighbour.state()["power"]
    finally:
        neighbour.close()


def test_the_loop_never_waits_for_a_dead_drive(wire, lateness):
    drive = wire.ready()
    wire.emulator.misbehave("die")
    took, began_s = [], time.monotonic()
    for _ in range(200):
        start = time.perf_counter()
        drive.read()
        drive.write(0.1)
        took.append(time.perf_counter() - start)
    assert sorted(took)[len(took) // 2] < 1e-3
    assert max(took) < 0.01 + lateness.worst_s(began_s)
    assert drive.write(float("inf")) == 0.0


def test_frames_that_make_no_sense_are_counted(wire):
    drive = wire.ready()
    other = can.Bus(interface="virtual", channel=wire.channel)
    try:
        for identifier, data in ((0x181, b"\x00"), (0x281, b""), (0x701, b"")):
            other.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))
        other.send(can.Message(arbitration_id=0x181, data=bytes(7), is_extended_id=True))
        other.send(can.Message(arbitration_id=0x345, data=bytes(8), is_extended_id=False))
        assert run_loop(drive, 0.2, for_s=0.1).cause == Cause.NONE
        assert drive.counts["damaged"] == 3
    finally:
        other.shutdown()


def test_the_emulator_is_a_drive_to_the_profile_that_others_wrote(wire):
    from canopen.objectdictionary import ObjectDictionary

    from rigidimeter.testing import dictionary

    emulator = wire.emulator
    bus = can.Bus(interface="virtual", channel=wire.channel)
    network = canopen.Network(bus)
    network.notifier = can.Notifier(bus, network.listeners, 0.02)
    try:
        node = canopen.BaseNode402(1, dictionary(canopen.objectdictionary, 1))
        assert isinstance(node.object_dictionary, ObjectDictionary)
        network.add_node(node)
        node.nmt.state = "PRE-OPERATIONAL"
        node.tpdo.read()
        node.rpdo.read()
        for map_, entries, kind in (
            (node.rpdo[1], (0x6040, 0x60FF), 255),
            (node.tpdo[1], (0x6041, 0x6061, 0x6064), 1),
            (node.tpdo[2], (0x606C,), 1),
        ):
            map_.clear()
            for entry in entries:
                map_.add_variable(entry)
            map_.trans_type, map_.enabled = kind, True
            map_.save()
        node.setup_402_state_machine()
        node.sdo[0x6085].raw = 819_200
        node.nmt.state = "OPERATIONAL"
        network.sync.start(0.01)
        assert wait_until(lambda: node.state == "SWITCH ON DISABLED")
        node.op_mode = "PROFILED VELOCITY"
        assert wait_until(lambda: node.op_mode == "PROFILED VELOCITY")
        node.state = "OPERATION ENABLED"
        node.rpdo[0x60FF].raw = 81_920
        node.rpdo[1].transmit()
        assert wait_until(lambda: abs(node.tpdo_values[0x606C] - 81_920) < 100)
        assert emulator.state()["velocity_rad_s"] == pytest.approx(0.2 * 3.14159265, rel=0.01)
        node.state = "QUICK STOP ACTIVE"
        assert wait_until(lambda: node.state == "SWITCH ON DISABLED")
        assert not emulator.state()["power"]
        emulator.misbehave("fault", 0x4210)
        assert wait_until(lambda: node.is_faulted())
        assert node.emcy.log[-1].code == 0x4210
        network.sync.stop()
    finally:
        network.disconnect()
