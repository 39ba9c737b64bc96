import gc
import multiprocessing
import os
import time

import pytest

from rigidimeter.acquisition.processes.realtime import (
    DeadlineClock,
    _relative_sleep,
    prepare_loop_process,
)
from rigidimeter.acquisition.processes.watched import Watched


def test_the_clock_wakes_at_its_deadlines():
    clock = DeadlineClock()
    for k in range(1, 6):
        now_s = clock.wait_until(0.01 * k)
        assert 0.01 * k <= now_s < 0.01 * k + 0.5
    assert clock.wait_until(0.0) >= 0.05  # passed: at once


def test_the_clock_does_not_look_at_the_wall(monkeypatch):
    def wall(*_):
        raise AssertionError("the wall clock was read")

    for name in ("time", "time_ns", "localtime", "gmtime"):
        monkeypatch.setattr(time, name, wall)
    clock = DeadlineClock()
    assert 0.005 <= clock.wait_until(0.005) < 0.5


def test_without_the_kernel_s_deadlines_it_sleeps():
    start_ns = time.monotonic_ns()
    _relative_sleep(start_ns + 5_000_000)
    assert time.monotonic_ns() >= start_ns + 5_000_000
    _relative_sleep(start_ns)


def prepared_in_child(pipe, **options) -> None:
    prepared = prepare_loop_process(**options)
    pipe.send((prepared, str(prepared), os.sched_getaffinity(0), gc.isenabled()))


def in_child(**options):
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe()
    process = context.Process(target=prepared_in_child, args=(there,), kwargs=options)
    process.start()
    found = here.recv()
    process.join()
    here.close()
    there.close()
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


def test_a_process_that_ended_is_gone_before_it_is_waited_for():
    pid = os.fork()
    if pid == 0:
        time.sleep(60)
        os._exit(0)
    watched = Watched(pid)
    assert watched.alive()
    watched.kill()
    until_s = time.monotonic() + 5.0
    while watched.alive() and time.monotonic() < until_s:
        time.sleep(0.005)
    assert not watched.alive()
    os.waitpid(pid, 0)
    watched.kill()
    watched.close()
    assert not Watched(pid).alive()


@pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="needs Linux")
def test_a_watched_process_is_not_taken_for_another():
    watched = Watched(os.getpid())
    assert watched.alive()
    watched.close()
    assert not watched.alive()
