"""The emulated rig in its own process, controlled by command lines.

    with RigProcess(tmp_path / "RIG.toml") as rig:
        rig.misbehave("torque", "silent")
        rig.state()["velocity_rad_s"]

A process that dies or hangs fails the test with its output; none outlives its context.
"""

from __future__ import annotations

import json
import select
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Self

from tests.lateness import ordinary_priority, same_priority

__all__ = ["RigProcess"]

ANSWER_S = 10.0
START_S = 30.0


class RigProcessError(AssertionError):
    """The emulated rig refused a command, died or did not answer."""


def _as_in_a_terminal() -> None:
    """Obey Ctrl-C, which is ignored in a shell's background; give up a real-time priority."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    ordinary_priority()


class RigProcess:
    """Spawn `rigidimeter emulate`; ready when entered.

    Parameters
    ----------
    rig : Path
        Where it writes its rig file.
    drive : str
    options : str
        More of the command line, such as ``"--noise-nm", "0.5"``.
    """

    def __init__(self, rig: Path, drive: str = "cia402", *options: str) -> None:
        self.rig = rig
        self._command = [sys.executable, "-m", "rigidimeter.cli.emulate", "--drive", drive]
        self._command += ["--rig-out", str(rig), *options]
        self._process: subprocess.Popen[bytes] | None = None
        self._heard = b""
        self.ready: dict[str, Any] = {}

    def __enter__(self) -> Self:
        # A file, not a pipe, so that unread output cannot block the process.
        self._errors = tempfile.TemporaryFile()
        self._process = subprocess.Popen(
            self._command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            bufsize=0,
            start_new_session=True,  # Ctrl-C in a test run is for the test run
            preexec_fn=_as_in_a_terminal,
        )
        try:
            self.ready = self._answer("start", START_S)
            same_priority(self.pid)
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def pid(self) -> int:
        assert self._process is not None
        return self._process.pid

    def command(self, line: str, *, refused: bool = False) -> dict[str, Any]:
        """Send one line and return the answer; one that is refused fails unless expected."""
        process = self._process
        assert process is not None
        assert process.stdin is not None
        try:
            process.stdin.write(line.encode() + b"\n")
        except OSError as error:
            raise RigProcessError(
                f"{line!r}: the emulated rig is gone ({error}): {self._said()}"
            ) from error
        answer = self._answer(line, ANSWER_S)
        if answer["ok"] is refused:
            raise RigProcessError(f"{line!r}: {answer}")
        return answer

    def misbehave(self, role: str, name: str, value: float | None = None) -> dict[str, Any]:
        """Start a misbehaviour of the torque or drive emulator."""
        return self.command(f"misbehave {role} {name}" + ("" if value is None else f" {value!r}"))

    def behave(self) -> None:
        self.command("behave")

    def state(self) -> dict[str, Any]:
        return self.command("state")

    def log(self) -> list[list[Any]]:
        log: list[list[Any]] = self.command("log")["log"]
        return log

    def wait_until(self, wanted: Any, timeout_s: float = 5.0) -> dict[str, Any]:
        """Return the first state for which `wanted(state)` holds."""
        until_s = time.monotonic() + timeout_s
        while not wanted(state := self.state()):
            if time.monotonic() > until_s:
                raise RigProcessError(f"after {timeout_s:g} s the state is still {state}")
            time.sleep(0.005)
        return state

    def close(self) -> None:
        """End the process by closing its input, and kill it if that does not end it."""
        process, self._process = self._process, None
        if process is None:
            return
        try:
            assert process.stdin is not None
            process.stdin.close()
            try:
                process.wait(5.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        finally:
            assert process.stdout is not None
            process.stdout.close()
            self._errors.close()

    def _answer(self, line: str, timeout_s: float) -> dict[str, Any]:
        process = self._process
        assert process is not None
        assert process.stdout is not None
        until_s = time.monotonic() + timeout_s
        while b"\n" not in self._heard:
            left_s = max(0.0, until_s - time.monotonic())
            if not select.select([process.stdout], [], [], left_s)[0]:
                raise RigProcessError(f"{line!r}: no answer in {timeout_s:g} s: {self._said()}")
            chunk = process.stdout.read(65536)
            if not chunk:
                raise RigProcessError(f"{line!r}: the emulated rig ended: {self._said()}")
            self._heard += chunk
        first, _, self._heard = self._heard.partition(b"\n")
        answer: dict[str, Any] = json.loads(first)
        return answer

    def _said(self) -> str:
        self._errors.seek(0)
        return self._errors.read().decode(errors="replace")[-2000:]
