"""A process of a real-time session is killed, stopped, or its disk fills: the others go on."""

import os
import resource
import signal
import subprocess
import sys
import time

import pytest
from tests.faults.running_session import Session, alive, memory, wait_for

from rigidimeter.core.session import read_events, read_samples
from rigidimeter.rig.acquisition.processes import HELD_BACK, held_back


@pytest.fixture
def session(tmp_path):
    started = []

    def start(duration_s, *options):
        started.append(Session(tmp_path / "session", duration_s, *options))
        return started[0]

    yield start
    for one in started:
        one.close()


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


@pytest.mark.parametrize(
    "number",
    [
        signal.SIGKILL,
        pytest.param(signal.SIGSTOP, marks=pytest.mark.slow),  # also on the wire, fault 21
    ],
)
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


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(signal.SIGKILL, marks=pytest.mark.slow),  # also on the wire, fault 9
        signal.SIGSTOP,
    ],
)
def test_the_loop(session, number):
    run = session(30.0)
    pid = run.running()["LOOP"]
    os.kill(pid, number)
    ended = run.ended()
    why = {
        signal.SIGKILL: "the loop's process ended without closing the session",
        signal.SIGSTOP: "the loop's process did not answer for 1 s",
    }[number]
    reason = ended["reason"]
    assert run.endings() == [("epoch_ended", "fail", reason), ("session_ended", "fail", reason)]
    assert ended["outcome"] == "fail"
    assert reason.startswith(why)
    assert reason.endswith("continue with `rigidimeter run --resume`")
    assert ended["recovered"] is None
    assert not alive(pid)
    run.ticks()


def test_signals_of_the_terminal_wait_while_a_process_loads():
    """They reach the whole group, and one that loads has not come to where it ignores them."""
    code = "import signal; print(*map(int, signal.pthread_sigmask(signal.SIG_BLOCK, [])))"
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    with held_back():
        child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert {int(number) for number in child.stdout.split()} >= set(HELD_BACK)
    assert signal.pthread_sigmask(signal.SIG_BLOCK, []) == before


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
    time.sleep(1.0)  # several writes, and less than what stops the arm
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
