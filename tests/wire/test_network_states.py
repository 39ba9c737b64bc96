"""A moving node that somebody takes out of operation, on two CANopen stacks.

The drive has neither a command deadline nor a heartbeat watchdog that ends in time, and does
nothing by itself: only what the driver sends stops it. Initialising takes the power off.
"""

from __future__ import annotations

import math
import time
from dataclasses import replace

import can
import pytest
from tests.wire.cia402_wire import GROUP, emulated_arm, free_port
from tests.wire.durand_axis import DurandAxis
from tests.wire.trial_setup import settings, setup

from rigidimeter.rig.commissioning import Operator, watchdog_checks
from rigidimeter.rig.devices import Cia402Drive, load_rig
from rigidimeter.rig.guard import Cause
from rigidimeter.testing import (
    Cia402Emulator,
    ConformanceError,
    DriveFixture,
    OtherEnd,
    RdtEmulator,
    drive_stops_by_itself,
)

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


@pytest.mark.parametrize("watches", [True, False], ids=["watches", "says that it watches"])
def test_only_a_trial_shows_whether_a_watchdog_that_reads_back_as_written_stops_the_drive(
    watches, tmp_path
):
    arm = emulated_arm()
    where = {"interface": "udp_multicast", "channel": GROUP, "port": free_port()}
    node = DurandAxis(arm, watches=watches, **where)
    with RdtEmulator(arm) as sensor:
        path = tmp_path / "RIG.toml"
        path.write_text(
            'name = "second stack"\n[torque_sensor]\ndriver = "ati-rdt"\n'
            f'address = "{sensor.address}"\nport = {sensor.port}\nhttp_port = {sensor.http_port}\n'
            f'[drive]\ndriver = "cia402"\ninterface = "udp_multicast"\nchannel = "{GROUP}"\n'
            f"port = {where['port']}\nlost_s = 0.2\ndrive_watchdog_s = 0.3\n"
        )
        asked = Operator(ask=lambda _: True, present=False)
        tried = setup(load_rig(path), settings(250.0), asked)
        try:
            tried.rig.connect()
            facts = tried.rig.configure()["drive"]
            assert facts["values"]["heartbeat watchdog (0x1016:01)"] == 127 << 16 | 300
            found = {check.name: check for check in watchdog_checks(tried, facts["watchdog_s"])}
        finally:
            tried.rig.close()
            node.close()
    assert found["watchdog"].outcome == ("passed" if watches else "failed"), found
    if not watches:
        assert found["watchdog"].value > 0.5
        assert "keeps moving when the computer stops" in found["watchdog"].remedy


def test_conformance_does_not_believe_a_drive_that_says_that_it_watches():
    where = {"interface": "udp_multicast", "channel": GROUP, "port": free_port()}
    arm = emulated_arm()
    node = DurandAxis(arm, watches=False, **where)
    values = Cia402Drive.Settings(drive_watchdog_s=0.1, lost_s=0.2, **where)
    fixture = DriveFixture(
        lambda: Cia402Drive(values, time.monotonic),
        other_end=OtherEnd(lambda: bool(node.state()["power"]), lambda: arm.motion()[1]),
        tick_s=TICK_S,
        settle_s=0.3,
    )
    try:
        with pytest.raises(ConformanceError, match=r"at rest 0\.1 s after the last command"):
            drive_stops_by_itself(fixture)
        with pytest.raises(ConformanceError, match="nothing proves that the drive stops"):
            drive_stops_by_itself(replace(fixture, other_end=None))
    finally:
        node.close()
