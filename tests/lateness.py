"""How late the machine wakes a process, measured beside each test that keeps time.

A test by the machine's clock is as exact as the machine is. Beside every test marked `realtime` a
small process on each processor sleeps to absolute deadlines, one a millisecond, at the priority of
the test itself, and notes how late it was woken. A test that compares a measured time with a bound
allows what the probe saw in addition:

    assert took_s < 0.4 + lateness.worst_s(began_s)

A machine that stood still for longer than a test can resolve says nothing about the software, so
the test is repeated after a pause. If that happens every time, the test is reported as skipped,
with the reason and what it last found: it has neither failed nor passed. That holds for a test that
passed with so wide a bound that it would have passed whatever happened. These are listed at the
end (`unjudged`). What must come before what is therefore also tested on a clock of the test's own,
where nothing is late. A failure is believed only
where the machine was more punctual still, because on
a wire one lateness adds to another (`FAILURE_SHARE`). The probes are processes and not threads:
what the software under test does to its own interpreter must not widen a bound. They are started
once for each priority, and only look now and then whether a test needs them while none does.
"""

from __future__ import annotations

import atexit
import gc
import mmap
import os
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Self

import pytest
from _pytest.runner import runtestprotocol

ATTEMPTS = 5
PATIENCE_S = 30.0
"""A test is not repeated after so long: on such a machine a long one would hold up all others."""

PAUSE_S = 1.0
"""Before a test is repeated, times the attempts so far: the test beside it may be what is late."""

ROWS = 20_000
HEAD_BYTES = 16
"""Begin with whether a test needs the probe."""

BYTES = 16 + 16 * ROWS
MOST_PROCESSORS = 8
FAILURE_SHARE = 0.2
"""A test that failed is repeated from this part on of the lateness that it can resolve."""

NOTED_S = 0.0005
"""Less than that is not noted."""

PROBE = """
import mmap, os, struct, sys, time
view = mmap.mmap(int(sys.argv[1]), 0)
head, rows, noted_s = int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])
at = head
for processor in sys.argv[6:]:
    at += 16 + 16 * rows
    if os.fork() == 0:
        os.sched_setaffinity(0, [int(processor)])
        break
else:
    at = head
    os.sched_setaffinity(0, [int(sys.argv[5])])
row, next_s = 0, time.monotonic()
parent = os.getppid()
while os.getppid() == parent:
    if not view[0]:
        time.sleep(0.008)
        next_s = time.monotonic()
        continue
    next_s += 0.001
    struct.pack_into("qd", view, at, row, next_s)
    time.sleep(max(next_s - time.monotonic(), 0.0))
    now_s = time.monotonic()
    if now_s - next_s > noted_s:
        struct.pack_into("dd", view, at + 16 + 16 * (row % rows), next_s, now_s)
        row += 1
        next_s = now_s
"""


class _Processes:
    """A process on each processor, of the present priority; it ends with this one."""

    def __init__(self, ordinary: bool) -> None:
        processors = sorted(os.sched_getaffinity(0))[:MOST_PROCESSORS]
        self.starts = range(HEAD_BYTES, HEAD_BYTES + BYTES * len(processors), BYTES)
        with tempfile.TemporaryFile() as file:
            file.truncate(self.starts.stop)
            self.view = mmap.mmap(file.fileno(), 0)
            numbers = [file.fileno(), HEAD_BYTES, ROWS, NOTED_S, *processors]
            self.process = subprocess.Popen(
                [sys.executable, "-S", "-c", PROBE, *map(str, numbers)],
                pass_fds=[file.fileno()],
                preexec_fn=ordinary_priority if ordinary else None,
            )
        atexit.register(self._end)

    def _end(self) -> None:
        self.process.kill()
        self.process.wait()


STARTED: dict[tuple[bool, int, int], _Processes] = {}
"""By whether they are ordinary, and the policy and priority that they have otherwise."""


def _processes(ordinary: bool) -> _Processes:
    """Return the processes of the present priority, started if there are none."""
    key = ordinary, os.sched_getscheduler(0), os.sched_getparam(0).sched_priority
    if key not in STARTED or STARTED[key].process.poll() is not None:
        STARTED[key] = _Processes(ordinary)
    return STARTED[key]


class LatenessProbe:
    """A process on each processor that notes when it should have been woken, and when it was.

    Parameters
    ----------
    ordinary : bool
        Whether it has no real-time priority, whatever this process has.

    Attributes
    ----------
    allowed_s : float
        By how much a test widened its bounds at most.
    """

    def __init__(self, ordinary: bool = False) -> None:
        self._ordinary = ordinary

    def __enter__(self) -> Self:
        self.allowed_s = 0.0
        processes = _processes(self._ordinary)
        self._process, self._view = processes.process, processes.view
        self._starts = processes.starts
        asked_s = time.monotonic()
        self._view[0] = 1
        while not all(self._due_s(start) > asked_s for start in self._starts):
            assert time.monotonic() < asked_s + 30.0, "the lateness probe did not start"
            time.sleep(0.001)
        self._began_s = time.monotonic()
        return self

    def __exit__(self, *_: object) -> None:
        self._view[0] = 0

    def _due_s(self, start: int) -> float:
        return float(struct.unpack_from("d", self._view, start + 8)[0])

    def worst_s(self, since_s: float) -> float:
        """Return the longest lateness since a time of `time.monotonic`, to widen a bound by."""
        worst_s = self._worst_s(since_s)
        self.allowed_s = max(self.allowed_s, worst_s)
        return worst_s

    def _worst_s(self, since_s: float) -> float:
        worst_s = 0.0
        for start in self._starts:
            (count,) = struct.unpack_from("q", self._view, start)
            due_s = max(self._due_s(start), since_s)
            worst_s = max(worst_s, time.monotonic() - due_s)  # it may be late just now
            rows = self._view[start + 16 : start + 16 + 16 * min(count, ROWS)]
            for due_s, woken_s in struct.iter_unpack("dd", rows):
                if woken_s > since_s:
                    worst_s = max(worst_s, woken_s - max(due_s, since_s))
        return worst_s

    def stood_still_s(self) -> float:
        """Return the longest lateness of all, without widening a bound by it."""
        return self._worst_s(self._began_s)


@contextmanager
def _priority(priority: int) -> Iterator[None]:
    """Ask for a real-time priority, as a rig's loop does; threads and processes inherit it."""
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    if priority:
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    try:
        yield
    finally:
        with suppress(OSError):
            os.sched_setscheduler(0, *before)


def ordinary_priority() -> None:
    """Give up a real-time priority; for the `preexec_fn` of a process that a test starts.

    While it loads, it would hold up all that has the same priority.
    """
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def same_priority(pid: int) -> None:
    """Give all threads of a process that has started the priority of this one."""
    for thread in Path(f"/proc/{pid}/task").iterdir():
        with suppress(OSError):
            os.sched_setscheduler(int(thread.name), os.sched_getscheduler(0), os.sched_getparam(0))


UNJUDGED = "unjudged"
"""The property of a report that says why the test was not judged."""


def unjudged(reports: Iterable[Any]) -> list[str]:
    """Return a line for each test that was not judged."""
    found = {report.nodeid: dict(report.user_properties).get(UNJUDGED) for report in reports}
    return [f"{name}: {why}" for name, why in found.items() if why]


PRESENT: list[LatenessProbe] = []
"""The probe beside the test that runs, for helpers that are no fixtures."""


def _error(report: Any) -> str:
    """Return the first line of what failed in a test."""
    crash = getattr(report.longrepr, "reprcrash", None)
    return f"; it last failed with {crash.message.splitlines()[0]}" if crash is not None else ""


def run_beside_probe(item: pytest.Item, nextitem: pytest.Item | None) -> bool | None:
    """Run a test marked `realtime` beside a probe; repeat it where the machine stood still."""
    marker = item.get_closest_marker("realtime")
    if marker is None:
        return None
    resolves_s = marker.kwargs.get("resolves_s", 0.05)
    ordinary = marker.kwargs.get("ordinary_probe", False)
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    stood_still_s: list[float] = []
    reports: list[Any] = []
    began_s = time.monotonic()
    for attempt in range(ATTEMPTS):
        time.sleep(PAUSE_S * attempt)
        # A look at every object of a whole test run takes 0.2 s, and no probe would see it.
        gc.collect(1)
        gc.freeze()
        with _priority(marker.kwargs.get("priority", 0)), LatenessProbe(ordinary) as probe:
            PRESENT[:] = [probe]
            item._initrequest()  # type: ignore[attr-defined]
            reports = runtestprotocol(item, nextitem=nextitem, log=False)
            failed = any(report.failed for report in reports)
            stood_still_s.append(probe.stood_still_s() if failed else probe.allowed_s)
        # A pseudo-terminal passes each message through the kernel's own workers several times.
        share = (FAILURE_SHARE / 4 if ordinary else FAILURE_SHARE) if failed else 1.0
        judged = stood_still_s[-1] <= resolves_s * share
        if judged or time.monotonic() - began_s > PATIENCE_S:
            break
    if not judged:
        late = ", ".join(f"{1e3 * late_s:.0f}" for late_s in stood_still_s)
        why = (
            f"the machine is too busy to judge: it woke a sleeping process {late} ms late in "
            f"{len(stood_still_s)} attempts, and this test resolves {1e3 * resolves_s:.0f} ms"
        )
        for report in reports:
            if report.failed or report.when == "call":
                found = f"; it last found: {report.longreprtext[-2000:]}" if report.failed else ""
                report.user_properties.append((UNJUDGED, why + _error(report)))
                report.outcome = "skipped"
                report.longrepr = (str(item.path), item.location[1] or 0, why + found)
    for report in reports:
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True
