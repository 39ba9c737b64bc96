"""What memory the operator's page takes while sessions run on it.

That is the resident memory of the server's process and of the browser's renderers, and the page's
heap after its garbage was collected, while sessions of epochs of a minute follow each other with
the page open. Printed are, from the second minute on, the rise in two hours within sessions, that
for each further session, and the rise in each half, by which a level is told from a rise. A session
that ends early, on a machine that was too busy to hear the page in time, is said and followed by
another.

A session's ring of samples is in memory that is shared, and resident as far as it was filled: it is
of a fixed size. The server's own memory is without it.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
import psutil
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page
from statsmodels.regression.linear_model import OLS
from statsmodels.tools import add_constant
from tests.browser import open_browser
from tests.console.opened import Console, open_page, start, wait_for

RUNS = "document.getElementById('state').textContent === 'epoch runs'"
LOOK_S = 10.0
BEGINS_S = 120.0
"""From here on memory counts."""

FILLED_S = 70.0
"""So long after its first reading a session has filled its ring of samples, which holds 60 s."""

LEAST_READ = 16
TWO_HOURS_S = 7200.0
NORMAL_95 = 1.96
COLUMNS = ("time_s", "session", "server", "server's own", "renderers", "page's heap")

PROTOCOL = """
prbs.duration_s = {seconds}
protocol.rests_s = [2.0]
protocol.return_s = 1.0
loop.stall_s = 1.0
loop.missed_in_a_row = 1000
protocol.blocks = [{{task = "prbs", condition = "OFF", epochs = {epochs}}}]
zeroing.duration_s = 0.2
"""


def renew(page: Page, console: Console) -> None:
    """Start a session from the page; return when its first epoch runs."""
    page.locator(".tab[data-view=before]").click()
    before = set(console.sessions.glob("*/manifest.json"))
    start(page)
    wait_for(lambda: set(console.sessions.glob("*/manifest.json")) - before)
    page.wait_for_function(RUNS)


def renderers(opened: Browser) -> list[int]:
    """Return the processes of the browser that show pages."""
    found = opened.new_browser_cdp_session().send("SystemInfo.getProcessInfo")
    return [one["id"] for one in found["processInfo"] if one["type"] == "renderer"]


def memory(minutes: float, rows: str = "") -> None:
    """Follow the resident memory while sessions run with the page open; print a table.

    Parameters
    ----------
    minutes : float
    rows : str
        A file for what was read, one line each time; none if empty.
    """
    read: list[tuple[float, ...]] = []
    epochs = max(1, int(minutes * 60.0 / 62.0))
    with tempfile.TemporaryDirectory() as name:
        console = Console(Path(name), protocol=PROTOCOL.format(seconds=60.0, epochs=epochs))
        try:
            with open_browser() as opened:
                page = open_page(opened, console)
                pids = renderers(opened)
                tools = page.context.new_cdp_session(page)
                sessions = 0.0
                begun_s = time.monotonic()
                until_s = begun_s + 60.0 * minutes
                while time.monotonic() < until_s:
                    renew(page, console)
                    sessions += 1.0
                    while console.leads_session() and time.monotonic() < until_s:
                        tools.send("HeapProfiler.collectGarbage")
                        heap_mb = tools.send("Runtime.getHeapUsage")["usedSize"] / 1e6
                        server = _sizes_mb([console.process.pid])
                        now_s = time.monotonic() - begun_s
                        read.append((now_s, sessions, *server, _sizes_mb(pids)[0], heap_mb))
                        if rows:
                            np.savetxt(rows, read, "%.3f", ",", header=",".join(COLUMNS))
                        page.wait_for_timeout(1e3 * LOOK_S)
                    if not console.leads_session():
                        ended = console.ended()
                        page.wait_for_function("document.body.dataset.view === 'after'")
                        print(f"a session ended: {ended['outcome']} {ended['reason']}", flush=True)
        finally:  # also of a study that was ended early
            console.close()
            _print_memory(np.array(read))


def _sizes_mb(pids: list[int]) -> tuple[float, float]:
    """Return resident memory in MB: all of it, and what no file and no other process has."""
    found = [psutil.Process(pid).memory_info() for pid in pids]
    return sum(one.rss for one in found) / 1e6, sum(one.rss - one.shared for one in found) / 1e6


def _rise_mb(read: NDArray[np.float64], column: int) -> tuple[str, str]:
    """Return the rise in two hours within sessions, and that from session to session.

    With half of their 95 % intervals, those of Newey and West, since what was read in turn is not
    independent. Each session has a level of its own, so one does not stand for the other.
    """
    numbers, first, of = np.unique(read[:, 1], return_index=True, return_inverse=True)
    levels = np.eye(numbers.size)[of]
    means = levels.T @ read[:, column] / levels.sum(axis=0)
    between = _slope(means, add_constant(numbers)[:, ::-1])
    full = read[:, 0] - read[first, 0][of] >= FILLED_S
    regressors = np.column_stack([read[:, 0] / TWO_HOURS_S, levels])[full]
    return _slope(read[full, column], regressors[:, regressors.any(axis=0)]), between


def _slope(size_mb: NDArray[np.float64], regressors: NDArray[np.float64]) -> str:
    """Return the coefficient of the first regressor with half of its interval."""
    if size_mb.size - regressors.shape[1] < LEAST_READ // 2:
        return "too few"
    lags = max(1, size_mb.size // 8)
    fitted = OLS(size_mb, regressors).fit(cov_type="HAC", cov_kwds={"maxlags": lags})
    return f"{fitted.params[0]:+.2f} ± {NORMAL_95 * fitted.bse[0]:.2f}"


def _print_memory(read: NDArray[np.float64]) -> None:
    counted = read[read[:, 0] >= BEGINS_S] if read.size else read
    if len(counted) < LEAST_READ:
        print(f"shorter than the {BEGINS_S:g} s after which memory counts")
        return
    half = len(counted) // 2
    minutes, sessions = counted[-1, 0] / 60, counted[-1, 1] - counted[0, 1] + 1
    print(f"{minutes:.0f} minutes, {sessions:.0f} sessions, {len(counted)} readings; all in MB\n")
    print("| | after 2 min | at the end | in 2 h | a session | 1st half, in 2 h | 2nd half |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for column, what in enumerate(COLUMNS[2:], start=2):
        cells = [f"{counted[0, column]:.0f}", f"{counted[-1, column]:.0f}"]
        cells += _rise_mb(counted, column)
        cells += [_rise_mb(part, column)[0] for part in (counted[:half], counted[half:])]
        print(f"| {what} | {' | '.join(cells)} |")
