"""A session in processes of its own, as a test sees it from outside; not a test itself."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rigidimeter.core.session import read_events, read_samples

SCRIPT = Path(__file__).with_name("realtime_session.py")
HANGS_S = 120.0
"""Three processes that load take so long on a machine that does a dozen other things at once."""


def memory() -> set[str]:
    """Return the names of all shared memory of this package."""
    return {path.name for path in Path("/dev/shm").glob("rigidimeter-*")}


def alive(pid: int) -> bool:
    """Whether a process has not ended."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state not in "ZX"


def wait_for(what: Callable[[], Any], timeout_s: float = 30.0) -> Any:
    """Return what the function returns, once that is true."""
    until_s = time.monotonic() + timeout_s
    while time.monotonic() < until_s:
        found = what()
        if found:
            return found
        time.sleep(0.02)
    pytest.fail(f"{what} did not come true within {timeout_s} s")


def fill(folder: Path) -> Path:
    """Leave no room; return the file that takes it."""
    path = folder / "ballast"
    with path.open("wb", buffering=0) as file:
        for size in (4096, 1):
            try:
                while True:
                    file.write(bytes(size))
            except OSError:
                continue
    return path


class Session:
    """A session of `realtime_session.py`, in a group of processes of its own."""

    def __init__(
        self,
        folder: Path,
        duration_s: float,
        *options: str,
        preexec: Callable[[], object] | None = None,
    ) -> None:
        self.folder = folder
        self.process = subprocess.Popen(
            [sys.executable, str(SCRIPT), str(folder), str(duration_s), *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            preexec_fn=preexec,
        )

    def running(self) -> dict[str, int]:
        """Wait until samples are in the file; return the processes."""
        path = self.folder / "samples.arrows"
        wait_for(lambda: path.is_file() and read_samples(path)["tick"].size > 50, HANGS_S)
        pids_path = self.folder.with_name("pids.json")

        def pids() -> dict[str, int | str]:
            found = json.loads(pids_path.read_text()) if pids_path.exists() else {}
            return found if found.get("LOOP") else {}

        found = wait_for(pids)
        self.stem = found.pop("MEMORY")  # other sessions may run beside this one
        self.mine = {name for name in memory() if name.startswith(self.stem)}
        return dict(found)

    def ended(self) -> dict[str, Any]:
        """Wait for its end; return how it ended, having seen that no memory is left."""
        out, err = self.process.communicate(timeout=HANGS_S)
        assert self.process.returncode == 0, err
        self.said = err
        assert not self.mine & memory()
        found: dict[str, Any] = json.loads(out.splitlines()[-1])
        return found

    def ticks(self) -> NDArray[Any]:
        """Return the recorded ticks, having seen that each is there once and no other."""
        found: NDArray[Any] = read_samples(self.folder / "samples.arrows")["tick"]
        np.testing.assert_array_equal(found, np.arange(found.size))
        return found

    def close(self) -> None:
        """End what still runs."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGCONT)
            self.process.terminate()
            try:
                self.process.communicate(timeout=HANGS_S)
            except subprocess.TimeoutExpired:
                os.killpg(self.process.pid, signal.SIGKILL)
                self.process.communicate()
                raise
        for pipe in (self.process.stdout, self.process.stderr):
            if pipe is not None:  # nobody has read it, if a test failed
                pipe.close()

    def endings(self) -> list[tuple[str, str, str]]:
        """Return what was closed, with its outcome and reason: once each, and nothing follows."""
        events, torn = read_events(self.folder / "events.jsonl")
        assert not torn
        kinds = [event["event"] for event in events]
        assert kinds.count("session_ended") == kinds.count("epoch_ended") == 1
        assert kinds[-1] == "session_ended"
        return [
            (event["event"], event["outcome"], event["reason"])
            for event in events
            if "outcome" in event
        ]
