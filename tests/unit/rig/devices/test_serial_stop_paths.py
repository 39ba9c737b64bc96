"""How the serial driver stops: the requests it sends, without a drive at the other end.

The clock and what the drive answers are the test's.
"""

from __future__ import annotations

import math
import threading

import pytest
from tests.unit.rig.devices.test_stop_paths import Clock

from rigidimeter.rig.devices import PATIENCE, AsciiDrive, AsciiLine
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause


class Port:
    """A serial port whose drive answers at once."""

    baudrate, timeout = 115200, 0.01

    def __init__(self) -> None:
        self.asked: list[str] = []
        self.replies: dict[str, str | None] = {}
        self.closed = False
        self.answering = threading.Event()
        self.answering.set()

    def write(self, data: bytes) -> int:
        self.asked.append(data.decode().strip())
        return len(data)

    def read_until(self, expected: bytes, size: int | None) -> bytes:
        self.answering.wait(2.0)
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
        drive._reported_off = False
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
    assert serial.tick()[1:] == (0.0, [])
    serial.drive.stop()
    assert serial.asked() == []  # no power, no motion to stop
    assert serial.drive._feedback.cause is Cause.NONE


@pytest.mark.parametrize("end", ["stop", "disable"])
def test_an_end_is_waited_for_and_no_other_reply_missed(serial, end):
    """What was asked before is discarded: that it stays unanswered is no cause."""
    serial.tick()
    serial.port.answering.clear()
    serial.drive.write(0.5)
    waited_s = []
    serial.drive._line.ask = lambda request, patience_s: waited_s.append(patience_s) or "ok"
    getattr(serial.drive, end)()
    assert waited_s == [pytest.approx(PATIENCE * 0.1)]
    assert serial.drive._feedback.unanswered_s(serial.clock.time_s + 1.0) == 0.0
    serial.port.answering.set()


@pytest.mark.parametrize("reply", [None, "e 1", "v 0", "#"])
@pytest.mark.parametrize("end", ["stop", "disable"])
def test_an_end_that_is_not_confirmed_is_a_drive_that_is_lost(serial, reply, end):
    serial.tick()
    serial.port.replies |= {"t 0": reply, "s r0x24 0": reply}
    getattr(serial.drive, end)()
    assert serial.drive._feedback.cause is Cause.DRIVE_LOST


def test_the_power_is_gone_when_the_drive_has_said_so(serial):
    assert serial.drive.powered
    for reply, powered in ((None, True), ("e 1", True), ("ok", False), (None, False)):
        serial.port.replies["s r0x24 0"] = reply
        serial.drive.disable()
        assert serial.drive.powered is powered


def test_the_power_of_a_drive_that_cannot_be_asked_is_not_known_to_be_gone(serial):
    serial.drive._speaking = False
    serial.drive.disable()
    assert serial.drive.powered


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


def test_a_port_that_is_opened_again_is_spoken_to_only_after_configure(serial):
    """The drive may have another baud rate by then."""
    serial.drive.close()
    serial.port.asked.clear()
    serial.drive._line = AsciiLine(serial.port, serial.clock)
    serial.drive.disable()
    with pytest.raises(DeviceError, match="enable before configure"):
        serial.drive.enable()
    assert serial.asked() == []


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


@pytest.mark.parametrize("why", ["told to stop", "keeps its velocity", "still being told"])
def test_beyond_the_horizon_only_a_move_that_ended_by_itself_is_a_cause(why):
    if why == "keeps its velocity":
        serial = Serial(mode="velocity", external_watchdog=True)
        serial.port.replies["g r0x24"] = "v 11"
    else:
        serial = Serial()
    serial.tick()
    if why == "told to stop":
        serial.drive.stop()
    elif why == "still being told":
        serial.port.answering.clear()
        serial.drive.write(0.5)
        assert serial.drive._line.busy
    serial.clock.time_s += 0.1005
    assert serial.drive.read().cause == Cause.NONE
    serial.port.answering.set()
    serial.drive.close()


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
