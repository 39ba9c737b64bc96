"""Whether the operator's page makes the loop late: a session, its page at work and frozen in turns.

A session of `rigidimeter run` on the virtual rig at 1 kHz has a page beside it, served by a process
of its own to Chromium. Server and browser are stopped by SIGSTOP in every other window of some
seconds, and go on in the next; which of the two comes first changes from pair to pair. So the loop
is compared with itself, on the same machine within seconds, and what else runs on that machine
comes into both. The session itself does not depend on the page.

Of each window the median, the 95th and the 99th percentile of the lateness of its ticks are taken,
without its beginning; of each pair of windows the ratio, page to none. Printed are the geometric
means over the windows, that of the ratios, and its 95 % interval (Student's t of the logarithms).
"""

from __future__ import annotations

import itertools
import multiprocessing
import os
import signal
import tempfile
from contextlib import suppress
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from numpy.typing import NDArray
from scipy import stats
from tests.browser import open_browser

from benchmarks import console_running
from benchmarks.console_gaps import gaps
from rigidimeter.cli.planned_session import PlannedSession, new_session, run_planned
from rigidimeter.core.session import read_samples
from rigidimeter.core.settings import load_settings
from rigidimeter.rig.acquisition import Command, Order
from rigidimeter.rig.acquisition.processes import Realtime, SessionMemory
from rigidimeter.rig.console import SessionPlan
from rigidimeter.rig.console.page import (
    Jobs,
    PageServer,
    Place,
    RunningSession,
    ServerState,
    new_token,
)

SETTLES_S = 1.0
"""So much of the beginning of a window does not count: the page draws what it has missed."""

QUANTILES = (50.0, 95.0, 99.0)
STARTS_S = 60.0
EPOCH_S = 60.0

PROTOCOL = f"{console_running.PROTOCOL}loop.console_lost_s = 2.0\n"


def lateness(pairs: int, seconds: float) -> None:
    """Run the session and print the comparison."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "session"
        path = Path(name) / "protocol.toml"
        epochs = 2 + int((2 * pairs * seconds + STARTS_S) / EPOCH_S)
        path.write_text(PROTOCOL.format(seconds=EPOCH_S, epochs=epochs))
        planned = new_session(load_settings(path), {}, path)
        turns = _Turns(planned, folder, pairs, seconds)
        try:
            ended = run_planned(planned, folder, None, Realtime(attended=False), turns)
        finally:
            turns.close()
        print(f"the session ended: {ended.outcome} {ended.reason} {' '.join(ended.remarks)}")
        samples: dict[str, Any] = read_samples(ended.folder / "samples.arrows")
    whole = turns.begun[: 1 + (len(turns.begun) - 1) // 2 * 2]  # of a session that ended early
    if len(whole) < 5:
        raise SystemExit(f"{len(turns.begun)} windows began; two pairs are needed")
    _print(samples, whole, planned.settings.rig.tick_rate_hz)


class _Turns:
    """Lets the page work, and freezes it, in turns; called about 20 times a second.

    Attributes
    ----------
    begun : list of (float, bool)
        When each window began, in session time, and whether the page works in it; the last entry is
        the end of the last window.
    """

    def __init__(self, planned: PlannedSession, folder: Path, pairs: int, seconds: float) -> None:
        self._plan, self._folder = planned.shown(virtual=True), folder
        self._order = [
            open_now for k in range(pairs) for open_now in ((True, False), (False, True))[k % 2]
        ]
        self._seconds = seconds
        self._context = multiprocessing.get_context("spawn")
        self._drawn = self._context.Event()
        self._page: BaseProcess | None = None
        self._of_page: list[psutil.Process] = []
        self.begun: list[tuple[float, bool]] = []

    def __call__(self, shared: SessionMemory) -> None:
        loop = shared.status.loop()
        if loop is None or loop.tick < 0:
            return
        if self._page is None:
            asked = shared.names, self._plan, self._folder, self._drawn
            self._page = self._context.Process(target=_serve_page, args=asked)
            self._page.start()
        if not self._drawn.is_set() or len(self.begun) > len(self._order):
            return
        if self.begun and loop.time_s < self.begun[-1][0] + self._seconds:
            return
        if not self.begun:
            page = psutil.Process(self._page.pid)
            self._of_page = [page, *page.children(recursive=True)]
        if len(self.begun) == len(self._order):
            shared.status.post(Order(Command.ABORT))
        else:
            self._signal(signal.SIGCONT if self._order[len(self.begun)] else signal.SIGSTOP)
        self.begun.append((loop.time_s, (*self._order, False)[len(self.begun)]))

    def _signal(self, number: signal.Signals) -> None:
        for process in self._of_page:
            with suppress(psutil.NoSuchProcess):
                process.send_signal(number)

    def close(self) -> None:
        """End the page's processes."""
        self._signal(signal.SIGCONT)
        if self._page is not None:
            self._page.terminate()
            self._page.join(10.0)
        self._signal(signal.SIGKILL)


def _serve_page(names: tuple[str, str, str], plan: SessionPlan, folder: Path, drawn: Any) -> None:
    """Serve the page of a session that runs, and open it in Chromium; a process of its own."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    state = ServerState(Place(folder.parent, plan.settings, "the protocol"))
    state.running = RunningSession(1, names, plan, folder)
    server = PageServer(state, Jobs(), "127.0.0.1", 0, new_token())
    server.start()
    parent = os.getppid()
    with open_browser() as opened:
        page = opened.new_page(viewport={"width": 1280, "height": 800})
        page.goto(server.address)
        page.wait_for_function("window.rigDrawnS > 0", timeout=1e3 * STARTS_S)
        drawn.set()
        while os.getppid() == parent:
            page.wait_for_timeout(1000)


def of_windows(
    time_s: NDArray[np.float64], late_s: NDArray[np.float64], begun: list[tuple[float, bool]]
) -> NDArray[np.float64]:
    """Return the percentiles of each window: pair, without or with page, percentile."""
    found = np.empty((len(begun) // 2, 2, len(QUANTILES)))
    for k, ((from_s, open_now), (to_s, _)) in enumerate(itertools.pairwise(begun)):
        counted = (time_s >= from_s + SETTLES_S) & (time_s < to_s)
        found[k // 2, int(open_now)] = np.percentile(late_s[counted], QUANTILES)
    return found


def ratios(found: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the geometric mean of the pairs' ratios and its 95 % interval, for each percentile."""
    logs = np.log(found[:, 1] / found[:, 0])
    mean, pairs = logs.mean(axis=0), len(logs)
    wide = stats.t.ppf(0.975, pairs - 1) * logs.std(axis=0, ddof=1) / np.sqrt(pairs)
    return np.exp(np.array([mean, mean - wide, mean + wide]))


def _print(samples: dict[str, Any], begun: list[tuple[float, bool]], rate_hz: float) -> None:
    time_s, late_s = samples["time_s"], samples["lateness_s"]
    found = of_windows(time_s, late_s, begun)
    without, page = np.exp(np.log(found).mean(axis=0))
    print("| lateness | with the page | without | ratio | 95 % interval |")
    print("| --- | --- | --- | --- | --- |")
    for k, (ratio, low, high) in enumerate(ratios(found).T):
        print(
            f"| {QUANTILES[k]:g} % | {1e6 * page[k]:.0f} µs | {1e6 * without[k]:.0f} µs "
            f"| {ratio:.2f} | {low:.2f} to {high:.2f} |"
        )
    left_out = {True: 0, False: 0}
    for (from_s, open_now), (to_s, _) in itertools.pairwise(begun):
        within = (time_s >= from_s + SETTLES_S) & (time_s < to_s)
        ticks = samples["tick"][within], late_s[within]
        left_out[open_now] += gaps(*ticks, rate_hz).left_out
    print(
        f"{len(found)} pairs of windows; ticks left out by a loop that was late: {left_out[True]} "
        f"with the page, {left_out[False]} without; samples lost by the recorder: "
        f"{gaps(samples['tick'], late_s, rate_hz).lost}"
    )
