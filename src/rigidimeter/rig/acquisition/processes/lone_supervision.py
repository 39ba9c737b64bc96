"""What stops a loop that runs in the program's own process: a silent operator, a suspension."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from rigidimeter.rig.acquisition import NOTHING, Order
from rigidimeter.rig.acquisition.processes.ring_writer import boot_ns
from rigidimeter.rig.acquisition.processes.shared_status import Nanoseconds
from rigidimeter.rig.guard import Cause

_NONE, _STALLED, _CONSOLE_LOST = int(Cause.NONE), int(Cause.STALLED), int(Cause.CONSOLE_LOST)


class LoneSupervision:
    """Answers the loop of one trial of a check, which moves the rig with nobody's arm in it.

    Parameters
    ----------
    operator_seen_ns : callable or None
        When the operator was last known to be there, in nanoseconds of CLOCK_MONOTONIC. None where
        a terminal's signals say that somebody has gone.
    console_lost_s, stall_s : float
        As `SharedSupervision` has them.
    now_ns, boot_ns : callable
        CLOCK_MONOTONIC and CLOCK_BOOTTIME in nanoseconds.
    """

    attended = False

    def __init__(
        self,
        operator_seen_ns: Callable[[], int] | None = None,
        *,
        console_lost_s: float = 0.5,
        stall_s: float = 0.1,
        now_ns: Nanoseconds = time.monotonic_ns,
        boot_ns: Nanoseconds = boot_ns,
    ) -> None:
        self.measured = math.nan
        self._seen_ns = operator_seen_ns
        self._lost_ns, self._stall_s = round(1e9 * console_lost_s), stall_s
        self._now_ns, self._boot_ns = now_ns, boot_ns
        awake_ns = max(boot_ns() - now_ns() for _ in range(3))  # as `SharedSupervision` takes it
        self._suspended_ns = awake_ns + round(1e9 * stall_s)

    def cause(self, now_s: float) -> int:
        """Return a `rig.guard.Cause` to stop for, 0 if there is none."""
        boot = self._boot_ns()
        now = self._now_ns()
        if boot - now > self._suspended_ns:
            self.measured = 1e-9 * (boot - now - self._suspended_ns) + self._stall_s
            return _STALLED
        if self._seen_ns is not None and now - self._seen_ns() > self._lost_ns:
            self.measured = 1e-9 * (now - self._seen_ns())
            return _CONSOLE_LOST
        return _NONE

    def order(self) -> Order:
        """Return no order: a check is ended by a signal."""
        return NOTHING
