"""Checks of torque sensors; see `conformance`."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager

from rigidimeter.rig.devices.base import TorqueSample, TorqueSensor
from rigidimeter.rig.guard import Cause
from rigidimeter.testing.conformance.fixture import (
    SensorFixture,
    check_counts,
    check_facts,
    check_quick,
    check_sample,
    require,
    require_error,
    wait_for,
)

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
    with closing(fixture.make()) as sensor:
        sensor.connect()
        check_facts(sensor.configure())


def sensor_samples_flow(fixture: SensorFixture) -> None:
    """Finite samples without a cause and with new time stamps arrive, for as long as is watched.

    A driver may take a while to say that its device is frozen.
    """
    with _sampling(fixture) as sensor:
        first = sensor.read()
        wait_for(lambda: sensor.read().time_s > first.time_s, fixture, "a new sample arrives")
        for _ in range(math.ceil(fixture.watch_s / fixture.tick_s)):
            sample = sensor.read()
            check_sample(sample, sample.torque_nm, fixture.now)
            time.sleep(fixture.tick_s)


def sensor_read_never_waits(fixture: SensorFixture) -> None:
    """`read` never waits, whether samples arrive or not."""
    with _sampling(fixture) as sensor:
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


def sensor_counts(fixture: SensorFixture) -> None:
    """Check that the counts have the required names and never decrease."""
    with _sampling(fixture) as sensor:

        def use() -> None:
            for _ in range(20):
                sensor.read()
                time.sleep(fixture.tick_s)

        check_counts(lambda: sensor.counts, SENSOR_COUNTS, use)


def sensor_closes_twice(fixture: SensorFixture) -> None:
    """`close` works at any time and when repeated; `read` does not raise afterwards."""
    fixture.make().close()
    sensor = fixture.make()
    sensor.connect()
    sensor.close()
    sensor.close()
    with _sampling(fixture) as sensor:
        for _ in range(2):
            sensor.close()
            sensor.read()
            _ = sensor.counts


def sensor_connects_again(fixture: SensorFixture) -> None:
    """Check that a second driver can connect after the first was closed."""
    for _ in range(2):
        with _sampling(fixture):
            pass


@contextmanager
def _sampling(fixture: SensorFixture) -> Iterator[TorqueSensor]:
    with closing(fixture.make()) as sensor:
        sensor.connect()
        sensor.configure()
        wait_for(lambda: math.isfinite(sensor.read().torque_nm), fixture, "a first sample arrives")
        yield sensor


SENSOR_CHECKS: tuple[Callable[[SensorFixture], None], ...] = (
    sensor_refuses_disorder,
    sensor_facts_are_complete,
    sensor_samples_flow,
    sensor_read_never_waits,
    sensor_counts,
    sensor_closes_twice,
    sensor_connects_again,
)
