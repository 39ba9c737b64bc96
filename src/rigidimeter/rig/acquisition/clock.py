"""Time, passed in: as fast as it goes, or real and waited for by absolute deadlines."""

from __future__ import annotations

import ctypes
import errno
import sys
import time
from collections.abc import Callable
from typing import Protocol

CLOCK_MONOTONIC, TIMER_ABSTIME = 1, 1

Sleep = Callable[[int], None]


class Clock(Protocol):
    """Seconds since the session's start."""

    def wait_until(self, deadline_s: float) -> float:
        """Return at the deadline, or at once when it has passed; return the time it then is."""


class SimulatedClock:
    """It is always exactly the deadline: a simulated session runs as fast as it goes."""

    def wait_until(self, deadline_s: float) -> float:
        """Return the deadline itself."""
        return deadline_s


class _Timespec(ctypes.Structure):
    _fields_ = (("tv_sec", ctypes.c_long), ("tv_nsec", ctypes.c_long))


def _absolute_sleep() -> Sleep | None:
    """Return a sleep until a time of CLOCK_MONOTONIC in nanoseconds; None where there is none."""
    if not sys.platform.startswith("linux"):
        return None
    nanosleep = ctypes.CDLL(None).clock_nanosleep
    nanosleep.argtypes = [
        ctypes.c_int,
        ctypes.c_int,
        ctypes.POINTER(_Timespec),
        ctypes.c_void_p,
    ]
    nanosleep.restype = ctypes.c_int
    until = _Timespec()
    pointer = ctypes.pointer(until)

    def sleep(until_ns: int) -> None:
        until.tv_sec, until.tv_nsec = divmod(until_ns, 1_000_000_000)
        while nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, pointer, None) == errno.EINTR:
            pass  # a signal's handler has run; the deadline is still the same

    return sleep


def relative_sleep(until_ns: int) -> None:
    """Sleep until a time of the monotonic clock, where the kernel takes no deadline."""
    remaining_ns = until_ns - time.monotonic_ns()
    if remaining_ns > 0:
        time.sleep(1e-9 * remaining_ns)


class DeadlineClock:
    """CLOCK_MONOTONIC since the session's start, waited for by absolute deadlines.

    The kernel is told when to wake, not how long to sleep, so nothing is lost when the process is
    interrupted between reading the clock and going to sleep. No change of the wall clock is felt.
    """

    def __init__(self) -> None:
        self._sleep: Sleep = _absolute_sleep() or relative_sleep
        self._start_ns = time.monotonic_ns()

    @property
    def origin_s(self) -> float:
        """The session's start on CLOCK_MONOTONIC, which all programs of the machine share."""
        return 1e-9 * self._start_ns

    def now_s(self) -> float:
        """Return the seconds since the session's start."""
        return 1e-9 * (time.monotonic_ns() - self._start_ns)

    def wait_until(self, deadline_s: float) -> float:
        """Return at the deadline, or at once when it has passed; return the time it then is."""
        self._sleep(self._start_ns + round(1e9 * deadline_s))
        return 1e-9 * (time.monotonic_ns() - self._start_ns)
