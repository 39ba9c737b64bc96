"""Many pieces in processes: all of them, once each, whatever becomes of a process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor
from contextlib import closing
from pathlib import Path

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.executor import each

SCRIPT = """
import time
from rigidimeter.core.executor import each
print("run", flush=True)
print(*sorted(result for _, result in each(abs, [-1, -2, -3], jobs=2)), flush=True)
for seconds, _ in each(time.sleep, [0, 600], jobs=2):
    print(seconds, flush=True)
"""


def squared(number: int) -> int:
    if number == 5:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def surroundings(_: int) -> tuple[int, object, str]:
    return os.getpid(), signal.getsignal(signal.SIGINT), os.environ["OPENBLAS_NUM_THREADS"]


def slow_first(number: int) -> int:
    time.sleep(0.0 if number else 0.3)
    return -number


def dies_once(marker: Path) -> int:
    """End the process unless the file is there, which the first call makes."""
    if marker.name != "none" and not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGTERM)
    return os.getpid()


def test_in_this_process_items_are_taken_as_they_are_needed() -> None:
    taken = []

    def items() -> Iterator[int]:
        for number in range(3):
            taken.append(number)
            yield number

    found = each(abs, items())
    assert next(found) == (0, 0)
    assert taken == [0]
    assert list(found) == [(1, 1), (2, 2)]


def test_processes_take_few_items_ahead_and_end_when_closed() -> None:
    taken = []

    def items() -> Iterator[int]:
        for number in range(1000):
            taken.append(number)
            yield number

    with closing(each(surroundings, items(), jobs=2)) as found:
        first = [next(found)[1] for _ in range(10)]
        assert len(taken) < 20
    assert {about[1:] for about in first} == {(signal.SIG_IGN, "1")}
    for pid, _, _ in first:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def test_closing_waits_for_no_result() -> None:
    start_s = time.monotonic()
    with closing(each(time.sleep, [0.0, 120.0, 120.0], jobs=2)) as found:
        next(found)
    assert time.monotonic() - start_s < 60.0


def test_results_in_the_order_of_the_items() -> None:
    found = list(each(slow_first, range(9), jobs=2, in_order=True))
    assert found == [(number, -number) for number in range(9)]


def test_an_item_that_ends_its_process_costs_no_other() -> None:
    found = list(each(squared, iter(range(12)), jobs=2, on_death=lambda _: -1))
    assert sorted(found) == [(n, -1 if n == 5 else n * n) for n in range(12)]
    with pytest.raises(BrokenExecutor):
        list(each(squared, [5], jobs=2))


def test_a_process_that_ended_is_replaced_and_named(tmp_path: Path) -> None:
    lost: list[str] = []
    items = [tmp_path / "none", tmp_path / "once", tmp_path / "none"]
    found = list(each(dies_once, items, jobs=2, on_lost=lost.extend))
    assert sorted(item for item, _ in found) == sorted(items)
    assert lost == ["a process of this machine"]


def test_a_script_is_not_run_again_and_its_processes_end_with_it(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True) as ran:
        assert ran.stdout is not None
        assert [ran.stdout.readline() for _ in range(3)] == ["run\n", "1 2 3\n", "0\n"]
        ran.kill()
        ran.communicate(timeout=60)  # comes to the end when no process has the output any more


def test_an_exception_of_the_function_comes_out() -> None:
    with pytest.raises(ValueError, match="invalid literal"):
        list(each(int, ["1", "x"], jobs=2))


def test_a_scheduler_that_is_not_there_is_said() -> None:
    pytest.importorskip("distributed")
    with pytest.raises(UserError, match=r"--scheduler nonsense://: cannot be reached"):
        list(each(abs, [1], scheduler="nonsense://"))


def test_nothing_is_left_of_a_scheduler_without_a_port_whose_end_fails() -> None:
    pytest.importorskip("distributed")
    script = "from rigidimeter.core.executor import each\nlist(each(abs, [1], scheduler='foo'))"
    ran = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert "UserError: --scheduler foo: cannot be reached" in ran.stderr
    assert "Exception ignored" not in ran.stderr
