"""The driver of CANopen servos behind a serial adapter that holds frames back.

The emulated drive reports when it measured as its position, so that the stamp of a sample can be
compared with the truth, however busy the machine is.
"""

from __future__ import annotations

import itertools
import os
import pty
import signal
import time
from contextlib import suppress
from types import SimpleNamespace

import can
import pytest
from tests.wire.cia402_wire import emulated_arm
from tests.wire.durand_axis import DurandAxis
from tests.wire.slcan_adapter import Manners, adapter

from rigidimeter.rig.devices import Cia402Drive
from rigidimeter.rig.guard import Cause
from rigidimeter.testing import Cia402Emulator

TICK_S, LOST_S = 0.004, 0.2
COUNTS_PER_S = 1e5
_channels = itertools.count()

ALWAYS = {
    "acknowledges nothing": Manners(acknowledges=False),
    "acknowledges": Manners(),
    "a line as slow as 115,200 baud": Manners(bytes_per_s=8000.0),  # 250 ticks/s would fill it
    "bursts": Manners(burst_s=0.01),
}
LOSES = Manners(loses_every=97)
LATE = Manners(late_every=100, late_s=(TICK_S, 50 * TICK_S))
SYNC = can.Message(arbitration_id=0x080, is_extended_id=False)


def ticks(stack, always=ALWAYS["acknowledges"], enabled=None, other=None, for_s=1.0):
    """Return the cause of the end, the counts, and every sample's age by stamp and in truth.

    The adapter may change its manners once the drive is enabled. `other` is sent by another master.
    """
    channel = f"slcan {next(_channels)}"
    emulator = stack(emulated_arm(), interface="virtual", channel=channel)
    second = can.Bus(interface="virtual", channel=channel)
    began_s = time.monotonic()
    emulator._servo.measured = lambda: (round((time.monotonic() - began_s) * COUNTS_PER_S), 0)
    ages = []
    try:
        with adapter(channel, always) as made:
            settings = Cia402Drive.Settings(
                interface="slcan",
                channel=made.port,
                lost_s=LOST_S,
                drive_watchdog_s=2.0,
                command_deadline_s=0.0,
                sdo_timeout_s=1.0,
            )
            drive = Cia402Drive(settings, time.monotonic)
            drive.connect()
            try:
                drive.configure()
                drive.enable()
                made.behave(enabled or always)
                end_s = time.monotonic() + for_s
                while (now_s := time.monotonic()) < end_s:
                    sample = drive.read()
                    if sample.cause:
                        break
                    true_s = began_s + sample.raw[0] / COUNTS_PER_S
                    ages.append((now_s - sample.time_s, now_s - true_s))
                    drive.write(0.0)
                    if other is not None and len(ages) % 50 == 0:
                        second.send(other)
                    time.sleep(TICK_S)
                return Cause(sample.cause), dict(drive.counts), ages
            finally:
                drive.close()
    finally:
        second.shutdown()
        emulator.close()


def assert_no_old_sample_is_new(ages):
    for by_stamp_s, true_s in ages:
        assert true_s <= by_stamp_s + 2 / COUNTS_PER_S
        assert by_stamp_s < 2 * LOST_S + 0.1


@pytest.fixture(params=[Cia402Emulator, DurandAxis])
def stack(request):
    return request.param


@pytest.mark.parametrize("always", ALWAYS.values(), ids=ALWAYS)
def test_a_measurement_is_as_old_as_it_says_however_late_it_comes(always):
    cause, counts, ages = ticks(Cia402Emulator, always)
    assert_no_old_sample_is_new(ages)
    assert cause is Cause.NONE
    assert counts["received"] > 30
    assert counts["lost"] == counts["unplaced"] == counts["damaged"] == 0


def test_a_lost_answer_is_counted_and_the_next_one_is_placed(stack):
    cause, counts, ages = ticks(stack, enabled=LOSES)
    assert_no_old_sample_is_new(ages)
    assert cause is Cause.NONE
    assert counts["lost"] >= 1
    assert counts["unplaced"] == 0
    assert ages[-1][0] < LOST_S


def test_frames_that_overtake_others_are_a_drive_that_is_lost(stack):
    cause, _, ages = ticks(stack, enabled=LATE, for_s=5.0)
    assert_no_old_sample_is_new(ages)
    assert cause is Cause.DRIVE_LOST


def test_a_second_master_on_the_bus_is_a_drive_that_is_lost(stack):
    cause, counts, ages = ticks(stack, other=SYNC, for_s=5.0)
    assert_no_old_sample_is_new(ages)
    assert cause is Cause.DRIVE_LOST
    assert 50 <= len(ages) < 50 + LOST_S / TICK_S
    assert counts["unplaced"]


def test_the_loop_does_not_wait_for_an_adapter_that_takes_nothing(monkeypatch):
    monkeypatch.setattr("can.interfaces.slcan.time", SimpleNamespace(sleep=lambda _: None))
    host, terminal = pty.openpty()
    drive = Cia402Drive(
        Cia402Drive.Settings(interface="slcan", channel=os.ttyname(terminal)), time.monotonic
    )
    drive.connect()

    def stuck(*_):
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, stuck)
    signal.alarm(10)
    try:
        while not drive.counts["unsent"]:
            drive.write(0.0)
        for _ in range(100):
            drive.write(0.0)
        assert drive.counts["unsent"] > 100
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
        os.close(host)  # which empties its queue: closing must not wait either
        with suppress(OSError, can.CanError):
            drive.close()
        os.close(terminal)
