"""How the CANopen driver stops: the frames it sends, without a drive at the other end.

The clock and what the drive reports are the test's. `tests/wire/test_guard_on_the_wire.py` asserts
the same against drives in motion.
"""

from __future__ import annotations

import itertools
import math
import struct

import can
import pytest

from rigidimeter.rig.devices import OPERATIONAL, PRE_OPERATIONAL, STOPPED, Cia402Drive, Control
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause

_channels = itertools.count()
IN_OPERATION, DISABLED, QUICK_STOP, FAULT = 0x27, 0x40, 0x07, 0x08
SYNC, HEARTBEAT = ("sync",), ("heartbeat", OPERATIONAL)
OFF_BY_SDO = ("sdo", b"\x2b\x40\x60\x00\x00\x00\x00\x00")
ASKED_BY_SDO = ("sdo", b"\x40\x00\x10\x00\x00\x00\x00\x00")
STATE_BY_SDO = ("sdo", b"\x40\x41\x60\x00\x00\x00\x00\x00")
STOP_BY_SDO = ("sdo", b"\x2b\x40\x60\x00\x02\x00\x00\x00")


class Clock:
    time_s = 100.0

    def __call__(self) -> float:
        return self.time_s


class Node:
    """A driver in operation on a bus, and the frames it sends; the clock goes on only by `tick`."""

    def __init__(self, **settings) -> None:
        channel = f"stop paths {next(_channels)}"
        self.clock = Clock()
        values = {
            "interface": "virtual",
            "channel": channel,
            "heartbeat_s": 0.02,
            "lost_s": 0.03,
            "command_deadline_s": 0.05,
            **settings,
        }
        self.drive = Cia402Drive(Cia402Drive.Settings(**values), self.clock)
        self.bus = can.Bus(interface="virtual", channel=channel)
        self.questions = can.Bus(interface="virtual", channel=channel)
        self.drive.connect()
        self.units = self.drive._scale.units_per_rad_s
        self.sent()
        # As `enable` leaves it.
        self.drive._configured = True
        self.drive._control = Control.ENABLE_OPERATION
        wire = self.drive._wire
        wire.heard_s = wire.commanded_s = self.clock.time_s
        wire.network_state = OPERATIONAL
        self.drive.write(0.0)
        self.report()
        self.drive.read()
        self.clock.time_s += 0.021  # the next heartbeat is due
        self.sent()

    def sent(self):
        """Return what arrived since the last time."""
        return [self._named(m) for m in iter(lambda: self.bus.recv(0), None)]

    def _named(self, message):
        identifier, data = message.arbitration_id, bytes(message.data)
        if identifier == 0x201:
            control, target = struct.unpack("<Hi", data)
            return "command", control, round(target / self.units, 3)
        names = {0x80: "sync", 0x77F: "heartbeat", 0x601: "sdo", 0: "network"}
        if identifier == 0x77F:
            return names[identifier], data[0]
        return (names[identifier], data) if data else (names[identifier],)

    def send(self, identifier, data):
        self.bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def report(self, status=IN_OPERATION, mode=3, heartbeat=OPERATIONAL, counts=0, asked=True):
        """Answer the SYNC if one was sent, or although none was; and beat."""
        heard = [m.arbitration_id for m in iter(lambda: self.questions.recv(0), None)]
        if 0x80 in heard or not asked:
            self.send(0x181, struct.pack("<Hbi", status, mode, counts))
            self.send(0x281, bytes(4))
        if heartbeat is not None:
            self.send(0x701, [heartbeat])

    def quiet_tick(self, network_state=OPERATIONAL):
        """A tick in which the node only beats; return what was sent."""
        self.send(0x701, [network_state])
        self.clock.time_s += 0.002
        self.drive.read()
        self.drive.write(0.5)
        return self.sent()

    def commands(self):
        return [frame[1:] for frame in self.sent() if frame[0] == "command"]

    def tick(self, velocity=0.5, dt=0.002, **report):
        """One tick of a loop: what was asked is answered, then read and commanded anew."""
        if report.get("status", 1) is not None:
            self.report(**report)
        self.clock.time_s += dt
        cause = Cause(self.drive.read().cause)
        returned = self.drive.write(velocity)
        return cause, returned, self.commands()[-1]


@pytest.fixture
def node():
    made = Node()
    yield made
    made.drive.close()
    made.bus.shutdown()
    made.questions.shutdown()


def test_a_tick_is_a_sync_a_command_and_a_heartbeat_when_due(node):
    assert node.drive.write(0.5) == pytest.approx(0.5, abs=1e-5)
    assert node.sent() == [SYNC, ("command", 0x0F, 0.5), HEARTBEAT]
    node.report()
    node.drive.read()
    node.drive.write(-0.25)
    assert node.sent() == [SYNC, ("command", 0x0F, -0.25)]
    node.clock.time_s += 0.021
    node.report()
    node.drive.read()
    node.drive.write(math.nan)
    assert node.sent() == [SYNC, ("command", 0x0F, 0.0), HEARTBEAT]
    node.report()
    for beyond in (99.0, -99.0, math.inf):
        node.drive.write(beyond)
        ((_, sent),) = node.commands()
        assert sent == (math.copysign(4.0, beyond) if math.isfinite(beyond) else 0.0)


@pytest.fixture
def with_button():
    made = Node(button_bit=3)
    made.drive._wire.inputs_s = made.clock.time_s  # as `enable` leaves it
    made.drive._cause = Cause.NONE
    yield made
    made.drive.close()
    made.bus.shutdown()
    made.questions.shutdown()


def inputs(node, levels):
    node.send(0x381, struct.pack("<I", levels))


def test_a_button_is_an_emergency_stop_while_its_contact_is_open(with_button):
    node = with_button
    inputs(node, 0xFFFF_FFFF)
    assert node.tick()[0] is Cause.NONE
    inputs(node, ~0x8 & 0xFFFF_FFFF)
    assert node.tick()[0] is Cause.EMERGENCY_STOP
    inputs(node, 0xFFFF_FFFF)  # its release takes nothing back
    assert node.tick()[0] is Cause.EMERGENCY_STOP


def test_a_button_is_heard_over_a_fault_and_after_a_restart(with_button):
    node = with_button
    inputs(node, 0x8)
    node.tick()
    assert node.tick(status=FAULT)[0] is Cause.DRIVE_FAULT
    inputs(node, 0x0)
    assert node.tick(status=FAULT)[0] is Cause.EMERGENCY_STOP
    _, returned, (control, _) = node.tick(heartbeat=0)  # the node has restarted
    assert (returned, control) == (0.0, Control.DISABLE_VOLTAGE)


def test_a_button_whose_frame_stays_away_for_lost_s_is_lost():
    """More than 1/32 s; the measurements go on. The lowest bit is a button like any other."""
    node = Node(button_bit=0, lost_s=0.03125)
    drive, wire = node.drive, node.drive._wire
    drive._cause = Cause.NONE
    wire.heard_s = wire.commanded_s = node.clock.time_s = 128.0
    wire.inputs_s, wire.asked_s = 128.0 - 0.03125, math.inf
    assert drive.read().cause == Cause.NONE
    node.clock.time_s += 0.001
    assert drive.read().cause == Cause.DRIVE_LOST
    drive.close()
    node.bus.shutdown()
    node.questions.shutdown()


def test_a_frame_of_inputs_of_another_length_is_damaged(with_button):
    node = with_button
    node.send(0x381, b"\0")
    node.drive.read()
    assert node.drive.counts["damaged"] == 1


def test_inputs_of_a_drive_without_a_button_are_not_heard(node):
    inputs(node, 0)
    assert [node.tick()[0] for _ in range(20)] == [Cause.NONE] * 20


@pytest.mark.parametrize(("bounded", "cause"), [(True, Cause.DRIVE_FAULT), (False, Cause.NONE)])
def test_slippage_is_a_fault_where_it_was_bounded(node, bounded, cause):
    node.drive._slips = bounded
    assert node.tick()[0] is Cause.NONE
    node.report(status=IN_OPERATION | 1 << 13)
    assert node.tick()[0] is cause  # also where a later statusword has it no more


def test_stop_is_sent_both_ways_and_kept(node):
    node.tick()
    node.drive.stop()
    assert node.sent() == [STOP_BY_SDO, ("command", 0x02, 0.0)]
    assert node.drive.write(0.5) == 0.0
    assert node.sent() == [("command", 0x02, 0.0)]
    node.drive.stop()
    assert ("command", 0x02, 0.0) in node.sent()
    assert node.tick(status=QUICK_STOP) == (Cause.NONE, 0.0, (0x02, 0.0))
    assert node.tick(status=DISABLED) == (Cause.NONE, 0.0, (0x02, 0.0))  # at rest, without power


def test_disable_is_sent_both_ways_and_nothing_takes_it_back(node):
    node.tick()
    node.drive.disable()
    assert node.sent() == [OFF_BY_SDO, ("command", 0x00, 0.0)]
    node.drive.stop()
    assert node.sent() == []  # a quick stop would bring the power back
    assert node.drive.write(0.5) == 0.0
    assert node.commands() == [(0x00, 0.0)]
    assert node.tick(status=FAULT) == (Cause.DRIVE_FAULT, 0.0, (0x00, 0.0))


def test_close_takes_the_power_and_the_node_out_of_operation(node):
    node.tick()
    node.drive.close()
    off = [OFF_BY_SDO, ("command", 0x00, 0.0), ("network", b"\x80\x01")]
    assert node.sent() == off
    assert not node.drive._wire.is_open
    assert Cause(node.drive.read().cause) is Cause.DRIVE_LOST
    for end in (node.drive.close, node.drive.disable, node.drive.stop):
        end()
    assert node.drive.write(0.5) == 0.0
    assert node.sent() == []
    node.drive.connect()
    with pytest.raises(DeviceError, match="not configured"):
        node.drive.enable()


def test_a_drive_without_power_may_be_left_alone(node):
    node.tick()
    node.drive.disable()
    node.tick(status=DISABLED)
    for _ in range(3):
        node.report(status=DISABLED)
        node.drive.read()
        node.clock.time_s += 1.0
        assert node.drive.write(0.5) == 0.0
        node.report(status=DISABLED)
        assert Cause(node.drive.read().cause) is Cause.NONE
    assert set(node.commands()) == {(0, 0.0)}


def test_a_fault_is_the_cause_also_after_a_pause(node):
    node.tick()
    node.send(0x081, struct.pack("<HB5x", 0x2310, 1))
    node.tick()
    node.clock.time_s += 1.0
    assert node.tick()[::2] == (Cause.DRIVE_FAULT, (0x02, 0.0))


def test_a_bus_that_fails_while_it_ends_is_closed_all_the_same(node, monkeypatch):
    monkeypatch.setattr(node.drive._wire, "send_both_ways", lambda _: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        node.drive.close()
    assert not node.drive._wire.is_open


@pytest.mark.parametrize(
    ("report", "cause", "control"),
    [
        ({"status": DISABLED}, Cause.DRIVE_STATE, 0x02),
        ({"status": QUICK_STOP}, Cause.DRIVE_STATE, 0x02),
        ({"status": 0x23}, Cause.DRIVE_STATE, 0x02),
        ({"mode": 1}, Cause.DRIVE_STATE, 0x02),
        ({"status": FAULT}, Cause.DRIVE_FAULT, 0x02),
        ({"heartbeat": 0x7F}, Cause.DRIVE_STATE, 0x02),  # it hears no command: by SDO
        ({"heartbeat": 0x04}, Cause.DRIVE_STATE, 0x02),
        ({"heartbeat": 0}, Cause.DRIVE_FAULT, 0x00),  # it restarted
    ],
)
def test_a_drive_that_is_not_in_operation_is_not_commanded_into_it(node, report, cause, control):
    assert node.tick() == (Cause.NONE, pytest.approx(0.5, abs=1e-5), (0x0F, 0.5))
    found, sent, command = node.tick(**report)
    assert (found, command[0], sent) == (cause, control, 0.0)
    assert node.tick()[0] is cause  # the first is kept
    assert node.tick()[2][0] == control


def test_a_fall_between_two_reports_of_one_tick_counts(node):
    node.tick()
    node.report(status=0x23)
    node.report(asked=False)
    assert node.tick()[::2] == (Cause.DRIVE_STATE, (0x02, 0.0))


def test_an_emergency_is_a_fault_and_the_ramp_goes_on(node):
    node.tick()
    node.send(0x081, struct.pack("<HB5x", 0x2310, 1))
    assert node.tick(0.4) == (Cause.DRIVE_FAULT, pytest.approx(0.4, abs=1e-5), (0x0F, 0.4))


def test_measurements_that_cease_are_missed_after_their_time(node):
    node.tick()
    asked_s = node.clock.time_s
    while node.clock.time_s - asked_s < 0.0295:
        assert node.tick(status=None)[0] is Cause.NONE
        node.send(0x701, [OPERATIONAL])
    found, _, command = node.tick(status=None)
    assert (found, command[0]) == (Cause.DRIVE_LOST, 0x0F)


def test_a_heartbeat_that_ceases_is_missed_after_its_time(node):
    node.tick()
    heard_s = node.clock.time_s
    while node.clock.time_s - heard_s < 0.0495:
        assert node.tick(heartbeat=None)[0] is Cause.NONE
    node.tick(heartbeat=None)
    assert node.tick(heartbeat=None)[0] is Cause.DRIVE_LOST


@pytest.mark.parametrize("answers", [True, False])
def test_after_a_pause_in_which_the_drive_stops_itself_it_is_told_to_stop(node, answers):
    """The command deadline of 0.05 s is the shorter of its two watchdogs."""
    node.tick()
    if answers:
        node.report()
        node.drive.read()
    node.clock.time_s += 0.0495
    node.drive.write(0.5)
    assert node.commands() == [(0x0F, 0.5)]
    if answers:
        node.report()
        node.drive.read()
    node.clock.time_s += 0.051 if answers else 0.001
    assert node.drive.write(0.5) == 0.0
    assert set(node.commands()) == {(0x02, 0.0)}
    node.report()
    cause = Cause.DRIVE_STATE if answers else Cause.DRIVE_LOST
    assert Cause(node.drive.read().cause) is cause


def test_a_drive_that_does_not_stop_in_time_is_named(node):
    node.tick()
    node.drive.stop()
    stopped_s = node.clock.time_s
    while node.clock.time_s - stopped_s < 0.0295:
        assert node.tick()[0] is Cause.NONE
    node.tick()
    assert node.tick()[::2] == (Cause.DRIVE_STATE, (0x02, 0.0))


def test_a_late_answer_keeps_the_time_of_its_sync_and_no_other_is_sent_before_it(node):
    node.tick()
    asked_s = node.clock.time_s
    for _ in range(3):
        assert SYNC not in node.quiet_tick()
    node.report(counts=1000)
    sample = node.drive.read()
    assert (sample.cause, sample.raw[0], sample.time_s) == (Cause.NONE, 1000, asked_s)
    node.drive.write(0.5)
    assert node.sent()[0] == SYNC


@pytest.mark.parametrize("lost", ["position", "velocity", "both"])
def test_an_answer_counts_as_lost_once_a_later_one_is_here(node, lost):
    """`lost_s` is 0.03 s: the SDO read is sent after a quarter of it."""
    node.tick()
    if lost == "velocity":
        node.send(0x181, struct.pack("<Hbi", IN_OPERATION, 3, 111))
    if lost == "position":
        node.send(0x281, bytes(4))
    while ASKED_BY_SDO not in (sent := node.quiet_tick()):
        assert SYNC not in sent
    for _ in range(3):  # once
        assert not {SYNC, ASKED_BY_SDO} & set(node.quiet_tick())
    node.send(0x581, b"\x43\x00\x10\x00\x92\x01\x02\x00")
    assert node.quiet_tick()[0] == SYNC
    asked_s = node.clock.time_s
    assert node.drive.counts["lost"] == 1
    node.clock.time_s += 0.002
    node.report(counts=222)
    sample = node.drive.read()
    assert (sample.cause, sample.raw[0], sample.time_s) == (Cause.NONE, 222, asked_s)


def test_an_sdo_answer_that_is_lost_too_is_a_drive_that_is_lost(node):
    node.tick()
    node.quiet_tick()
    asked_s = node.clock.time_s - 0.002
    while node.clock.time_s - asked_s < 0.0295:
        assert SYNC not in node.quiet_tick()
        assert Cause(node.drive.read().cause) is Cause.NONE
    node.quiet_tick()
    assert Cause(node.drive.read().cause) is Cause.DRIVE_LOST


def test_one_answer_more_than_questions_is_a_drive_that_is_lost(node):
    """Whether it is this one that is late or the one before it cannot be known."""
    node.tick()
    node.report()
    node.report(asked=False)
    assert Cause(node.drive.read().cause) is Cause.DRIVE_LOST
    assert node.drive.counts["unplaced"] == 2


@pytest.mark.parametrize("network_state", [PRE_OPERATIONAL, STOPPED])
def test_a_node_that_hears_no_command_is_stopped_by_sdo_until_it_says_that_it_is(
    node, network_state
):
    """`lost_s` is 0.03 s: the stop is sent again, or what it did is read, after a quarter of it."""
    node.tick()
    first = node.quiet_tick(network_state)
    opened = [("network", b"\x80\x01")] if network_state == STOPPED else []
    assert first[: len(opened) + 1] == [*opened, STOP_BY_SDO]  # in the same tick
    sent = [frame for _ in range(20) for frame in node.quiet_tick(network_state)]
    said = [f for f in sent if f in (STOP_BY_SDO, STATE_BY_SDO, *opened)]
    assert said == ([STATE_BY_SDO, *opened, STOP_BY_SDO] * 3)[: len(said)]
    assert len(said) > 4
    assert node.drive.powered
    node.send(0x581, b"\x4b\x41\x60\x00\x40\x02\x00\x00")  # switch-on disabled
    node.quiet_tick(network_state)
    assert not node.drive.powered


def test_the_stop_is_not_repeated_to_a_drive_that_answers(node):
    node.tick()
    node.drive.stop()
    node.sent()
    for _ in range(20):
        node.report(status=QUICK_STOP)
        assert not {STOP_BY_SDO, STATE_BY_SDO} & set(node.quiet_tick())


@pytest.mark.parametrize("found", ["a pause", "pre-operational", "a fall"])
def test_who_only_reads_sends_nothing(node, found):
    """The trial of the drive's own watchdog is silence: the driver must not be what stops it."""
    node.tick()
    node.sent()
    node.clock.time_s += 0.06
    node.report(
        status=0x23 if found == "a fall" else IN_OPERATION,
        heartbeat=PRE_OPERATIONAL if found == "pre-operational" else OPERATIONAL,
    )
    assert Cause(node.drive.read().cause) is not Cause.NONE
    assert node.sent() == []
    assert node.drive.write(0.5) == 0.0
    assert node.sent()[0] == STOP_BY_SDO


def test_a_node_that_misses_our_frames_is_a_fault_while_it_is_enabled_only(node):
    missed = struct.pack("<HB5x", 0x8130, 0x11)
    node.tick()
    node.drive.disable()
    node.send(0x081, missed)
    assert node.tick(status=DISABLED)[0] is Cause.NONE
    node.drive._control = Control.ENABLE_OPERATION
    assert node.tick()[0] is Cause.DRIVE_FAULT
