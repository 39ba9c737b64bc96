"""Progress with the time left, for anything that takes longer than two seconds."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

QUIET_S = 2.0
"""Nothing is shown before this."""

LINE_EVERY_S = 5.0
"""How often a line is written to a file or a pipe."""

TERMINAL_EVERY_S = 0.2
"""How often the line on a terminal is replaced."""

LEAST_SHARE = 0.1
"""No time left is shown before this share of the work is done: it would be a guess."""


class Meter:
    """Show how much of a task is done, on the standard error.

    On a terminal one line is replaced; in a file or a pipe a line is written now and then. A task
    that is done within two seconds shows nothing.

    Parameters
    ----------
    title : str
        What is being done.
    total : float
        The amount of work, in any unit in which equal amounts take equal times.
    clock : callable
        Gives the time in s.
    from_first : bool
        The speed counts from the first report on: before that processes are started, or libraries
        loaded.
    """

    def __init__(
        self,
        title: str,
        total: float,
        clock: Callable[[], float] = time.monotonic,
        *,
        from_first: bool = False,
    ) -> None:
        self._title = title
        self._total = max(total, 1e-12)
        self._done = 0.0
        self._clock = clock
        self._start_s = clock()
        self._first = None if from_first else (self._start_s, 0.0)
        self._line_s: float | None = None
        self._replaces = sys.stderr.isatty()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._replaces and self._line_s is not None:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)

    @property
    def share(self) -> float:
        """The share of the work that is done."""
        return self._done / self._total

    @property
    def left_s(self) -> float | None:
        """The time left at the mean speed so far; None before a tenth of the work is done."""
        first_s, first = self._first or (0.0, self._done)
        if self.share < LEAST_SHARE or self._done <= first:
            return None
        return (self._clock() - first_s) * (self._total - self._done) / (self._done - first)

    def advance(self, amount: float = 1.0) -> None:
        """Add to what is done."""
        self.reach(self._done + amount)

    def reach(self, done: float) -> None:
        """Set what is done."""
        self._done = min(done, self._total)
        now_s = self._clock()
        self._first = self._first or (now_s, self._done)
        every_s = TERMINAL_EVERY_S if self._replaces else LINE_EVERY_S
        if now_s - self._start_s < QUIET_S or (
            self._line_s is not None and now_s - self._line_s < every_s
        ):
            return
        self._line_s = now_s
        left = "" if self.left_s is None else f", about {self.left_s:.0f} s left"
        line = f"{self._title}: {100 * self.share:.0f} %{left}"
        start, end = ("\r\x1b[K", "") if self._replaces else ("", "\n")
        print(f"{start}{line}", end=end, file=sys.stderr, flush=True)
