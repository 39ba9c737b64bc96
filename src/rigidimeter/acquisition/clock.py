"""Time, passed in: real, or as fast as it goes."""

from __future__ import annotations

import time
from typing import Protocol

__all__ = ["Clock", "RealTimeClock", "SimulatedClock"]


class Clock(Protocol):
    """Seconds since the session's start."""

    def wait_until(self, deadline_s: float) -> float:
        """Return at the deadline, or at once when it has passed; return the time it then is."""


class SimulatedClock:
    """It is always exactly the deadline: a simulated session runs as fast as it goes."""

    def wait_until(self, deadline_s: float) -> float:
        """Return the deadline itself."""
        return deadline_s


class RealTimeClock:
    """The monotonic clock, waited for on absolute deadlines so that errors do not add up."""

    def __init__(self) -> None:
        self._start_s = time.monotonic()

    def wait_until(self, deadline_s: float) -> float:
        """Sleep until the deadline."""
        remaining_s = self._start_s + deadline_s - time.monotonic()
        if remaining_s > 0:
            time.sleep(remaining_s)
        return time.monotonic() - self._start_s
