"""Run the fast suite: `python -m tests`, which is `make test`.

On a machine that is too busy for a test by the clock (`tests.lateness`) that test has no result.
Which these are is printed at the end; more than `MOST_UNJUDGED` of the environment are a failure.

What keeps real time has the processors; all else runs in the processor time that it leaves, which
is half of it. Linux's idle policy lets nothing of the second delay the first; where there is none,
one comes after the other.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import IO

TIMED = ["tests/console", "tests/docs", "tests/faults", "tests/wire", "tests/unit/rig/acquisition"]
"""The folders that hold tests marked `realtime`."""

TELL_S = 20.0
"""Between lines that say how far the tests are whose output is shown at the end."""


def pytest(
    *options: str, idle: bool = False, output: IO[bytes] | None = None
) -> subprocess.Popen[bytes]:
    """Start pytest, perhaps at the idle policy."""
    return subprocess.Popen(
        [sys.executable, "-m", "pytest", *options],
        stdout=output,
        stderr=subprocess.STDOUT if output else None,
        preexec_fn=_idle if idle else None,
    )


def _idle() -> None:
    # Where the kernel shares out its time by sessions first, it counts for this one as a whole.
    os.setsid()
    with suppress(OSError):
        Path("/proc/self/autogroup").write_text("19")
    os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))


def too_many_unjudged(path: Path, most: float) -> bool:
    """Print the tests of a file as `--unjudged` writes it; return whether they are more than that.

    Of a run that was broken off there is none.
    """
    lines = path.read_text("utf-8").splitlines() if path.exists() else []
    if lines:
        print(f"\nnot judged, which is neither passed nor failed: {len(lines)}", *lines, sep="\n")
    if len(lines) > most:
        print(f"{most:g} may be left without a result; repeat on a machine that does less besides")
    return len(lines) > most


def main() -> int:
    """Run both halves; return 1 if one failed, or too much of the first has no result."""
    most = float(os.environ.get("MOST_UNJUDGED") or "inf")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "unjudged"
        failed = _both_halves("--unjudged", str(path))
        return int(too_many_unjudged(path, most) or failed)


def _both_halves(*timed_options: str) -> bool:
    # In the order of their names: by the number of tests, files of few long ones would come last.
    untimed = ["-n", "auto", "--dist", "loadfile", "--no-loadscope-reorder"]
    untimed += ["-m", "not slow and not realtime"]
    timed = ["-n", "2", "-m", "not slow and realtime", *timed_options, *TIMED]
    if not hasattr(os, "SCHED_IDLE"):
        return any([pytest(*options).wait() for options in (untimed, timed)])
    with tempfile.TemporaryFile() as output:
        beside = pytest(*untimed, idle=True, output=output)
        try:
            failed = pytest(*timed).wait()
            failed_beside = _wait_telling(beside, output)
        finally:
            beside.kill()
            output.seek(0)
            sys.stdout.buffer.write(output.read())
            sys.stdout.flush()
    return bool(failed or failed_beside)


def _wait_telling(beside: subprocess.Popen[bytes], output: IO[bytes]) -> int:
    """Wait for the tests whose output goes into a file; print how far they are."""
    began_s = time.monotonic()
    while True:
        with suppress(subprocess.TimeoutExpired):
            return beside.wait(TELL_S)
        # Its own place in the file stays where it writes.
        written = os.pread(output.fileno(), os.fstat(output.fileno()).st_size, 0).decode("utf-8")
        print(f"{progress(written)}, {time.monotonic() - began_s:.0f} s", flush=True)


def progress(written: str) -> str:
    """Return how many of pytest's tests have run, by what it has written so far."""
    done = re.findall(r"^([.sxXFE]+) *\[ *(\d+)%\]$", written, re.MULTILINE)
    failed = sum(len(re.findall("[FE]", marks)) for marks, _ in done)
    percent = done[-1][1] if done else "0"
    return f"tests that keep no time: {percent} % done" + (f", {failed} failed" if failed else "")


if __name__ == "__main__":
    sys.exit(main())
