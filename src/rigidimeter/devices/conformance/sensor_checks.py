"""Checks of torque sensors; see `conformance`."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import ExitStack

from rigidimeter.devices.base import TorqueSample, TorqueSensor
from rigidimeter.devices.conformance.fixture import (
    SensorFixture,
    check_counts,
    check_facts,
    check_quick,
    check_stamp,
    require,
    require_error,
    wait_for,
)
from rigidimeter.guard import Cause

SENSOR_COUNTS = ("received", "lost", "repeated", "reordered", "damaged")


def sensor_refuses_disorder(fixture: SensorFixture) -> None:
    """Check that a sensor that is not connected can be read and closed but not configured."""
    sensor = fixture.make()
    sample = sensor.read()
    require(isinstance(sample, TorqueSample), "read returns a TorqueSample from the beginning")
    require_error(sensor.configure, "configure before connect raises DeviceError")
    sensor.close()


def sensor_facts_are_complete(fixture: SensorFixture) -> None:
    """`configure` returns facts that can be stored."""
    sensor = fixture.make()
    try:
        sensor.connect()
        check_facts(sensor.configure())
    finally:
        sensor.close()


def sensor_samples_flow(fixture: SensorFixture) -> None:
    """Finite samples without a cause and with new time stamps arrive."""
    sensor = _sampling(fixture)
    try:
        first = sensor.read()
        wait_for(lambda: sensor.read().time_s > first.time_s, fixture, "a new sample arrives")
        sample = sensor.read()
        require(
            sample.cause == Cause.NONE, f"a good sample has no cause; {Cause(sample.cause).name}"
        )
        require(math.isfinite(sample.torque_nm), "a good sample is finite")
        check_stamp(sample, fixture.now)
    finally:
        sensor.close()


def sensor_read_never_waits(fixture: SensorFixture) -> None:
    """`read` never waits, whether samples arrive or not."""
    sensor = _sampling(fixture)
    try:
        check_quick(sensor.read, fixture.longest_read_s, fixture.tick_s, "while samples arrive")
        if fixture.silence is not None:
            fixture.silence()
            check_quick(sensor.read, fixture.longest_read_s, fixture.tick_s, "when none arrive")
            last = sensor.read()
            time.sleep(2 * fixture.tick_s)
            again = sensor.read()
            require(
                again.time_s == last.time_s or again.cause != Cause.NONE,
                "a sensor that is silent repeats its last sample, or reports a cause",
            )
    finally:
        sensor.close()


def sensor_counts(fixture: SensorFixture) -> None:
    """Check that the counts have the required names and never decrease."""
    sensor = _sampling(fixture)

    def use() -> None:
        for _ in range(20):
            sensor.read()
            time.sleep(fixture.tick_s)

    try:
        check_counts(lambda: sensor.counts, SENSOR_COUNTS, use)
    finally:
        sensor.close()


def sensor_closes_twice(fixture: SensorFixture) -> None:
    """`close` works at any time and when repeated; `read` does not raise afterwards."""
    fixture.make().close()
    sensor = fixture.make()
    sensor.connect()
    sensor.close()
    sensor.close()
    sensor = _sampling(fixture)
    for _ in range(2):
        sensor.close()
        sensor.read()
        _ = sensor.counts


def sensor_connects_again(fixture: SensorFixture) -> None:
    """Check that a second driver can connect after the first was closed."""
    for _ in range(2):
        sensor = _sampling(fixture)
        sensor.close()


def _sampling(fixture: SensorFixture) -> TorqueSensor:
    sensor = fixture.make()
    with ExitStack() as on_failure:
        on_failure.callback(sensor.close)
        sensor.connect()
        sensor.configure()
        wait_for(lambda: math.isfinite(sensor.read().torque_nm), fixture, "a first sample arrives")
        on_failure.pop_all()
    return sensor


SENSOR_CHECKS: tuple[Callable[[SensorFixture], None], ...] = (
    sensor_refuses_disorder,
    sensor_facts_are_complete,
    sensor_samples_flow,
    sensor_read_never_waits,
    sensor_counts,
    sensor_closes_twice,
    sensor_connects_again,
)
