"""Run the fast suite: `python -m tests`, which is `make test`.

What keeps real time has the processors; all else runs in the processor time that it leaves, which
is half of it. Linux's idle policy lets nothing of the second delay the first; where there is none,
one comes after the other.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import IO

TIMED = ["tests/console", "tests/faults", "tests/wire", "tests/unit/acquisition"]
"""The folders that hold tests marked `realtime`."""


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


def main() -> int:
    """Run both halves; return 1 if one failed."""
    # In the order of their names: by the number of tests, files of few long ones would come last.
    untimed = ["-n", "auto", "--dist", "loadfile", "--no-loadscope-reorder"]
    untimed += ["-m", "not slow and not realtime"]
    timed = ["-n", "2", "-m", "not slow and realtime", *TIMED]
    if not hasattr(os, "SCHED_IDLE"):
        return 1 if any([pytest(*options).wait() for options in (untimed, timed)]) else 0
    with tempfile.TemporaryFile() as output:
        beside = pytest(*untimed, idle=True, output=output)
        try:
            failed = pytest(*timed).wait()
            print("the tests that keep no time still run", flush=True)
            failed_beside = beside.wait()
        finally:
            beside.kill()
            output.seek(0)
            sys.stdout.buffer.write(output.read())
            sys.stdout.flush()
    return 1 if failed or failed_beside else 0


if __name__ == "__main__":
    sys.exit(main())
