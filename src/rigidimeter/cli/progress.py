"""Progress with the time left, for anything that takes longer than two seconds."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TaskProgressColumn, TextColumn

__all__ = ["Meter"]

QUIET_S = 2.0
"""Nothing is shown before this."""

LINE_EVERY_S = 5.0
"""How often a line is written where there is no terminal to draw on."""

LEAST_SHARE = 0.1
"""No time left is shown before this share of the work is done: it would be a guess."""


class Meter:
    """Show how much of a task is done, on the standard error.

    A bar with the time left on a terminal, a line now and then elsewhere, and nothing at all for
    a task that is done within two seconds.

    Parameters
    ----------
    title : str
        What is being done.
    total : float
        The amount of work, in any unit in which equal amounts take equal times.
    clock : callable
        Gives the time in s.
    """

    def __init__(
        self, title: str, total: float, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._title = title
        self._total = max(total, 1e-12)
        self._done = 0.0
        self._clock = clock
        self._start_s = clock()
        self._line_s: float | None = None
        self._bar: Progress | None = None
        self._task: TaskID | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    @property
    def share(self) -> float:
        """The share of the work that is done."""
        return self._done / self._total

    @property
    def left_s(self) -> float | None:
        """The time left at the mean speed so far; None before a tenth of the work is done."""
        if self.share < LEAST_SHARE:
            return None
        return (self._clock() - self._start_s) * (1 - self.share) / self.share

    def advance(self, amount: float = 1.0) -> None:
        """Add to what is done."""
        self.reach(self._done + amount)

    def reach(self, done: float) -> None:
        """Set what is done."""
        self._done = min(done, self._total)
        now_s = self._clock()
        if now_s - self._start_s < QUIET_S:
            return
        if sys.stderr.isatty():
            self._draw()
        elif self._line_s is None or now_s - self._line_s >= LINE_EVERY_S:
            self._line_s = now_s
            print(f"{self._title}: {100 * self.share:.0f} %{self._left()}", file=sys.stderr)
            sys.stderr.flush()

    def _left(self) -> str:
        left_s = self.left_s
        return "" if left_s is None else f", about {left_s:.0f} s left"

    def _draw(self) -> None:
        if self._bar is None:
            self._bar = Progress(
                TextColumn("{task.description}"),
                BarColumn(),
                TaskProgressColumn(),
                TextColumn("{task.fields[left]}"),
                console=Console(stderr=True),
                transient=True,
            )
            self._bar.start()
            self._task = self._bar.add_task(self._title, total=self._total, left="")
        if self._task is not None:
            self._bar.update(self._task, completed=self._done, left=self._left().lstrip(", "))
