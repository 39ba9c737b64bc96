"""A moving node that somebody takes out of operation, on two CANopen stacks.

The drive has neither a command deadline nor a heartbeat watchdog that ends in time, and does
nothing by itself: only what the driver sends stops it. Initialising takes the power off.
"""

from __future__ import annotations

import math
import time

import can
import pytest
from tests.wire.cia402_wire import GROUP, emulated_arm, free_port, wait_until
from tests.wire.durand_axis import DurandAxis

from rigidimeter.devices.cia402.drive import Cia402Drive
from rigidimeter.emulation.cia402.cia402_emulator import Cia402Emulator
from rigidimeter.guard import Cause

STACKS = {"canopen": Cia402Emulator, "durand": DurandAxis}
TICK_S, HEARTBEAT_S = 0.004, 0.02
SPEED_RAD_S, QUICK_STOP_RAD_S2 = 1.0, 20.0
BANDWIDTH_S = 0.02
"""A drive of 50 Hz comes to 1 % of a step within it."""

STATES = {
    "operational": (None, Cause.NONE),
    "pre-operational": (0x80, Cause.DRIVE_STATE),
    "stopped": (0x02, Cause.DRIVE_STATE),
    "initialising (reset node)": (0x81, Cause.DRIVE_FAULT),
    "initialising (reset communication)": (0x82, Cause.DRIVE_FAULT),
}


@pytest.fixture(params=STACKS)
def moving(request):
    """Give a node, a driver whose arm turns, and another master's bus."""
    where = {"interface": "udp_multicast", "channel": GROUP, "port": free_port()}
    node = STACKS[request.param](emulated_arm(), **where)
    drive = Cia402Drive(
        Cia402Drive.Settings(
            heartbeat_s=HEARTBEAT_S,
            lost_s=0.2,
            drive_watchdog_s=5.0,
            command_deadline_s=0.0,
            quick_stop_rad_s2=QUICK_STOP_RAD_S2,
            **where,
        ),
        time.monotonic,
    )
    other = can.Bus(**where)
    try:
        drive.connect()
        drive.configure()
        drive.enable()
        assert go_on(drive, for_s=0.3).cause == Cause.NONE
        assert node.state()["velocity_rad_s"] == pytest.approx(SPEED_RAD_S, abs=0.02)
        yield node, drive, other
    finally:
        drive.close()
        other.shutdown()
        node.close()


def go_on(drive, for_s=1.0, until=lambda _: False):
    """Ask for the speed at every tick, whatever the driver says."""
    end_s = time.monotonic() + for_s
    while True:
        sample = drive.read()
        drive.write(SPEED_RAD_S)
        if until(sample) or time.monotonic() > end_s:
            return sample
        time.sleep(TICK_S)


@pytest.mark.parametrize("state", STATES)
def test_a_moving_node_comes_to_rest_in_every_network_state(moving, state, lateness):
    node, drive, other = moving
    command, cause = STATES[state]
    began_s = time.monotonic()
    if command is None:
        drive.stop()
    else:
        other.send(can.Message(arbitration_id=0, data=[command, 1], is_extended_id=False))
    sample = go_on(drive, until=lambda _: abs(node.state()["velocity_rad_s"]) < 0.01)
    rest_s = time.monotonic() - began_s
    print(f"\n{state}: at rest after {rest_s:.3f} s")
    assert Cause(sample.cause) is cause
    ramp_s = SPEED_RAD_S / QUICK_STOP_RAD_S2
    bound_s = HEARTBEAT_S + TICK_S + ramp_s + BANDWIDTH_S
    assert rest_s < bound_s + 0.01 + lateness.worst_s(began_s)
    # It says so itself, and what is written does not move it again.
    go_on(drive, until=lambda _: not drive.powered)
    assert not drive.powered
    assert not node.state()["power"]
    assert math.isclose(node.state()["velocity_rad_s"], 0.0, abs_tol=0.01)


@pytest.mark.parametrize("state", ["pre-operational", "stopped"])
def test_a_stop_or_the_end_reaches_a_node_before_its_heartbeat_told_its_state(moving, state):
    """The driver does not know yet; the node's next heartbeat tells it what else it must send."""
    node, drive, other = moving
    command, _ = STATES[state]
    other.send(can.Message(arbitration_id=0, data=[command, 1], is_extended_id=False))
    drive.disable()
    go_on(drive, until=lambda _: not drive.powered)
    assert not drive.powered
    assert not node.state()["power"]


def test_what_is_not_watched_does_not_stop():
    """A heartbeat watchdog that reads back as written, and does nothing: only a trial shows it."""
    where = {"interface": "udp_multicast", "channel": GROUP, "port": free_port()}
    node = DurandAxis(emulated_arm(), watches=False, **where)
    settings = Cia402Drive.Settings(drive_watchdog_s=0.1, lost_s=0.2, **where)
    drive = Cia402Drive(settings, time.monotonic)
    try:
        drive.connect()
        facts = drive.configure()
        assert facts.watchdog_s == 0.1
        assert facts.values["heartbeat watchdog (0x1016:01)"] == 127 << 16 | 100
        assert facts.values["command deadline in ms (0x1400:05)"] == "absent"
        drive.enable()
        go_on(drive, for_s=0.2)
        time.sleep(0.5)
        assert node.state()["velocity_rad_s"] == pytest.approx(SPEED_RAD_S, abs=0.02)
        drive.stop()
        assert wait_until(lambda: not node.state()["power"])
    finally:
        drive.close()
        node.close()
