"""Fixtures of the conformance checks, and functions shared by the checks."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rigidimeter.rig.devices.base import (
    DeviceError,
    DeviceFacts,
    MotionSample,
    Now,
    TorqueSample,
    TorqueSensor,
    VelocityDrive,
)
from rigidimeter.rig.guard import Cause

MANY_READS = 100


class ConformanceError(AssertionError):
    """A driver violates a requirement of `rig.devices.base`."""


@dataclass(frozen=True)
class OtherEnd:
    """Observations of a drive that do not use its driver.

    Parameters
    ----------
    powered : callable
        Whether the motor has power.
    velocity_rad_s : callable
        The velocity of the joint.
    """

    powered: Callable[[], bool]
    velocity_rad_s: Callable[[], float]


@dataclass(frozen=True)
class SensorFixture:
    """A sensor and how to test it.

    Parameters
    ----------
    make : callable
        Returns a driver, not connected.
    now : callable, optional
        The clock of its time stamps; None if they come from a recording.
    silence : callable, optional
        Makes the device stop sending from then on.
    tick_s, settle_s, longest_read_s : float
        Interval of the reads; how long starting may take; how long a `read` may take.
    watch_s : float
        How long good samples are watched: longer than the driver takes to call a device frozen.
    """

    make: Callable[[], TorqueSensor]
    now: Now | None = None
    silence: Callable[[], object] | None = None
    tick_s: float = 0.005
    settle_s: float = 0.5
    longest_read_s: float = 0.002
    watch_s: float = 0.3


@dataclass(frozen=True)
class DriveFixture:
    """A drive and how to test it; the other parameters are those of `SensorFixture`.

    Parameters
    ----------
    other_end : OtherEnd, optional
        Without it, the motion of the motor is not checked, and a drive with a watchdog fails.
    speed_rad_s, tolerance : float
        A test velocity, and the relative difference allowed between it and what is sent.
    """

    make: Callable[[], VelocityDrive]
    now: Now | None = None
    silence: Callable[[], object] | None = None
    other_end: OtherEnd | None = None
    tick_s: float = 0.02
    settle_s: float = 0.5
    longest_read_s: float = 0.002
    speed_rad_s: float = 0.3
    tolerance: float = 0.01


def require(condition: bool, requirement: str) -> None:
    """Raise `ConformanceError` unless the condition holds."""
    if not condition:
        raise ConformanceError(requirement)


def require_error(action: Callable[[], object], requirement: str) -> None:
    """Raise `ConformanceError` unless the action raises `DeviceError`."""
    try:
        action()
    except DeviceError:
        return
    raise ConformanceError(requirement)


def check_facts(facts: DeviceFacts) -> None:
    """Check that facts are complete and of the right types."""
    require(isinstance(facts, DeviceFacts), "configure returns DeviceFacts")
    rate_hz = facts.fastest_tick_rate_hz
    require(math.isfinite(rate_hz) and rate_hz > 0, "fastest_tick_rate_hz is finite and above 0")
    require(
        facts.watchdog_s is None or 0 <= facts.watchdog_s < math.inf,
        "watchdog_s is None, or a time in s",
    )
    require(isinstance(facts.model, str) and isinstance(facts.serial, str), "names are text")
    for name, value in facts.values.items():
        require(
            isinstance(value, (str, int, float)),
            f"fact {name!r} is text or a number, not {value!r}",
        )


def check_counts(
    counts: Callable[[], Mapping[str, int]], names: tuple[str, ...], use: Callable[[], object]
) -> None:
    """Check the names of counts and that they never decrease."""
    before = dict(counts())
    missing = [name for name in names if name not in before]
    require(not missing, f"counts has {', '.join(names)}; {', '.join(missing)} missing")
    use()
    after = counts()
    for name, count in before.items():
        require(
            isinstance(count, int) and 0 <= count <= after[name], f"count {name!r} never goes down"
        )
    require(after["received"] > before["received"], "received goes up while samples arrive")


def check_quick(read: Callable[[], object], longest_s: float, tick_s: float, when: str) -> None:
    """Check that a read does not wait."""
    taken_s = []
    for _ in range(MANY_READS):
        began_s = time.perf_counter()
        read()
        taken_s.append(time.perf_counter() - began_s)
        time.sleep(min(tick_s, 0.002))
    # Up to three may be delays of the computer that runs the checks.
    slow_s = sorted(taken_s)[-4]
    require(
        slow_s <= longest_s,
        f"read takes no longer than {1e3 * longest_s:g} ms {when}; it took {1e3 * slow_s:.2f} ms",
    )


def wait_for(
    condition: Callable[[], bool], fixture: SensorFixture | DriveFixture, requirement: str
) -> None:
    """Wait until a condition holds; raise `ConformanceError` on timeout."""
    until_s = time.monotonic() + fixture.settle_s
    while not condition():
        require(time.monotonic() < until_s, f"{requirement}, within {fixture.settle_s:g} s")
        time.sleep(fixture.tick_s)


def check_sample(sample: TorqueSample | MotionSample, value: float, now: Now | None) -> None:
    """Check that a sample with this value, or sum of values, is good and stamped on the clock."""
    require(sample.cause == Cause.NONE, f"a good sample has no cause; {Cause(sample.cause).name}")
    require(math.isfinite(value), "a good sample is finite")
    if now is not None:
        age_s = now() - sample.time_s
        require(-1e-3 <= age_s < 1.0, f"a stamp is on the loop's clock; it is {age_s:.3f} s old")
