"""What the guard does to a rig, as the other end of the wire and the enable contact see it.

    hold     zero velocity is written, tick after tick, and the power stays
    stop     the velocity comes down in a ramp, then the power goes
    cut      the contact opens and the power goes at once
    disable  the same, without a motion before
    enable   the contact closes first, and the first velocity is zero

Nothing here is the driver's own word: CAN frames are those that another node of the bus received,
serial requests those that the emulated drive read. The contact is the line of a serial port, which
no pseudo-terminal has, so the port is replaced where pyserial would be. Its changes are put among
the frames and requests, in their order.
"""

from __future__ import annotations

import math
import struct
import time
from contextlib import contextmanager
from typing import NamedTuple

import can
import pytest
from tests.faults.rigs import ASCII, CANOPEN, WIRES, bench
from tests.faults.trials import Desk, run

from rigidimeter.rig.acquisition import ControlLoop, follow, hold, skip_passed_ticks
from rigidimeter.rig.devices import SerialEnableLine
from rigidimeter.rig.guard import Cause
from rigidimeter.testing import UNITS_PER_RAD

SPEED_RAD_S = 0.5
MARK = 0x7E5
"""An identifier that no node has."""

POWER = {0x0F: "on", 0x02: "quick stop", 0x00: "off"}


class Seen(NamedTuple):
    """One thing that arrived: what it asks of the power, and the velocity, if it is about them."""

    what: str
    power: str = ""
    velocity_rad_s: float = math.nan


class CanWire:
    """Another node of the bus, which hears everything."""

    def __init__(self, made) -> None:
        channel = made.drive_emulator._bus.channel_id
        self._ear = can.Bus(interface="virtual", channel=channel)
        self._mouth = can.Bus(interface="virtual", channel=channel)
        self._open = True

    def mark(self, what: str) -> None:
        message = can.Message(arbitration_id=MARK, data=what.encode(), is_extended_id=False)
        if self._open:  # the contact opens once more at the very end
            self._mouth.send(message)

    def seen(self) -> list[Seen]:
        """Return what arrived so far. The bus keeps the order, and is never quiet."""
        self.mark("seen")
        return list(iter(lambda: _frame(self._ear.recv(1.0)), Seen("seen")))

    def close(self) -> None:
        self._open = False
        self._ear.shutdown()
        self._mouth.shutdown()


def _frame(message: can.Message) -> Seen:
    identifier, data = message.arbitration_id, bytes(message.data)
    if identifier == MARK:
        return Seen(data.decode())
    if identifier == 0x201:
        control, target = struct.unpack("<Hi", data)
        return Seen("command", POWER.get(control, "steps"), target / UNITS_PER_RAD)
    if identifier == 0x601 and data[:4] == b"\x2b\x40\x60\x00":  # 0x6040, two bytes
        return Seen("by SDO", POWER.get(data[4], "steps"))
    if identifier == 0 and data == b"\x80\x01":
        return Seen("pre-operational")
    return Seen("other")


class SerialWire:
    """The requests that the emulated drive read."""

    def __init__(self, made) -> None:
        self._log = made.drive_emulator.log
        self._per_rad = 360_000.0 / (2 * math.pi)

    def mark(self, what: str) -> None:
        self._log.append((time.monotonic(), f"({what})", ""))

    def seen(self) -> list[Seen]:
        found, next_rad_s = [], math.nan
        for _, request, _ in list(self._log):
            if request.startswith("s r0xcb"):
                next_rad_s = 0.1 * int(request.split()[2]) / self._per_rad
            elif request == "t 1":
                found.append(Seen("command", "on", next_rad_s))
            elif request == "t 0":
                found.append(Seen("command", "on", 0.0))
            elif request.startswith("s r0x24"):
                found.append(Seen("state", "off" if request.endswith(" 0") else "on"))
            elif request.startswith("("):
                found.append(Seen(request[1:-1]))
        return found

    def close(self) -> None: ...


class Port:
    """A serial port whose lines are seen among what is on the wire."""

    def __init__(self, mark) -> None:
        self._mark, self._rts, self.dtr = mark, False, False

    @property
    def rts(self) -> bool:
        return self._rts

    @rts.setter
    def rts(self, raised: bool) -> None:
        if raised != self._rts:
            self._mark("closes" if raised else "opens")
        self._rts = raised

    def close(self) -> None:
        self.rts = False


@contextmanager
def rig_on_wire(name):
    with bench(name) as made:
        wire = CanWire(made) if name == CANOPEN else SerialWire(made)
        port = Port(wire.mark)
        settings = SerialEnableLine.Settings(port="/dev/no-such")
        made.rig._line = SerialEnableLine(settings, made.clock.now_s, lambda _: port)
        try:
            yield made, wire, port
        finally:
            wire.close()


def after(seen: list[Seen], what: str) -> list[Seen]:
    """Return what came after the first of this name."""
    return seen[[s.what for s in seen].index(what) + 1 :]


def commands(seen: list[Seen]) -> list[Seen]:
    return [s for s in seen if s.what == "command"]


def last_step(made) -> float:
    """Return what the last command may be: a serial line may be busy when the zero is due."""
    step = math.radians(made.settings.guard.acceleration_limit_deg_s2) / made.rate_hz
    return step if made.name == ASCII else 0.0


class Marking(Desk):
    """An operator or another process that names a cause at a tick, seen on the wire as a mark."""

    def __init__(self, wire, cause: Cause, tick: int) -> None:
        super().__init__(causes={tick: cause})
        self._wire = wire

    def cause(self, now_s: float) -> int:
        found = super().cause(now_s)
        if found:
            self._wire.mark("cause")
        return found


def loop_in_motion(made, wire, cause: Cause):
    """Enable the rig and move it, until the guard takes this cause."""
    ticks = round(0.2 * made.rate_hz)
    supervision = Marking(wire, cause, ticks)
    loop = ControlLoop(made.settings, made.rig, made.clock, lambda _: None, supervision=supervision)
    made.rig.enable()
    skip_passed_ticks(loop)
    step_rad = SPEED_RAD_S / made.rate_hz
    n = 2 * ticks
    ended = follow(loop, 1, [step_rad * k for k in range(n)], [SPEED_RAD_S] * n)
    assert ended.cause is cause
    return loop


@pytest.mark.parametrize("rig", WIRES)
def test_hold_writes_zero_velocity_and_keeps_the_power(rig):
    with rig_on_wire(rig) as (made, wire, port):
        loop = loop_in_motion(made, wire, Cause.TORQUE_HIGH)
        hold(loop, 0.3)
        assert made.powered
        seen = after(wire.seen(), "cause")
        sent = commands(seen)
        assert len(sent) >= (100 if rig == CANOPEN else 8)
        assert {s.power for s in sent} == {"on"}
        assert [s.velocity_rad_s for s in sent[len(sent) // 2 :]] == [0.0] * (
            len(sent) - len(sent) // 2
        )
        assert "opens" not in [s.what for s in seen]
        assert port.rts
        assert abs(made.arm.motion()[1]) < 0.02


@pytest.mark.parametrize("rig", WIRES)
def test_stop_is_a_ramp_and_then_no_power(rig, tmp_path):
    with rig_on_wire(rig) as (made, wire, port):
        desk = Marking(wire, Cause.SIGNAL, round(0.25 * made.rate_hz))
        trial = run(made, tmp_path / "s", desk=desk)
        seen = after(wire.seen(), "cause")
        before = abs(trial.samples["velocity_command_rad_s"][trial.first - 1])
        powered = [s for s in commands(seen) if s.power == "on"]
        ramp = [abs(s.velocity_rad_s) for s in powered]
        assert ramp[-1] <= last_step(made)
        assert ramp == sorted(ramp, reverse=True)
        # In steps of at most what a late tick may catch up on.
        limit = math.radians(made.settings.guard.acceleration_limit_deg_s2) / made.rate_hz
        steps = [a - b for a, b in zip([before, *ramp], ramp, strict=False)]
        assert max(steps) <= 5 * limit + 1e-3
        assert sum(s > 0 for s in steps) >= (5 if rig == CANOPEN else 1)
        # The power goes after the last zero, by the contact and by the drive.
        names = [s.what for s in seen]
        last_on = max(i for i, s in enumerate(seen) if s.power == "on")
        first_off = min(i for i, s in enumerate(seen) if s.power == "off")
        assert last_on < names.index("opens") < first_off
        assert not port.rts
        assert not made.powered


@pytest.mark.parametrize("rig", WIRES)
def test_cut_opens_the_contact_and_takes_the_power_in_the_same_tick(rig, tmp_path):
    with rig_on_wire(rig) as (made, wire, port):
        desk = Marking(wire, Cause.EMERGENCY_STOP, round(0.25 * made.rate_hz))
        run(made, tmp_path / "s", desk=desk)
        seen = after(wire.seen(), "cause")
        assert next(s.what for s in seen if s.what != "other") == "opens"
        asks = [s for s in after(seen, "opens") if s.power]
        # The batch that the serial line was carrying may end with what it began.
        assert asks[0].power == "off" or (rig == ASCII and asks[1].power == "off")
        first_off = [s.power for s in asks].index("off")
        assert {s.power for s in asks[first_off:]} == {"off"} or rig == ASCII
        assert "on" not in [s.power for s in asks[first_off:] if s.velocity_rad_s != 0.0]
        if rig == CANOPEN:
            assert "by SDO" in [s.what for s in asks]  # which needs no mapping
        assert not port.rts
        assert not made.powered


@pytest.mark.parametrize("rig", WIRES)
def test_the_contact_closes_before_power_is_asked_for_and_zero_is_sent_first(rig):
    with rig_on_wire(rig) as (made, wire, port):
        wire.mark("enable")
        made.rig.enable()
        made.rig.write(0.0)
        time.sleep(0.05)
        seen = after(wire.seen(), "enable")
        names = [s.what for s in seen]
        first_on = min(i for i, s in enumerate(seen) if s.power == "on")
        assert names.index("closes") < first_on
        assert port.rts
        assert {s.velocity_rad_s for s in commands(seen)} == {0.0}


def moving(made, wire):
    """Enable and command a velocity until the arm has it."""
    made.rig.enable()
    until_s = time.monotonic() + 2.0
    while made.arm.motion()[1] < 0.8 * SPEED_RAD_S:
        assert time.monotonic() < until_s
        made.rig.read()
        made.rig.write(SPEED_RAD_S)
        time.sleep(1.0 / made.rate_hz)
    wire.mark("now")


def insist(made, for_s=0.15):
    """Go on commanding a velocity, as a loop would that does not know."""
    until_s = time.monotonic() + for_s
    while time.monotonic() < until_s:
        made.rig.read()
        made.rig.write(SPEED_RAD_S)
        time.sleep(1.0 / made.rate_hz)


@pytest.mark.parametrize("rig", WIRES)
def test_the_drives_own_stop_is_asked_for_and_not_taken_back(rig):
    with rig_on_wire(rig) as (made, wire, port):
        moving(made, wire)
        made.rig.stop()
        insist(made)
        seen = [s for s in after(wire.seen(), "now") if s.power]
        if rig == CANOPEN:
            assert {s.power for s in seen} == {"quick stop"}
            assert "by SDO" in [s.what for s in seen]
        else:
            assert [s.velocity_rad_s for s in commands(seen)][-1] == 0.0
            stopped = [s.velocity_rad_s for s in commands(seen)].index(0.0)
            assert {s.velocity_rad_s for s in commands(seen)[stopped:]} == {0.0}
        assert port.rts  # the contact is not part of a stop
        assert abs(made.arm.motion()[1]) < 0.02


@pytest.mark.parametrize("rig", WIRES)
@pytest.mark.parametrize("end", ["disable", "close"])
def test_disable_and_close_take_the_power_and_it_does_not_come_back(rig, end):
    with rig_on_wire(rig) as (made, wire, port):
        moving(made, wire)
        getattr(made.rig, end)()
        insist(made)
        seen = after(wire.seen(), "now")
        asks = [s for s in after(seen, "opens") if s.power]
        off = [s.power for s in asks].index("off")
        assert off <= (0 if rig == CANOPEN else 1)
        assert "on" not in [s.power for s in asks[off:]]
        if rig == CANOPEN:
            assert {"command", "by SDO"} <= {s.what for s in asks}
            assert ("pre-operational" in [s.what for s in seen]) == (end == "close")
        assert not port.rts
        assert not made.powered
        if end == "close":  # the sensor's stream ends too
            time.sleep(0.05)
            assert made.sensor_emulator.requests[-1] == 0


def test_a_sensor_that_falls_silent_stops_the_drive_and_opens_the_contact(tmp_path):
    with rig_on_wire(CANOPEN) as (made, wire, port):

        def silent():
            wire.mark("silent")
            made.sensor_emulator.misbehave("silent")

        trial = run(made, tmp_path / "s", silent)
        assert trial.result.cause is Cause.TORQUE_STALE
        seen = after(wire.seen(), "silent")
        on = [abs(s.velocity_rad_s) for s in commands(seen) if s.power == "on"]
        assert on[-1] <= last_step(made)
        last_on = max(i for i, s in enumerate(seen) if s.power == "on")
        assert "opens" in [s.what for s in seen[last_on:]]
        assert "off" in [s.power for s in seen[last_on:]]
        assert not port.rts
