"""What a process asks of the operating system before it runs a real-time loop, and how it waits.

Each of these is a request. A laptop may refuse all of them and the session still runs, with later
ticks; so what was refused, and what to do about it, is said in a sentence and stored with the
session.
"""

from __future__ import annotations

import ctypes
import errno
import gc
import os
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from rigidimeter.acquisition.processes.shared import ORDERED

__all__ = ["DeadlineClock", "Prepared", "prepare_loop_process"]

CLOCK_MONOTONIC, TIMER_ABSTIME = 1, 1
MCL_CURRENT, MCL_FUTURE = 1, 2
PR_SET_TIMERSLACK = 29

Sleep = Callable[[int], None]


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


def _relative_sleep(until_ns: int) -> None:
    remaining_ns = until_ns - time.monotonic_ns()
    if remaining_ns > 0:
        time.sleep(1e-9 * remaining_ns)


class DeadlineClock:
    """CLOCK_MONOTONIC since the session's start, waited for by absolute deadlines.

    The kernel is told when to wake, not how long to sleep, so nothing is lost when the process is
    interrupted between reading the clock and going to sleep. No change of the wall clock is felt.
    """

    def __init__(self) -> None:
        self._sleep: Sleep = _absolute_sleep() or _relative_sleep
        self._start_ns = time.monotonic_ns()

    def now_s(self) -> float:
        """Return the seconds since the session's start."""
        return 1e-9 * (time.monotonic_ns() - self._start_ns)

    def wait_until(self, deadline_s: float) -> float:
        """Return at the deadline, or at once when it has passed; return the time it then is."""
        self._sleep(self._start_ns + round(1e9 * deadline_s))
        return 1e-9 * (time.monotonic_ns() - self._start_ns)


@dataclass(frozen=True)
class Prepared:
    """What the loop's process was given.

    Attributes
    ----------
    priority : int or None
        Of SCHED_FIFO; None if it was refused.
    cpu : int or None
        The only processor it runs on.
    memory_locked : bool
        Whether no page of it can be swapped out.
    timer_slack_ns : int or None
        By how much the kernel may delay a wake-up to save power.
    collector_off : bool
        Whether Python looks for cycles of objects while the loop runs.
    refused : tuple of str
        A sentence for each request that was not granted.
    """

    priority: int | None
    cpu: int | None
    memory_locked: bool
    timer_slack_ns: int | None
    collector_off: bool
    refused: tuple[str, ...]

    def facts(self) -> dict[str, Any]:
        """Return what is stored with the session."""
        return {**asdict(self), "refused": list(self.refused)}

    def __str__(self) -> str:
        granted = [
            f"SCHED_FIFO at priority {self.priority}" if self.priority else "",
            f"processor {self.cpu} alone" if self.cpu is not None else "",
            "memory locked" if self.memory_locked else "",
            f"timer slack {self.timer_slack_ns} ns" if self.timer_slack_ns else "",
        ]
        said = ", ".join(text for text in granted if text) or "nothing of what it asked for"
        return "\n".join([f"The loop's process has {said}.", *self.refused])


def prepare_loop_process(
    *, priority: int = 80, cpu: int | None = None, lock_memory: bool = True
) -> Prepared:
    """Ask for what a real-time loop needs; whatever is refused is said, not raised.

    Call it in the process and the thread of the loop, once everything is imported and made.

    Parameters
    ----------
    priority : int
        Of SCHED_FIFO, 1 to 99; 0 asks for none.
    cpu : int or None
        The processor to stay on; the last one if not given, none if there is only one.
    lock_memory : bool
    """
    refused: list[str] = []
    has_priority = bool(priority) and _tried(
        lambda: os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority)),
        f"The priority {priority} of SCHED_FIFO was refused ({{}}), so other programs can delay "
        "the loop; allow it with `ulimit -r 90`, an rtprio line in /etc/security/limits.conf or "
        "CAP_SYS_NICE.",
        refused,
    )
    processors = sorted(os.sched_getaffinity(0))
    wanted = ({cpu} if cpu is not None else set(processors[-1:])) if len(processors) > 1 else set()
    if not _tried(
        lambda: os.sched_setaffinity(0, wanted or processors),
        f"Processor {cpu} was refused ({{}}); this process may use "
        f"{', '.join(map(str, processors))}.",
        refused,
    ):
        wanted = set()
    libc = ctypes.CDLL(None, use_errno=True)
    locked = lock_memory and _tried(
        lambda: _checked(libc.mlockall(MCL_CURRENT | MCL_FUTURE)),
        "The memory was not locked ({}), so a page that was swapped out can delay the loop; allow "
        "it with `ulimit -l unlimited` or CAP_IPC_LOCK.",
        refused,
    )
    slack = _tried(
        lambda: _checked(libc.prctl(PR_SET_TIMERSLACK, *(ctypes.c_ulong(n) for n in (1, 0, 0, 0)))),
        "The timer slack was not changed ({}), so ticks may be 50 µs late.",
        refused,
    )
    if not ORDERED:
        refused.append(
            "This processor does not keep the order of writes, so other processes may see a "
            "sample before it is whole; record on an x86-64 machine."
        )
    gc.collect()
    gc.freeze()
    gc.disable()
    return Prepared(
        priority=priority if has_priority else None,
        cpu=next(iter(wanted), None),
        memory_locked=locked,
        timer_slack_ns=1 if slack else None,
        collector_off=not gc.isenabled(),
        refused=tuple(refused),
    )


def _tried(step: Callable[[], object], sentence: str, refused: list[str]) -> bool:
    """Try a step; on failure add the sentence with the system's reason."""
    try:
        step()
    except (OSError, ValueError, AttributeError) as error:
        reason = (isinstance(error, OSError) and error.strerror) or str(error)
        refused.append(sentence.format(reason))
        return False
    return True


def _checked(result: int) -> None:
    """Raise what a C function left in errno."""
    if result != 0:
        code = ctypes.get_errno()
        raise OSError(code, os.strerror(code))
