"""A process of a real-time session is killed, stopped, or its disk fills: the others go on."""

import json
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from rigidimeter.acquisition.processes.supervise import OF_THE_TERMINAL, _undisturbed
from rigidimeter.guard import Cause
from rigidimeter.recording.event_log import read_events
from rigidimeter.recording.sample_log import read_samples

SCRIPT = Path(__file__).with_name("realtime_session.py")


def memory() -> set[str]:
    return {path.name for path in Path("/dev/shm").glob("rigidimeter-*")}


def alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state not in "ZX"


def wait_for(what, timeout_s=30.0):
    until_s = time.monotonic() + timeout_s
    while time.monotonic() < until_s:
        found = what()
        if found:
            return found
        time.sleep(0.02)
    pytest.fail(f"{what} did not come true within {timeout_s} s")


class Session:
    def __init__(self, folder: Path, duration_s: float, *options: str) -> None:
        self.folder = folder
        self.before = memory()
        self.process = subprocess.Popen(
            [sys.executable, str(SCRIPT), str(folder), str(duration_s), *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def running(self) -> dict[str, int]:
        """Wait until samples are in the file; return the processes."""
        path = self.folder / "samples.arrows"
        wait_for(lambda: path.is_file() and read_samples(path)["tick"].size > 50)
        self.mine = memory() - self.before
        pids_path = self.folder.with_name("pids.json")

        def pids() -> dict[str, int]:
            found = json.loads(pids_path.read_text()) if pids_path.exists() else {}
            return found if found.get("LOOP") else {}

        return wait_for(pids)

    def ended(self) -> dict:
        out, err = self.process.communicate(timeout=40.0)
        assert self.process.returncode == 0, err
        self.said = err
        assert not self.mine & memory()
        return json.loads(out.splitlines()[-1])

    def ticks(self) -> np.ndarray:
        """Return the recorded ticks, having seen that each is there once and no other."""
        found = read_samples(self.folder / "samples.arrows")["tick"]
        np.testing.assert_array_equal(found, np.arange(found.size))
        return found

    def endings(self) -> list[tuple[str, str, str]]:
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


@pytest.fixture
def session(tmp_path):
    started = []

    def start(duration_s, *options):
        started.append(Session(tmp_path / "session", duration_s, *options))
        return started[0]

    yield start
    process = started[0].process
    if process.poll() is None:
        process.send_signal(signal.SIGCONT)
        process.terminate()
        process.communicate(timeout=30.0)


def test_nothing_happens(session):
    run = session(1.0, "live")
    run.running()
    ended = run.ended()
    assert (ended["outcome"], ended["loop_exit"], ended["remarks"]) == ("success", 0, [])
    assert run.ticks().size == 500
    assert (ended["recovered"], ended["samples"]) == (None, 500)
    assert "did not answer" not in run.said
    assert 400 < ended["seen"]["tick"] < 500
    assert [ending[1] for ending in run.endings()] == ["success", "success"]
    events, _ = read_events(run.folder / "events.jsonl")
    assert [event["event"] for event in events[:3]] == [
        "loop_prepared",
        "session_started",
        "epoch_started",
    ]


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_the_recorder(session, number):
    run = session(30.0)
    os.kill(run.running()["RECORDER"], number)
    ended = run.ended()
    assert ended["outcome"] == "fail"
    assert ended["reason"] == "the recorder no longer answered"
    assert ended["loop_exit"] == 0
    # The loop went on for a second, and all of that was brought in from the ring.
    assert ended["recovered"]["samples"] >= 400
    assert ended["recovered"]["missing_samples"] == 0
    run.ticks()
    assert {ending[2] for ending in run.endings()} == {"the recorder no longer answered"}


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_the_loop(session, number):
    run = session(30.0)
    pid = run.running()["LOOP"]
    os.kill(pid, number)
    ended = run.ended()
    why = {
        signal.SIGKILL: "the loop's process ended without closing the session",
        signal.SIGSTOP: "the loop's process did not answer for 1 s",
    }[number]
    assert run.endings() == [("epoch_ended", "fail", why), ("session_ended", "fail", why)]
    assert (ended["outcome"], ended["reason"]) == ("fail", why)
    assert ended["recovered"] is None
    assert not alive(pid)
    run.ticks()


def test_the_console_is_killed(session):
    run = session(30.0)
    pids = run.running()
    run.process.kill()
    run.process.communicate(timeout=30.0)
    wait_for(lambda: not any(alive(pids[role]) for role in ("LOOP", "RECORDER")))
    wait_for(lambda: not run.mine & memory())
    assert {ending[2] for ending in run.endings()} == {"the operator's console no longer answered"}
    run.ticks()


def test_the_terminal_is_closed(session):
    """The loop is told at once; it need not wait until the console has been silent for long."""
    run = session(60.0)
    run.running()
    run.process.send_signal(signal.SIGHUP)
    ended = run.ended()
    assert ended["outcome"] == "fail"
    assert ended["reason"] == Cause.SIGNAL.sentence
    run.ticks()
    run.endings()


def test_signals_of_the_terminal_wait_while_a_process_loads():
    """They reach the whole group, and one that loads has not come to where it ignores them."""
    code = "import signal; print(*map(int, signal.pthread_sigmask(signal.SIG_BLOCK, [])))"
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    with _undisturbed():
        child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert {int(number) for number in child.stdout.split()} >= set(OF_THE_TERMINAL)
    assert signal.pthread_sigmask(signal.SIG_BLOCK, []) == before


def test_the_console_is_stopped_and_goes_on(session):
    run = session(30.0)
    pids = run.running()
    run.process.send_signal(signal.SIGSTOP)
    wait_for(lambda: not alive(pids["LOOP"]))
    run.process.send_signal(signal.SIGCONT)
    assert run.ended()["reason"] == "the operator's console no longer answered"
    run.ticks()


def test_console_and_recorder_are_killed(session):
    run = session(30.0)
    pids = run.running()
    os.kill(pids["RECORDER"], signal.SIGKILL)
    run.process.kill()
    run.process.communicate(timeout=30.0)
    wait_for(lambda: not alive(pids["LOOP"]))
    wait_for(lambda: not run.mine & memory())
    assert run.endings()[-1][1] == "fail"
    run.ticks()


def test_the_disk_is_full_for_a_while(session):
    run = session(3.0)
    recorder = run.running()["RECORDER"]
    # As when the disk is full: a write takes a part and the next one nothing.
    size = (run.folder / "samples.arrows").stat().st_size + 3001
    resource.prlimit(recorder, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
    wait_for(lambda: (run.folder / "samples.arrows").stat().st_size > size - 30000)
    time.sleep(1.0)
    written = read_samples(run.folder / "samples.arrows")["tick"].size
    assert written < 1300
    unlimited = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
    resource.prlimit(recorder, resource.RLIMIT_FSIZE, unlimited)
    ended = run.ended()
    assert ended["outcome"] == "success"
    assert "nothing can be written there (File too large)" in ended["seen"]["trouble"]
    assert run.ticks().size == 1500
    events, _ = read_events(run.folder / "events.jsonl")
    assert any(event["event"] == "recording_resumed" for event in events)


def test_a_folder_that_is_in_use_is_refused_before_anything_moves(session, tmp_path):
    (tmp_path / "session").mkdir()
    (tmp_path / "session" / "notes.txt").write_text("mine")
    run = session(1.0)
    _, err = run.process.communicate(timeout=30.0)
    assert run.process.returncode == 1
    assert "is not empty" in err.splitlines()[-1]
