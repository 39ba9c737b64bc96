"""The serial drive against its emulator: every misbehaviour, and a computer that dies."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import time

import pytest
from tests.lateness import ordinary_priority, same_priority
from tests.wire.ascii_wire import (
    COUNTS_PER_TURN,
    DECELERATION_DEG_S2,
    HORIZON_S,
    SPEED_RAD_S,
    Wire,
    wire,
)

from rigidimeter.rig.devices import AsciiDrive
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause
from rigidimeter.testing import ASCII_MISBEHAVIOURS

__all__ = ["wire"]


def test_the_arm_follows_and_the_stamps_are_those_of_the_samples(wire, lateness):
    drive = wire.enabled()
    began_s = time.monotonic()
    sample, sent = wire.run(drive, SPEED_RAD_S, 0.6)
    angle_rad, velocity_rad_s = wire.arm.motion()
    age_s = time.monotonic() - sample.time_s
    assert sent == pytest.approx(SPEED_RAD_S, abs=1e-5)
    assert velocity_rad_s == pytest.approx(sent, rel=0.1)
    assert sample.velocity_rad_s == pytest.approx(sent, rel=0.1)
    # Where the arm was at the stamp, within 5 ms and what the machine added.
    within_rad = SPEED_RAD_S * (0.005 + lateness.worst_s(began_s))
    assert sample.angle_rad == pytest.approx(angle_rad - velocity_rad_s * age_s, abs=within_rad)
    assert sample.cause == 0


def test_sign_and_offset_turn_the_joint_about(wire):
    drive = wire.enabled(sign=-1, angle_offset_deg=10.0)
    sample, _ = wire.run(drive, SPEED_RAD_S, 0.4)
    assert wire.arm.motion()[1] == pytest.approx(-SPEED_RAD_S, rel=0.1)
    assert sample.velocity_rad_s == pytest.approx(SPEED_RAD_S, rel=0.1)
    assert sample.angle_rad > math.radians(10.0)


def test_facts_are_read_from_the_drive(wire):
    facts = wire.drive().configure()
    assert (facts.model, facts.serial) == ("EMU-055-18", "4711")
    assert facts.watchdog_s == HORIZON_S
    assert wire.emulator.state()["baud"] == 115200
    assert facts.values["deceleration_counts_s2"] == pytest.approx(500_000.0)


@pytest.mark.parametrize("sign", [1, -1])
def test_the_current_of_the_motor_is_its_torque_where_the_scale_is_given(wire, sign):
    drive = wire.drive(sign=sign, torque_nm_per_a=1.0)
    assert drive.configure().values["rated_torque_nm"] == pytest.approx(10.0)
    drive.enable()
    wire.arm.voluntary_nm = lambda _: -2.0
    sample, _ = wire.run(drive, 0.0, 0.3)
    assert sample.drive_torque_nm == pytest.approx(sign * wire.arm.drive_torque_nm(), abs=0.006)
    assert abs(sample.drive_torque_nm) > 1.5
    drive.disable()
    assert wire.run(drive, 0.0, 0.3)[0].drive_torque_nm == 0.0


def test_without_its_scale_the_current_is_not_read(wire):
    drive = wire.enabled()
    sample, _ = wire.run(drive, 0.0, 0.2)
    assert math.isnan(sample.drive_torque_nm)
    assert all("0x0c" not in request for _, request, _ in wire.emulator.log)


def test_velocity_mode_asks_for_a_watchdog_of_hardware(wire):
    with pytest.raises(DeviceError, match="external_watchdog = true"):
        wire.drive(mode="velocity").configure()
    drive = wire.drive(mode="velocity", external_watchdog=True)
    assert drive.configure().watchdog_s is None


def test_a_horizon_too_short_for_the_wire_is_refused(wire):
    with pytest.raises(DeviceError, match=r"horizon_s = 0\.02 is too short"):
        wire.drive(horizon_s=0.02).configure()


def test_a_velocity_above_the_limit_is_sent_at_the_limit(wire):
    drive = wire.enabled(max_velocity_deg_s=30.0)
    _, sent = wire.run(drive, 5.0, 0.4)
    assert sent == pytest.approx(math.radians(30.0), abs=1e-5)
    assert wire.arm.motion()[1] == pytest.approx(sent, rel=0.1)


def test_slowing_down_never_turns_the_arm_back(wire):
    drive = wire.enabled(deceleration_deg_s2=200.0)
    wire.run(drive, SPEED_RAD_S, 0.4)
    slowest = SPEED_RAD_S
    for _ in range(25):
        drive.read()
        drive.write(0.05)
        time.sleep(0.02)
        slowest = min(slowest, wire.arm.motion()[1])
    assert slowest > -0.05


@pytest.mark.parametrize(
    ("habit", "value", "cause"),
    [
        ("silent", 1, Cause.DRIVE_LOST),
        # Velocity, status and target; the others of their kind in the same way.
        *(("damaged_register", at, Cause.DRIVE_LOST) for at in (0x18, 0xA0, 0xCA)),
        *(
            pytest.param("damaged_register", at, Cause.DRIVE_LOST, marks=pytest.mark.slow)
            for at in (0x32, 0x24, 0xCB)
        ),
        ("status_is", 2**63, Cause.DRIVE_LOST),
        ("half_replies", 1, Cause.DRIVE_LOST),
        ("garbage", 1, Cause.DRIVE_LOST),
        ("slow_replies", 0.2, Cause.DRIVE_LOST),
        ("wrong_baud", 38400, Cause.DRIVE_LOST),
        ("error_replies", 33, Cause.DRIVE_FAULT),
        ("fault", 0, Cause.DRIVE_FAULT),
        ("power_lost", 1, Cause.DRIVE_STATE),
        ("changes_state", 11, Cause.DRIVE_STATE),
        ("encoder_jump", 20_000, Cause.NOT_FOLLOWING),
        ("encoder_sign_flip", 1, Cause.NOT_FOLLOWING),
    ],
)
def test_what_goes_wrong_is_named_and_the_arm_comes_to_rest(wire, lateness, habit, value, cause):
    drive = wire.enabled()
    wire.run(drive, SPEED_RAD_S, 0.3)
    wire.emulator.misbehave(habit, value)
    began_s = time.monotonic()
    assert wire.cause(drive, SPEED_RAD_S) is cause
    assert time.monotonic() - began_s < 0.4 + lateness.worst_s(began_s)
    # The guard would ramp now; a drive that does not hear it ends its move.
    wire.run(drive, 0.0, HORIZON_S + 0.2)
    assert abs(wire.arm.motion()[1]) < 0.02
    assert drive.read().cause == cause, "the first cause is kept"


@pytest.mark.parametrize("sleeps", [True, False])
def test_after_a_pause_the_arm_waits_to_be_enabled_again(wire, sleeps):
    """As after SIGSTOP and SIGCONT: the loop goes on with the velocity it had."""
    ahead_s = 0.0
    drive = wire.drive()
    drive._now = lambda: time.monotonic() + ahead_s
    drive.configure()
    drive.enable()
    assert wire.run(drive, SPEED_RAD_S, 0.3)[0].cause == 0
    if sleeps:
        time.sleep(HORIZON_S + 0.3)  # the drive ends its move and stands still
    else:
        assert drive._line.wait(1.0)  # what was asked is answered; then only the clock goes on
        ahead_s = HORIZON_S + 0.1
    stood_rad = wire.arm.motion()[0]
    asked = len(wire.emulator.log)
    sent = [drive.write(SPEED_RAD_S)]  # before anything was read
    sample, last = wire.run(drive, SPEED_RAD_S, 0.3)
    assert sample.cause == Cause.DRIVE_STATE
    assert [*sent, last] == [0.0, 0.0]
    assert "t 1" not in [request for _, request, _ in list(wire.emulator.log)[asked:]]
    assert wire.arm.motion()[0] == pytest.approx(stood_rad, abs=1e-3 if sleeps else 0.05)
    assert abs(wire.arm.motion()[1]) < 0.02
    assert drive.powered
    drive.disable()
    assert not drive.powered
    drive.enable()
    assert wire.run(drive, SPEED_RAD_S, 0.3)[0].cause == 0
    assert wire.arm.motion()[1] == pytest.approx(SPEED_RAD_S, rel=0.1)


def test_power_that_comes_back_moves_nothing(wire):
    drive = wire.enabled()
    wire.run(drive, SPEED_RAD_S, 0.3)
    wire.emulator.misbehave("power_lost")
    assert wire.cause(drive, SPEED_RAD_S) is Cause.DRIVE_STATE
    wire.run(drive, SPEED_RAD_S, 0.1)
    wire.emulator.behave()
    angle_rad = wire.arm.motion()[0]
    wire.run(drive, SPEED_RAD_S, 0.3)
    assert wire.arm.motion()[0] == pytest.approx(angle_rad, abs=1e-3)


@pytest.mark.parametrize(
    ("habit", "value", "measured_rad_s"),
    [
        ("does_not_follow", 1, 0.0),
        ("runs_away", 1.2, 1.2),
        ("encoder_frozen", 1, SPEED_RAD_S),
        ("velocity_gain", -1.0, -SPEED_RAD_S),
    ],
)
def test_what_the_guard_must_see_is_passed_on_as_it_is(wire, habit, value, measured_rad_s):
    drive = wire.enabled()
    wire.run(drive, SPEED_RAD_S, 0.3)
    wire.emulator.misbehave(habit, value)
    sample, sent = wire.run(drive, SPEED_RAD_S if habit != "encoder_frozen" else 0.0, 0.3)
    assert sample.cause == 0
    assert sample.velocity_rad_s == pytest.approx(measured_rad_s, abs=0.1)
    assert abs(sample.velocity_rad_s - sent) > 0.3


def test_every_misbehaviour_has_a_test():
    tested = {
        mark
        for test in (
            test_what_goes_wrong_is_named_and_the_arm_comes_to_rest,
            test_what_the_guard_must_see_is_passed_on_as_it_is,
        )
        for mark in (getattr(case, "values", case)[0] for case in test.pytestmark[0].args[1])
    }
    of_bounds = {"bound_sleeps", "no_register"}  # in `test_serial_bounds`
    assert tested | of_bounds | {"stale_target"} == set(ASCII_MISBEHAVIOURS)


def test_a_stale_target_that_does_not_go_is_refused_before_power(wire):
    wire.emulator.misbehave("stale_target", 5000)
    with pytest.raises(DeviceError, match="0x2f is 5000 after 0 was written"):
        wire.drive().configure()
    wire.emulator.behave()
    drive = wire.drive()
    drive.configure()
    wire.emulator.misbehave("stale_target", 5000)
    with pytest.raises(DeviceError, match="0x2f is 5000"):
        drive.enable()
    assert not any(request == "s r0x24 21" for _, request, _ in wire.emulator.log)


def test_a_stale_target_of_a_session_before_moves_nothing(wire):
    drive = wire.enabled()
    wire.run(drive, SPEED_RAD_S, 0.2)
    before = wire.drives.pop()
    before._line.close()  # as when the program is killed: nothing is said to the drive
    before._line = None
    again = wire.enabled()
    angle_rad = wire.arm.motion()[0]
    wire.run(again, 0.0, 0.2)
    assert wire.arm.motion()[0] == pytest.approx(angle_rad, abs=1e-3)


def test_a_latched_fault_is_cleared_once_and_one_that_stays_is_refused(wire):
    wire.emulator.misbehave("fault", 3)
    wire.emulator.behave()
    facts = wire.drive().configure()
    assert facts.values["latched_faults_before"] == 1 << 3
    wire.emulator.misbehave("power_lost")
    drive = wire.drives[-1]
    with pytest.raises(DeviceError, match="enable input not active"):
        drive.enable()
    assert wire.emulator.state()["desired_state"] == 0


def test_a_drive_that_is_not_there_is_named():
    drive = AsciiDrive(
        AsciiDrive.Settings(port="/dev/no-such-port", counts_per_turn=1.0), time.monotonic
    )
    with pytest.raises(DeviceError, match="no-such-port"):
        drive.connect()
    drive.close()


def test_a_drive_that_says_nothing_is_named(wire):
    wire.emulator.misbehave("silent")
    with pytest.raises(DeviceError, match=r"no answer on .* at 9600 or 115200 baud"):
        wire.drive().configure()


@pytest.mark.parametrize("baud", [9600, 57600, 115200])
def test_commands_keep_up_with_the_rate_the_facts_state(wire, baud, record_property):
    horizon_s = 0.5 if baud == 9600 else HORIZON_S
    drive = wire.drive(baud=baud, horizon_s=horizon_s, lost_s=0.2)
    facts = drive.configure()
    rate_hz = facts.fastest_tick_rate_hz
    # Characters alone allow this; what the drive and the computer add makes it less.
    assert rate_hz <= baud / 10 / 92
    drive.enable()
    ticks = max(6, round(0.6 * rate_hz))
    began_s = time.monotonic()
    for tick in range(ticks):
        drive.read()
        drive.write(0.1)
        time.sleep(max(0.0, began_s + (tick + 1) * 1.05 / rate_hz - time.monotonic()))
    skipped = drive.counts["skipped"] / ticks
    print(f"{baud} baud: {rate_hz:.1f} ticks/s, {100 * skipped:.0f} % of commands skipped")
    record_property("ticks_per_s", rate_hz)
    assert skipped < 0.5


SCRIPT = """
import sys, time
from rigidimeter.rig.devices.ascii.drive import AsciiDrive
settings = AsciiDrive.Settings(
    port=sys.argv[1], counts_per_turn=float(sys.argv[2]), horizon_s=float(sys.argv[3]),
    deceleration_deg_s2=float(sys.argv[4]), lost_s=0.5)
drive = AsciiDrive(settings, time.monotonic)
drive.connect(); drive.configure(); drive.enable()
while True:
    sample = drive.read()
    drive.write(float(sys.argv[5]))
    print(sample.velocity_rad_s, flush=True)
    time.sleep(0.02)
"""


def test_the_drive_stops_by_itself_when_the_computer_dies(lateness):
    wires = {signal.SIGSTOP: Wire(), signal.SIGKILL: Wire()}
    programs = {}
    try:
        for how, wire in wires.items():
            values = [
                wire.emulator.port,
                COUNTS_PER_TURN,
                HORIZON_S,
                DECELERATION_DEG_S2,
                SPEED_RAD_S,
            ]
            programs[how] = subprocess.Popen(
                [sys.executable, "-c", SCRIPT, *map(str, values)],
                stdout=subprocess.PIPE,
                text=True,
                preexec_fn=ordinary_priority,
            )
        for how, wire in wires.items():
            _dies_at_speed(how, wire, programs[how], lateness)
    finally:
        for program in programs.values():
            program.kill()
            program.communicate()
        for wire in wires.values():
            wire.close()


def _dies_at_speed(how, wire, program, lateness):
    for line in program.stdout:
        same_priority(program.pid)
        if float(line) > 0.95 * SPEED_RAD_S:
            break
    time.sleep(0.1)
    os.kill(program.pid, how)
    # What was on the wire then still arrives; the last command is the one the drive took.
    time.sleep(0.02)
    last_s = moving_s = max(at for at, request, _ in list(wire.emulator.log) if request == "t 1")
    while time.monotonic() < last_s + 1.0:
        if abs(wire.arm.motion()[1]) > 0.01 * SPEED_RAD_S:
            moving_s = time.monotonic()
        time.sleep(0.001)
    taken_s = moving_s - last_s
    braking_s = SPEED_RAD_S / math.radians(DECELERATION_DEG_S2)
    print(
        f"{how.name}: at rest {taken_s:.3f} s after the last command "
        f"(horizon {HORIZON_S} s, braking {braking_s:.3f} s)"
    )
    # The arm comes after the generator by its position loop: to 1 % in five times 1/60 s.
    assert 0.5 * HORIZON_S < taken_s < HORIZON_S + braking_s + 5 / 60 + lateness.worst_s(last_s)
