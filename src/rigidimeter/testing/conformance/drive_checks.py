"""Checks of velocity drives; see `conformance`."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager

from rigidimeter.rig.devices.base import MotionSample, VelocityDrive
from rigidimeter.rig.guard import Cause
from rigidimeter.testing.conformance.fixture import (
    DriveFixture,
    check_counts,
    check_facts,
    check_quick,
    check_sample,
    require,
    require_error,
    wait_for,
)

DRIVE_COUNTS = ("received", "lost", "damaged")
POWER_OFF_S = 0.1
MOST_RATED = 33.0
"""Of a drive's torque in its rated torque: more is no torque, or of another unit."""

AT_REST = 0.02
"""As a part of the fixture's speed."""


def drive_refuses_disorder(fixture: DriveFixture) -> None:
    """Each step requires the previous one; a drive that is not enabled sends only zero."""
    with closing(fixture.make()) as drive:
        require(isinstance(drive.read(), MotionSample), "read returns a MotionSample always")
        require(drive.write(fixture.speed_rad_s) == 0.0, "write before connect returns 0")
        require_error(drive.enable, "enable before connect raises DeviceError")
        require_error(drive.configure, "configure before connect raises DeviceError")
        drive.connect()
        require_error(drive.enable, "enable before configure raises DeviceError")
        _unpowered(fixture, "after a refused enable")


def drive_energises_by_enable_only(fixture: DriveFixture) -> None:
    """Neither connect nor configure nor a command energises the drive."""
    with closing(fixture.make()) as drive:
        drive.connect()
        _unpowered(fixture, "after connect")
        check_facts(drive.configure())
        _unpowered(fixture, "after configure")
        for _ in range(10):
            require(drive.write(fixture.speed_rad_s) == 0.0, "write before enable returns 0")
            drive.read()
            time.sleep(fixture.tick_s)
        _unpowered(fixture, "after write without enable")


def drive_enables_at_rest(fixture: DriveFixture) -> None:
    """Enable energises the drive without motion."""
    with _enabled(fixture) as drive:
        end = fixture.other_end
        require(end is None or end.powered(), "the motor has power after enable")
        for _ in range(20):
            _run(drive, fixture, 0.0, 1)
            _at_rest(fixture, "after enable")
    _loses_power(fixture, "after close")


def drive_samples_flow(fixture: DriveFixture) -> None:
    """Finite samples without a cause and with new time stamps arrive while commands are sent."""
    with _enabled(fixture) as drive:
        first = drive.read()

        def newer() -> bool:
            drive.write(0.0)
            return drive.read().time_s > first.time_s

        wait_for(newer, fixture, "a new sample arrives")
        sample = drive.read()
        check_sample(sample, sample.angle_rad + sample.velocity_rad_s, fixture.now)


def drive_reports_torque_or_none(fixture: DriveFixture) -> None:
    """Check that samples hold a torque if the facts have `rated_torque_nm`, and NaN if not."""
    with closing(fixture.make()) as drive:
        drive.connect()
        rated = drive.configure().values.get("rated_torque_nm")
        require(
            rated is None or (isinstance(rated, float | int) and 0.0 < rated < math.inf),
            f"rated_torque_nm, if the facts have it, is above 0; it is {rated!r}",
        )
        drive.enable()
        before_s = drive.read().time_s
        for _ in range(50):
            _run(drive, fixture, 0.0, 1)
            sample = drive.read()
            torque_nm = sample.drive_torque_nm
            if rated is None:
                require(
                    math.isnan(torque_nm),
                    f"without rated_torque_nm in the facts drive_torque_nm is NaN; it is "
                    f"{torque_nm:g}",
                )
            elif sample.time_s > before_s:
                require(
                    abs(torque_nm) <= MOST_RATED * float(rated),  # which NaN is not
                    f"drive_torque_nm is a number in N·m at the joint, at most {MOST_RATED:g} "
                    f"times rated_torque_nm = {rated:g}; it is {torque_nm:g}",
                )


def drive_returns_what_was_sent(fixture: DriveFixture) -> None:
    """`write` returns the velocity that was sent to the drive, after limit and rounding."""
    with _enabled(fixture) as drive:
        speed = fixture.speed_rad_s
        for wanted in (speed, -speed):
            sent = _run(drive, fixture, wanted, math.ceil(fixture.settle_s / fixture.tick_s))
            require(
                abs(sent - wanted) <= fixture.tolerance * speed,
                f"write({wanted:g}) returns about that; it returned {sent:g}",
            )
            if fixture.other_end is not None:
                turning = fixture.other_end.velocity_rad_s()
                require(
                    abs(turning - sent) <= 0.2 * speed,
                    f"the joint turns as sent ({sent:g} rad/s); it turns at {turning:g}",
                )
        _run(drive, fixture, 0.0, math.ceil(fixture.settle_s / fixture.tick_s))
        _at_rest(fixture, "after write(0)")


def drive_bounds_commands(fixture: DriveFixture) -> None:
    """Commands that are not finite become zero, and very large ones are limited."""
    with _enabled(fixture) as drive:
        for wanted in (1e9, -1e9):
            sent = drive.write(wanted)
            require(math.isfinite(sent) and abs(sent) < 1e6, "write limits a velocity")
        for wanted in (math.nan, math.inf, -math.inf):
            sent = _run(drive, fixture, wanted, 5)
            require(sent == 0.0, f"write({wanted}) sends 0; it returned {sent}")


def drive_read_never_waits(fixture: DriveFixture) -> None:
    """`read` and `write` never wait; a drive that stops answering is reported."""
    with _enabled(fixture) as drive:

        def tick() -> None:
            drive.read()
            drive.write(0.0)

        check_quick(tick, 2 * fixture.longest_read_s, fixture.tick_s, "while the drive answers")
        if fixture.silence is not None:
            fixture.silence()
            check_quick(tick, 2 * fixture.longest_read_s, fixture.tick_s, "when it does not")
            wait_for(
                lambda: drive.read().cause != Cause.NONE,
                fixture,
                "a drive that is silent is reported with a cause",
            )


def drive_counts(fixture: DriveFixture) -> None:
    """Check that the counts have the required names and never decrease."""
    with _enabled(fixture) as drive:
        check_counts(lambda: drive.counts, DRIVE_COUNTS, lambda: _run(drive, fixture, 0.0, 20))


def drive_stops(fixture: DriveFixture) -> None:
    """`stop` brings a moving joint to rest, and later commands do not move it."""
    with _enabled(fixture) as drive:
        _run(drive, fixture, fixture.speed_rad_s, math.ceil(fixture.settle_s / fixture.tick_s))
        drive.stop()
        drive.stop()
        wait_for(lambda: _rests(fixture), fixture, "the joint is at rest after stop")
        sent = _run(drive, fixture, fixture.speed_rad_s, 10)
        require(sent == 0.0, f"write after stop sends 0; it returned {sent:g}")
        _at_rest(fixture, "after stop, whatever is written")


def drive_ends_in_any_order(fixture: DriveFixture) -> None:
    """`stop`, `disable` and `close` work in any order, repeated, and from every state."""
    orders = [(3, order) for order in itertools.permutations(range(3))]
    for stage, order in (*((stage, (2, 1, 0)) for stage in range(3)), *orders):
        drive = fixture.make()
        for step in (drive.connect, drive.configure, drive.enable)[:stage]:
            step()
        for number in order:
            for _ in range(2):
                (drive.stop, drive.disable, drive.close)[number]()
                require(drive.write(fixture.speed_rad_s) == 0.0, "write returns 0 after the end")
                drive.read()
        _loses_power(fixture, "after stop, disable and close")
        drive.close()


def drive_stops_by_itself(fixture: DriveFixture) -> None:
    """Check that a drive whose facts name a watchdog comes to rest when writing ceases.

    A drive may accept its watchdog, read it back as written, and turn on all the same. So this is
    not passed by a fixture without the other end.
    """
    with closing(fixture.make()) as drive:
        drive.connect()
        watchdog_s = drive.configure().watchdog_s
        if watchdog_s is None:
            return
        require(
            fixture.other_end is not None,
            "the fixture has an other_end: without it nothing proves that the drive stops",
        )
        drive.enable()
        _run(drive, fixture, fixture.speed_rad_s, math.ceil(fixture.settle_s / fixture.tick_s))
        time.sleep(watchdog_s)
        wait_for(
            lambda: _rests(fixture), fixture, f"at rest {watchdog_s:g} s after the last command"
        )


def drive_restarts_at_rest(fixture: DriveFixture) -> None:
    """After a driver was closed in motion, the next enable does not move the joint."""
    with _enabled(fixture) as drive:
        _run(drive, fixture, fixture.speed_rad_s, 20)
    wait_for(lambda: _rests(fixture), fixture, "the joint is at rest after close")
    drive_enables_at_rest(fixture)


@contextmanager
def _enabled(fixture: DriveFixture) -> Iterator[VelocityDrive]:
    with closing(fixture.make()) as drive:
        drive.connect()
        drive.configure()
        drive.enable()
        yield drive


def _run(drive: VelocityDrive, fixture: DriveFixture, velocity_rad_s: float, ticks: int) -> float:
    """Read and write for a number of ticks; return what was sent last."""
    sent = 0.0
    for _ in range(ticks):
        drive.read()
        sent = drive.write(velocity_rad_s)
        time.sleep(fixture.tick_s)
    return sent


def _rests(fixture: DriveFixture) -> bool:
    end = fixture.other_end
    return end is None or abs(end.velocity_rad_s()) <= AT_REST * fixture.speed_rad_s


def _at_rest(fixture: DriveFixture, when: str) -> None:
    require(_rests(fixture), f"the joint is at rest {when}")


def _unpowered(fixture: DriveFixture, when: str) -> None:
    end = fixture.other_end
    require(end is None or not end.powered(), f"the motor has no power {when}")


def _loses_power(fixture: DriveFixture, when: str) -> None:
    # The command may still be on its way.
    until_s = time.monotonic() + POWER_OFF_S
    end = fixture.other_end
    while end is not None and end.powered() and time.monotonic() < until_s:
        time.sleep(0.001)
    _unpowered(fixture, f"{when}, within {POWER_OFF_S:g} s")


DRIVE_CHECKS: tuple[Callable[[DriveFixture], None], ...] = (
    drive_refuses_disorder,
    drive_energises_by_enable_only,
    drive_enables_at_rest,
    drive_samples_flow,
    drive_reports_torque_or_none,
    drive_returns_what_was_sent,
    drive_bounds_commands,
    drive_read_never_waits,
    drive_counts,
    drive_stops,
    drive_ends_in_any_order,
    drive_stops_by_itself,
    drive_restarts_at_rest,
)
