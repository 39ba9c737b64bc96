"""How each driver stops: the frames and characters it sends, without a drive at the other end.

The clock and what the drive reports are the test's. `tests/wire/test_guard_on_the_wire.py` asserts
the same against drives in motion.
"""

from __future__ import annotations

import itertools
import math
import struct

import can
import pytest

from rigidimeter.devices.ascii.drive import AsciiDrive
from rigidimeter.devices.ascii.line import AsciiLine
from rigidimeter.devices.base import DeviceError
from rigidimeter.devices.cia402.drive import Cia402Drive
from rigidimeter.devices.cia402.state_words import OPERATIONAL, Control
from rigidimeter.guard import Cause

_channels = itertools.count()
IN_OPERATION, DISABLED, QUICK_STOP, FAULT = 0x27, 0x40, 0x07, 0x08
SYNC, HEARTBEAT = ("sync",), ("heartbeat", OPERATIONAL)
OFF_BY_SDO = ("sdo", b"\x2b\x40\x60\x00\x00\x00\x00\x00")
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
        self.drive.connect()
        self.units = self.drive._scale.units_per_rad_s
        self.sent()
        # As `enable` leaves it.
        self.drive._configured = True
        self.drive._control = Control.ENABLE_OPERATION
        wire = self.drive._wire
        wire.heard_s = wire.sync_s = self.clock.time_s
        wire.network_state = OPERATIONAL

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

    def report(self, status=IN_OPERATION, mode=3, heartbeat=OPERATIONAL):
        self.send(0x181, struct.pack("<Hbi", status, mode, 0))
        self.send(0x281, bytes(4))
        if heartbeat is not None:
            self.send(0x701, [heartbeat])

    def tick(self, velocity=0.5, dt=0.002, **report):
        """One tick of a loop: what was asked is answered, then read and commanded anew."""
        if report.get("status", 1) is not None:
            self.report(**report)
        self.clock.time_s += dt
        cause = Cause(self.drive.read().cause)
        returned = self.drive.write(velocity)
        commands = [frame[1:] for frame in self.sent() if frame[0] == "command"]
        return cause, returned, commands[-1]


@pytest.fixture
def node():
    made = Node()
    yield made
    made.drive.close()
    made.bus.shutdown()


def test_a_tick_is_a_sync_a_command_and_a_heartbeat_when_due(node):
    assert node.drive.write(0.5) == pytest.approx(0.5, abs=1e-5)
    assert node.sent() == [SYNC, ("command", 0x0F, 0.5), HEARTBEAT]
    node.drive.write(-0.25)
    assert node.sent() == [SYNC, ("command", 0x0F, -0.25)]
    node.clock.time_s += 0.021
    node.drive.write(math.nan)
    assert node.sent() == [SYNC, ("command", 0x0F, 0.0), HEARTBEAT]
    node.report()
    for beyond in (99.0, -99.0, math.inf):
        node.drive.write(beyond)
        ((_, _, sent), *_) = [f for f in node.sent() if f[0] == "command"]
        assert sent == (math.copysign(4.0, beyond) if math.isfinite(beyond) else 0.0)


def test_stop_is_sent_both_ways_and_kept(node):
    node.tick()
    node.drive.stop()
    assert node.sent() == [SYNC, ("command", 0x02, 0.0), STOP_BY_SDO]
    assert node.drive.write(0.5) == 0.0
    assert node.sent()[:2] == [SYNC, ("command", 0x02, 0.0)]
    node.drive.stop()
    assert ("command", 0x02, 0.0) in node.sent()
    assert node.tick(status=QUICK_STOP) == (Cause.NONE, 0.0, (0x02, 0.0))
    assert node.tick(status=DISABLED) == (Cause.NONE, 0.0, (0x02, 0.0))  # at rest, without power


def test_disable_is_sent_both_ways_and_nothing_takes_it_back(node):
    node.tick()
    node.drive.disable()
    assert node.sent() == [SYNC, ("command", 0x00, 0.0), OFF_BY_SDO]
    node.drive.stop()
    assert node.sent() == []  # a quick stop would bring the power back
    assert node.drive.write(0.5) == 0.0
    assert node.sent()[1] == ("command", 0x00, 0.0)
    assert node.tick(status=FAULT) == (Cause.DRIVE_FAULT, 0.0, (0x00, 0.0))


def test_close_takes_the_power_and_the_node_out_of_operation(node):
    node.tick()
    node.drive.close()
    off = [SYNC, ("command", 0x00, 0.0), OFF_BY_SDO, ("network", b"\x80\x01")]
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
    assert {frame for frame in node.sent() if frame[0] == "command"} == {("command", 0, 0.0)}


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
        ({"heartbeat": 0x7F}, Cause.DRIVE_STATE, 0x0F),  # it still obeys: the guard's ramp
        ({"heartbeat": 0}, Cause.DRIVE_FAULT, 0x00),  # it restarted
    ],
)
def test_a_drive_that_is_not_in_operation_is_not_commanded_into_it(node, report, cause, control):
    assert node.tick() == (Cause.NONE, pytest.approx(0.5, abs=1e-5), (0x0F, 0.5))
    found, sent, command = node.tick(**report)
    assert (found, command[0]) == (cause, control)
    assert sent == (pytest.approx(0.5, abs=1e-5) if control == 0x0F else 0.0)
    assert node.tick()[0] is cause  # the first is kept
    assert node.tick()[2][0] == control


def test_a_fall_between_two_reports_of_one_tick_counts(node):
    node.tick()
    node.report(status=0x23)
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
    assert node.sent()[1] == ("command", 0x0F, 0.5)
    if answers:
        node.report()
        node.drive.read()
    node.clock.time_s += 0.051 if answers else 0.001
    assert node.drive.write(0.5) == 0.0
    assert node.sent()[1] == ("command", 0x02, 0.0)
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


class Port:
    """A serial port whose drive answers at once."""

    baudrate, timeout = 115200, 0.01

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.replies: dict[str, str | None] = {}
        self.closed = False

    def write(self, data: bytes) -> int:
        self.asked.append(data.decode().strip())
        return len(data)

    def read_until(self, expected: bytes, size: int | None) -> bytes:
        request = self.asked[-1]
        reply = self.replies.get(request, "v 0" if request.startswith("g") else "ok")
        reply = "v 21" if request == "g r0x24" and request not in self.replies else reply
        return b"" if reply is None else reply.encode() + b"\r"

    def reset_input_buffer(self) -> None: ...
    def send_break(self, duration: float) -> None: ...

    def close(self) -> None:
        self.closed = True


class Serial:
    """A serial driver in operation, and the requests it sends."""

    def __init__(self, **settings) -> None:
        self.clock, self.port = Clock(), Port()
        values = {"port": "/dev/no-such", "counts_per_turn": 360_000.0, **settings}
        self.drive = drive = AsciiDrive(AsciiDrive.Settings(**values), self.clock)
        drive._line = AsciiLine(self.port, self.clock)
        # As `enable` leaves it.
        drive._speaking = drive._configured = drive._powered = drive._commanding = True
        drive._cycle_s, drive._commanded_s = 0.01, self.clock.time_s
        drive._feedback.begin(0, 0, 0, self.clock.time_s)

    def asked(self):
        """Return what was asked since the last time, without the questions."""
        line = self.drive._line
        if line is not None:
            assert line.wait(2.0)
        found = [request for request in self.port.asked if not request.startswith("g")]
        self.port.asked.clear()
        return found

    def tick(self, velocity=0.5, dt=0.02):
        self.clock.time_s += dt
        cause = Cause(self.drive.read().cause)
        returned = self.drive.write(velocity)
        return cause, returned, self.asked()


@pytest.fixture
def serial():
    made = Serial()
    yield made
    made.drive.close()


def test_a_command_is_a_target_a_velocity_and_a_start(serial):
    cause, returned, asked = serial.tick()
    assert (cause, returned) == (Cause.NONE, pytest.approx(0.5, abs=1e-5))
    assert [request.split()[:2] for request in asked] == [
        ["s", "r0xca"],
        ["s", "r0xcb"],
        ["t", "1"],
    ]
    assert serial.tick(0.0) == (Cause.NONE, 0.0, ["t 0"])
    assert serial.tick(math.nan) == (Cause.NONE, 0.0, ["t 0"])
    assert serial.tick()[0] is Cause.COMMAND_NOT_FINITE


def test_serial_stop_aborts_the_move_and_is_kept(serial):
    serial.tick()
    serial.drive.stop()
    assert serial.asked() == ["t 0"]
    for _ in range(3):
        assert serial.tick() == (Cause.NONE, 0.0, [])
    serial.drive.stop()
    assert serial.asked() == ["t 0"]


def test_serial_stop_in_velocity_mode_writes_zero():
    serial = Serial(mode="velocity", external_watchdog=True)
    serial.port.replies["g r0x24"] = "v 11"
    assert serial.tick()[2] == ["s r0x2f 286479"]
    serial.drive.stop()
    assert serial.asked() == ["s r0x2f 0"]
    serial.drive.close()


def test_serial_disable_takes_the_power_and_nothing_brings_it_back(serial):
    serial.tick()
    serial.drive.disable()
    assert serial.asked() == ["s r0x24 0"]
    serial.drive.stop()
    assert serial.asked() == []  # no power, no motion to stop
    assert serial.tick()[1:] == (0.0, [])
    assert serial.drive._feedback.cause is Cause.NONE


@pytest.mark.parametrize("reply", [None, "e 1", "v 0", "#"])
@pytest.mark.parametrize("end", ["stop", "disable"])
def test_an_end_that_is_not_confirmed_is_a_drive_that_is_lost(serial, reply, end):
    serial.tick()
    serial.port.replies |= {"t 0": reply, "s r0x24 0": reply}
    getattr(serial.drive, end)()
    assert serial.drive._feedback.cause is Cause.DRIVE_LOST


def test_serial_close_takes_the_power_and_closes_the_port(serial):
    serial.tick()
    line = serial.drive._line
    serial.drive.close()
    assert serial.asked() == ["s r0x24 0"]
    assert serial.port.closed
    assert not line._thread.is_alive()
    for end in (serial.drive.close, serial.drive.disable, serial.drive.stop):
        end()
    assert (serial.drive.write(0.5), serial.asked()) == (0.0, [])


def test_a_drive_that_was_never_spoken_to_is_told_nothing(serial):
    serial.drive._speaking = False
    serial.drive.stop()
    serial.drive.disable()
    assert serial.asked() == []


def test_after_a_pause_beyond_the_horizon_zero_is_sent(serial):
    serial.tick()
    assert serial.tick(dt=0.0995)[0] is Cause.NONE
    assert serial.tick(dt=0.1005) == (Cause.DRIVE_STATE, 0.0, ["t 0"])
    assert serial.tick()[1:] == (0.0, ["t 0"])


def test_a_write_after_a_pause_does_not_wait_for_a_read(serial):
    serial.tick()
    serial.drive.read()
    serial.clock.time_s += 0.1005
    assert serial.drive.write(0.5) == 0.0
    assert serial.asked() == ["t 0"]


def test_after_a_fault_zero_is_sent(serial):
    serial.port.replies["g r0xa0"] = "v 4194304"
    for _ in range(3):
        found = serial.tick()
    assert found == (Cause.DRIVE_FAULT, 0.0, ["t 0"])
