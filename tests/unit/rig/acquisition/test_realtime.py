import gc
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest

from rigidimeter.rig.acquisition import DeadlineClock, relative_sleep
from rigidimeter.rig.acquisition.processes import Prepared, WatchedProcess, prepare_loop_process
from rigidimeter.rig.acquisition.processes import realtime_scheduling as realtime


@pytest.mark.realtime
def test_the_clock_wakes_at_its_deadlines_and_errors_do_not_add_up(lateness):
    clock, began_s = DeadlineClock(), time.monotonic()
    for k in range(1, 11):
        now_s = clock.wait_until(0.01 * k)
        assert 0.01 * k <= now_s < 0.01 * k + 0.005 + lateness.worst_s(began_s)
        assert now_s == pytest.approx(clock.now_s(), abs=0.005 + lateness.worst_s(began_s))
    assert clock.wait_until(0.0) >= 0.1  # passed: at once


@pytest.mark.realtime
def test_the_clock_does_not_look_at_the_wall(lateness, monkeypatch):
    def wall(*_):
        raise AssertionError("the wall clock was read")

    for name in ("time", "time_ns", "localtime", "gmtime"):
        monkeypatch.setattr(time, name, wall)
    clock, began_s = DeadlineClock(), time.monotonic()
    assert 0.005 <= clock.wait_until(0.005) < 0.01 + lateness.worst_s(began_s)


def test_without_the_kernel_s_deadlines_it_sleeps():
    start_ns = time.monotonic_ns()
    relative_sleep(start_ns + 5_000_000)
    assert time.monotonic_ns() >= start_ns + 5_000_000
    relative_sleep(start_ns)


def prepared_in_child(pipe, **options) -> None:
    prepared = prepare_loop_process(**options)
    pipe.send((prepared, str(prepared), os.sched_getaffinity(0), gc.isenabled()))


def in_child(main=prepared_in_child, **options):
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe()
    process = context.Process(target=main, args=(there,), kwargs=options)
    process.start()
    there.close()  # so that a child that fails ends the wait
    found = here.recv()
    process.join()
    here.close()
    return found


def test_what_is_permitted_is_said():
    prepared, text, processors, collects = in_child(priority=0, lock_memory=False)
    assert prepared.priority is None
    assert not collects
    assert prepared.collector_off
    assert prepared.cpu in (None, *processors)
    assert text.startswith("The loop's process has ")
    assert prepared.facts()["refused"] == list(prepared.refused)


def test_what_is_refused_is_said_and_not_raised():
    prepared, text, _, _ = in_child(priority=1000, cpu=4000, lock_memory=False)
    assert prepared.priority is None
    assert "The priority 1000 of SCHED_FIFO was refused (Invalid argument)" in text
    if len(os.sched_getaffinity(0)) > 1:
        assert prepared.cpu is None
        assert "Processor 4000 was refused" in text


def prepared_in_order(pipe) -> None:
    """Say in what order the slow steps and the priority come."""
    steps = []
    # Truly done, both would copy all that the test run holds into this process.
    gc.collect = lambda: steps.append("collect")
    libc = SimpleNamespace(mlockall=lambda _: steps.append("lock") or 0, prctl=lambda *_: 0)
    realtime.ctypes.CDLL = lambda *_, **__: libc
    realtime._beside = lambda *_: steps.append("look") or []
    os.sched_setscheduler = lambda *_: steps.append("priority")
    prepare_loop_process()
    pipe.send(steps)


def test_the_priority_comes_after_all_that_takes_long():
    """At a real-time priority the work before it would hold up another loop on the processor."""
    steps = in_child(prepared_in_order)
    assert set(steps) == {"collect", "lock", "look", "priority"}
    assert steps.index("priority") == len(steps) - 1


def test_what_share_of_the_time_there_is_is_said():
    share = realtime._real_time_share()
    assert share is None or 0.0 <= share <= 1.0
    prepared = Prepared(80, 0.95, 1, True, 1, True, ())
    assert "SCHED_FIFO at priority 80 for at most 95 % of the time, processor 1" in str(prepared)
    for all_of_it in (1.0, None):
        assert "%" not in str(Prepared(80, all_of_it, 1, True, 1, True, ()))


@pytest.fixture
def rival():
    """Another program that runs in real time on the last processor; it sleeps."""
    pid = os.fork()
    if pid == 0:
        time.sleep(60)
        os._exit(0)
    try:
        os.sched_setaffinity(pid, {max(os.sched_getaffinity(0))})
        try:
            os.sched_setscheduler(pid, os.SCHED_FIFO, os.sched_param(7))
        except PermissionError:
            pytest.skip("no real-time priority is permitted here")
        yield pid
    finally:
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)


def test_other_programs_in_real_time_are_named(rival):
    last = max(os.sched_getaffinity(0))
    (sentence,) = realtime._beside([last], 80, 0.95)
    assert sentence.startswith(f"Other real-time programs on processor {last}: ")
    assert f"({rival}) at priority 7" in sentence
    assert "One of 80 or more delays the loop" in sentence
    assert "all are paused once they were busy for 95 % of a second" in sentence
    (sentence,) = realtime._beside([last], 80, 1.0)
    assert "stand still" not in sentence
    assert f"({rival})" not in " ".join(realtime._beside([last + 1], 80, 0.95))


GROWTH = """
import numpy as np
from rigidimeter.rig.acquisition.processes.realtime_scheduling import prepare_loop_process
from rigidimeter.rig.guard.torque_sign import explained_answer

def mapped_kib():
    with open("/proc/self/status") as file:
        return next(int(line.split()[1]) for line in file if line.startswith("VmSize"))

window = np.random.default_rng(1).normal(size=(60, 9))
prepare_loop_process(priority=0, lock_memory=False)
before = mapped_kib()
explained_answer(window)
print(mapped_kib() - before)
"""


@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="needs Linux")
def test_linear_algebra_takes_its_memory_before_the_loop_runs():
    """With the memory locked, 32 MB more held the loop up for 110 ms as the joint was perturbed."""
    done = subprocess.run([sys.executable, "-c", GROWTH], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) < 1024


def test_a_process_that_ended_is_gone_before_it_is_waited_for():
    pid = os.fork()
    if pid == 0:
        time.sleep(60)
        os._exit(0)
    watched = WatchedProcess(pid)
    assert watched.alive()
    watched.kill()
    until_s = time.monotonic() + 5.0
    while watched.alive() and time.monotonic() < until_s:
        time.sleep(0.005)
    assert not watched.alive()
    os.waitpid(pid, 0)
    watched.kill()
    watched.close()
    assert not WatchedProcess(pid).alive()


@pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="needs Linux")
def test_a_watched_process_is_not_taken_for_another():
    watched = WatchedProcess(os.getpid())
    assert watched.alive()
    watched.close()
    assert not watched.alive()
