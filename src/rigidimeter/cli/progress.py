"""Progress with the time left, for anything that takes longer than two seconds."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)

__all__ = ["Meter"]

QUIET_S = 2.0
"""Nothing is shown before this."""

LINE_EVERY_S = 5.0
"""How often a line is written where there is no terminal to draw on."""


class Meter:
    """Show how far a piece of work has come, on the standard error.

    A bar with the time left on a terminal, a line now and then elsewhere, and nothing at all for
    work that is done within two seconds.

    Parameters
    ----------
    title : str
        What is being done.
    total : float
        The amount of work, in any unit.
    """

    def __init__(self, title: str, total: float) -> None:
        self._title = title
        self._total = max(total, 1e-12)
        self._done = 0.0
        self._start_s = self._line_s = time.monotonic()
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

    def advance(self, amount: float = 1.0) -> None:
        """Add to what is done."""
        self.reach(self._done + amount)

    def reach(self, done: float) -> None:
        """Set what is done."""
        self._done = min(done, self._total)
        now_s = time.monotonic()
        if now_s - self._start_s < QUIET_S:
            return
        if sys.stderr.isatty():
            self._draw()
        elif now_s - self._line_s >= LINE_EVERY_S or self._line_s == self._start_s:
            self._line_s = now_s
            share = self._done / self._total
            left_s = (now_s - self._start_s) * (1 - share) / share if share > 0 else float("nan")
            left = f", about {left_s:.0f} s left" if share > 0 else ""
            print(f"{self._title}: {100 * share:.0f} %{left}", file=sys.stderr, flush=True)

    def _draw(self) -> None:
        if self._bar is None:
            self._bar = Progress(
                TextColumn("{task.description}"),
                BarColumn(),
                TaskProgressColumn(),
                TimeRemainingColumn(),
                console=Console(stderr=True),
                transient=True,
            )
            self._bar.start()
            self._task = self._bar.add_task(self._title, total=self._total)
        if self._task is not None:
            self._bar.update(self._task, completed=self._done)
