"""Signals, killed groups and full disks: the session ends in order, nothing is lost or left."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tests.faults.running_session import Session, alive, fill, memory, wait_for
from tests.faults.written_ring import Ring

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import read_events, read_samples
from rigidimeter.rig.acquisition.processes import (
    Patience,
    ProcessCondition,
    Role,
    SharedStatus,
    complete_left,
)
from rigidimeter.rig.guard import Cause


def ignoring():
    """Ignore what a background shell and `nohup` ignore."""
    for number in (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT):
        signal.signal(number, signal.SIG_IGN)


@pytest.fixture
def session(tmp_path):
    started = []

    def start(duration_s, *options, folder=tmp_path / "session", preexec=None):
        started.append(Session(folder, duration_s, *options, preexec=preexec))
        return started[0]

    yield start
    for one in started:
        one.close()


OUTCOMES = {
    signal.SIGINT: ("abort", "aborted"),
    signal.SIGTERM: ("fail", Cause.SIGNAL.sentence),
    signal.SIGHUP: ("fail", Cause.SIGNAL.sentence),
    signal.SIGQUIT: ("fail", Cause.SIGNAL.sentence),
}


@pytest.mark.parametrize(
    "number",
    [
        signal.SIGINT,
        signal.SIGHUP,
        pytest.param(signal.SIGTERM, marks=pytest.mark.slow),
        pytest.param(signal.SIGQUIT, marks=pytest.mark.slow),  # also on the wire, fault 20
    ],
)
def test_a_signal_to_the_group_ends_it_in_order(number, session):
    """Whatever the program that started it did with the signal, and without a traceback."""
    run = session(60.0, preexec=ignoring)
    run.running()
    os.killpg(run.process.pid, number)
    ended = run.ended()
    assert (ended["outcome"], ended["reason"]) == OUTCOMES[number]
    assert ended["loop_exit"] == 0
    assert "Traceback" not in run.said
    run.ticks()
    run.endings()


@pytest.mark.parametrize(
    ("role", "number"),
    [
        ("RECORDER", signal.SIGTERM),
        ("LOOP", signal.SIGINT),
        pytest.param("RECORDER", signal.SIGINT, marks=pytest.mark.slow),
        pytest.param("RECORDER", signal.SIGQUIT, marks=pytest.mark.slow),
        pytest.param("LOOP", signal.SIGTERM, marks=pytest.mark.slow),
        pytest.param("LOOP", signal.SIGHUP, marks=pytest.mark.slow),
        pytest.param("LOOP", signal.SIGQUIT, marks=pytest.mark.slow),
    ],
)
def test_a_signal_to_one_process_ends_it_in_order(role, number, session):
    run = session(60.0)
    os.kill(run.running()[role], number)
    ended = run.ended()
    assert (ended["outcome"], ended["reason"]) == OUTCOMES[number]
    run.ticks()
    run.endings()


@pytest.mark.realtime(resolves_s=0.1)
def test_a_console_that_was_killed_is_not_outlived(session, lateness):
    run = session(60.0)
    pids = run.running()
    began_s, newest_s = time.monotonic(), Ring(run.stem).newest()["time_s"]
    run.process.kill()
    wait_for(lambda: not any(alive(pids[role]) for role in ("LOOP", "RECORDER")))
    # By the loop's own clock: how long its process then takes to end is the machine's.
    ran_s = read_samples(run.folder / "samples.arrows")["time_s"][-1] - newest_s
    assert 0.0 <= ran_s < 1.0 + lateness.worst_s(began_s)  # the dead-man's time
    run.process.communicate(timeout=30.0)
    assert not run.mine & memory()
    assert {ending[2] for ending in run.endings()} == {Cause.CONSOLE_LOST.sentence}
    run.ticks()


def test_what_a_killed_group_left_is_brought_in(session):
    run = session(60.0)
    run.running()
    with pytest.raises(UserError, match="still being recorded"):
        complete_left(run.folder)
    os.killpg(run.process.pid, signal.SIGKILL)
    run.process.communicate(timeout=30.0)
    assert run.mine <= memory()
    told = complete_left(run.folder, "the group was killed")
    assert not run.mine & memory()
    assert len(told) <= 1  # none if the recorder had just written
    recovered = subprocess.run(
        [sys.executable, "-m", "rigidimeter", "recover", str(run.folder)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert recovered.returncode == 0, recovered.stderr
    assert [ending[1] for ending in run.endings()] == ["fail", "fail"]
    run.ticks()
    assert complete_left(run.folder) == []


def status_of(run: Session) -> SharedStatus:
    (name,) = (name for name in run.mine if name.endswith("-status"))
    return SharedStatus.attach(name)


def stopped_by_full_disk(run: Session, disk: Path) -> Path:
    """Let the session run until its disk was full and the loop has stopped; return the ballast."""
    run.running()
    ballast = fill(disk)
    status = status_of(run)
    wait_for(lambda: status.condition(Role.LOOP) is ProcessCondition.DONE)
    assert status.condition(Role.RECORDER) is ProcessCondition.TROUBLE
    status.close()
    assert run.process.poll() is None
    return ballast


@pytest.mark.slow  # always: one that is told to end before there is room, as below
def test_a_full_disk_stops_the_arm_and_the_record_waits_for_room(session, small_disk):
    run = session(60.0, folder=small_disk / "session")
    ballast = stopped_by_full_disk(run, small_disk)
    ballast.unlink()
    ended = run.ended()
    assert ended["reason"] == Cause.RECORD_OVERFLOW.sentence
    assert "No space left on device); 0.0 MB are free, " in ended["seen"]["trouble"]
    assert ended["recovered"] is None
    assert run.ticks().size == ended["samples"]
    run.endings()


def test_another_folder_is_taken_when_the_disk_is_full(session, small_disk, tmp_path):
    run = session(60.0, f"save={tmp_path / 'other'}", folder=small_disk / "session")
    run.running()
    fill(small_disk)
    wait_for(lambda: (tmp_path / "other" / "samples.arrows").exists())
    run.process.send_signal(signal.SIGTERM)
    ended = run.ended()
    assert ended["folder"] == str(tmp_path / "other")
    assert ended["reason"] == Cause.SIGNAL.sentence
    assert not any("could not" in remark for remark in ended["remarks"])
    run.folder = tmp_path / "other"
    assert run.ticks().size == ended["samples"]
    run.endings()
    events, _ = read_events(run.folder / "events.jsonl")
    (moved,) = (event for event in events if event["event"] == "recording_moved")
    assert moved["from"] == str(small_disk / "session")


@pytest.mark.parametrize(
    "number", [signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.slow)]
)
def test_a_full_disk_does_not_keep_the_program(number, session, small_disk):
    """Told to end it ends, and the samples stay in memory until there is room."""
    run = session(60.0, folder=small_disk / "session")
    ballast = stopped_by_full_disk(run, small_disk)
    began_s = time.monotonic()
    run.process.send_signal(number)
    out, err = run.process.communicate(timeout=40.0)
    # Here its patience with a disk is 1 s. By default it is 30 s, and all together at most 60 s.
    assert time.monotonic() - began_s < 1.0 + (60.0 - Patience().disk_s)
    assert run.process.returncode == 0, err
    assert "Traceback" not in err
    ended = json.loads(out.splitlines()[-1])
    assert ended["outcome"] == ""
    assert "No space left on device); 0.0 MB are free, " in ended["seen"]["trouble"]
    assert any("stay in memory" in remark for remark in ended["remarks"])
    assert run.mine <= memory()
    with pytest.raises(UserError, match="could not be written"):
        complete_left(run.folder)
    assert run.mine <= memory()
    ballast.unlink()
    (told,) = complete_left(run.folder)
    assert "were brought in" in told
    assert not run.mine & memory()
    assert run.ticks().size == ended["samples"]
    assert {ending[2] for ending in run.endings()} == {Cause.RECORD_OVERFLOW.sentence}
