"""`rigidimeter run` on a pseudo-terminal: a key stops the arm, and the terminal is given back."""

from __future__ import annotations

import json
import os
import pty
import select
import subprocess
import sys
import termios
import time
from pathlib import Path

from tests.replayed import assert_folder_replayed

from rigidimeter.rig.console import LEAVE

SETTINGS = """
[loop]
stall_s = 1.0
missed_in_a_row = 1000
[zeroing]
duration_s = 0.2
"""
"""The machine may be slow: that is not what is tested."""

LONGEST_S = 90.0


class Operator:
    """The far end of the terminal."""

    def __init__(self) -> None:
        self.far, self.near = pty.openpty()
        self.seen = b""

    def watch(self, seconds: float) -> None:
        """Read what comes for some time."""
        until_s = time.monotonic() + seconds
        while (left_s := until_s - time.monotonic()) > 0.0:
            if select.select([self.far], [], [], left_s)[0]:
                self.seen += os.read(self.far, 1 << 16)

    def wait_for(self, text: bytes, process: subprocess.Popen[bytes]) -> None:
        """Read until a text has come."""
        until_s = time.monotonic() + LONGEST_S
        while text not in self.seen and process.poll() is None and time.monotonic() < until_s:
            self.watch(0.05)
        assert text in self.seen, self.seen[-3000:].decode(errors="replace")


def test_a_key_stops_the_arm_and_the_terminal_is_given_back(tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text(SETTINGS)
    operator, folder = Operator(), tmp_path / "my session"
    before = termios.tcgetattr(operator.near)
    command = [sys.executable, "-m", "rigidimeter", "run", str(tmp_path / "p.toml")]
    process = subprocess.Popen(
        [*command, "--out", str(folder), "--priority", "0"],
        stdin=operator.near,
        stdout=operator.near,
        stderr=operator.near,
        env={**os.environ, "TERM": "xterm"},
        start_new_session=True,
    )
    try:
        operator.wait_for(b"| epoch 1 of 8: ", process)
        os.write(operator.far, b"e")
        until_s = time.monotonic() + LONGEST_S
        while process.poll() is None and time.monotonic() < until_s:
            if b"What to do next:" not in operator.seen:
                os.write(operator.far, b"x\n")  # half an order, typed on in fright
            operator.watch(0.05)
        assert process.wait(1.0) == 1
    finally:
        process.kill()
    operator.watch(0.2)
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    assert_folder_replayed(folder)
    (latched,) = (event for event in events if event["event"] == "guard_latched")
    assert latched["cause"] == "emergency_stop"
    after = operator.seen.rpartition(LEAVE.rstrip())[2].decode()
    assert "What to do next:" in after
    assert f"rigidimeter run --resume '{folder}' --out '{folder}-2'" in after
    assert "run the 8 epochs that are left" in after
    unfolded = " ".join(after.split())  # where it is folded depends on the folder's name
    assert "the emergency stop was pressed; see to the subject" in unfolded
    assert termios.tcgetattr(operator.near) == before
    os.close(operator.far)
    os.close(operator.near)
