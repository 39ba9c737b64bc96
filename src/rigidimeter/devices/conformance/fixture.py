"""The fixtures of the conformance checks, and what checks of sensors and of drives share."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rigidimeter.devices.base import (
    DeviceError,
    DeviceFacts,
    MotionSample,
    Now,
    TorqueSample,
    TorqueSensor,
    VelocityDrive,
)

__all__ = [
    "ConformanceError",
    "DriveFixture",
    "OtherEnd",
    "SensorFixture",
    "await_",
    "check_counts",
    "check_facts",
    "check_quick",
    "check_stamp",
    "refuses",
    "require",
]

MANY_READS = 100


class ConformanceError(AssertionError):
    """A driver does not keep a promise of `device.base`."""


@dataclass(frozen=True)
class OtherEnd:
    """What is seen of a drive from outside its driver.

    Parameters
    ----------
    powered : callable
        Whether the motor has power.
    velocity_rad_s : callable
        How fast the joint turns.
    """

    powered: Callable[[], bool]
    velocity_rad_s: Callable[[], float]


@dataclass(frozen=True)
class SensorFixture:
    """A sensor and how to try it.

    Parameters
    ----------
    make : callable
        Returns a driver, not connected.
    now : callable, optional
        The clock of its stamps; None where they are those of a record.
    silence : callable, optional
        Makes the device say nothing from then on.
    tick_s, settle_s, longest_read_s : float
        How often it is read; how long it may take to begin; what a `read` may take.
    """

    make: Callable[[], TorqueSensor]
    now: Now | None = None
    silence: Callable[[], object] | None = None
    tick_s: float = 0.005
    settle_s: float = 0.5
    longest_read_s: float = 0.002


@dataclass(frozen=True)
class DriveFixture:
    """A drive and how to try it; what is not said here is as of `SensorFixture`.

    Parameters
    ----------
    other_end : OtherEnd, optional
        Without it, what the motor does is not checked.
    speed_rad_s, tolerance : float
        A velocity to try, and how far what is sent may be from it, as a part of it.
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


def require(condition: bool, promise: str) -> None:
    """Raise unless a promise is kept."""
    if not condition:
        raise ConformanceError(promise)


def refuses(action: Callable[[], object], promise: str) -> None:
    """Raise unless an action raises `DeviceError`."""
    try:
        action()
    except DeviceError:
        return
    raise ConformanceError(promise)


def check_facts(facts: DeviceFacts) -> None:
    """Check that facts are whole."""
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
    """Check names and direction of counts."""
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
    # Three of them may be the fault of the computer the checks run on.
    slow_s = sorted(taken_s)[-4]
    require(
        slow_s <= longest_s,
        f"read takes no longer than {1e3 * longest_s:g} ms {when}; it took {1e3 * slow_s:.2f} ms",
    )


def await_(
    condition: Callable[[], bool], fixture: SensorFixture | DriveFixture, promise: str
) -> None:
    """Wait until something is so, or raise."""
    until_s = time.monotonic() + fixture.settle_s
    while not condition():
        require(time.monotonic() < until_s, f"{promise}, within {fixture.settle_s:g} s")
        time.sleep(fixture.tick_s)


def check_stamp(sample: TorqueSample | MotionSample, now: Now | None) -> None:
    """Check that a stamp is on the clock."""
    if now is not None:
        age_s = now() - sample.time_s
        require(-1e-3 <= age_s < 1.0, f"a stamp is on the loop's clock; it is {age_s:.3f} s old")
