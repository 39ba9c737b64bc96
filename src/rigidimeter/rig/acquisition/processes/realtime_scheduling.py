"""What a process asks of the operating system before it runs a real-time loop.

Each of these is a request. A laptop may refuse all of them and the session still runs, with later
ticks; so what was refused, and what to do about it, is said in a sentence and stored with the
session.

The priority comes last. To lock the memory and to collect the garbage of all that was imported is
more than a tenth of a second of work; at a real-time priority it would hold up the loop of another
program on the same processor for as long.

Linux lets the real-time programs of a processor be busy for a share of each period, 95 % of 1 s
unless set otherwise; then all of them stand still for the rest, 50 ms. A loop alone is never so
busy. Beside another real-time program, of whatever priority, it may be.
"""

from __future__ import annotations

import ctypes
import gc
import os
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rigidimeter.rig.acquisition.processes.shared_memory import ORDERED

MCL_CURRENT, MCL_FUTURE = 1, 2
PR_SET_TIMERSLACK = 29
KERNEL_THREAD = 0x00200000  # of the flags in /proc/PID/stat


@dataclass(frozen=True)
class Prepared:
    """What the loop's process was given.

    Attributes
    ----------
    priority : int or None
        Of SCHED_FIFO; None if it was refused.
    real_time_share : float or None
        What part of a processor's time its real-time programs may take together, 1 for all of it;
        None where that is not known.
    cpu : int or None
        The only processor it runs on.
    memory_locked : bool
        Whether no page of it can be swapped out.
    timer_slack_ns : int or None
        By how much the kernel may delay a wake-up to save power.
    collector_off : bool
        Whether Python looks for cycles of objects while the loop runs.
    refused : tuple of str
        A sentence for each request that was not granted, and for what else can delay the loop.
    """

    priority: int | None
    real_time_share: float | None
    cpu: int | None
    memory_locked: bool
    timer_slack_ns: int | None
    collector_off: bool
    refused: tuple[str, ...]

    def facts(self) -> dict[str, Any]:
        """Return what is stored with the session."""
        return {**asdict(self), "refused": list(self.refused)}

    def __str__(self) -> str:
        share = self.real_time_share
        upto = f" for at most {100 * share:.3g} % of the time" if share and share < 1 else ""
        granted = [
            f"SCHED_FIFO at priority {self.priority}{upto}" if self.priority else "",
            f"processor {self.cpu} alone" if self.cpu is not None else "",
            "memory locked" if self.memory_locked else "",
            f"timer slack {self.timer_slack_ns} ns" if self.timer_slack_ns else "",
        ]
        words = ", ".join(text for text in granted if text) or "nothing of what it asked for"
        return "\n".join([f"The loop's process has {words}.", *self.refused])


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
    _take_working_memory()
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
            "sample before it is complete; record on an x86-64 machine."
        )
    gc.collect()
    gc.freeze()
    gc.disable()
    share = _real_time_share()
    beside = _beside(wanted or processors, priority, share)
    has_priority = bool(priority) and _tried(
        lambda: os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority)),
        f"The priority {priority} of SCHED_FIFO was refused ({{}}), so other programs can delay "
        "the loop; allow it with `ulimit -r 90`, an rtprio line in /etc/security/limits.conf or "
        "CAP_SYS_NICE.",
        refused,
    )
    if has_priority:
        refused += beside
    return Prepared(
        priority=priority if has_priority else None,
        real_time_share=share,
        cpu=next(iter(wanted), None),
        memory_locked=locked,
        timer_slack_ns=1 if slack else None,
        collector_off=not gc.isenabled(),
        refused=tuple(refused),
    )


def _take_working_memory() -> None:
    """Let NumPy's linear algebra take its working memory, 32 MB, before memory is locked.

    OpenBLAS takes it at the first product of large matrices or the first solution. Where memory is
    locked the system fills all of it at once, and the loop stands still for that time.
    """
    square = np.eye(256)
    np.linalg.solve(square @ square.T, square)


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


def _real_time_share() -> float | None:
    """Return what part of a processor's time the real-time programs may take, None if unknown.

    A control group may allow less than the system does.
    """
    kernel, groups = Path("/proc/sys/kernel"), Path("/sys/fs/cgroup/cpu")
    places = [(kernel / "sched_rt_runtime_us", kernel / "sched_rt_period_us")]
    with suppress(OSError):
        for line in Path("/proc/self/cgroup").read_text().splitlines():
            _, controllers, path = line.split(":", 2)
            if "cpu" in controllers.split(","):
                mine = groups / path.lstrip("/")
                places.append((mine / "cpu.rt_runtime_us", mine / "cpu.rt_period_us"))
    shares = []
    for runtime, period in places:
        with suppress(OSError, ValueError):
            runtime_us, period_us = int(runtime.read_text()), int(period.read_text())
            shares.append(1.0 if runtime_us < 0 else min(runtime_us / period_us, 1.0))
    return min(shares, default=None)


def _beside(processors: Collection[int], priority: int, share: float | None) -> list[str]:
    """Return a sentence if other programs run in real time on one of the processors."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError, ValueError, IndexError):
            head, _, rest = path.read_text(errors="replace").rpartition(")")
            fields, (pid, _, name) = rest.split(), head.partition(" (")
            flags, its_priority, policy = int(fields[6]), int(fields[37]), int(fields[38])
            if policy not in (os.SCHED_FIFO, os.SCHED_RR) or flags & KERNEL_THREAD:
                continue
            if int(pid) != os.getpid() and os.sched_getaffinity(int(pid)) & set(processors):
                found.append(f"{name} ({pid}) at priority {its_priority}")
    if not found:
        return []
    still = ""
    if share is not None and share < 1:
        still = f", and all are paused once they were busy for {100 * share:.3g} % of a second"
    return [
        f"Other real-time programs on processor {', '.join(map(str, sorted(processors)))}: "
        f"{', '.join(found)}. One of {priority} or more delays the loop while it is busy{still}; "
        "end them, or give the loop another processor."
    ]
