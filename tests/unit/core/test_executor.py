"""Many pieces in processes: all of them, once each, whatever becomes of a process."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.core.executor import each


def squared(number: int) -> int:
    if number == 5:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


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


def test_an_item_that_ends_its_process_costs_no_other() -> None:
    found = list(each(squared, iter(range(12)), jobs=2, on_death=lambda _: -1))
    assert sorted(found) == [(n, -1 if n == 5 else n * n) for n in range(12)]


def test_an_exception_of_the_function_comes_out() -> None:
    with pytest.raises(ValueError, match="invalid literal"):
        list(each(int, ["1", "x"], jobs=2))


def test_a_scheduler_that_is_not_there_is_said() -> None:
    pytest.importorskip("distributed")
    with pytest.raises(UserError, match=r"--scheduler nonsense://: cannot be reached"):
        list(each(abs, [1], scheduler="nonsense://"))
