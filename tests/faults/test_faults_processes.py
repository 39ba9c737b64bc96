"""Faults 9 and 19 to 21 with true processes: one is killed or stopped while the arm swings.

Bench, console, loop and recorder are four processes. What is measured is the arm of the bench. One
signal of each kind is tried every time; the others take as long again and are marked slow.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from tests.faults.running_session import fill
from tests.faults.session import CONSOLE_LOST_S, PATIENCE, RATE_HZ, RECORDER_LOST_S, SPEED_DEG_S
from tests.lateness import PRESENT
from tests.wire.rig_process import RigProcess

from rigidimeter.core.session import read_samples
from rigidimeter.rig.guard import Cause

ROOT = Path(__file__).parents[2]
RIG = {"cia402": "rdt_canopen", "ascii": "rdt_ascii"}
WATCHDOG_S = {"cia402": 0.1, "ascii": 0.1}
"""The emulated servo's command deadline; the horizon of a serial drive's moves."""

BRAKING_DEG_S2 = {"cia402": math.degrees(120.0), "ascii": 7000.0}
"""The quick stop that the rig file leaves at its default; the serial drive's deceleration."""

SLACK_S = 0.05
"""The bench is asked through a pipe every few milliseconds, on a machine that does other things."""


def slack_s(at_s):
    """Return what the machine may have added since a time."""
    return SLACK_S + PRESENT[0].worst_s(at_s)


class Session:
    """The processes under test; all that were started here are ended here."""

    def __init__(self, bench, folder):
        self.bench, self.folder = bench, folder
        self.errors = (bench.rig.parent / "errors.txt").open("w+b")  # not on a disk that is full
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tests.faults.session", str(bench.rig), str(folder)],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=self.errors,
            start_new_session=True,
        )
        self.pids = {}

    def __enter__(self):
        first = self.line(40.0)
        assert "LOOP" in first, f"the session ended before it ran: {first}"
        self.pids = {name: pid for name, pid in first.items() if pid}
        return self

    def __exit__(self, *_):
        for pid in self.pids.values():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(5.0)  # what is killed leaves its shared memory
        for pid in self.pids.values():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        self.errors.close()

    def line(self, timeout_s):
        assert select.select([self.process.stdout], [], [], timeout_s)[0], self.said()
        line = self.process.stdout.readline()
        assert line, self.said()
        return json.loads(line)

    def said(self):
        self.errors.seek(0)
        return self.errors.read().decode()[-3000:]

    def signal_at_speed(self, role, number):
        """Signal a process when the arm is fast; return the time at which that was."""
        fast = 0.8 * math.radians(SPEED_DEG_S[self.drive])
        self.bench.wait_until(lambda state: abs(state["velocity_rad_s"]) > fast)
        at_s = time.monotonic()
        os.kill(self.pids[role], number)
        return at_s

    @property
    def drive(self):
        return self.bench.ready["drive"]

    def rest_s(self, at_s, within_s):
        """Return how long after a time the arm was first seen to stand still for good.

        Between the last look at which it moved and that one it may have stopped at any time: the
        answer is too long by so much, never too short, and the bench is asked every few ms.
        """
        still_s = None
        until_s = at_s + within_s + 0.5
        while time.monotonic() < until_s:
            state = self.bench.state()
            moves = abs(state["velocity_rad_s"]) > 0.02
            still_s = None if moves else still_s or state["time_s"]
            time.sleep(0.002)
        assert still_s is not None, "the arm still moves"
        return still_s - at_s

    def closed(self, timeout_s=15.0):
        """Wait until the folder is closed; return its events and samples."""
        until_s = time.monotonic() + timeout_s
        while time.monotonic() < until_s:
            lines = (self.folder / "events.jsonl").read_text().splitlines()
            events = [json.loads(line) for line in lines]
            if events and events[-1]["event"] == "session_ended":
                return events, read_samples(self.folder / "samples.arrows")
            time.sleep(0.02)
        pytest.fail(f"the session was not closed in {timeout_s} s: {self.said()}")


@contextlib.contextmanager
def session(drive, tmp_path, folder=None):
    with (
        RigProcess(tmp_path / "RIG.toml", drive) as bench,
        Session(bench, folder or tmp_path / "s") as running,
    ):
        yield running


def assert_whole(samples):
    """Assert that no tick is missing that was not late."""
    late = samples["lateness_s"] * np.round(1.0 / np.median(np.diff(samples["time_s"])))
    left_out = np.diff(samples["tick"]) - 1
    np.testing.assert_array_equal(left_out, np.floor(late[1:] + 1e-9).clip(0))


@pytest.mark.parametrize(
    ("drive", "number"),
    [
        ("cia402", signal.SIGKILL),
        pytest.param("cia402", signal.SIGSTOP, marks=pytest.mark.slow),
        pytest.param("ascii", signal.SIGKILL, marks=pytest.mark.slow),
    ],
)
def test_fault_09_loop_process_lost(drive, number, tmp_path, measured):
    """Nobody commands the drive any more: it stops itself."""
    with session(drive, tmp_path) as running:
        at_s = running.signal_at_speed("LOOP", number)
        bound_s = WATCHDOG_S[drive] + SPEED_DEG_S[drive] / BRAKING_DEG_S2[drive] + 0.02
        rest_s = running.rest_s(at_s, bound_s)
        state = running.bench.state()
        if drive == "cia402":
            rest_s = state["stop_rest_s"] - at_s  # the drive's own word, exact
            # By its watchdog and nothing else: the last command was sent some ticks before.
            assert state["stop_began_s"] - at_s >= 0.5 * WATCHDOG_S[drive]
            assert not state["power"]
            log = [text for _, text in running.bench.log()]
            assert any("emergency 0x8250" in text or "0x8130" in text for text in log)
        assert rest_s <= bound_s + slack_s(at_s)
        events, samples = running.closed()
        assert events[-1]["outcome"] == "fail"
        lost = {
            signal.SIGKILL: "the loop's process ended without closing the session",
            signal.SIGSTOP: "the loop's process did not answer",
        }
        assert events[-1]["reason"].startswith(lost[number])
        assert [event["event"] for event in events].count("epoch_ended") == 1
        assert_whole(samples)
        measured(9, RIG[drive], signal.Signals(number).name, rest_s=rest_s, bound_s=bound_s)


@pytest.mark.parametrize(
    "number", [signal.SIGSTOP, pytest.param(signal.SIGKILL, marks=pytest.mark.slow)]
)
def test_fault_19_console_process_lost(number, tmp_path, measured):
    with session("cia402", tmp_path) as running:
        at_s = running.signal_at_speed("CONSOLE", number)
        lost_s = CONSOLE_LOST_S if number is signal.SIGSTOP else 0.0  # its end is seen at once
        bound_s = lost_s + 1 / RATE_HZ["cia402"] + 126 / 6000 + 0.03
        rest_s = running.rest_s(at_s, bound_s)
        assert rest_s <= bound_s + slack_s(at_s)
        events, samples = running.closed()
        assert Cause.CONSOLE_LOST.sentence in events[-1]["reason"]
        assert samples["cause"][-1] == int(Cause.CONSOLE_LOST)
        assert samples["velocity_command_rad_s"][-1] == 0.0
        assert_whole(samples)
        assert not running.bench.state()["power"]
        if number is signal.SIGSTOP:  # it goes on, and says what has happened meanwhile
            os.kill(running.pids["CONSOLE"], signal.SIGCONT)
            assert Cause.CONSOLE_LOST.sentence in running.line(15.0)["reason"]
        measured(19, "rdt_canopen", signal.Signals(number).name, rest_s=rest_s, bound_s=bound_s)


@pytest.mark.parametrize(
    "number",
    [
        signal.SIGQUIT,
        *(
            pytest.param(number, marks=pytest.mark.slow)
            for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
        ),
    ],
)
def test_fault_20_signals(number, tmp_path, measured):
    with session("cia402", tmp_path) as running:
        at_s = running.signal_at_speed("CONSOLE", number)
        bound_s = 2 / RATE_HZ["cia402"] + 126 / 6000 + 0.03
        rest_s = running.rest_s(at_s, bound_s)
        assert rest_s <= bound_s + slack_s(at_s)
        events, samples = running.closed()
        if number is signal.SIGINT:
            assert events[-1]["outcome"] == "abort"
        else:
            assert Cause.SIGNAL.sentence in events[-1]["reason"]
        assert samples["velocity_command_rad_s"][-1] == 0.0
        assert_whole(samples)
        assert not running.bench.state()["power"]
        measured(20, "rdt_canopen", signal.Signals(number).name, rest_s=rest_s, bound_s=bound_s)


@pytest.mark.parametrize(
    "number", [signal.SIGSTOP, pytest.param(signal.SIGKILL, marks=pytest.mark.slow)]
)
def test_fault_21_recorder_process_lost(number, tmp_path, measured):
    """The loop goes on until it must not, then stops in order; nothing of the record is lost."""
    with session("cia402", tmp_path) as running:
        at_s = running.signal_at_speed("RECORDER", number)
        bound_s = RECORDER_LOST_S + 1 / RATE_HZ["cia402"] + 126 / 6000 + 0.03
        rest_s = running.rest_s(at_s, bound_s)
        assert 0.5 * RECORDER_LOST_S < rest_s <= bound_s + slack_s(at_s)
        events, samples = running.closed()
        assert Cause.RECORDER_LOST.sentence in events[-1]["reason"]
        assert samples["cause"][-1] == int(Cause.RECORDER_LOST)
        assert samples["velocity_command_rad_s"][-1] == 0.0
        assert_whole(samples)
        measured(21, "rdt_canopen", signal.Signals(number).name, rest_s=rest_s, bound_s=bound_s)


@pytest.mark.slow
def test_fault_21_disk_full(tmp_path, small_disk, measured):
    """The arm stops before the ring is full; with room again, nothing of the record is missing."""
    with session("cia402", tmp_path, small_disk / "s") as running:
        ballast = fill(small_disk)
        at_s = time.monotonic()
        # What waits is looked at now and then, and a batch may have had room.
        bound_s = RECORDER_LOST_S + 4 * PATIENCE.poll_s + 126 / 6000 + 0.03
        rest_s = running.rest_s(at_s, bound_s)
        assert rest_s <= bound_s + slack_s(at_s)
        assert not running.bench.state()["power"]
        assert running.process.poll() is None
        ballast.unlink()
        events, samples = running.closed()
        assert Cause.RECORD_OVERFLOW.sentence in events[-1]["reason"]
        assert samples["cause"][-1] == int(Cause.RECORD_OVERFLOW)
        assert samples["velocity_command_rad_s"][-1] == 0.0
        assert_whole(samples)
        measured(21, "rdt_canopen", "its disk full", rest_s=rest_s, bound_s=bound_s)
