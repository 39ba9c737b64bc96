"""Servo and driver in two processes, of which one is killed or stopped."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest
from tests.lateness import ordinary_priority, same_priority
from tests.wire.cia402_wire import GROUP, SLACK, emulated_arm, free_port, run_loop, wait_until

from rigidimeter.rig.devices import Cia402Drive, Cia402Settings, Cia402State, state_of
from rigidimeter.rig.guard import Cause
from rigidimeter.testing import Cia402Emulator

EMULATOR = """
import sys
from rigidimeter.testing import EmulatedArm
from rigidimeter.testing.cia402.cia402_emulator import Cia402Emulator
from rigidimeter.model.joint import JointDynamics

arm = EmulatedArm(JointDynamics(0.08, 0.5, 10.0))
channel, port = sys.argv[1], int(sys.argv[2])
emulator = Cia402Emulator(arm, interface="udp_multicast", channel=channel, port=port)
print("ready", flush=True)
for line in sys.stdin:
    name = line.strip()
    emulator.misbehave(name) if name else print(emulator.state()["power"], flush=True)
emulator.close()
"""
DRIVER = """
import sys, time
from rigidimeter.rig.devices.cia402.drive import Cia402Drive, Cia402Settings

drive = Cia402Drive(
    Cia402Settings(
        interface="udp_multicast", channel=sys.argv[1], port=int(sys.argv[2]), lost_s=1.0,
        heartbeat_s=0.02, drive_watchdog_s=0.3, command_deadline_s=float(sys.argv[3]),
        quick_stop_rad_s2=60.0,  # a ramp that the arm can follow: it rings after a steeper one
    ),
    time.monotonic,
)
drive.connect()
drive.configure()
drive.enable()
print("ready", flush=True)
while True:
    drive.read()
    drive.write(1.0)
    time.sleep(0.002)
"""


@pytest.fixture
def started() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    processes: list[subprocess.Popen[str]] = []

    def start(code: str, *arguments: object) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, "-c", code, *map(str, arguments)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            preexec_fn=ordinary_priority,
        )
        processes.append(process)
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        same_priority(process.pid)
        return process

    yield start
    for process in processes:
        process.kill()
        process.communicate()


def test_a_drive_in_another_process_runs_and_is_missed_when_it_is_killed(started, lateness):
    port = free_port()
    emulator = started(EMULATOR, GROUP, port)
    settings = Cia402Settings(
        interface="udp_multicast", channel=GROUP, port=port, **{**SLACK, "lost_s": 0.2}
    )
    drive = Cia402Drive(settings, time.monotonic)
    try:
        drive.connect()
        drive.configure()
        drive.enable()
        sample = run_loop(drive, 0.5, for_s=0.5)
        assert sample.cause == Cause.NONE
        assert state_of(sample.status & 0xFFFF) is Cia402State.OPERATION_ENABLED
        assert sample.velocity_rad_s == pytest.approx(0.5, abs=0.01)
        emulator.kill()
        killed_s = time.monotonic()
        assert Cause(run_loop(drive, 0.5).cause) is Cause.DRIVE_LOST
        assert time.monotonic() - killed_s < 0.2 + 0.05 + lateness.worst_s(killed_s)
    finally:
        drive.close()


@pytest.mark.parametrize(("blow", "deadline_s"), [(signal.SIGKILL, 0.0), (signal.SIGSTOP, 0.15)])
def test_a_killed_or_stopped_program_leaves_the_drive_to_stop_itself(
    started, lateness, blow, deadline_s
):
    port = free_port()
    emulator = Cia402Emulator(emulated_arm(), interface="udp_multicast", channel=GROUP, port=port)
    try:
        program = started(DRIVER, GROUP, port, deadline_s)
        assert wait_until(lambda: emulator.state()["velocity_rad_s"] > 0.9, for_s=5.0)
        os.kill(program.pid, blow)
        struck_s = time.monotonic()
        assert wait_until(lambda: not emulator.state()["power"])
        stop = emulator.state()
        within_s = deadline_s or 0.3
        print(
            f"\n{blow.name}: braking after {stop['stop_began_s'] - struck_s:.3f} s, at rest after "
            f"{stop['stop_rest_s'] - struck_s:.3f} s; watchdog {within_s:g} s"
        )
        assert stop["stop_began_s"] - struck_s < within_s + 0.05 + lateness.worst_s(struck_s)
        assert abs(stop["velocity_rad_s"]) < 0.02
    finally:
        emulator.close()
